//! What a page has to know of a session besides its pictures.

use cotouch_scene::mesh::TriangleMesh;
use cotouch_scene::scene::{Architecture, Body, Scene, User, WallPlane};
use glam::DVec3;
use serde_json::{Value, json};

use crate::skin::Skin;

/// The facts of `scene`: `About` in `page/src/protocol.ts`.
pub(crate) fn about(scene: &Scene) -> Value {
    json!({
        "scene": scene.name,
        "description": scene.description,
        "architecture": scene.session.architecture,
        "copies": scene.session.architecture == Architecture::Distributed,
        "users": scene.users.iter().map(|user| user.name.as_str()).collect::<Vec<_>>(),
        "fingers_m": scene.users.iter().map(fingers).collect::<Vec<_>>(),
        "space": scene.space,
        "control_hz": scene.rates.control_hz.hz(),
        "network_hz": scene.rates.network_hz.hz(),
        "delay_periods": scene.link.delay_periods,
        "max_force_n": scene.governor.max_force_n,
        "finger_radius_m": scene.hand.finger_radius_m,
        "bodies": scene.world_bodies().iter().map(body).collect::<Vec<_>>(),
        "soft": scene.soft.exists().then(|| soft(scene)),
        "walls": scene.walls().iter().map(wall).collect::<Vec<_>>(),
    })
}

/// Where the user's fingers rest.
fn fingers(user: &User) -> Vec<DVec3> {
    user.fingers.iter().map(|finger| finger.position_m).collect()
}

/// A body as a page draws it; its poses are in the pictures.
fn body(body: &Body) -> Value {
    let shape = &body.shape;
    json!({
        "name": body.name,
        "kind": shape.kind,
        "size_m": shape.size_m,
        "radius_m": shape.radius_m,
        "length_m": shape.length_m,
        "fixed": body.fixed,
        "surface": shape.surface.as_deref().map(surface),
    })
}

/// As single precision: a display needs no more.
fn surface(mesh: &TriangleMesh) -> Value {
    let vertices: Vec<f32> = mesh.vertices.iter().flat_map(|vertex| vertex.as_vec3().to_array()).collect();
    json!({ "vertices_m": vertices, "triangles": mesh.triangles.concat() })
}

/// The soft object as a page draws it, and what is between it and a hand; where it is, is in the pictures.
fn soft(scene: &Scene) -> Value {
    let model = &scene.local_model;
    json!({
        "model": scene.soft.model,
        "surface": Skin::of(scene).map(|skin| skin.facts()),
        "nodes": scene.soft.nodes.as_ref().map(|mesh| mesh.nodes_m.len()),
        "tetrahedra": scene.soft.nodes.as_ref().map(|mesh| mesh.tetrahedra.len()),
        "simulation_hz": scene.rates.simulation_hz.hz(),
        "local_model": {
            "kind": model.kind,
            "stiffness_n_per_m": model.stiffness_n_per_m,
            "stiffness_ratio": model.stiffness_ratio,
            "integral_n_per_m": model.integral_n_per_m,
            "integral_ratio": model.integral_ratio,
        },
    })
}

fn wall(plane: &WallPlane) -> Value {
    json!({ "name": plane.name, "point_m": plane.point_m, "normal": plane.normal.normalize() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_facts_of_a_grasp_are_those_of_its_scene() {
        let facts = about(&cotouch_scene::load("grasp", &[]).unwrap());
        assert_eq!(facts["users"], json!(["anna", "ben"]));
        assert_eq!(facts["fingers_m"][0].as_array().unwrap().len(), 2);
        assert_eq!(facts["bodies"][0]["kind"], "box");
        assert_eq!(facts["bodies"][0]["surface"], Value::Null);
        assert_eq!(facts["walls"].as_array().unwrap().len(), 4);
        assert_eq!(facts["space"], "plane");
        assert_eq!(facts["copies"], true);
        assert_eq!(facts["soft"], Value::Null);
    }
}
