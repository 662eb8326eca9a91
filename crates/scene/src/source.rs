//! Where scenes come from: built in, a file, or a text.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::error::{Place, Problem, SceneError, SceneErrors};
use crate::keys::parts::IMPAIRMENT;
use crate::keys::scene::{INCLUDE, LINK_IMPAIRMENT};
use crate::overrides::Override;
use crate::scene::Scene;
use crate::tree::{self, Content, Node, Table};
use crate::{builtin, check, unknown};

/// Longest scene or link file, in bytes.
pub(crate) const LONGEST_TEXT: usize = 1 << 20;

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The name of a built-in scene.
    BuiltIn(String),
    /// The file at this path.
    File(PathBuf),
    /// A text from anywhere else. It cannot include a link file, because texts also come over the network, and names
    /// mesh files by absolute paths only.
    Text {
        /// The scene as TOML.
        text: String,
        /// What messages call it.
        label: String,
    },
}

impl Source {
    /// The built-in scene of that name, else the file at that path.
    #[must_use]
    pub fn named(name_or_path: &str) -> Self {
        match builtin::source(name_or_path) {
            Some(_) => Self::BuiltIn(name_or_path.to_owned()),
            None => Self::File(name_or_path.into()),
        }
    }

    /// Reads and checks the scene.
    ///
    /// # Errors
    /// Everything that is wrong with it or with `overrides`, or that it cannot be read.
    pub fn load(&self, overrides: &[Override]) -> Result<Scene, SceneErrors> {
        match self {
            Self::BuiltIn(name) => {
                let text = builtin::source(name).ok_or_else(|| no_such_scene(name))?;
                parse(text, name, None, overrides)
            }
            Self::File(path) => {
                let label = path.display().to_string();
                let looks_like_name = path.components().count() == 1 && path.extension().is_none();
                if looks_like_name && !path.exists() {
                    return Err(no_such_scene(&label).into());
                }
                let text = read_text(path, &Place::file(&label))?;
                parse(&text, &label, Some(path.parent().unwrap_or(Path::new(""))), overrides)
            }
            Self::Text { text, label } => parse(text, label, None, overrides),
        }
    }
}

/// Reads and checks a scene: a built-in one by name, or a file.
///
/// # Errors
/// Everything that is wrong with it or with `overrides`, or that it cannot be read.
pub fn load(source: &str, overrides: &[Override]) -> Result<Scene, SceneErrors> {
    Source::named(source).load(overrides)
}

/// Reads and checks the scene in `text`, which messages call `label`. `base` is the folder from which
/// `link.include` and mesh files start; without one a text may not include and names mesh files by absolute paths (an
/// override still may, from the current folder).
///
/// # Errors
/// Everything that is wrong with the text or with `overrides`.
pub fn parse(
    text: &str,
    label: &str,
    base: Option<&Path>,
    overrides: &[Override],
) -> Result<Scene, SceneErrors> {
    let whole = Place::file(label);
    if text.len() > LONGEST_TEXT {
        return Err(too_long(whole).into());
    }
    read_scene(text, label, base, overrides, whole)
        .map_err(|errors| SceneErrors::from_list(errors).expect("a scene is refused for a reason"))
}

/// Like [`parse`], for bytes from anywhere.
///
/// # Errors
/// As [`parse`]; also when the bytes are not UTF-8.
pub fn parse_bytes(
    bytes: &[u8],
    label: &str,
    base: Option<&Path>,
    overrides: &[Override],
) -> Result<Scene, SceneErrors> {
    let text = std::str::from_utf8(bytes).map_err(|error| not_utf8(Place::file(label), bytes, &error))?;
    parse(text, label, base, overrides)
}

fn read_scene(
    text: &str,
    label: &str,
    base: Option<&Path>,
    overrides: &[Override],
    whole: Place,
) -> Result<Scene, Vec<SceneError>> {
    let mut tree = tree::parse(text, label)?;
    expand_mesh(&mut tree);
    let mut errors: Vec<SceneError> = overrides.iter().filter_map(|set| set.apply(&mut tree).err()).collect();
    expand_mesh(&mut tree);
    if let Err(found) = include_link(&mut tree, base) {
        errors.extend(found);
    }
    match check::scene(tree, whole, name_from(label), base) {
        Ok(scene) if errors.is_empty() => Ok(scene),
        Ok(_) => Err(errors),
        Err(found) => Err([errors, found].concat()),
    }
}

/// A text in place of `[soft.mesh]` is the path of a file.
fn expand_mesh(tree: &mut Table) {
    let Some(Node { content: Content::Table(soft), .. }) = tree.get_mut("soft") else { return };
    if let Some(mesh) = soft.get_mut("mesh")
        && let Content::Text(_) = mesh.content
    {
        let file = mesh.clone();
        mesh.content = Content::Table(Table::from([("file".to_owned(), file)]));
    }
}

