//! Hands, the devices that they hold, and the limits on what devices render.

use serde::{Deserialize, Serialize};

use super::coupling::SpringDamper;
use crate::value::choice;

/// `[hand]`: mass of hand and device together, and the arm's damping and stiffness to where the hand rests; the same for
/// every finger.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hand {
    /// m_h: mass of hand and device together.
    pub mass_kg: f64,
    /// b_h: damping of the arm.
    pub damping_n_s_per_m: f64,
    /// k_h, towards the rest position: where the finger is at the start.
    pub stiffness_n_per_m: f64,
    /// A finger is a sphere of this radius, where bodies have shapes.
    pub finger_radius_m: f64,
}

/// What a finger is to the ground, whatever it touches: the one place where keys of `[hand]` and `[governor]` become mass, springs
/// and dampers. Hosts, simulated hands and the analysis all take them from here
/// ([`SceneValues::hand_impedance`](super::SceneValues::hand_impedance)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HandImpedance {
    /// m_h, of hand and moving part of the device together, kg; links of a mechanism come on top
    /// ([`finger_inertia`](crate::mechanism::finger_inertia)).
    pub mass_kg: f64,
    /// What the arm does by itself, in continuous time, towards where the finger rests; tracking comes on top
    /// ([`User::tracking_of`](super::User::tracking_of)).
    pub arm: SpringDamper,
    /// What every device renders besides the session's forces, from the reading of each tick: towards where the finger starts.
    pub rendered: SpringDamper,
}

impl HandImpedance {
    pub(super) fn new(hand: &Hand, governor: &GovernorLimits) -> Self {
        Self {
            mass_kg: hand.mass_kg,
            arm: SpringDamper {
                stiffness_n_per_m: hand.stiffness_n_per_m,
                damping_n_s_per_m: hand.damping_n_s_per_m,
            },
            rendered: SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: governor.damping_n_s_per_m },
        }
    }

    /// All that holds the finger, whoever makes it.
    #[must_use]
    pub fn to_ground(&self) -> SpringDamper {
        self.arm + self.rendered
    }
}

/// `[device]`: what every finger of every user is on. Its inertia at the finger is part of `hand.mass_kg` unless
/// [`DeviceSpec::inertia`] adds the links' own.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DeviceSpec {
    /// Which mechanism it is.
    pub kind: DeviceKind,
    /// Counts of an encoder a turn of its joint; 0 is a perfect sensor. Without effect for `point`.
    pub encoder_counts_per_turn: u32,
    /// How velocity is told.
    pub velocity: VelocityEstimate,
    /// Corner of the low pass of [`VelocityEstimate::Filtered`].
    pub velocity_cutoff_hz: f64,
    /// Largest torque of a joint; 0 is no limit. Without effect for `point`.
    pub max_joint_torque_n_m: f64,
    /// Whether the inertia of the links is added to the hand's mass. Without effect for `point`.
    pub inertia: bool,
}

/// The mechanism of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceKind {
    /// A point mass without a mechanism.
    Point,
    /// The planar five-bar pantograph of Fotoohi Ghiam 2006, in the x-y plane.
    Pantograph,
    /// A three-joint arm like the PHANToM 1.0's.
    Phantom,
}

choice!(DeviceKind { "point" => Point, "pantograph" => Pantograph, "phantom" => Phantom });

/// How a device tells velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityEstimate {
    /// The true velocity, as a simulation knows it.
    Exact,
    /// (x_k − x_{k−1})/T_c: the last two positions.
    Difference,
    /// The same through a first-order low pass: `v_k = v_{k−1} + (1 − e^{−ω·T_c})·((x_k − x_{k−1})/T_c − v_{k−1})`.
    Filtered,
}

choice!(VelocityEstimate { "exact" => Exact, "difference" => Difference, "filtered" => Filtered });

/// `[governor]`: limits on every force that reaches a device.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct GovernorLimits {
    /// Largest force that reaches a device.
    pub max_force_n: f64,
    /// Largest change of force; the default `max_force_n · control_hz` admits 0 → F_max in one tick.
    pub max_slew_n_per_s: f64,
    /// After so long without a tick, or without a reading of the device, forces fade out and come back softly.
    pub watchdog_s: f64,
    /// Time in which forces fade in at the start.
    pub soft_start_s: f64,
    /// Time in which forces fade out on a stop, a lost link or a fault.
    pub release_s: f64,
    /// Damping that the governor adds at the device.
    pub damping_n_s_per_m: f64,
    /// Whether the governor brakes a finger that the session gave more energy than it took (time-domain passivity control,
    /// Hannaford & Ryu 2002).
    pub passivity_control: bool,
}
