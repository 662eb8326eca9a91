//! The program, started from outside.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

pub(crate) fn cotouch(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
    command.args(words).current_dir(folder).env_remove("COTOUCH_LOG").output().expect("the program starts")
}

pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// The one JSON document on stdout.
pub(crate) fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", stdout(output)))
}

/// Every dotted key, `[]` going into a list's first element, is there.
pub(crate) fn has_keys(document: &Value, keys: &[&str]) {
    for key in keys {
        let pointer = format!("/{}", key.replace("[]", ".0").replace('.', "/"));
        assert!(document.pointer(&pointer).is_some(), "{key} is missing in {document}");
    }
}
