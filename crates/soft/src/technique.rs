//! The choice between techniques.

use cotouch_scene::scene::{Scene, SoftModel};

use crate::balloon::balloon;
use crate::body::{SoftBody, SoftError};
use crate::corotational::Corotational;
use crate::mass_spring::mass_spring;

/// The soft body of a scene, at rest.
///
/// # Errors
/// When the scene has none, or its technique cannot work with mesh or material.
pub fn soft_body(scene: &Scene) -> Result<Box<dyn SoftBody>, SoftError> {
    match scene.soft.model {
        SoftModel::None => Err(SoftError::Unsuitable("the scene has no soft object".into())),
        SoftModel::MassSpring => Ok(Box::new(mass_spring(scene))),
        SoftModel::Balloon => Ok(Box::new(balloon(scene)?)),
        SoftModel::Corotational => Ok(Box::new(Corotational::from_scene(scene)?)),
    }
}
