//! The contact modes of any scene: the one place where kinds of scene are told apart.

use cotouch_scene::Scene;

use crate::compile::{self, ContactMode};
use crate::soft::{self, Bodies};
use crate::verdict::AnalysisError;

/// Every contact mode, and what was left out, in plain sentences. `bodies` remembers what was prepared before.
pub(crate) fn contact_modes(
    scene: &Scene,
    bodies: &Bodies,
) -> Result<(Vec<ContactMode>, Vec<String>), AnalysisError> {
    if scene.soft.exists() { Ok(soft::modes(scene, bodies)?) } else { Ok(compile::modes(scene)) }
}