/// Replaces `link.include` by the impairment in that file; what the scene says itself stays.
fn include_link(tree: &mut Table, base: Option<&Path>) -> Result<(), Vec<SceneError>> {
    let Some(node) = tree::take(tree, INCLUDE.0) else { return Ok(()) };
    let refuse = |allowed: &str| {
        let (key, found, allowed) = (INCLUDE.0.to_owned(), node.found(), allowed.to_owned());
        vec![SceneError { place: node.place.clone(), problem: Problem::NotAllowed { key, found, allowed } }]
    };
    let Content::Text(name) = &node.content else { return Err(refuse("the path of a link file")) };
    let path = match (&node.place, base) {
        (Place::Override(_) | Place::Number(_), _) => PathBuf::from(name),
        (Place::File { .. }, Some(base)) => base.join(name),
        (Place::File { .. }, None) => return Err(refuse("left out, because this scene is not in a file")),
    };
    let label = path.display().to_string();
    let text = read_text(&path, &node.place).map_err(|error| vec![error])?;
    for (key, found) in read_link(&text, &label)? {
        let written = tree::find(tree, &format!("{LINK_IMPAIRMENT}{key}")).is_some();
        if !written {
            // Fails only where the scene has a value in place of [link] or [link.impairment], which is refused later.
            let _ = tree::put(tree, &["link", "impairment", &key], found);
        }
    }
    Ok(())
}

/// The impairment of a link file. Its `[measured]` is for people.
fn read_link(text: &str, label: &str) -> Result<Vec<(String, Node)>, Vec<SceneError>> {
    let mut link = tree::parse(text, label)?;
    link.remove("measured");
    let known: Vec<String> = IMPAIRMENT.iter().map(|key| format!("impairment.{}", key.name)).collect();
    let taken: Vec<(String, Node)> = IMPAIRMENT
        .iter()
        .filter_map(|key| {
            Some((key.name.to_owned(), tree::take(&mut link, &format!("impairment.{}", key.name))?))
        })
        .collect();
    let mut errors = Vec::new();
    unknown::refuse(link, "", "", &known, &mut errors);
    if errors.is_empty() { Ok(taken) } else { Err(errors) }
}

fn read_text(path: &Path, place: &Place) -> Result<String, SceneError> {
    let refuse = |why: String| {
        // The place of a scene is its file, which need not be named twice.
        let is_named =
            matches!(place, Place::File { label, line: None } if **label == *path.display().to_string());
        let what = if is_named { "this".to_owned() } else { path.display().to_string() };
        let text = format!("{what} cannot be read ({why}); it must be a readable TOML file");
        SceneError { place: place.clone(), problem: Problem::Unreadable(text) }
    };
    let unreadable = |error: std::io::Error| refuse(error.to_string());
    // A pipe or a device could be read without end.
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(refuse("it is not a regular file".to_owned()));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(LONGEST_TEXT as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    let whole = || Place::file(&path.display().to_string());
    if bytes.len() > LONGEST_TEXT {
        return Err(too_long(whole()));
    }
    String::from_utf8(bytes).map_err(|error| not_utf8(whole(), error.as_bytes(), &error.utf8_error()))
}

fn too_long(place: Place) -> SceneError {
    let text = format!("this is longer than {LONGEST_TEXT} bytes, the most that is allowed");
    SceneError { place, problem: Problem::Unreadable(text) }
}

fn not_utf8(place: Place, bytes: &[u8], error: &std::str::Utf8Error) -> SceneError {
    let valid = error.valid_up_to();
    let line = 1 + bytes[..valid].iter().filter(|&&byte| byte == b'\n').count();
    let place = match place {
        Place::File { label, .. } => Place::File { label, line: Some(line) },
        place => place,
    };
    let text = format!("byte {valid} is 0x{:02x}; the text must be UTF-8", bytes[valid]);
    SceneError { place, problem: Problem::Unreadable(text) }
}

fn no_such_scene(name: &str) -> SceneError {
    let near = unknown::nearest(name, builtin::names());
    let meant = near.map_or_else(String::new, |near| format!("; did you mean {near}?"));
    let names = builtin::names().collect::<Vec<_>>().join(", ");
    let text = format!("there is no such file, and the built-in scenes are {names}{meant}");
    SceneError { place: Place::file(name), problem: Problem::Unreadable(text) }
}

/// A scene that does not say its name is called like its file.
fn name_from(label: &str) -> String {
    let stem = Path::new(label).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let printable: String = stem.unwrap_or_default().chars().filter(|c| !c.is_control()).take(64).collect();
    let name = printable.trim();
    if name.is_empty() { "scene".to_owned() } else { name.to_owned() }
}
