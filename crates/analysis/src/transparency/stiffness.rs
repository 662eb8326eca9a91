//! Stiffness at rest.

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use serde::Serialize;

use super::alone::Held;
use super::error::TransparencyError;
use super::one_line::{OneLine, Reduction, ideal_stiffness};
use super::statics;

/// What users feel at rest; serialises to the document of `cotouch analyze stiffness`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalentStiffness {
    /// In the order of the scene.
    pub users: Vec<UserStiffness>,
    /// What the ideal system has (6.4): the wall's stiffness, and the hand's own.
    pub ideal_n_per_m: f64,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub notes: Vec<String>,
}

/// What one user feels at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UserStiffness {
    /// The user's name.
    pub name: String,
    /// Force over displacement; 0 where nothing resists.
    pub stiffness_n_per_m: f64,
}

/// Of every user, the others absent, the object against the wall if there is one.
///
/// # Errors
/// When the scene cannot be analysed, or its object is soft.
pub fn equivalent_stiffness(scene: &Scene) -> Result<EquivalentStiffness, TransparencyError> {
    if scene.soft.exists() {
        return Err(TransparencyError::Soft);
    }
    let line = OneLine::at_wall(scene);
    let spec = line.spec();
    crate::check::check(&spec)?;
    let of_user = |user: HostIndex| UserStiffness {
        name: line.scene.users[user.index()].name.clone(),
        stiffness_n_per_m: statics::stiffness(&Held::by_hand(&spec, user)),
    };
    Ok(EquivalentStiffness {
        users: line.scene.hosts().map(of_user).collect(),
        ideal_n_per_m: ideal_stiffness(&line.scene),
        reduction: line.reduction,
        notes: line.notes,
    })
}
