//! `cotouch replay`: is a recording what the code does?

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::thread;

use anyhow::Context as _;
use cotouch_runtime::{LOOK_PERIOD, RecordingReader, export_csv};
use cotouch_scene::names::HostIndex;
use serde_json::json;

use crate::arguments::Replay;
use crate::failure::{Failure, Verdict};
use crate::output::{Output, make_folder_of};
use crate::progress::Stop;
use crate::session;

/// Shows recordings on a page, if asked to, until Ctrl-C; meanwhile re-simulates the first one and compares.
pub(super) fn replay(replay: &Replay, output: &Output) -> Result<Verdict, Failure> {
    for file in std::iter::once(&replay.file).chain(&replay.beside) {
        if !file.is_file() {
            return Err(Failure::usage(format!(
                "{} is not a file; it must be a recording that a run wrote",
                file.display()
            )));
        }
    }
    let Some(address) = replay.viewer else { return compare(&replay.file, replay.csv.as_deref(), output) };
    let stop = Stop::on_interrupt()?;
    let files = std::iter::once(&replay.file).chain(&replay.beside).cloned().collect();
    let page = session::show_recordings(files, address, output)?;
    let verdict = compare(&replay.file, replay.csv.as_deref(), output)?;
    output.say(format_args!("the page stays until Ctrl-C"));
    while !stop.is_set() {
        thread::sleep(LOOK_PERIOD);
    }
    drop(page);
    Ok(verdict)
}

/// Re-simulates `file`, compares, and writes its tables to `csv`.
fn compare(file: &Path, csv: Option<&Path>, output: &Output) -> Result<Verdict, Failure> {
    let replayed = session::replay(file)?;
    if replayed.ended_abruptly {
        eprintln!("note: {} stops without its end; what it holds is replayed", file.display());
    }
    let tables = csv.map(|folder| write_tables(file, folder)).transpose()?.unwrap_or_default();
    let difference = replayed.comparison.first_difference.as_ref().map(ToString::to_string);
    let verdict = match &difference {
        None => "identical".to_owned(),
        Some(difference) => format!("not identical: {difference}"),
    };
    let mut text = format!("{} ticks replayed, {verdict}\n", replayed.comparison.ticks);
    if replayed.skipped > 0 {
        let skipped = replayed.skipped;
        text.push_str(&format!(
            "{skipped} ticks could not be replayed, because items before them are missing\n"
        ));
    }
    tables.iter().for_each(|table| text.push_str(&format!("wrote {table}\n")));
    let answer = json!({
        "ticks": replayed.comparison.ticks,
        "identical": difference.is_none(),
        "difference": difference,
        "not_replayed": replayed.skipped,
        "ended_abruptly": replayed.ended_abruptly,
        "tables": tables,
    });
    output.answer_as(&answer, &text)?;
    Ok(if difference.is_none() { Verdict::Good } else { Verdict::Bad })
}

/// One CSV file a host, a row a tick: `hostN.csv` in `folder`.
fn write_tables(file: &Path, folder: &Path) -> anyhow::Result<Vec<String>> {
    let scene = cotouch_scene::parse(
        &RecordingReader::open(file)?.header().scene_toml,
        "the recording's scene",
        None,
        &[],
    )?;
    let mut tables = Vec::new();
    for host in HostIndex::all(scene.session.users) {
        let path = folder.join(format!("{host}.csv"));
        make_folder_of(&path)?;
        let out = File::create(&path).with_context(|| format!("{} cannot be written", path.display()))?;
        let rows = export_csv(&mut RecordingReader::open(file)?, Some(host), BufWriter::new(out))?;
        if rows == 0 {
            // A host of another process: this recording knows nothing of it.
            std::fs::remove_file(&path).with_context(|| format!("{} cannot be removed", path.display()))?;
        } else {
            tables.push(path.display().to_string());
        }
    }
    Ok(tables)
}
