//! The loops of any scene: the one place where kinds of scene are told apart.

use cotouch_scene::Scene;
use cotouch_scene::scene::SceneValues;

use crate::compile::{self, ContactMode};
use crate::left_out::LeftOut;
use crate::operating_point::Settled;
use crate::soft::{self, Bodies, UserTouch};
use crate::switching::ContactPoints;
use crate::verdict::AnalysisError;

/// Every contact mode, and what was left out. `bodies` remembers what was prepared before.
pub(crate) fn contact_modes(
    scene: &Scene,
    bodies: &Bodies,
) -> Result<(Vec<ContactMode>, Vec<LeftOut>), AnalysisError> {
    if scene.soft.exists() { Ok(soft::modes(scene, bodies)?) } else { Ok(compile::modes(scene)) }
}

/// About what a scene with rigid bodies is linear, and which of its contacts switch.
pub(crate) fn contact_points(scene: &SceneValues) -> ContactPoints {
    let settled = Settled::of_every_finger(scene);
    let (always, grips) = (settled.always(), (0..settled.grips.len()).collect::<Vec<_>>());
    let switching: Vec<_> = (0..settled.leans.len()).filter(|lean| !always.contains(lean)).collect();
    ContactPoints {
        always: settled.point(scene, &[], &always),
        switching: settled.point(scene, &grips, &switching),
    }
}

/// Each user alone on the soft object, with the hands that `hands` describes; `None` where the object is rigid.
pub(crate) fn touches_of_users(
    scene: &Scene,
    hands: &SceneValues,
) -> Result<Option<Vec<UserTouch>>, AnalysisError> {
    if scene.soft.exists() { Ok(Some(soft::touches_of_users(scene, hands)?)) } else { Ok(None) }
}
