//! What users can do that no mode is about.

use cotouch_scene::scene::{Scene, WallSides};

use crate::left_out::LeftOut;
use crate::operating_point::{Reach, has_surface};

/// Bodies that can meet each other.
pub(super) fn add_of_bodies(reach: &Reach, left_out: &mut Vec<LeftOut>) {
    let with_surface = || reach.bodies.iter().filter(|body| has_surface(&body.shape));
    if with_surface().count() > 1 && with_surface().any(|body| !body.fixed) {
        left_out.push(LeftOut::new(
            "Contacts between bodies, and fingers that touch two bodies at once",
            "bodies are taken to be apart",
        ));
    }
}

/// Of local models on a soft body.
pub(crate) fn of_soft_contact(scene: &Scene) -> Option<LeftOut> {
    (scene.local_model.sides == WallSides::One).then(|| {
        LeftOut::new(
            "Contacts elsewhere on the soft surface, under load, and such that slide",
            "each finger is taken to stick to the nearest point of the resting body from where it starts",
        )
    })
}
