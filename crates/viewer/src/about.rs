//! What a page has to know of a session besides its snapshots: sent once, first.

use cotouch_scene::scene::{Architecture, Body, Scene, WallPlane};
use serde_json::{Value, json};

/// The session's fixed facts, and who to ask for the prediction.
pub struct About {
    facts: Value,
    prediction: Box<dyn Fn() -> Value + Send + Sync>,
}

impl About {
    /// The facts of `scene`. `prediction` is asked once for every page that connects; it answers `null`, or an object
    /// with `stable` (true or false) and `spectral_radius` (a number).
    pub fn new(scene: &Scene, prediction: impl Fn() -> Value + Send + Sync + 'static) -> Self {
        let walls: Vec<Value> = scene.walls().iter().map(wall).collect();
        let bodies: Vec<Value> = scene.world_bodies().iter().map(body).collect();
        let facts = json!({
            "scene": scene.name,
            "description": scene.description,
            "architecture": scene.session.architecture,
            "copies": scene.session.architecture == Architecture::Distributed,
            "users": scene.users.iter().map(|user| user.name.as_str()).collect::<Vec<_>>(),
            "control_hz": scene.rates.control_hz.hz(),
            "network_hz": scene.rates.network_hz.hz(),
            "delay_periods": scene.link.delay_periods,
            "max_force_n": scene.governor.max_force_n,
            "space": scene.space,
            "finger_radius_m": scene.hand.finger_radius_m,
            "bodies": bodies,
            "walls": walls,
        });
        Self { facts, prediction: Box::new(prediction) }
    }

    /// The first message on the WebSocket.
    pub(crate) fn message(&self) -> String {
        json!({ "about": self.facts, "predicted": (self.prediction)() }).to_string()
    }
}

/// A body as a page draws it; its poses are in the snapshots.
fn body(body: &Body) -> Value {
    let shape = &body.shape;
    json!({
        "name": body.name,
        "kind": shape.kind,
        "size_m": shape.size_m,
        "radius_m": shape.radius_m,
        "length_m": shape.length_m,
        "fixed": body.fixed,
    })
}

fn wall(plane: &WallPlane) -> Value {
    json!({ "name": plane.name, "point_m": plane.point_m, "normal": plane.normal.normalize() })
}
