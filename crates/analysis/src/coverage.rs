//! What users can do in a scene that no contact mode is about.

use cotouch_scene::scene::{Architecture, Scene, ShapeKind, Space, WallSides};

use crate::left_out::LeftOut;
use crate::operating_point::has_surface;

/// Adds what follows from the kind of scene.
pub(crate) fn add_left_out(scene: &Scene, left_out: &mut Vec<LeftOut>) {
    if scene.soft.exists() {
        add_of_soft_contact(scene, left_out);
    } else {
        add_of_rigid_contact(scene, left_out);
    }
}

fn add_of_rigid_contact(scene: &Scene, left_out: &mut Vec<LeftOut>) {
    let bodies = scene.world_bodies();
    let with_surface = || bodies.iter().filter(|body| has_surface(&body.shape));
    let touched = with_surface().next().is_some();
    let one_sided_wall = scene.wall.exists() && (touched || scene.wall.sides == WallSides::One);
    if scene.session.architecture == Architecture::Distributed && (touched || one_sided_wall) {
        left_out.push(LeftOut::new(
            "Contacts with some copies of a body and not with the others",
            "all copies are taken to be touched at the same instants",
        ));
    }
    if !touched {
        return;
    }
    if scene.space != Space::Line {
        left_out.push(LeftOut::new("Contacts that slide", "contacts are taken to stick"));
        left_out.push(LeftOut::new(
            "Contacts elsewhere on a surface",
            "each finger is taken to touch where it comes from",
        ));
    }
    if with_surface().any(|body| matches!(body.shape.kind, ShapeKind::Hull | ShapeKind::Mesh)) {
        left_out.push(LeftOut::new(
            "Edges of meshes and hulls",
            "they are taken as flat where fingers touch them",
        ));
    }
    if bodies.len() > 1 {
        left_out.push(LeftOut::new("Contacts between bodies", "the bodies are taken to stay apart"));
    }
}

fn add_of_soft_contact(scene: &Scene, left_out: &mut Vec<LeftOut>) {
    if scene.local_model.sides == WallSides::One {
        left_out.push(LeftOut::new(
            "Contacts elsewhere on the soft surface, under load, and such that slide",
            "each finger is taken to stick to the nearest point of the resting body from where it starts",
        ));
    }
}
