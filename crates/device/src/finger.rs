//! One finger of a simulated user, with the device that it is on: the plant, the sensor, the motors.
//!
//! The finger is `m_h·x″ = u − (k_h + k_track)·(x − rest) − (b_h + b_track)·v` on every free axis, with u held from tick to
//! tick: exact in between ([`SecondOrderPlant`]), or, where the links of a mechanism add their inertia, integrated by Runge–Kutta
//! steps of fourth order.
//! What a mechanism does besides:
//!
//! - **Sensor.** The reading's position is the forward kinematics of the joint angles, each rounded to the nearest
//!   count of its encoder. The rounding may carry a reading on the workspace's edge beyond it: it is put back.
//! - **Motors.** A force needs the torques Jᵀ·f; if one is above the largest, all are scaled down alike, so that the hand
//!   gets a smaller force in the same direction. (A Jacobian at the quantised angles would differ by less than a
//!   count's worth; that is left out.)
//! - **Stops.** The interface point cannot leave the mechanism's workspace, a box that lies wholly where the mechanism is
//!   far from singular: it stops there without a rebound. Inside, kinematics always have an answer.

use cotouch_scene::geometry::Reading;
use cotouch_scene::mechanism::Placed;
use cotouch_scene::scene::{DeviceSpec, HandImpedance, Space, SpringDamper, VelocityEstimate};
use glam::{BVec3, DVec3};
use serde::{Deserialize, Serialize};

use crate::linked::Linked;
use crate::plant::SecondOrderPlant;
use crate::script::{Drive, Touch, free_axes};

/// A finger that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FingerError {
    /// Mass, damping or stiffness.
    #[error(
        "a simulated hand needs a mass above 0 kg and finite damping and stiffness; found {mass_kg} kg, {damping_n_s_per_m} N·s/m and {stiffness_n_per_m} N/m (tracking included)"
    )]
    Impedance {
        /// The hand's mass m_h, kg.
        mass_kg: f64,
        /// The hand's damping b_h and that of tracking together, N·s/m.
        damping_n_s_per_m: f64,
        /// The hand's stiffness k_h and that of tracking together, N/m.
        stiffness_n_per_m: f64,
    },
}

/// A finger's state at the instant of a tick, before anything is written there. Places are in the scene's world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FingerState {
    /// Where the finger is, m.
    pub position: DVec3,
    /// How fast the finger moves, m/s.
    pub velocity: DVec3,
    /// The device's force on the hand that is held if nothing new is written, N.
    pub held_force: DVec3,
    /// What the device remembers to tell velocity.
    pub sensor: SensorState,
}

/// What a device remembers to tell the velocity of a finger; at rest where the velocity is told exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorState {
    /// The position that it read at the tick before, m.
    pub position: DVec3,
    /// The velocity that it told then, m/s; only [`VelocityEstimate::Filtered`] remembers it.
    pub velocity: DVec3,
}

/// How a finger moves from tick to tick.
#[derive(Clone, Debug, PartialEq)]
enum Motion {
    Point(SecondOrderPlant),
    Linked(Linked),
}

/// What does not change about a finger and the mechanism that it is on.
#[derive(Clone, Debug, PartialEq)]
pub struct FingerModel {
    rest: DVec3,
    rendered: SpringDamper,
    tracking: SpringDamper,
    free: BVec3,
    motion: Motion,
    device: Option<Placed>,
    counts_per_rad: Option<f64>,
    max_joint_torque_n_m: f64,
    estimate: VelocityEstimate,
    period_s: f64,
    /// The share of a new difference that the velocity filter takes in a tick, 1 − e^{−ω·T}.
    filter_share: f64,
}

