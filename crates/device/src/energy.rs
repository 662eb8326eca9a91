//! What passes through a haptic port: the energy that a user puts into the session, and the largest force felt.

use cotouch_scene::geometry::{Pose, Reading, Wrench};
use serde::{Deserialize, Serialize};

/// Observes one haptic port: `E = −∫ (f·v + τ·ω) dt`, where f, τ act on the hand.
///
/// A wrench is held from tick to tick, so the work between two readings is exactly `−f·Δx` (and, about a fixed axis,
/// `−τ·Δθ`), whatever the motion between and however many ticks were skipped. `E` is positive when the user has put
/// energy into the session; a session that is passive at this port never lets it fall far below zero.
/// A plain value; no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PortEnergy {
    energy_j: f64,
    peak_force_n: f64,
    last: Option<(Pose, Wrench)>,
}

impl PortEnergy {
    /// One tick: the reading at its instant, and the wrench that is held from that instant on. A tick whose reading
    /// or wrench is not finite is left out.
    pub fn observe(&mut self, reading: &Reading, commanded: Wrench) {
        if !reading.is_finite() || !commanded.is_finite() {
            return;
        }
        if let Some((pose, held)) = self.last {
            self.energy_j -= held.force.dot(reading.pose.position - pose.position);
            if held.torque != glam::DVec3::ZERO {
                let turn = reading.pose.orientation * pose.orientation.inverse();
                let shortest = if turn.w < 0.0 { -turn } else { turn };
                self.energy_j -= held.torque.dot(shortest.to_scaled_axis());
            }
        }
        self.peak_force_n = self.peak_force_n.max(commanded.force.length());
        self.last = Some((reading.pose, commanded));
    }

    /// Energy from the user into the session so far, J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// The largest force so far, N.
    #[must_use]
    pub fn peak_force_n(&self) -> f64 {
        self.peak_force_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    #[test]
    fn the_work_of_a_held_force_is_force_times_way() {
        let mut port = PortEnergy::default();
        for (x, force) in [(0.0, -2.0), (0.5, -3.0), (0.25, 4.0), (0.5, 0.0), (9.0, 1.0)] {
            port.observe(&Reading::point(DVec3::X * x, DVec3::ZERO), Wrench::force(DVec3::X * force));
        }
        // Against −2 N over 0.5 m, with −3 N over −0.25 m, with 4 N over 0.25 m, freely.
        assert_eq!(port.energy_j(), 1.0 - 0.75 - 1.0);
        assert_eq!(port.peak_force_n(), 4.0);
    }

    #[test]
    fn torque_works_along_the_turn() {
        let mut port = PortEnergy::default();
        let wrench = Wrench { force: DVec3::ZERO, torque: DVec3::Z * -0.5 };
        for angle in [3.0, 3.2_f64] {
            let mut reading = Reading::default();
            reading.pose.orientation = DQuat::from_rotation_z(angle);
            port.observe(&reading, wrench);
        }
        assert!((port.energy_j() - 0.1).abs() < 1e-15, "{}", port.energy_j());
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let mut port = PortEnergy::default();
        let force = Wrench::force(DVec3::X);
        port.observe(&Reading::default(), force);
        port.observe(&Reading::point(DVec3::NAN, DVec3::ZERO), force);
        port.observe(&Reading::point(DVec3::X, DVec3::ZERO), Wrench::force(DVec3::INFINITY));
        port.observe(&Reading::point(DVec3::X * 2.0, DVec3::ZERO), force);
        assert_eq!((port.energy_j(), port.peak_force_n()), (-2.0, 1.0));
    }
}
