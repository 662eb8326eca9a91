//! How a loop brakes, with and without Fotoohi Ghiam's compensation.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
use glam::DVec3;

use super::alone::Held;
use super::drift::{Drift, drift};
use super::error::TransparencyError;
use crate::loop_spec::LoopSpec;
use crate::poles::analyze_loop;

/// A scene on a line, in free motion, with and without compensation.
pub(super) struct Compensated {
    pub(super) before: Viscous,
    /// N·s/m, of every copy.
    pub(super) compensation: Option<f64>,
    pub(super) after: Option<Viscous>,
}

/// How a scene on a line brakes.
#[derive(Clone, Copy)]
pub(super) struct Viscous {
    pub(super) damping: Option<f64>,
    pub(super) mean_damping: Option<f64>,
    /// Of the loop of these two; true where no hand was asked for.
    pub(super) by_hand_is_stable: bool,
    pub(super) simplified: Option<f64>,
    pub(super) simplified_is_stable: bool,
    pub(super) drag_pole: Option<f64>,
    /// Of the session with all hands.
    pub(super) stable: bool,
    pub(super) why_none: Option<&'static str>,
}

impl Compensated {
    /// With hands.
    pub(super) fn of_session(line: &SceneValues, user: HostIndex) -> Result<Self, TransparencyError> {
        Self::new(line, &|line| Viscous::new(&spec(line), Some(user), user))
    }

    /// Copies that nobody holds.
    pub(super) fn of_copies(line: &SceneValues, user: HostIndex) -> Result<Self, TransparencyError> {
        Self::new(line, &|line| Viscous::new(&Held::directly(&spec(line), user).spec, None, user))
    }

    fn new(
        line: &SceneValues,
        viscous: &dyn Fn(&SceneValues) -> Result<Viscous, TransparencyError>,
    ) -> Result<Self, TransparencyError> {
        let before = viscous(line)?;
        let Some(simplified) = before.simplified else {
            return Ok(Self { before, compensation: None, after: None });
        };
        let mut compensated = line.clone();
        compensated.object.damping_n_s_per_m -= simplified;
        let compensation = Some(compensated.object.damping_n_s_per_m);
        Ok(Self { before, compensation, after: Some(viscous(&compensated)?) })
    }
}

impl Viscous {
    fn new(spec: &LoopSpec, hand: Option<HostIndex>, user: HostIndex) -> Result<Self, TransparencyError> {
        let session = analyze_loop(spec)?;
        let held = hand.map(|user| Held::by_hand(spec, user, &|_| DVec3::X));
        let by_hand = held.as_ref().map(drift).transpose()?;
        let by_hand_is_stable = held.map_or(Ok(true), |held| settles(&held.spec))?;
        let copies = Held::directly(spec, user);
        let simplified = drift(&copies)?;
        Ok(Self {
            damping: by_hand.and_then(|drift| drift.damping(|at_instants, _| at_instants)),
            mean_damping: by_hand.and_then(|drift| drift.damping(|_, mean| mean)),
            by_hand_is_stable,
            simplified: simplified.damping(|at_instants, _| at_instants),
            simplified_is_stable: settles(&copies.spec)?,
            drag_pole: session.drag_pole,
            stable: session.stable,
            why_none: by_hand.and_then(Drift::why_no_damping),
        })
    }
}

/// Whether every motion dies out, but for what drifts by structure.
fn settles(spec: &LoopSpec) -> Result<bool, TransparencyError> {
    Ok(analyze_loop(spec)?.stable)
}

fn spec(line: &SceneValues) -> LoopSpec {
    crate::compile::compile(line).swap_remove(0).spec
}

#[cfg(test)]
mod tests;
