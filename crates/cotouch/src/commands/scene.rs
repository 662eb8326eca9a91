//! `cotouch scene list|show|check|schema`.

use std::fmt::Write as _;

use cotouch_scene::{Override, builtin};
use serde_json::json;

use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Names and sentences of the built-in scenes.
pub(super) fn list(output: &Output) -> Result<Verdict, Failure> {
    let description = |name| cotouch_scene::load(name, &[]).map(|scene| scene.description.clone());
    let described = |name| (name, description(name).unwrap_or_default());
    let scenes: Vec<_> = builtin::names().map(described).collect();
    let width = scenes.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, description) in &scenes {
        let _ = writeln!(text, "{name:width$}  {description}");
    }
    let entry = |(name, description): &(&str, String)| json!({ "name": name, "description": description });
    output.answer_as(&scenes.iter().map(entry).collect::<Vec<_>>(), &text)?;
    Ok(Verdict::Good)
}

/// A scene as TOML: as it was written, or with every key where overrides change it.
pub(super) fn show(name: &str, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let text = match builtin::source(name) {
        Some(source) if overrides.is_empty() => source.to_owned(),
        _ => cotouch_scene::to_toml(&scene),
    };
    output.answer_as(&scene, &text)?;
    Ok(Verdict::Good)
}

/// Whether a scene is valid; every problem is a line on stderr.
pub(super) fn check(name: &str, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    match cotouch_scene::load(name, overrides) {
        Ok(scene) => {
            let text = format!("{name}: valid; {}", super::prediction::who_and_how(&scene));
            output.answer_as(&json!({ "file": name, "valid": true, "errors": [] }), &text)?;
            Ok(Verdict::Good)
        }
        Err(errors) => {
            let list: Vec<String> = errors.iter().map(ToString::to_string).collect();
            if output.json {
                output.answer_as(&json!({ "file": name, "valid": false, "errors": list }), "")?;
            }
            Err(errors.into())
        }
    }
}

/// The JSON Schema of scene files.
pub(super) fn schema(output: &Output) -> Result<Verdict, Failure> {
    let schema = cotouch_scene::json_schema();
    let text = serde_json::to_string_pretty(&schema).map_err(anyhow::Error::from)?;
    output.answer_as(&schema, &text)?;
    Ok(Verdict::Good)
}
