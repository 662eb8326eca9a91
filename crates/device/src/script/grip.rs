//! Closing on a body, holding it, letting it go.

use cotouch_scene::geometry::Pose;
use glam::DVec3;

use super::model::{FingerPath, Script, ScriptState, Touch};
use super::side::free_axes;

impl Script {
    /// Sends a finger straight at the side of `body` that it is at.
    pub(super) fn close(&self, body: Option<usize>, path: &mut FingerPath, touch: &Touch, bodies: &[Pose]) {
        path.closing = true;
        (path.approach, path.grip) = (DVec3::ZERO, DVec3::ZERO);
        let found = body.and_then(|index| Some((self.sides.get(index)?, bodies.get(index)?)));
        let Some((side, pose)) = found else { return };
        let free = free_axes(self.space);
        // Bodies turn only about axes across what is free, so that the same axes are free in a body's frame.
        let at = DVec3::select(free, pose.to_local(touch.position), DVec3::ZERO);
        let approach = DVec3::select(free, pose.orientation * side.direction(at), DVec3::ZERO);
        path.approach = approach.normalize_or_zero();
        path.grip = pose.orientation.conjugate() * path.approach;
    }

    /// By how much a finger's target is to move so that the finger gets `distance_m` back from where it is, m.
    pub(super) fn opening(
        &self,
        state: &ScriptState,
        path: &FingerPath,
        touch: &Touch,
        bodies: &[Pose],
        distance_m: f64,
    ) -> DVec3 {
        let pose = state.body.and_then(|index| bodies.get(index));
        let approach = pose.map_or(path.approach, |pose| pose.orientation * path.grip);
        approach * ((touch.position - path.anchor).dot(approach) - distance_m)
    }

    /// The centre of what is held, m: that of the body that was grasped last, or else of the fingers.
    pub(super) fn centre(&self, state: &ScriptState, touches: &[Touch], bodies: &[Pose]) -> DVec3 {
        state.body.and_then(|index| bodies.get(index)).map_or_else(
            || touches.iter().map(|touch| touch.position).sum::<DVec3>() / touches.len().max(1) as f64,
            |pose| pose.position,
        )
    }
}
