//! Every key of every table, one by one.

use super::parts::{ACTIONS, BODY, FINGER, FIXED, IMPAIRMENT, PLANE, USER, WAY};
use super::scene::SCENE;
use super::*;
use crate::error::Place;
use crate::limits::{MAX_BODIES, MAX_ENTRIES, MAX_FINGERS};
use crate::scene::SceneValues;

fn read(kind: &Kind, text: &str) -> Option<Value> {
    kind.read(&crate::tree::parse_value(text, &Place::file("test")).unwrap())
}

/// Both ends of a key's range are taken, and nothing beyond them.
fn check_ends<T>(key: &Key<T>) {
    let name = key.name;
    let (inside, outside): (Vec<String>, Vec<String>) = match key.kind {
        Kind::Number { min, max } => {
            (vec![plain(min), plain(max)], vec![plain(min.next_down()), plain(max.next_up())])
        }
        Kind::Count { min, max } => {
            let outside =
                vec![(i128::from(min) - 1).to_string(), (u128::from(max) + 1).to_string(), "2.5".into()];
            (vec![min.to_string(), max.to_string()], outside)
        }
        Kind::Rate { min, max } => {
            let inside = vec![min.to_string(), format!("{max}.0"), format!("\"{}/10\"", max * 10)];
            (inside, vec![format!("0.{}", "9".repeat(9)), format!("{max}.0000001"), "0".into(), "-1".into()])
        }
        Kind::Choice(words) => (words.iter().map(|w| format!("\"{w}\"")).collect(), vec!["\"other\"".into()]),
        Kind::Text { min, max } => {
            let text = |length: usize| format!("\"{}\"", "é".repeat(length));
            let mut outside =
                vec![text(max + 1), "\" a\"".into(), "\"a\\nb\"".into(), "\"a\\u202eb\"".into()];
            outside.extend((min > 0).then(|| text(min - 1)));
            (vec![text(min), text(max)], outside)
        }
        Kind::Flag => (vec!["true".into(), "false".into()], vec!["1".into(), "\"true\"".into()]),
        Kind::Vector { max } => {
            let (end, beyond) = (plain(max), plain(max.next_up()));
            let inside = vec![end.clone(), format!("[0, -{end}, {end}]")];
            (
                inside,
                vec![beyond.clone(), format!("[0, 0, -{beyond}]"), "[1, 2]".into(), "[1, 2, nan]".into()],
            )
        }
        Kind::Counts { min, max } => {
            let (less, more) = (i64::from(min) - 1, u64::from(max) + 1);
            let outside =
                [format!("[{min}, {less}, {max}]"), format!("[{min}, {min}, {more}]"), "[1, 2]".into()];
            (
                vec![format!("[{min}, {max}, {min}]")],
                [&outside[..], &["[1, 1, 1.5]".into(), min.to_string()]].concat(),
            )
        }
    };
    for text in &inside {
        assert!(read(&key.kind, text).is_some(), "{name} = {text}");
    }
    let nonsense = ["nan", "inf", "-inf", "1979-05-27", "{}", "[]"].map(str::to_owned);
    for text in outside.iter().chain(&nonsense) {
        assert!(read(&key.kind, text).is_none(), "{name} = {text}");
    }
}

/// Every key says what it is, has a default that it would itself accept, and sets its own field.
fn check_key<T: Clone>(key: &Key<T>, blank: &T) {
    let name = key.name;
    assert!(key.doc.ends_with('.') && key.doc.len() > 3, "{name}: {}", key.doc);
    let has_unit = ["_s", "_s2", "_m", "_m3", "_kg", "_hz", "_n", "_pa", "_rad", "_periods", "_packets"]
        .iter()
        .any(|end| name.ends_with(end));
    assert_eq!(has_unit, !key.unit.is_empty(), "{name}");
    if let Fallback::Is(text) = key.fallback {
        let value = key.kind.read_word(text);
        assert!(value.as_ref().is_some_and(|value| key.kind.admit(value.clone()).is_some()), "{name}");
        assert_eq!(key.default(blank), value, "{name}");
    }
    let mut owner = blank.clone();
    for value in samples(&key.kind) {
        (key.access.set)(&mut owner, value.clone());
        assert_eq!((key.access.get)(&owner), value, "{name}");
    }
    check_ends(key);
}

fn samples(kind: &Kind) -> Vec<Value> {
    match *kind {
        Kind::Number { min, max } => vec![Value::Number(min), Value::Number(max)],
        Kind::Count { min, max } => vec![Value::Count(min), Value::Count(max)],
        Kind::Rate { max, .. } => vec![Value::Rate(Rate::new(max, 7).unwrap())],
        Kind::Choice(words) => words.iter().map(|&word| Value::Text(word.to_owned())).collect(),
        Kind::Text { .. } => vec![Value::Text("any".to_owned())],
        Kind::Flag => vec![Value::Flag(true), Value::Flag(false)],
        Kind::Vector { max } => vec![Value::Vector(glam::DVec3::new(max, 1.0, -1.0))],
        Kind::Counts { min, max } => {
            vec![Value::Vector(glam::DVec3::new(min.into(), max.into(), min.into()))]
        }
    }
}

#[test]
fn every_key_is_what_it_says() {
    SCENE.iter().for_each(|key| check_key(key, &blank(SCENE)));
    IMPAIRMENT.iter().for_each(|key| check_key(key, &blank(IMPAIRMENT)));
    WAY.iter().for_each(|key| check_key(key, &blank(WAY)));
    BODY.iter().for_each(|key| check_key(key, &blank(BODY)));
    FIXED.iter().for_each(|key| check_key(key, &blank(FIXED)));
    PLANE.iter().for_each(|key| check_key(key, &blank(PLANE)));
    FINGER.iter().for_each(|key| check_key(key, &blank(FINGER)));
    USER.iter().for_each(|key| check_key(key, &blank(USER)));
    for kind in ACTIONS {
        let blank = (kind.blank)();
        assert!((kind.is)(&blank), "{}", kind.word);
        kind.keys.iter().for_each(|key| check_key(key, &blank));
    }
}

/// A field without a key would stay at the zero that reading starts from.
#[test]
fn every_field_has_a_key() {
    let lists = ["bodies", "users", "link.ways", "wall.planes", "soft.fixed"];
    let names = crate::reference::keys().into_iter().map(|key| key.name);
    let known: Vec<String> = names.chain(lists.map(str::to_owned)).collect();
    let mut fields = Vec::new();
    collect_fields("", &serde_json::to_value(blank::<SceneValues>(SCENE)).unwrap(), &mut fields);
    for field in fields {
        let key = field.replace("object.shape.kind", "object.shape").replace("object.shape.", "object.");
        assert!(known.contains(&key), "{field}");
    }
}

/// The dotted names of everything in `table` that is no table.
fn collect_fields(path: &str, table: &serde_json::Value, fields: &mut Vec<String>) {
    for (name, value) in table.as_object().unwrap() {
        let path = format!("{path}{name}");
        if value.is_object() {
            collect_fields(&format!("{path}."), value, fields);
        } else {
            fields.push(path);
        }
    }
}

#[test]
fn words_name_the_limits() {
    assert!(super::parts::FINGER_LIST.1.contains(&format!("1 to {MAX_FINGERS};")));
    let bodies = super::scene::BODY_LIST.1;
    assert!(
        bodies.contains(&format!("up to {MAX_BODIES},"))
            && bodies.contains(&format!("at most {MAX_ENTRIES} together"))
    );
}
