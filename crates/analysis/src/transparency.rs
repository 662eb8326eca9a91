//! What users perceive of the object: admittance, added damping, equivalent stiffness (thesis ch. 6).

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use serde::Serialize;

use crate::stability::AnalysisError;

/// Serialises to the document of `cotouch analyze admittance`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Admittance {
    /// Where it was evaluated.
    pub frequency_rad_s: Vec<f64>,
}

/// Serialises to the document of `cotouch analyze damping`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AddedDamping {
    /// (6.2) of the whole model: that user moving, the others absent, V at the network instants.
    pub damping_n_s_per_m: f64,
    /// (6.2) of the model of Fig 6.3.
    pub simplified_damping_n_s_per_m: f64,
}

/// Serialises to the document of `cotouch analyze stiffness`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalentStiffness {
    /// In the order of the scene.
    pub users: Vec<UserStiffness>,
}

/// What one user feels at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UserStiffness {
    /// The user's name.
    pub name: String,
    /// Force over displacement.
    pub stiffness_n_per_m: f64,
}

/// At each of `frequencies_rad_s`.
///
/// # Errors
/// When the scene cannot be analysed.
pub fn admittance(_scene: &Scene, _frequencies_rad_s: &[f64]) -> Result<Admittance, AnalysisError> {
    todo!("helper 2")
}

/// What held data add to the damping that a user feels.
///
/// # Errors
/// When the scene cannot be analysed.
pub fn added_damping(_scene: &Scene, _user: HostIndex) -> Result<AddedDamping, AnalysisError> {
    todo!("helper 2")
}

/// Of every user, the others absent.
///
/// # Errors
/// When the scene cannot be analysed.
pub fn equivalent_stiffness(_scene: &Scene) -> Result<EquivalentStiffness, AnalysisError> {
    todo!("helper 2")
}
