//! The CSV table holds exactly what was recorded.

use crate::common::{record, session, tick_record};
use cotouch_runtime::{ExportError, RecordItem, RecordKind, RecordingReader, TickRecord, export_csv};
use cotouch_scene::names::HostIndex;

fn table(items: &[RecordItem], host: Option<HostIndex>) -> (csv::StringRecord, Vec<csv::StringRecord>) {
    let mut out = Vec::new();
    let rows = export_csv(&mut RecordingReader::new(&record(items)[..]).unwrap(), host, &mut out).unwrap();
    let mut reader = csv::Reader::from_reader(&out[..]);
    let names = reader.headers().unwrap().clone();
    let table: Vec<_> = reader.records().map(Result::unwrap).collect();
    assert_eq!(table.len() as u64, rows);
    (names, table)
}

#[test]
fn a_row_a_tick_and_every_number_exact() {
    let (names, rows) = table(&session(50), None);
    assert_eq!(rows.len(), 100);
    let cell = |row: usize, name: &str| &rows[row][names.iter().position(|other| other == name).unwrap()];
    for row in 0..100 {
        let tick = row as u64 / 2;
        let expected = tick_record(tick);
        assert_eq!(cell(row, "host"), format!("host{}", row % 2 + 1));
        assert_eq!(cell(row, "tick"), tick.to_string());
        let number = |name| cell(row, name).parse::<f64>().unwrap().to_bits();
        assert_eq!(number("finger1_position_x_m"), expected.readings[0].pose.position.x.to_bits());
        assert_eq!(number("finger1_position_z_m"), (-0.0f64).to_bits());
        assert_eq!(number("body1_position_x_m"), expected.bodies[0].pose.position.x.to_bits());
        assert_eq!(number("body1_force_x_n"), (-1.5f64).to_bits());
        assert_eq!(number("energy_j"), expected.energy_j.to_bits());
        assert_eq!(cell(row, "step_in_use_host1"), "");
        let touches = row % 2 == 1 && tick.is_multiple_of(2);
        assert_eq!(cell(row, "finger2_contact_phase"), if touches { "1" } else { "0" }, "{row}");
        assert_eq!(cell(row, "finger2_contact_body"), if touches { "1" } else { "" });
        assert_eq!(number("finger2_contact_force_y_n"), if touches { -0.5f64 } else { 0.0 }.to_bits());
        assert_eq!(cell(row, "finger1_contact_phase"), "0");
        let step = tick.checked_sub(9).map(|step| step.to_string()).unwrap_or_default();
        assert_eq!(cell(row, "step_in_use_host2"), step);
    }
    let distinct: std::collections::BTreeSet<_> = names.iter().collect();
    assert_eq!(distinct.len(), names.len());
}

#[test]
fn one_host_alone() {
    let (_, rows) = table(&session(5), Some(HostIndex(1)));
    assert!(rows.len() == 5 && rows.iter().all(|row| &row[0] == "host2"));
}

#[test]
fn odd_numbers_read_back() {
    let mut record = tick_record(0);
    record.bodies[0].twist.linear = [f64::INFINITY, f64::from_bits(1), f64::NAN].into();
    let item = RecordItem { host: HostIndex(0), tick: 0, kind: RecordKind::Tick(record) };
    let (names, rows) = table(&[item], None);
    let cell = |name: &str| &rows[0][names.iter().position(|other| other == name).unwrap()];
    assert_eq!(cell("body1_velocity_x_m_per_s"), "inf");
    assert_eq!(cell("body1_velocity_y_m_per_s").parse::<f64>().unwrap().to_bits(), 1);
    assert_eq!(cell("body1_velocity_z_m_per_s"), "NaN");
}

#[test]
fn ticks_with_other_columns_are_an_error() {
    let item = |tick, record| RecordItem { host: HostIndex(0), tick, kind: RecordKind::Tick(record) };
    let file = record(&[item(0, tick_record(0)), item(1, TickRecord::default())]);
    let mut reader = RecordingReader::new(&file[..]).unwrap();
    let error = export_csv(&mut reader, None, std::io::sink()).unwrap_err();
    assert!(matches!(error, ExportError::Uneven { tick: 1, .. }));
}