impl FingerModel {
    /// A finger of a hand with impedance `hand` on `device` that rests at `rest` (m) and follows a script with impedance `tracking`.
    ///
    /// # Errors
    /// When the impedance is not one.
    pub fn new(
        hand: HandImpedance,
        device: &DeviceSpec,
        space: Space,
        rest: DVec3,
        tracking: SpringDamper,
        period_s: f64,
    ) -> Result<Self, FingerError> {
        let (mass_kg, impedance) = (hand.mass_kg, hand.arm + tracking);
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = impedance;
        let is_sound = mass_kg > 0.0
            && mass_kg.is_finite()
            && damping_n_s_per_m.is_finite()
            && stiffness_n_per_m.is_finite();
        if !is_sound {
            return Err(FingerError::Impedance { mass_kg, damping_n_s_per_m, stiffness_n_per_m });
        }
        let (free, placed) = (free_axes(space), Placed::of_finger(device, rest));
        let motion = match placed.filter(|_| device.inertia) {
            Some(placed) => Motion::Linked(Linked::new(placed, mass_kg, impedance, free, period_s)),
            None => {
                Motion::Point(SecondOrderPlant::new(mass_kg, damping_n_s_per_m, stiffness_n_per_m, period_s))
            }
        };
        let counts = device.encoder_counts_per_turn;
        let limit = device.max_joint_torque_n_m;
        Ok(Self {
            rest,
            rendered: hand.rendered,
            tracking,
            free,
            motion,
            device: placed,
            counts_per_rad: (counts > 0).then_some(f64::from(counts) / std::f64::consts::TAU),
            max_joint_torque_n_m: if limit > 0.0 { limit } else { f64::INFINITY },
            estimate: device.velocity,
            period_s,
            filter_share: -(-std::f64::consts::TAU * device.velocity_cutoff_hz * period_s).exp_m1(),
        })
    }

    /// Where the finger rests and starts, m.
    #[must_use]
    pub fn rest(&self) -> DVec3 {
        self.rest
    }

    /// The mechanism that it is on.
    #[must_use]
    pub fn device(&self) -> Option<&Placed> {
        self.device.as_ref()
    }

    /// The force that the device renders everywhere and in every direction, N.
    #[must_use]
    pub fn everywhere_n(&self) -> f64 {
        let lever_m = self.device.as_ref().map_or(0.0, |placed| placed.mechanism.longest_lever_m());
        if lever_m > 0.0 { self.max_joint_torque_n_m / lever_m } else { f64::INFINITY }
    }

    /// The state of a finger that is at rest, and was, at `position` (m).
    #[must_use]
    pub fn at_rest(&self, position: DVec3) -> FingerState {
        let mut state = FingerState { position, ..FingerState::default() };
        state.sensor.position = self.measured(position);
        state
    }

    /// What the finger is and feels. Its user knows the spring that the device renders to where it started, and tells what it
    /// touches from that.
    #[must_use]
    pub fn touch(&self, state: &FingerState) -> Touch {
        let mut felt = state.held_force;
        if self.rendered.stiffness_n_per_m != 0.0 {
            felt += (state.position - self.rest) * self.rendered.stiffness_n_per_m;
        }
        Touch { position: state.position, rest: self.rest, felt }
    }

    /// What the device reports of a finger in `state`.
    #[must_use]
    pub fn reading(&self, state: &FingerState) -> Reading {
        let position = self.measured(state.position);
        let difference = || (position - state.sensor.position) / self.period_s;
        let velocity = match self.estimate {
            VelocityEstimate::Exact => state.velocity,
            VelocityEstimate::Difference => difference(),
            VelocityEstimate::Filtered => {
                state.sensor.velocity + (difference() - state.sensor.velocity) * self.filter_share
            }
        };
        Reading::point(position, velocity)
    }

    /// Where the device says that a finger at `position` (m) is.
    fn measured(&self, position: DVec3) -> DVec3 {
        let (Some(Placed { mechanism, offset }), Some(counts)) = (&self.device, self.counts_per_rad) else {
            return position;
        };
        let quantised = |joints: DVec3| {
            let mut rounded = (joints * counts).round() / counts;
            if mechanism.joints() < 3 {
                rounded.z = joints.z;
            }
            mechanism.position(rounded)
        };
        let found = mechanism.joints_at(position + *offset).and_then(quantised);
        let found = found.map_or(position, |place| mechanism.workspace().nearest(place) - *offset);
        // What holds a finger on its line or in its plane also holds the reading there.
        DVec3::select(self.free, found, position)
    }

    /// The force (N) that reaches the hand at `position` (m) when `force` is asked for.
    #[must_use]
    pub fn rendered(&self, position: DVec3, force: DVec3) -> DVec3 {
        let Some(Placed { mechanism, offset }) = &self.device else { return force };
        if self.max_joint_torque_n_m == f64::INFINITY {
            return force;
        }
        let joints = mechanism.joints_at(position + *offset);
        let Some(mut torques) = joints.and_then(|joints| mechanism.torques(joints, force)) else {
            return DVec3::ZERO;
        };
        if mechanism.joints() < 3 {
            torques.z = 0.0;
        }
        let largest = torques.abs().max_element();
        if largest > self.max_joint_torque_n_m {
            force * (self.max_joint_torque_n_m / largest)
        } else {
            force
        }
    }

