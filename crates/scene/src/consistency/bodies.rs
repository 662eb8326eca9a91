//! What shapes, walls, friction and devices demand.

use std::path::Path;

use glam::DVec3;

use super::conflict::{Conflict, conflict};
use crate::limits::{MAX_BODIES, MAX_ENTRIES};
use crate::mesh::MeshError;
use crate::scene::{Architecture, DeviceKind, SceneValues, Shape, ShapeKind, Space};
use crate::value::{Value, plain};

pub(super) fn bodies(scene: &SceneValues, found: &mut Vec<Conflict>) {
    if scene.bodies.is_empty() {
        check_shape("object.", &scene.object.shape, found);
    }
    for (index, body) in scene.bodies.iter().enumerate() {
        check_shape(&format!("body.{}.", index + 1), &body.shape, found);
    }
    found.extend(point_among_many(scene));
    found.extend(count(scene));
    friction(scene, found);
    for (index, plane) in scene.wall.planes.iter().enumerate() {
        if plane.normal == DVec3::ZERO {
            let key = format!("wall.plane.{}.normal", index + 1);
            found.push(conflict(&[&key], "0", "a vector of any length but 0"));
        }
    }
    if scene.device.kind == DeviceKind::Pantograph && scene.space != Space::Plane {
        let keys = ["device.kind", "space"];
        let allowed =
            "\"point\" or \"phantom\", because a pantograph moves in a plane and space is not \"plane\"";
        found.push(conflict(&keys, "\"pantograph\"", allowed));
    }
}

/// A shape has the numbers that it needs.
fn check_shape(table: &str, shape: &Shape, found: &mut Vec<Conflict>) {
    let word = format!("{table}shape");
    let mut need = |name: &str, value: Value, allowed: &str| {
        let key = format!("{table}{name}");
        found.push(conflict(&[&key, &word], value.to_string(), allowed));
    };
    let is_round = matches!(shape.kind, ShapeKind::Ball | ShapeKind::Capsule);
    if is_round && shape.radius_m == 0.0 {
        need("radius_m", Value::Number(0.0), "more than 0 (m), because the shape is a ball or a capsule");
    }
    if shape.kind == ShapeKind::Capsule && shape.length_m == 0.0 {
        need("length_m", Value::Number(0.0), "more than 0 (m), because the shape is a capsule");
    }
    if shape.kind == ShapeKind::Box && shape.size_m.min_element() <= 0.0 {
        need("size_m", Value::Vector(shape.size_m), "3 numbers above 0 (m), because the shape is a box");
    }
    if matches!(shape.kind, ShapeKind::Hull | ShapeKind::Mesh) && shape.mesh.is_empty() {
        let allowed = "the path of an .stl, .obj, .gltf or .glb file, because the shape is a hull or a mesh";
        need("mesh", Value::Text(String::new()), allowed);
    }
}

/// What is wrong with the mesh file of the shape in `table`, which is empty or ends in a dot.
pub(crate) fn surface(table: &str, path: &Path, error: &MeshError) -> Conflict {
    conflict(&[&format!("{table}mesh")], format!("\"{}\", and {error}", path.display()), error.allowed())
}

/// A body without a surface is coupled to every finger for good; that leaves none for other bodies.
fn point_among_many(scene: &SceneValues) -> Option<Conflict> {
    let point = scene.bodies.iter().position(|body| body.shape.kind == ShapeKind::Point)?;
    (scene.bodies.len() > 1).then(|| {
        let key = format!("body.{}.shape", point + 1);
        let allowed = "\"ball\", \"box\", \"capsule\", \"hull\" or \"mesh\": every finger is coupled to a point for good, so \
                       only a single body can be one";
        conflict(&[&key, "body"], "\"point\"", allowed)
    })
}

fn count(scene: &SceneValues) -> Option<Conflict> {
    let bodies = scene.bodies.len();
    if bodies > MAX_BODIES {
        let found = format!("a list of {bodies}");
        return Some(conflict(&["body"], found, format!("a list of at most {MAX_BODIES} tables")));
    }
    let moving = if bodies == 0 { 1 } else { scene.bodies.iter().filter(|body| !body.fixed).count() };
    let sends = scene.session.architecture == Architecture::Distributed && scene.session.coordination.sends();
    let most = room_for_fingers(scene.session.users, moving, sends);
    let (index, user) = scene.users.iter().enumerate().find(|(_, user)| user.fingers.len() > most)?;
    let key = format!("user.{}.finger", index + 1);
    let found = format!("a list of {}", user.fingers.len());
    let told = if sends { ", and what coordination tells each peer of each body," } else { "" };
    let allowed = format!(
        "a list of at most {most} tables: fingers and bodies that are not fixed ({moving}){told} are at most {MAX_ENTRIES}"
    );
    Some(conflict(&[&key, "body"], found, allowed))
}

/// How many fingers fit into a state packet beside the bodies that move and what a scheme that sends tells every peer of
/// each of these.
fn room_for_fingers(users: u8, moving: usize, sends: bool) -> usize {
    let told = if sends { moving * usize::from(users).saturating_sub(1) } else { 0 };
    MAX_ENTRIES.saturating_sub(moving + told)
}

fn friction(scene: &SceneValues, found: &mut Vec<Conflict>) {
    let pairs = [
        ("contact", scene.contact.dynamic_friction, scene.contact.static_friction),
        ("wall", scene.wall.dynamic_friction, scene.wall.static_friction),
    ];
    for (table, sliding, sticking) in pairs {
        if sliding > sticking {
            let keys = [format!("{table}.dynamic_friction"), format!("{table}.static_friction")];
            let allowed = format!("at most {} ({})", keys[1], plain(sticking));
            found.push(conflict(&[&keys[0], &keys[1]], plain(sliding), allowed));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_coordination_tells_peers_takes_room_in_packets() {
        assert_eq!(room_for_fingers(4, 2, false), MAX_ENTRIES - 2);
        assert_eq!(room_for_fingers(4, 2, true), MAX_ENTRIES - 2 - 2 * 3);
        assert_eq!(room_for_fingers(16, 1, true), 0);
    }
}
