//! The reference of scene keys, from the key tables.

use std::fmt::Write as _;

use crate::keys::Key;
use crate::keys::parts::{
    ACTIONS, BODY, FINGER, FINGER_LIST, FINGER_SCRIPT, FIXED, IMPAIRMENT, PLANE, SCRIPT, USER, WAY,
};
use crate::keys::scene::{
    BODY_LIST, FIXED_LIST, INCLUDE, LINK_IMPAIRMENT, PLANE_LIST, SCENE, SOFT_MESH, USER_LIST, WAY_LIST,
};

/// A scene key, as documentation and completion need it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyInfo {
    /// Dotted, below the table or list that it is in.
    pub name: String,
    /// Kind, range and unit.
    pub allowed: String,
    /// The default, in words.
    pub default: String,
    /// What the key means, in one sentence.
    pub doc: &'static str,
}

/// All keys of a scene that are not in lists; each can be given to [`crate::Override`], and those that are
/// numbers to [`crate::with_override`].
#[must_use]
pub fn keys() -> Vec<KeyInfo> {
    [infos(SCENE, ""), infos(IMPAIRMENT, LINK_IMPAIRMENT)].concat()
}

/// A key on whose number the loops of scenes depend as on a spring or a damper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GainKey {
    /// Dotted.
    pub name: &'static str,
    /// Whether it is a damper.
    pub damps: bool,
}

/// The springs and dampers of a scene, and what makes them (moduli, shares of others), by their units: those whose stability
/// margins are told, in the order of [`keys`].
pub fn gain_keys() -> impl Iterator<Item = GainKey> {
    let gain = |key: &Key<_>| GainKey { name: key.name, damps: key.damps() };
    SCENE.iter().filter(|key| key.has_margin()).map(gain)
}

/// Every key of a scene file, in Markdown.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::from(
        "# Keys of a scene file\n\nEverything has a default unless it says \"must be written\".\n",
    );
    section(&mut text, "A scene", "All numbers are SI; the unit is in the name.", &keys());
    section(&mut text, "`link.include`", INCLUDE.1, &[]);
    section(&mut text, &format!("`[[{}]]`", BODY_LIST.0), BODY_LIST.1, &infos(BODY, ""));
    section(&mut text, &format!("`[[{}]]`", PLANE_LIST.0), PLANE_LIST.1, &infos(PLANE, ""));
    section(&mut text, &format!("`{}`", SOFT_MESH.0), SOFT_MESH.1, &[]);
    section(&mut text, &format!("`[[{}]]`", FIXED_LIST.0), FIXED_LIST.1, &infos(FIXED, ""));
    let way = [infos(WAY, ""), infos(IMPAIRMENT, "")].concat();
    section(&mut text, &format!("`[[{}]]`", WAY_LIST.0), WAY_LIST.1, &way);
    section(&mut text, &format!("`[[{}]]`", USER_LIST.0), USER_LIST.1, &infos(USER, ""));
    let finger = format!("`[[{}.{}]]`", USER_LIST.0, FINGER_LIST.0);
    section(&mut text, &finger, FINGER_LIST.1, &infos(FINGER, ""));
    section(&mut text, &format!("`{}` of a finger", FINGER_SCRIPT.0), FINGER_SCRIPT.1, &[]);
    section(&mut text, &format!("`{}` of a user", SCRIPT.0), SCRIPT.1, &[]);
    for kind in ACTIONS {
        section(&mut text, &format!("`do = \"{}\"`", kind.word), kind.doc, &infos(kind.keys, ""));
    }
    text
}

fn infos<T>(keys: &[Key<T>], prefix: &str) -> Vec<KeyInfo> {
    let info = |key: &Key<T>| KeyInfo {
        name: format!("{prefix}{}", key.name),
        allowed: key.allowed(),
        default: key.default_in_words(),
        doc: key.doc,
    };
    keys.iter().map(info).collect()
}

fn section(text: &mut String, title: &str, doc: &str, keys: &[KeyInfo]) {
    let mut push = |line: std::fmt::Arguments<'_>| text.write_fmt(line).expect("a String takes any text");
    push(format_args!("\n## {title}\n\n{doc}\n"));
    if !keys.is_empty() {
        push(format_args!("\n| key | default | allowed | meaning |\n|---|---|---|---|\n"));
    }
    for KeyInfo { name, allowed, default, doc } in keys {
        push(format_args!("| `{name}` | {default} | {allowed} | {doc} |\n"));
    }
}
