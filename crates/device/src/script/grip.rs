//! Closing on a body, holding it, letting it go: what fingers do about what they feel and see.

use cotouch_scene::geometry::Pose;
use cotouch_scene::scene::{Action, Shape, ShapeKind, Space};
use glam::{BVec3, DVec3};

use super::{FingerPath, SHORTEST_STOP_S, Script, ScriptState, TRANSITION_S, Touch};
use crate::target::{Target, Transition};

/// How fingers go at a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    /// Straight at the face of a box of these half edges, m.
    Face(DVec3),
    /// Towards the centre.
    Centre,
}

impl Side {
    pub(super) fn of_shape(shape: &Shape) -> Self {
        match shape.kind {
            ShapeKind::Box => Self::Face(shape.size_m * 0.5),
            _ => Self::Centre,
        }
    }

    /// The direction from `point` (m) to the side, a unit vector, or zero at the centre; both in the body's frame.
    fn direction(self, point: DVec3) -> DVec3 {
        match self {
            Self::Centre => -point.normalize_or_zero(),
            Self::Face(half) => {
                let relative = point / half;
                let (mut axis, mut sign) = (0, relative.x);
                for other in 1..3 {
                    if relative[other].abs() > sign.abs() {
                        (axis, sign) = (other, relative[other]);
                    }
                }
                if sign == 0.0 { DVec3::ZERO } else { -DVec3::AXES[axis] * sign.signum() }
            }
        }
    }
}

/// Which axes are free.
pub(crate) fn free_axes(space: Space) -> BVec3 {
    match space {
        Space::Line => BVec3::new(true, false, false),
        Space::Plane => BVec3::new(true, true, false),
        Space::Space => BVec3::TRUE,
    }
}

impl Script {
    /// Notes what is felt. Whether that ends the present action: a grasp when all fingers press, a hand-over when
    /// the load is gone.
    pub(super) fn is_ended_by_event(&self, state: &mut ScriptState, tick: u64, touches: &[Touch]) -> bool {
        if let Some(down) = self.down {
            let load: f64 = touches.iter().map(|touch| touch.felt.dot(down)).sum();
            state.load_n += self.load_share * (load - state.load_n);
        }
        if tick >= state.until_tick {
            return false;
        }
        match self.action(state.action) {
            Some(&Action::Grasp { force_n, .. }) => {
                self.stop_pressing_fingers(state, tick, touches, force_n);
                state.fingers.iter().all(|finger| !finger.closing)
            }
            Some(Action::HandOver { .. }) => {
                let begin = state.load_at_begin_n;
                begin > 0.0 && state.load_n <= 0.5 * begin
            }
            _ => false,
        }
    }

    /// A finger that feels `force_n` against its approach keeps its target where it goes on pressing so:
    /// k_track·(target − x) − k_h·(x − rest) = force_n along the approach.
    fn stop_pressing_fingers(&self, state: &mut ScriptState, tick: u64, touches: &[Touch], force_n: f64) {
        let elapsed_s = self.elapsed_s(state, tick);
        for (finger, touch) in touches.iter().enumerate().take(state.fingers.len()) {
            let FingerPath { closing, approach, .. } = state.fingers[finger];
            let presses = approach != DVec3::ZERO && -touch.felt.dot(approach) >= force_n;
            if !(closing && presses) {
                continue;
            }
            let target = self.target(state, finger, elapsed_s);
            let arm_n = self.arm_stiffness_n_per_m * (touch.position - touch.rest).dot(approach);
            let ahead_m = (force_n + arm_n) / self.tracking.stiffness_n_per_m;
            let there_m = (touch.position - target.position).dot(approach);
            let way = if ahead_m.is_finite() { ahead_m + there_m } else { 0.0 };
            // Longer than twice way over speed, and it would overshoot.
            let unhurried_s = 2.0 * way / target.velocity.dot(approach);
            let path = &mut state.fingers[finger];
            path.anchor = target.position + approach * way;
            path.closing = false;
            path.transition = Transition {
                from: target.minus(Target::at(path.anchor)),
                duration_s: if unhurried_s < TRANSITION_S {
                    unhurried_s.max(SHORTEST_STOP_S)
                } else {
                    TRANSITION_S
                },
            };
            path.transition_began_s = elapsed_s;
        }
    }

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
