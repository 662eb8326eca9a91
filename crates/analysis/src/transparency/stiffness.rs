//! Stiffness at rest.

use cotouch_scene::Scene;
use serde::Serialize;

use super::error::TransparencyError;
use super::one_line::Reduction;
use super::statics;
use super::user_loops::{UserLoop, UserLoops};
use crate::poles::analyze_loop;

/// What users feel at rest; serialises to the document of `cotouch analyze stiffness`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalentStiffness {
    /// In the order of the scene.
    pub users: Vec<UserStiffness>,
    /// Of the first user; around a rigid object, of all.
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
    /// Whether the loop of this user alone is stable. Where it is not, it never comes to this rest.
    pub stable: bool,
    /// Force over displacement; 0 where nothing resists.
    pub stiffness_n_per_m: f64,
    /// What the ideal system has (6.4): the wall's stiffness, or the soft object's where this user touches it, and the
    /// hand's own.
    pub ideal_n_per_m: f64,
}

/// Of every user, the others absent, the object against the wall if there is one.
///
/// # Errors
/// When the scene cannot be analysed, or a user's loop is too large.
pub fn equivalent_stiffness(scene: &Scene) -> Result<EquivalentStiffness, TransparencyError> {
    let UserLoops { users, reduction, notes, .. } = UserLoops::new(scene)?;
    let of_user = |user: UserLoop| -> Result<UserStiffness, TransparencyError> {
        Ok(UserStiffness {
            stable: analyze_loop(&user.held.spec)?.stable,
            name: user.name,
            stiffness_n_per_m: statics::stiffness(&user.held),
            ideal_n_per_m: user.ideal.stiffness_n_per_m,
        })
    };
    let users = users.into_iter().map(of_user).collect::<Result<Vec<_>, _>>()?;
    let ideal_n_per_m = users.first().map_or(0.0, |user| user.ideal_n_per_m);
    Ok(EquivalentStiffness { users, ideal_n_per_m, reduction, notes })
}
