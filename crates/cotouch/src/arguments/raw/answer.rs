//! Where an answer may go.

use std::path::Path;

use super::super::invocation::{Command, LocalModel, Recording, Replay, Run};
use crate::output::Output;

/// Only some commands draw or make tables.
pub(super) fn check_ending(command: &Command, output: &Output) -> Result<(), String> {
    let Some(file) = &output.file else { return Ok(()) };
    let ending = file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let makes = match command {
        Command::Stability { sweeps, .. } if !sweeps.is_empty() => &["svg", "csv"][..],
        Command::LocalModel(LocalModel::Step(_)) => &["svg", "csv"],
        Command::Admittance { .. } => &["svg"],
        _ => &[],
    };
    if ["svg", "csv", "png", "pdf"].contains(&ending) && !makes.contains(&ending) {
        let file = file.display();
        let possible: Vec<String> =
            makes.iter().chain(&["txt", "json"]).map(|ending| format!(".{ending}")).collect();
        let possible = possible.join(", ");
        return Err(format!("--out {file}: this command makes no .{ending}; possible are {possible}"));
    }
    Ok(())
}

/// An answer must not take the place of the recording that it is about.
pub(super) fn check_no_recording_is_lost(command: &Command, output: &Output) -> Result<(), String> {
    let Some(file) = &output.file else { return Ok(()) };
    let recordings = match command {
        Command::Replay(Replay { file, beside, .. }) => std::iter::once(file).chain(beside).collect(),
        Command::Run(Run { host, .. }) | Command::Serve { host, .. } | Command::Join { host, .. } => {
            match &host.recording {
                Recording::To(recording) => vec![recording],
                Recording::Off | Recording::Named => Vec::new(),
            }
        }
        _ => Vec::new(),
    };
    match recordings.into_iter().find(|recording| is_same_file(recording, file)) {
        Some(recording) => Err(format!(
            "--out {}: this is the recording {}, which the answer would replace; name another file",
            file.display(),
            recording.display()
        )),
        None => Ok(()),
    }
}

/// Whether two paths lead to one file, which may not be there yet.
fn is_same_file(one: &Path, other: &Path) -> bool {
    let found = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    one == other || found(one).is_some_and(|one| found(other) == Some(one))
}
