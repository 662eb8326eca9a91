//! Contact, and the virtual couplers.

use std::ops::Add;

use serde::{Deserialize, Serialize};

/// `[contact]`: how fingers touch bodies. Stiffness and damping are in `[coupling]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Contact {
    /// μ_s: up to this times the normal force a finger sticks.
    pub static_friction: f64,
    /// μ_k, at most μ_s.
    pub dynamic_friction: f64,
    /// v_tr: a contact that slides more slowly than this sticks.
    pub stick_speed_m_per_s: f64,
    /// Whether the device is pushed to a stop on first contact, Fotoohi Ghiam 2006, (7.1)–(7.2).
    pub moment_cancellation: bool,
    /// Between bodies, across the surface.
    pub body_body: SpringDamper,
    /// Between bodies, along the surface.
    pub body_body_tangential: SpringDamper,
}

/// `[coupling]`: the virtual couplers.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Coupling {
    /// k_11 = k_22, b_11 = b_22; centralized: k_1, b_1.
    pub hand_object: SpringDamper,
    /// k_12 = k_21, b_12 = b_21; centralized: k_2, b_2.
    pub remote_hand_object: SpringDamper,
    /// k_o, b_o: between copies of the object (distributed).
    pub object_object: SpringDamper,
    /// k_T11 = k_T22, b_T11 = b_T22; centralized k_T1: along the surface, where bodies have shapes; then
    /// `hand_object` is across it.
    pub hand_object_tangential: SpringDamper,
    /// k_T12 = k_T21, b_T12 = b_T21; centralized k_T2.
    pub remote_hand_object_tangential: SpringDamper,
    /// k_oR, b_oR: between copies of the object, for turning (distributed).
    pub object_object_rotational: RotationalSpringDamper,
}

/// A virtual coupler's spring and damper for turning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RotationalSpringDamper {
    /// Stiffness, N·m/rad.
    pub stiffness_n_m_per_rad: f64,
    /// Damping, N·m·s/rad.
    pub damping_n_m_s_per_rad: f64,
}

/// A virtual coupler's spring and damper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpringDamper {
    /// Stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Damping, N·s/m.
    pub damping_n_s_per_m: f64,
}

impl Add for SpringDamper {
    type Output = Self;

    /// Both at once, between the same two ends.
    fn add(self, other: Self) -> Self {
        Self {
            stiffness_n_per_m: self.stiffness_n_per_m + other.stiffness_n_per_m,
            damping_n_s_per_m: self.damping_n_s_per_m + other.damping_n_s_per_m,
        }
    }
}
