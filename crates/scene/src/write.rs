//! A scene as TOML again, and its hash.

use std::fmt::Write as _;

use xxhash_rust::xxh3::xxh3_64;

use crate::keys::Key;
use crate::keys::parts::{DO, IMPAIRMENT, SCRIPT, USER, WAY, kind_of};
use crate::keys::scene::{LINK_IMPAIRMENT, SCENE, USER_LIST, WAY_LIST};
use crate::scene::{Action, Scene, User};
use crate::value::Value;

/// The scene as TOML, every key written, except those that just follow from others. Reading it back gives an equal
/// scene.
#[must_use]
pub fn to_toml(scene: &Scene) -> String {
    let mut document = Document::default();
    document.keys(SCENE, scene, "", true);
    // After [link], in which the keys of SCENE leave off, only sub-tables of it may follow.
    document.keys(IMPAIRMENT, &scene.link.impairment, LINK_IMPAIRMENT, true);
    for way in &scene.link.ways {
        document.list_element(WAY_LIST.0);
        document.lines(WAY, way, true);
        document.lines(IMPAIRMENT, &way.impairment, true);
    }
    for user in &scene.users {
        document.list_element(USER_LIST.0);
        document.lines(USER, user, true);
        document.script(user);
    }
    document.text
}

/// A hash of everything that both ends of a session must agree on: all keys but `name` and `description`.
///
/// It is the XXH3 of the values in the order of the key tables, written as `key = value` lines.
#[must_use]
pub fn scene_hash(scene: &Scene) -> u64 {
    let mut document = Document::default();
    for key in SCENE.iter().filter(|key| !matches!(key.name, "name" | "description")) {
        document.line(key.name, &(key.access.get)(scene));
    }
    document.lines(IMPAIRMENT, &scene.link.impairment, false);
    for way in &scene.link.ways {
        document.list_element(WAY_LIST.0);
        document.lines(WAY, way, false);
        document.lines(IMPAIRMENT, &way.impairment, false);
    }
    for user in &scene.users {
        document.list_element(USER_LIST.0);
        document.lines(USER, user, false);
        document.script(user);
    }
    xxh3_64(document.text.as_bytes())
}

#[derive(Default)]
struct Document {
    text: String,
    table: String,
}

impl Document {
    /// Keys with dots, below `[table]` headings.
    fn keys<T>(&mut self, keys: &[Key<T>], owner: &T, prefix: &str, omit_following: bool) {
        for key in keys.iter().filter(|key| !(omit_following && key.follows(owner))) {
            let path = format!("{prefix}{}", key.name);
            let (table, name) = path.rsplit_once('.').unwrap_or(("", &path));
            if table != self.table {
                self.heading(&format!("[{table}]"));
                table.clone_into(&mut self.table);
            }
            self.line(name, &(key.access.get)(owner));
        }
    }

    /// Keys without headings.
    fn lines<T>(&mut self, keys: &[Key<T>], owner: &T, omit_following: bool) {
        for key in keys.iter().filter(|key| !(omit_following && key.follows(owner))) {
            self.line(key.name, &(key.access.get)(owner));
        }
    }

    fn list_element(&mut self, list: &str) {
        self.heading(&format!("[[{list}]]"));
    }

    fn heading(&mut self, heading: &str) {
        let gap = if self.text.is_empty() { "" } else { "\n" };
        self.push(format_args!("{gap}{heading}\n"));
    }

    fn line(&mut self, name: &str, value: &Value) {
        self.push(format_args!("{name} = {value}\n"));
    }

    fn script(&mut self, user: &User) {
        self.push(format_args!("{} = [\n", SCRIPT.0));
        for action in &user.script {
            self.push(format_args!("  {{ {} }},\n", in_line(action)));
        }
        self.push(format_args!("]\n"));
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        self.text.write_fmt(text).expect("a String takes any text");
    }
}

fn in_line(action: &Action) -> String {
    let kind = kind_of(action);
    let word = Value::Text(kind.word.to_owned());
    let fields = kind.keys.iter().map(|key| format!(", {} = {}", key.name, (key.access.get)(action)));
    format!("{DO} = {word}{}", fields.collect::<String>())
}
