//! Keys that no scene has, and what may have been meant.

use crate::error::{Problem, SceneError};
use crate::keys::Key;
use crate::keys::parts::{
    BODY, FINGER, FINGER_LIST, FINGER_SCRIPT, FIXED, IMPAIRMENT, PLANE, SCRIPT, USER, WAY,
};
use crate::keys::scene::{
    BODY_LIST, FIXED_LIST, INCLUDE, LINK_IMPAIRMENT, PLANE_LIST, SCENE, SOFT_MESH, USER_LIST, WAY_LIST,
};
use crate::tree::{Content, Table, shorten};

/// The names of `keys`.
pub(crate) fn names<T>(keys: &[Key<T>]) -> Vec<String> {
    keys.iter().map(|key| key.name.to_owned()).collect()
}

/// All that a scene may have at the top.
pub(crate) fn scene_keys() -> Vec<String> {
    let mut known = names(SCENE);
    known.extend(IMPAIRMENT.iter().map(|key| format!("{LINK_IMPAIRMENT}{}", key.name)));
    let lists = [BODY_LIST.0, PLANE_LIST.0, FIXED_LIST.0, USER_LIST.0, WAY_LIST.0, INCLUDE.0];
    known.extend(lists.map(str::to_owned));
    known
}

/// All that a `[[user]]` may have.
pub(crate) fn user_keys() -> Vec<String> {
    let mut known = names(USER);
    known.extend([SCRIPT.0, FINGER_LIST.0].map(str::to_owned));
    known
}

/// All that a `[[user.finger]]` may have.
pub(crate) fn finger_keys() -> Vec<String> {
    let mut known = names(FINGER);
    known.push(FINGER_SCRIPT.0.to_owned());
    known
}

/// All that a `[[body]]` may have.
pub(crate) fn body_keys() -> Vec<String> {
    names(BODY)
}

/// All that a `[[wall.plane]]` may have.
pub(crate) fn plane_keys() -> Vec<String> {
    names(PLANE)
}

/// All that a `[[soft.fixed]]` may have.
pub(crate) fn fixed_keys() -> Vec<String> {
    names(FIXED)
}

/// All that a `[[link.way]]` may have.
pub(crate) fn way_keys() -> Vec<String> {
    [names(WAY), names(IMPAIRMENT)].concat()
}

/// Refuses everything in `rest`, what is left after all `known` keys were taken. `path` is where `rest` is below the
/// table that `prefix` names.
pub(crate) fn refuse(rest: Table, prefix: &str, path: &str, known: &[String], errors: &mut Vec<SceneError>) {
    for (name, node) in rest {
        let path = format!("{path}{name}");
        let inside: Vec<&str> =
            known.iter().filter_map(|key| key.strip_prefix(&path)?.strip_prefix('.')).collect();
        let found = node.found();
        let problem = match node.content {
            Content::Table(table) if !table.is_empty() || !inside.is_empty() => {
                refuse(table, prefix, &format!("{path}."), known, errors);
                continue;
            }
            _ if !inside.is_empty() => Problem::NotAllowed {
                key: format!("{prefix}{path}"),
                found,
                allowed: allowed_table(&path, &inside),
            },
            _ => problem(prefix, &path, known),
        };
        errors.push(SceneError { place: node.place, problem });
    }
}

fn allowed_table(path: &str, inside: &[&str]) -> String {
    let table = format!("a table with {}", inside.join(", "));
    if path == SOFT_MESH.0 { format!("the path of a file, or {table}") } else { table }
}

/// What is wrong with a key that is not among `known`.
pub(crate) fn problem(prefix: &str, path: &str, known: &[String]) -> Problem {
    Problem::UnknownKey { key: shorten(&format!("{prefix}{path}")), hint: hint(prefix, path, known) }
}

fn hint(prefix: &str, path: &str, known: &[String]) -> String {
    if let Some(near) = nearest(path, known.iter().map(String::as_str)) {
        return format!("did you mean {prefix}{near}?");
    }
    let table = path.rsplit_once('.').map_or("", |(table, _)| table);
    let inside = |key: &String| key.strip_prefix(table).map(|rest| rest.trim_start_matches('.').to_owned());
    let mut allowed: Vec<String> = known.iter().filter_map(inside).collect();
    if allowed.is_empty() {
        allowed = known.to_vec();
    }
    let mut names: Vec<&str> = Vec::new();
    for name in allowed.iter().filter_map(|key| key.split('.').next()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    format!("allowed here: {}", names.join(", "))
}

/// The candidate that `word` was probably meant to be: one typed with a slip, or one of which it is the end.
pub(crate) fn nearest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    const ALIKE: f64 = 0.7;
    // Longer than any key: comparing takes time with the square of the length.
    const LONGEST: usize = 100;
    if word.len() > LONGEST {
        return None;
    }
    let likeness = |candidate: &str| {
        let is_end = candidate.strip_suffix(word).is_some_and(|start| start.ends_with('.'));
        if is_end { 0.9 } else { strsim::normalized_damerau_levenshtein(word, candidate) }
    };
    let scored = candidates.map(|candidate| (likeness(candidate), candidate));
    let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (best.0 >= ALIKE).then_some(best.1)
}
