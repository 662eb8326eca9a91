//! The loops in which one user alone has the object, and what an ideal system would do instead.

use cotouch_scene::Scene;
use cotouch_scene::scene::SceneValues;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::alone::Held;
use super::error::TransparencyError;
use super::one_line::{OneLine, Reduction, fingers, without_tracking};
use crate::modes::touches_of_users;
use crate::soft::UserTouch;

/// What answers to the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AdmittanceQuantity {
    /// In free motion, m/s per N.
    Velocity,
    /// Against a wall or on a soft object, m per N.
    Position,
}

/// Every user alone, against the wall if there is one.
pub(super) struct UserLoops {
    /// In the order of the scene.
    pub(super) users: Vec<UserLoop>,
    pub(super) quantity: AdmittanceQuantity,
    pub(super) reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub(super) notes: Vec<String>,
}

/// One user alone.
pub(super) struct UserLoop {
    pub(super) name: String,
    pub(super) held: Held,
    pub(super) ideal: Ideal,
}

/// One mass with a damper and a spring to the ground, continuous in time. What devices are asked to damp is what the system adds,
/// and compensation is made for that: neither is in it.
#[derive(Clone, Copy)]
pub(super) struct Ideal {
    pub(super) mass_kg: f64,
    pub(super) damping_n_s_per_m: f64,
    pub(super) stiffness_n_per_m: f64,
}

impl UserLoops {
    pub(super) fn new(scene: &Scene) -> Result<Self, TransparencyError> {
        Self::on_soft_object(scene)?.map_or_else(|| Self::on_line(scene), Ok)
    }

    fn on_line(scene: &SceneValues) -> Result<Self, TransparencyError> {
        let line = OneLine::at_wall(scene);
        let spec = line.spec();
        crate::check::check(&spec)?;
        let scene = &line.scene;
        let ideal = ideal_on_line(scene);
        let users = scene.hosts().map(|user| UserLoop {
            name: scene.users[user.index()].name.clone(),
            held: Held::by_hand(&spec, user, &|_| DVec3::X),
            ideal,
        });
        Ok(Self {
            users: users.collect(),
            quantity: if scene.wall.exists() {
                AdmittanceQuantity::Position
            } else {
                AdmittanceQuantity::Velocity
            },
            reduction: line.reduction,
            notes: line.notes,
        })
    }

    /// `None` where the object is rigid.
    pub(super) fn on_soft_object(scene: &Scene) -> Result<Option<Self>, TransparencyError> {
        let (hands, note) = without_tracking(scene);
        let Some(touches) = touches_of_users(scene, &hands)? else { return Ok(None) };
        let users = hands.hosts().zip(touches).map(|(user, touch)| UserLoop {
            name: hands.users[user.index()].name.clone(),
            held: Held::by_hand(&touch.spec, user, &|finger| touch.inward[usize::from(finger)]),
            ideal: ideal_on_soft_object(&hands, &touch),
        });
        let along = "Every finger's force and motion are along the inward normal of the surface where it touches at rest; \
                     several fingers share the force equally. The ideal is the hand on the body's own stiffness at rest, \
                     without the body's mass.";
        Ok(Some(Self {
            users: users.collect(),
            quantity: AdmittanceQuantity::Position,
            reduction: Reduction::None,
            notes: std::iter::once(along.to_owned()).chain(note).collect(),
        }))
    }
}

/// Hand, object and wall as one.
fn ideal_on_line(line: &SceneValues) -> Ideal {
    let (fingers, hand) = (fingers(line), line.hand_impedance());
    let object_n_per_m = line.object.to_ground().stiffness_n_per_m.x;
    Ideal {
        mass_kg: fingers * hand.mass_kg + line.object.mass_kg,
        damping_n_s_per_m: fingers * hand.arm.damping_n_s_per_m + line.wall.damping_n_s_per_m,
        stiffness_n_per_m: line.wall.stiffness_n_per_m
            + fingers * hand.to_ground().stiffness_n_per_m
            + object_n_per_m,
    }
}

/// Fingers with the hand's springs to the ground, glued to the body at rest: with its joint compliance W and the hand's k, the mean
/// displacement along the normals is `aᵀ·(W⁻¹ + k·I)⁻¹·a` for a force of 1 N that all fingers share equally.
fn ideal_on_soft_object(hands: &SceneValues, touch: &UserTouch) -> Ideal {
    let (fingers, hand) = (touch.inward.len() as f64, hands.hand_impedance());
    let compliance = &touch.compliance;
    let numbers = compliance.nrows();
    let along = touch.inward.iter().flat_map(|normal| (*normal / fingers).to_array());
    let along = DVector::from_iterator(numbers, along);
    let yielding = DMatrix::identity(numbers, numbers) + compliance * hand.to_ground().stiffness_n_per_m;
    let moved = yielding.lu().solve(&(compliance * &along)).map_or(0.0, |moved| along.dot(&moved));
    Ideal {
        mass_kg: fingers * hand.mass_kg,
        damping_n_s_per_m: fingers * hand.arm.damping_n_s_per_m,
        stiffness_n_per_m: moved.recip(),
    }
}
