//! The JSON Schema of scenes, from the key tables: for editors that complete and check TOML.

use serde_json::{Map, Value as Json, json};

use crate::keys::parts::{
    ACTIONS, ActionKind, BODY, DO, FINGER, FINGER_LIST, FINGER_SCRIPT, FIXED, IMPAIRMENT, PLANE, SCRIPT,
    USER, WAY,
};
use crate::keys::scene::{
    BODY_LIST, FIXED_LIST, INCLUDE, LINK_IMPAIRMENT, PLANE_LIST, SCENE, SOFT_MESH, TABLES, USER_LIST,
    WAY_LIST,
};
use crate::keys::{Fallback, Key, Kind};

/// The JSON Schema (draft 2020-12) of a scene file. It states every key's kind, range, default, unit and meaning; what
/// keys demand of each other is only checked when a scene is read.
#[must_use]
pub fn json_schema() -> Json {
    let mut root = object("A cotouch scene.");
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("cotouch scene");
    add_keys(&mut root, SCENE, "");
    add_keys(&mut root, IMPAIRMENT, LINK_IMPAIRMENT);
    add(&mut root, INCLUDE.0, json!({ "type": "string", "description": INCLUDE.1 }));
    let mut body = object(BODY_LIST.1);
    add_keys(&mut body, BODY, "");
    add(&mut root, BODY_LIST.0, list(body, BODY_LIST.1));
    let mut plane = object(PLANE_LIST.1);
    add_keys(&mut plane, PLANE, "");
    add(&mut root, PLANE_LIST.0, list(plane, PLANE_LIST.1));
    let mut region = object(FIXED_LIST.1);
    add_keys(&mut region, FIXED, "");
    add(&mut root, FIXED_LIST.0, list(region, FIXED_LIST.1));
    let mut way = object(WAY_LIST.1);
    add_keys(&mut way, WAY, "");
    add_keys(&mut way, IMPAIRMENT, "");
    add(&mut root, WAY_LIST.0, list(way, WAY_LIST.1));
    let mut user = object(USER_LIST.1);
    add_keys(&mut user, USER, "");
    let actions: Vec<Json> = ACTIONS.iter().map(action).collect();
    root["$defs"] = json!({ "action": { "oneOf": actions } });
    let an_action = || json!({ "$ref": "#/$defs/action" });
    add(&mut user, SCRIPT.0, list(an_action(), SCRIPT.1));
    let mut finger = object(FINGER_LIST.1);
    add_keys(&mut finger, FINGER, "");
    add(&mut finger, FINGER_SCRIPT.0, list(an_action(), FINGER_SCRIPT.1));
    add(&mut user, FINGER_LIST.0, list(finger, FINGER_LIST.1));
    add(&mut root, USER_LIST.0, list(user, USER_LIST.1));
    describe_tables(&mut root);
    admit_mesh_file(&mut root);
    root
}

/// `soft.mesh` may also be the path of a file.
fn admit_mesh_file(root: &mut Json) {
    let pointer: String = SOFT_MESH.0.split('.').map(|name| format!("/properties/{name}")).collect();
    if let Some(table) = root.pointer_mut(&pointer) {
        let path = json!({ "type": "string", "description": SOFT_MESH.1 });
        *table = json!({ "anyOf": [table.take(), path] });
    }
}

fn object(description: &str) -> Json {
    json!({ "type": "object", "description": description, "additionalProperties": false, "properties": {} })
}

fn list(items: Json, description: &str) -> Json {
    json!({ "type": "array", "description": description, "items": items })
}

fn action(kind: &ActionKind) -> Json {
    let mut schema = object(kind.doc);
    schema["required"] = json!([DO]);
    add(&mut schema, DO, json!({ "const": kind.word }));
    add_keys(&mut schema, kind.keys, "");
    schema
}

fn add_keys<T>(schema: &mut Json, keys: &[Key<T>], prefix: &str) {
    for key in keys {
        add(schema, &format!("{prefix}{}", key.name), of_key(key));
        if matches!(key.fallback, Fallback::Required) {
            let required = schema
                .as_object_mut()
                .and_then(|object| object.entry("required").or_insert_with(|| json!([])).as_array_mut());
            required.into_iter().for_each(|list| list.push(json!(key.name)));
        }
    }
}

/// Puts `property` at a dotted path; tables on the way are created.
fn add(schema: &mut Json, path: &str, property: Json) {
    let (name, rest) = path.split_once('.').map_or((path, None), |(name, rest)| (name, Some(rest)));
    let Some(properties) = schema["properties"].as_object_mut() else { return };
    match rest {
        None => drop(properties.insert(name.to_owned(), property)),
        Some(rest) => add(properties.entry(name).or_insert_with(|| object("")), rest, property),
    }
}

fn describe_tables(root: &mut Json) {
    for (path, doc) in TABLES {
        let pointer: String = path.split('.').map(|name| format!("/properties/{name}")).collect();
        if let Some(table) = root.pointer_mut(&pointer) {
            table["description"] = json!(doc);
        }
    }
}

fn of_key<T>(key: &Key<T>) -> Json {
    let unit = if key.unit.is_empty() { String::new() } else { format!(" In {}.", key.unit) };
    let mut schema = of_kind(&key.kind);
    let description = format!("{}{unit} Default: {}.", key.doc, key.default_in_words());
    schema.insert("description".to_owned(), json!(description));
    if let Fallback::Is(text) = key.fallback {
        schema.insert("default".to_owned(), default(&key.kind, text));
    }
    Json::Object(schema)
}

fn of_kind(kind: &Kind) -> Map<String, Json> {
    let schema = match *kind {
        Kind::Number { min, max } => json!({ "type": "number", "minimum": min, "maximum": max }),
        Kind::Count { min, max } => json!({ "type": "integer", "minimum": min, "maximum": max }),
        Kind::Rate { min, max } => json!({ "anyOf": [
            { "type": "number", "minimum": min, "maximum": max },
            { "type": "string", "pattern": "^[0-9.eE+-]+(/[0-9.eE+-]+)?$" },
        ] }),
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Text { min, max } => json!({ "type": "string", "minLength": min, "maxLength": max }),
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Vector { max } => {
            let number = json!({ "type": "number", "minimum": -max, "maximum": max });
            json!({ "anyOf": [number, { "type": "array", "items": number, "minItems": 3, "maxItems": 3 }] })
        }
        Kind::Counts { min, max } => {
            let count = json!({ "type": "integer", "minimum": min, "maximum": max });
            json!({ "type": "array", "items": count, "minItems": 3, "maxItems": 3 })
        }
    };
    schema.as_object().cloned().unwrap_or_default()
}

/// A default as a number where it is one.
fn default(kind: &Kind, text: &str) -> Json {
    match kind {
        Kind::Choice(_) | Kind::Text { .. } => json!(text),
        Kind::Counts { .. } => json!(text.parse::<u32>().map_or_else(|_| vec![], |count| vec![count; 3])),
        _ => serde_json::from_str(text).unwrap_or_else(|_| json!(text)),
    }
}
