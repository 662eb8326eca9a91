//! Where a command's answer goes: stdout, as text or as one JSON document, and a file as well when `--out` names one.

use std::fmt::Display;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;

use crate::progress::{Progress, Shown};

/// How a command answers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Output {
    /// One JSON document instead of text; everything else goes to stderr.
    pub(crate) json: bool,
    /// A file that gets the answer too.
    pub(crate) file: Option<PathBuf>,
}

impl Output {
    /// Gives the command's answer, `text` being what people read. A file whose name ends with .json gets JSON.
    pub(crate) fn answer_as(&self, answer: &impl Serialize, text: &str) -> anyhow::Result<()> {
        if let Some(file) = &self.file {
            let json = self.json || file.extension().is_some_and(|ending| ending == "json");
            write_file(file, &Self { json, file: None }.shown(answer, text)?)?;
            told(file);
        }
        print(&self.shown(answer, text)?)
    }

    /// Gives the command's answer on stdout and `file_text` to the file.
    pub(crate) fn answer_and_file(
        &self,
        answer: &impl Serialize,
        text: &str,
        file_text: &str,
    ) -> anyhow::Result<()> {
        if let Some(file) = &self.file {
            write_file(file, file_text)?;
            told(file);
        }
        print(&self.shown(answer, text)?)
    }

    /// Says something on the way: on stdout, or on stderr where stdout is for JSON.
    pub(crate) fn say(&self, sentence: impl Display) {
        if self.json {
            tell!("{sentence}");
        } else {
            // A reader that went away is noticed when the answer is given.
            let _ = writeln!(std::io::stdout(), "{sentence}");
        }
    }

    /// What shows the progress of long work: lines where stdout is for JSON, else a bar where stderr is a terminal.
    pub(crate) fn progress(&self, what: &str) -> Progress {
        Progress::new(what, if self.json { Shown::Lines } else { Shown::Bar })
    }

    fn shown(&self, answer: &impl Serialize, text: &str) -> anyhow::Result<String> {
        let shown = if self.json { serde_json::to_string_pretty(answer)? } else { text.to_owned() };
        Ok(format!("{}\n", shown.trim_end_matches('\n')))
    }
}

/// Says which file was written, where it is in nobody's way.
fn told(file: &Path) {
    tell!("wrote {}", file.display());
}

/// Writes a file, with the folders that it is to be in.
pub(crate) fn write_file(file: &Path, text: &str) -> anyhow::Result<()> {
    make_folder_of(file)?;
    fs::write(file, text).with_context(|| format!("{} cannot be written", file.display()))
}

/// Makes the folders that `file` is to be in.
pub(crate) fn make_folder_of(file: &Path) -> anyhow::Result<()> {
    let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) else { return Ok(()) };
    fs::create_dir_all(folder).with_context(|| format!("the folder {} cannot be made", folder.display()))
}

fn print(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        // `cotouch … | head` is not a failure.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("the answer cannot be printed"),
    }
}
