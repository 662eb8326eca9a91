//! What passes through a haptic port: the energy that a user puts into the session, and the largest force felt.

use cotouch_scene::geometry::{Pose, Reading, Wrench};
use serde::{Deserialize, Serialize};

/// Observes one haptic port: `E = −∫ (f·v + τ·ω) dt`, where f, τ act on the hand.
///
/// The passivity observer of Hannaford & Ryu (2002, IEEE Trans. Robotics and Automation 18(1)), exact for held wrenches:
/// a wrench is held from tick to tick, so the work between two readings is exactly `−f·Δx` (and, about a fixed axis,
/// `−τ·Δθ`), whatever the motion between and however many ticks were skipped. `E` is positive when the user has put
/// energy into the session; a session that is passive at this port never lets it fall below zero. Energy that
/// another user has put in may come out here: then this port gives, though the session as a whole does not.
/// A plain value; no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PortEnergy {
    energy_j: f64,
    least_energy_j: f64,
    max_energy_j: f64,
    largest_fall_j: f64,
    peak_force_n: f64,
    last: Option<(Pose, Wrench)>,
}

impl PortEnergy {
    /// One tick: the reading at its instant, and the wrench that is held from that instant on. A tick whose reading
    /// or wrench is not finite is left out.
    pub fn observe(&mut self, reading: &Reading, commanded: Wrench) {
        if reading.is_finite() && commanded.is_finite() {
            self.arrive(reading);
            self.hold(reading, commanded);
        }
    }

    /// The first half of a tick: the work of the wrench that was held until this reading. Twice at one reading is the
    /// same as once. A reading that is not finite is left out.
    pub fn arrive(&mut self, reading: &Reading) {
        let Some((pose, held)) = self.last.filter(|_| reading.is_finite()) else { return };
        self.energy_j -= held.force.dot(reading.pose.position - pose.position);
        if held.torque != glam::DVec3::ZERO {
            let turn = reading.pose.orientation * pose.orientation.inverse();
            let shortest = if turn.w < 0.0 { -turn } else { turn };
            self.energy_j -= held.torque.dot(shortest.to_scaled_axis());
        }
        self.least_energy_j = self.least_energy_j.min(self.energy_j);
        self.max_energy_j = self.max_energy_j.max(self.energy_j);
        self.largest_fall_j = self.largest_fall_j.max(self.max_energy_j - self.energy_j);
        self.last = Some((reading.pose, held));
    }

    /// The second half: the wrench that is held from this reading on. It is what the governor let through, even while the
    /// device's force is switched off, until whoever switched it off is heard of: a replay must find the same energy.
    pub fn hold(&mut self, reading: &Reading, commanded: Wrench) {
        if reading.is_finite() && commanded.is_finite() {
            self.peak_force_n = self.peak_force_n.max(commanded.force.length());
            self.last = Some((reading.pose, commanded));
        }
    }

    /// Energy from the user into the session so far, J.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.energy_j
    }

    /// The least that it has been, J, at most 0: at a passive port, 0.
    #[must_use]
    pub fn least_energy_j(&self) -> f64 {
        self.least_energy_j
    }

    /// The largest fall from an earlier value, J: the most that came out of the session on balance between two instants,
    /// what it had stored included.
    #[must_use]
    pub fn largest_fall_j(&self) -> f64 {
        self.largest_fall_j
    }

    /// What the session has given more than it had taken, J; 0 while it is passive. What a passivity controller brakes for.
    #[must_use]
    pub fn deficit_j(&self) -> f64 {
        (-self.energy_j).max(0.0)
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

    #[test]
    fn the_lowest_energy_and_the_largest_fall_are_kept() {
        let mut port = PortEnergy::default();
        // Puts in 1, takes 3, puts in 4, takes 2.5: 1, −2, 2, −0.5 J.
        for (x, force) in [(0.0, -1.0), (1.0, 3.0), (2.0, -4.0), (3.0, 2.5), (4.0, 0.0)] {
            port.observe(&Reading::point(DVec3::X * x, DVec3::ZERO), Wrench::force(DVec3::X * force));
        }
        assert_eq!((port.energy_j(), port.least_energy_j(), port.largest_fall_j()), (-0.5, -2.0, 3.0));
        assert_eq!(port.deficit_j(), 0.5);
    }

    #[test]
    fn a_tick_in_two_halves_is_a_tick() {
        let (mut whole, mut halves) = (PortEnergy::default(), PortEnergy::default());
        for tick in 0..20 {
            let reading = Reading::point(DVec3::X * f64::from(tick).sin(), DVec3::ZERO);
            let wrench = Wrench::force(DVec3::X * f64::from(tick).cos());
            whole.observe(&reading, wrench);
            halves.arrive(&reading);
            halves.arrive(&reading);
            halves.hold(&reading, wrench);
        }
        assert_eq!(whole, halves);
    }
}
