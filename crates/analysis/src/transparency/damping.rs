//! The damping that held data add.

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, SceneValues};
use serde::Serialize;

use super::drift::drift;
use super::error::TransparencyError;
use super::one_line::{OneLine, Reduction, fingers};
use super::turning::{self, TurningDamping};
use super::user_loops::{UserLoop, UserLoops};
use super::viscous::Compensated;
use crate::poles::analyze_loop;

/// What held data add to the damping that a user feels; serialises to the document of `cotouch analyze damping`.
///
/// Dampers to the ground that the scene has (`hand`, `object`, `governor`) are in it. In free motion, whatever walls the
/// scene has. A damping is `None` where a spring ties the hand to the ground, so that no force keeps it moving, and where
/// the loop outgrows floating point. It is a limit of (6.1), which an unstable loop has too without ever coming there: each
/// damping is followed by whether its loop is stable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AddedDamping {
    /// Who moves the object.
    pub user: String,
    /// (6.2) of the whole model: that user moving, the others absent, V at the network instants.
    pub damping_n_s_per_m: Option<f64>,
    /// Whether the loop of this user alone is stable. Where it is not, it never comes to that damping.
    pub stable: bool,
    /// (6.2) of the model of Fig 6.3: no hands, the force acts on every copy.
    pub simplified_damping_n_s_per_m: Option<f64>,
    /// Whether the loop of that model is stable. `None` where there is no such model.
    pub simplified_stable: Option<bool>,
    /// As the first, with the mean velocity instead of that at the network instants: what a slow hand feels.
    pub mean_damping_n_s_per_m: Option<f64>,
    /// What the scene's own dampers to the ground (`hand`, `governor`, `object` on every copy) come to, when all moves as
    /// one: part of the above.
    pub dampers_of_scene_n_s_per_m: f64,
    /// Of the session with all hands on the object: the real pole nearest 1 that is not 1 by structure.
    pub drag_pole: Option<f64>,
    /// Whether that session is stable in free motion. `None` on a soft object.
    pub session_stable: Option<bool>,
    /// `object.damping_n_s_per_m` that cancels the simplified damping, as Fotoohi Ghiam 2006 proposes: it is on every
    /// copy.
    pub compensation_n_s_per_m: Option<f64>,
    /// The first damping, with that compensation.
    pub damping_if_compensated_n_s_per_m: Option<f64>,
    /// The drag pole with that compensation.
    pub drag_pole_if_compensated: Option<f64>,
    /// Whether the session is stable with that compensation.
    pub stable_if_compensated: Option<bool>,
    /// Of turning, about each axis about which the first body turns.
    pub turning: Vec<TurningDamping>,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, and why there is no number, in plain sentences.
    pub notes: Vec<String>,
}

/// What held data add to the damping that `user` feels, and what Fotoohi Ghiam's compensation does about it.
///
/// # Errors
/// When there is no such user, or the scene cannot be analysed.
pub fn added_damping(scene: &Scene, user: HostIndex) -> Result<AddedDamping, TransparencyError> {
    let users = scene.session.users;
    if user.index() >= usize::from(users) {
        return Err(TransparencyError::User { found: u32::from(user.0) + 1, users });
    }
    if let Some(loops) = UserLoops::on_soft_object(scene)? {
        return on_soft_object(scene, loops, user);
    }
    let OneLine { scene: line, reduction, mut notes } = OneLine::free(scene);
    let Compensated { before, compensation, after } = Compensated::of_session(&line, user)?;
    notes.extend(before.why_none.map(str::to_owned));
    Ok(AddedDamping {
        user: scene.users[user.index()].name.clone(),
        damping_n_s_per_m: before.damping,
        stable: before.by_hand_is_stable,
        simplified_damping_n_s_per_m: before.simplified,
        simplified_stable: Some(before.simplified_is_stable),
        mean_damping_n_s_per_m: before.mean_damping,
        dampers_of_scene_n_s_per_m: dampers(&line),
        drag_pole: before.drag_pole,
        session_stable: Some(before.stable),
        compensation_n_s_per_m: compensation,
        damping_if_compensated_n_s_per_m: after.and_then(|after| after.damping),
        drag_pole_if_compensated: after.and_then(|after| after.drag_pole),
        stable_if_compensated: after.map(|after| after.stable),
        turning: turning::about_axes(scene, user)?,
        reduction,
        notes,
    })
}

/// Of a user who touches a soft object: nobody else does, and no compensation is for it.
fn on_soft_object(
    scene: &SceneValues,
    UserLoops { mut users, reduction, mut notes, .. }: UserLoops,
    user: HostIndex,
) -> Result<AddedDamping, TransparencyError> {
    let UserLoop { name, held, .. } = users.swap_remove(user.index());
    let stable = analyze_loop(&held.spec)?.stable;
    let drift = drift(&held)?;
    notes.push("The soft object is held to the ground; so is what touches it.".to_owned());
    notes.extend(drift.why_no_damping().map(str::to_owned));
    Ok(AddedDamping {
        user: name,
        damping_n_s_per_m: drift.damping(|at_instants, _| at_instants),
        stable,
        simplified_damping_n_s_per_m: None,
        simplified_stable: None,
        mean_damping_n_s_per_m: drift.damping(|_, mean| mean),
        dampers_of_scene_n_s_per_m: dampers_of_hand(scene),
        drag_pole: None,
        session_stable: None,
        compensation_n_s_per_m: None,
        damping_if_compensated_n_s_per_m: None,
        drag_pole_if_compensated: None,
        stable_if_compensated: None,
        turning: Vec::new(),
        reduction,
        notes,
    })
}

/// To the ground, of all fingers of one user.
fn dampers_of_hand(scene: &SceneValues) -> f64 {
    fingers(scene) * scene.hand_impedance().to_ground().damping_n_s_per_m
}

/// To the ground, of one user's hand and all copies.
fn dampers(line: &SceneValues) -> f64 {
    let copies = match line.session.architecture {
        Architecture::Centralized => 1.0,
        Architecture::Distributed => f64::from(line.session.users),
    };
    dampers_of_hand(line) + copies * line.object.to_ground().damping_n_s_per_m.x
}
