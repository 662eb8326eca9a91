//! `cotouch replay`: is a recording what the code does?

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::thread;

use anyhow::Context as _;
use cotouch_runtime::{LOOK_PERIOD, RecordingReader, Summary, export_csv};
use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use serde_json::json;

use crate::arguments::Replay;
use crate::failure::{Failure, Verdict};
use crate::output::{Output, make_folder_of};
use crate::progress::Stop;
use crate::session;

use super::{prediction, report, settings, stretches};

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
    if replay.beside.is_some() {
        let first = replay.file.display();
        output.say(format_args!("the page shows both; what follows is about {first} alone"));
    }
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
    let mut replayed = session::replay(file)?;
    if replayed.ended_abruptly {
        tell!("note: {} stops without its end; what it holds is replayed", file.display());
    }
    let tables = csv.map(|folder| write_tables(file, folder)).transpose()?.unwrap_or_default();
    let difference = replayed.comparison.first_difference.as_ref().map(ToString::to_string);
    let verdict = match &difference {
        None if replayed.comparison.ticks == 0 => "so that there is nothing to compare".to_owned(),
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
    let run = replayed.run.take().map(|run| with_predictions(file, run, output)).transpose()?;
    if let Some(run) = &run {
        let outcome = stretches::verdict(run).unwrap_or_else(|| report::outcome(run));
        text.push_str(&format!("the run was {outcome}\n"));
    }
    let answer = json!({
        "ticks": replayed.comparison.ticks,
        "identical": difference.is_none(),
        "difference": difference,
        "not_replayed": replayed.skipped,
        "ended_abruptly": replayed.ended_abruptly,
        "tables": tables,
        "verdict": run.as_ref().map(|run| run.verdict),
        "judged_s": run.as_ref().map(|run| run.judged_s),
        "diverged": run.as_ref().and_then(|run| run.diverged.clone()),
        "shaking": run.as_ref().map(|run| &run.shaking),
        "predictions": run.as_ref().map(|run| &run.predictions),
    });
    output.answer_as(&answer, &text)?;
    Ok(if difference.is_none() { Verdict::Good } else { Verdict::Bad })
}

/// Where settings were changed, with what the analysis says of each.
fn with_predictions(file: &Path, mut run: Summary, output: &Output) -> anyhow::Result<Summary> {
    if run.predictions.len() > 1 {
        let scene = recorded_scene(file)?;
        settings::complete(&mut run, &scene, prediction::predicted_if_possible(&scene), output);
    }
    Ok(run)
}

fn recorded_scene(file: &Path) -> anyhow::Result<Scene> {
    let recording = RecordingReader::open(file)?;
    Ok(cotouch_scene::parse(&recording.header().scene_toml, "the recording's scene", None, &[])?)
}

/// One CSV file a host, a row a tick: `hostN.csv` in `folder`.
fn write_tables(file: &Path, folder: &Path) -> anyhow::Result<Vec<String>> {
    let scene = recorded_scene(file)?;
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