    /// Advances `state` by one period under its held force; `reading` is the one at this state.
    pub(crate) fn step(&self, state: &mut FingerState, reading: &Reading, drive: &Drive) {
        if self.estimate != VelocityEstimate::Exact {
            state.sensor.position = reading.pose.position;
        }
        if self.estimate == VelocityEstimate::Filtered {
            state.sensor.velocity = reading.twist.linear;
        }
        let input = drive.force
            + (drive.target.position - self.rest) * self.tracking.stiffness_n_per_m
            + drive.target.velocity * self.tracking.damping_n_s_per_m
            + state.held_force;
        let input = self.freed(input);
        let from_rest = state.position - self.rest;
        let (from_rest, velocity) = match &self.motion {
            Motion::Point(plant) => plant.step(from_rest, state.velocity, input),
            Motion::Linked(linked) => linked.step(from_rest, state.velocity, input),
        };
        (state.position, state.velocity) = (self.rest + from_rest, velocity);
        self.stop(state);
    }

    /// The force (N) of muscles on a finger in `state` that is asked for by `drive`; the arm's own impedance is apart.
    pub(crate) fn pull(&self, state: &FingerState, drive: &Drive) -> DVec3 {
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = self.tracking;
        let pull = drive.force
            + (drive.target.position - state.position) * stiffness_n_per_m
            + (drive.target.velocity - state.velocity) * damping_n_s_per_m;
        self.freed(pull)
    }

    /// The impedance by which the finger is drawn to a target.
    pub(crate) fn tracking(&self) -> SpringDamper {
        self.tracking
    }

    /// Whether anything draws the finger to a target.
    pub(crate) fn tracks(&self) -> bool {
        self.tracking.stiffness_n_per_m > 0.0
    }

    /// The place nearest to `place` (m) to which the finger can be moved: on its line or plane, within the stops.
    pub(crate) fn reachable(&self, place: DVec3) -> DVec3 {
        let within = self.device.as_ref().map_or(place, |Placed { mechanism, offset }| {
            mechanism.workspace().nearest(place + *offset) - *offset
        });
        DVec3::select(self.free, within, self.rest)
    }

    /// The mechanism's stops: no motion beyond the workspace, no rebound.
    fn stop(&self, state: &mut FingerState) {
        let Some(Placed { mechanism, offset }) = &self.device else { return };
        let workspace = mechanism.workspace();
        let place = state.position + *offset;
        // A planar mechanism has no room across its plane: there rounding is no way.
        if workspace.contains(place) {
            return;
        }
        let nearest = workspace.nearest(place);
        for axis in 0..3 {
            if nearest[axis] != place[axis] && self.free.test(axis) {
                state.position[axis] = nearest[axis] - offset[axis];
                let beyond = place[axis] - nearest[axis];
                if state.velocity[axis] * beyond > 0.0 {
                    state.velocity[axis] = 0.0;
                }
            }
        }
    }

    /// The part of a vector along which the finger can move.
    pub(crate) fn freed(&self, vector: DVec3) -> DVec3 {
        DVec3::select(self.free, vector, DVec3::ZERO)
    }

    /// A state in which nothing is off the finger's line or plane.
    #[cfg(feature = "testing")]
    pub(crate) fn allowed(&self, state: FingerState) -> FingerState {
        FingerState {
            position: DVec3::select(self.free, state.position, self.rest),
            velocity: self.freed(state.velocity),
            ..state
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rendered_spring_is_no_touch() {
        let rendered = SpringDamper { stiffness_n_per_m: 90.0, damping_n_s_per_m: 0.0 };
        let hand = HandImpedance { mass_kg: 0.1, rendered, ..HandImpedance::default() };
        let (device, tracking) = (DeviceSpec::default(), SpringDamper::default());
        let finger = FingerModel::new(hand, &device, Space::Space, DVec3::Z, tracking, 1e-3).unwrap();
        let at = DVec3::Z + DVec3::X * 0.1;
        let pushed_back = FingerState { held_force: DVec3::new(-9.0, 2.0, 0.0), ..finger.at_rest(at) };
        assert!((finger.touch(&pushed_back).felt - DVec3::Y * 2.0).length() < 1e-12);
    }
}
