//! Whether every value of a scene lies in the range of its key, wherever the values come from.

use crate::consistency::Conflict;
use crate::keys::Key;
use crate::keys::parts::{
    BODY, FINGER, FINGER_LIST, FINGER_SCRIPT, FIXED, IMPAIRMENT, PLANE, SCRIPT, USER, WAY, kind_of,
};
use crate::keys::scene::{BODY_LIST, FIXED_LIST, LINK_IMPAIRMENT, PLANE_LIST, SCENE, USER_LIST, WAY_LIST};
use crate::scene::{Action, SceneValues, User};

/// Values out of their range. Those within become what reading would make of them (−0 is 0).
pub(crate) fn admit(values: &mut SceneValues) -> Vec<Conflict> {
    let mut found = Vec::new();
    keys(SCENE, "", values, &mut found);
    keys(IMPAIRMENT, LINK_IMPAIRMENT, &mut values.link.impairment, &mut found);
    for (table, way) in numbered(WAY_LIST.0, &mut values.link.ways) {
        keys(WAY, &table, way, &mut found);
        keys(IMPAIRMENT, &table, &mut way.impairment, &mut found);
    }
    for (table, body) in numbered(BODY_LIST.0, &mut values.bodies) {
        keys(BODY, &table, body, &mut found);
    }
    for (table, plane) in numbered(PLANE_LIST.0, &mut values.wall.planes) {
        keys(PLANE, &table, plane, &mut found);
    }
    for (table, region) in numbered(FIXED_LIST.0, &mut values.soft.fixed) {
        keys(FIXED, &table, region, &mut found);
    }
    for (table, user) in numbered(USER_LIST.0, &mut values.users) {
        admit_user(&table, user, &mut found);
    }
    found
}

fn admit_user(table: &str, user: &mut User, found: &mut Vec<Conflict>) {
    keys(USER, table, user, found);
    script(&format!("{table}{}", SCRIPT.0), &mut user.script, found);
    for (table, finger) in numbered(&format!("{table}{}", FINGER_LIST.0), &mut user.fingers) {
        keys(FINGER, &table, finger, found);
        script(&format!("{table}{}", FINGER_SCRIPT.0), &mut finger.script, found);
    }
}

fn script(list: &str, actions: &mut [Action], found: &mut Vec<Conflict>) {
    for (table, action) in numbered(list, actions) {
        keys(kind_of(action).keys, &table, action, found);
    }
}

/// Each element of a list with what its keys begin with.
fn numbered<'a, T>(list: &str, elements: &'a mut [T]) -> impl Iterator<Item = (String, &'a mut T)> {
    elements.iter_mut().enumerate().map(move |(index, element)| (format!("{list}.{}.", index + 1), element))
}

fn keys<T>(keys: &[Key<T>], table: &str, owner: &mut T, found: &mut Vec<Conflict>) {
    for key in keys {
        let value = (key.access.get)(owner);
        match key.kind.admit(value.clone()) {
            Some(admitted) => (key.access.set)(owner, admitted),
            None => found.push(Conflict {
                keys: vec![format!("{table}{}", key.name)],
                found: value.to_string(),
                allowed: key.allowed(),
            }),
        }
    }
}
