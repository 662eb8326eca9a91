//! A recording as a table: CSV, a row a tick.

use std::io::{Read, Write};

use cotouch_scene::names::HostIndex;

use crate::record::{RecordKind, TickRecord};
use crate::recording::{RecordingError, RecordingReader};
use crate::tick_fields::visit_fields;

/// Why a recording could not be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The table cannot be written.
    #[error("cannot write the CSV table: {0}")]
    Csv(#[from] csv::Error),
    /// The ticks do not all have the same numbers.
    #[error("{host} tick {tick} has {found} numbers where {expected} were expected as in the first tick")]
    Uneven {
        /// The host whose tick it is.
        host: HostIndex,
        /// The index of that tick.
        tick: u64,
        /// How many numbers it has.
        found: usize,
        /// How many the first tick has.
        expected: usize,
    },
}

/// Writes every tick of `recording` (of `host`, or of all hosts in the order of recording) to `out`; how many.
///
/// Columns: `host` (as in `host1`), `tick`, `time_s` (nominal, since tick 0), and every number of a tick under a name
/// with its unit: `finger1_position_x_m`, `body2_velocity_y_m_per_s`, `finger1_contact_phase` (0 free, 1 moment
/// cancellation, 2 pre-slide, 3 slide) and so on. Real numbers are written so that they read back to exactly the same number; not-a-number is `NaN`.
/// An empty cell means that no sample was in use, or nothing is touched.
///
/// # Errors
/// When the recording is damaged, or `out` cannot be written.
pub fn export_csv<R: Read>(
    recording: &mut RecordingReader<R>,
    host: Option<HostIndex>,
    out: impl Write,
) -> Result<u64, ExportError> {
    let mut table = csv::Writer::from_writer(out);
    let mut columns = None;
    let mut rows = 0;
    for item in recording {
        let item = item?;
        let RecordKind::Tick(record) = &item.kind else { continue };
        if host.is_some_and(|host| host != item.host) {
            continue;
        }
        let row = row(item.host, item.tick, record);
        let expected = match columns {
            Some(columns) => columns,
            None => *columns.insert(write_names(&mut table, item.host, record)?),
        };
        if row.len() != expected {
            let found = row.len();
            return Err(ExportError::Uneven { host: item.host, tick: item.tick, found, expected });
        }
        table.write_record(&row)?;
        rows += 1;
    }
    table.flush().map_err(csv::Error::from)?;
    Ok(rows)
}

/// The number of columns.
fn write_names(
    table: &mut csv::Writer<impl Write>,
    host: HostIndex,
    record: &TickRecord,
) -> Result<usize, csv::Error> {
    let mut names: Vec<String> = ["host", "tick", "time_s"].map(str::to_owned).to_vec();
    visit_fields(host, record, |field, _| names.push(field.to_string()));
    table.write_record(&names)?;
    Ok(names.len())
}

fn row(host: HostIndex, tick: u64, record: &TickRecord) -> Vec<String> {
    let mut cells = vec![host.to_string(), tick.to_string(), format!("{:?}", record.instant.as_secs_f64())];
    visit_fields(host, record, |_, value| cells.push(value.to_string()));
    cells
}
