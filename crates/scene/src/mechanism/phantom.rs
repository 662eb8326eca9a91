//! The three-joint arm of the PHANToM, after Çavuşoğlu, Feygin & Tendick, "A Critical Study of the Mechanical and Electrical
//! Properties of the PHANToM Haptic Interface and Improvements for High Performance Control" (Presence 11(6), 2002).

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec2, DVec3};

use super::pantograph::reciprocal_condition;
use super::workspace::Workspace;

/// A turret with a parallelogram: θ₁ turns it about the vertical axis, θ₂ raises the upper arm from the horizontal,
/// θ₃ swings the forearm out from the vertical; both motors of the parallelogram sit on the turret.
///
/// The frame's origin is where the haptic interface point is at θ = 0; x points to the right, y away from the user, z up
/// (the paper's x, −z, y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phantom {
    /// Length of the upper arm, l₁, m.
    pub upper_m: f64,
    /// Length of the forearm, l₂, m.
    pub fore_m: f64,
    /// The part of the turret's inertia (kg·m²) that stays: it is A + B·cos 2θ₂ + C·cos 2θ₃ + D·cos θ₂·sin θ₃.
    pub turret_constant: f64,
    /// B.
    pub turret_upper: f64,
    /// C.
    pub turret_fore: f64,
    /// D; −D/2·sin(θ₂ − θ₃) also couples the arms.
    pub coupling: f64,
    /// M₂₂, kg·m².
    pub upper_inertia: f64,
    /// M₃₃, kg·m².
    pub fore_inertia: f64,
    /// Where the stops are.
    pub workspace: Workspace,
}

/// What the rates of the joints make of the energy, at one place.
struct Motion {
    /// Acceleration of the haptic interface point while no joint accelerates, m/s².
    bent: DVec3,
    /// Torques while no joint accelerates, N·m.
    torques: DVec3,
}

impl Phantom {
    /// Links and inertias of the paper's Table 1 (measured on a version 1.5 arm), with the workspace of the PHANToM 1.0:
    /// 25 cm wide, 18 cm high, 13 cm deep.
    pub const PUBLISHED: Self = {
        let (l1, l2, l3) = (0.215, 0.170, 0.0325);
        let (m_a, m_c) = (0.0202, 0.0249);
        let (a_xx, a_yy, a_zz) = (0.4864e-4, 0.001_843e-4, 0.4864e-4);
        let (c_xx, c_yy, c_zz) = (0.959e-4, 0.959e-4, 0.0051e-4);
        let (be_xx, be_yy, be_zz) = (11.09e-4, 10.06e-4, 0.591e-4);
        let (df_xx, df_yy, df_zz) = (7.11e-4, 0.629e-4, 6.246e-4);
        let base_yy = 11.87e-4;
        let upper = l1 * l1 * (m_a + 0.25 * m_c);
        let fore = 0.25 * l2 * l2 * m_a + l3 * l3 * m_c;
        Self {
            upper_m: l1,
            fore_m: l2,
            turret_constant: base_yy
                + 0.5 * (a_yy + a_zz + be_yy + be_zz + c_yy + c_zz + df_yy + df_zz + upper + fore),
            turret_upper: 0.5 * (be_yy - be_zz + c_yy - c_zz + upper),
            turret_fore: 0.5 * (a_yy - a_zz + df_yy - df_zz - fore),
            coupling: l1 * (l2 * m_a + l3 * m_c),
            upper_inertia: be_xx + c_xx + upper,
            fore_inertia: a_xx + df_xx + fore,
            workspace: Workspace {
                centre: DVec3::new(0.0, l1 - 0.18, l2 - 0.15),
                half_size: DVec3::new(0.125, 0.065, 0.09),
            },
        }
    };

    /// How far out the haptic interface point is from the turret's axis, m.
    fn out(&self, joints: DVec3) -> f64 {
        self.upper_m * joints.y.cos() + self.fore_m * joints.z.sin()
    }

    /// See [`Mechanism::position`](super::Mechanism::position).
    #[must_use]
    pub fn position(&self, joints: DVec3) -> DVec3 {
        let (sine, cosine) = joints.x.sin_cos();
        let out = self.out(joints);
        let up = self.fore_m * (1.0 - joints.z.cos()) + self.upper_m * joints.y.sin();
        DVec3::new(out * sine, self.upper_m - out * cosine, up)
    }

    /// See [`Mechanism::joints_at`](super::Mechanism::joints_at): in front of the turret, elbow up.
    #[must_use]
    pub fn joints_at(&self, position: DVec3) -> Option<DVec3> {
        let (l1, l2) = (self.upper_m, self.fore_m);
        let (right, front, up) = (position.x, l1 - position.y, position.z - l2);
        let out_squared = right * right + front * front;
        let squared = out_squared + up * up;
        let shoulder = (l1 * l1 + squared - l2 * l2) / (2.0 * l1 * squared.sqrt());
        let elbow = (l1 * l1 + l2 * l2 - squared) / (2.0 * l1 * l2);
        if out_squared == 0.0 || !(shoulder.abs() <= 1.0 && elbow.abs() <= 1.0) {
            return None;
        }
        let raised = up.atan2(out_squared.sqrt()) + shoulder.acos();
        Some(DVec3::new(right.atan2(front), raised, raised + elbow.acos() - FRAC_PI_2))
    }

    /// See [`Mechanism::jacobian`](super::Mechanism::jacobian).
    #[must_use]
    pub fn jacobian(&self, joints: DVec3) -> DMat3 {
        let (sine, cosine) = joints.x.sin_cos();
        let (outwards, sideways) = (DVec3::new(sine, -cosine, 0.0), DVec3::new(cosine, sine, 0.0));
        let [upper, fore] = self.planar(joints);
        DMat3::from_cols(
            sideways * self.out(joints),
            outwards * upper.x + DVec3::Z * upper.y,
            outwards * fore.x + DVec3::Z * fore.y,
        )
    }

    /// Motion outwards and upwards per θ₂ and per θ₃, m/rad.
    fn planar(&self, joints: DVec3) -> [DVec2; 2] {
        let (sine2, cosine2) = joints.y.sin_cos();
        let (sine3, cosine3) = joints.z.sin_cos();
        [DVec2::new(-sine2, cosine2) * self.upper_m, DVec2::new(cosine3, sine3) * self.fore_m]
    }

    /// See [`Mechanism::reciprocal_condition`](super::Mechanism::reciprocal_condition); 0 with the arm stretched or
    /// folded, or on the turret's axis.
    #[must_use]
    pub fn reciprocal_condition(&self, joints: DVec3) -> f64 {
        let [upper, fore] = self.planar(joints);
        let ratio = reciprocal_condition(upper, fore);
        let product = upper.perp_dot(fore).abs();
        let largest = if ratio > 0.0 { (product / ratio).sqrt() } else { upper.length() + fore.length() };
        let (smallest, out) = (largest * ratio, self.out(joints).abs());
        smallest.min(out) / largest.max(out)
    }

    /// See [`Mechanism::joint_inertia`](super::Mechanism::joint_inertia).
    #[must_use]
    pub fn joint_inertia(&self, joints: DVec3) -> DMat3 {
        let turret = self.turret_constant
            + self.turret_upper * (2.0 * joints.y).cos()
            + self.turret_fore * (2.0 * joints.z).cos()
            + self.coupling * joints.y.cos() * joints.z.sin();
        let between = -0.5 * self.coupling * (joints.y - joints.z).sin();
        DMat3::from_cols(
            DVec3::X * turret,
            DVec3::new(0.0, self.upper_inertia, between),
            DVec3::new(0.0, between, self.fore_inertia),
        )
    }

    /// See [`Mechanism::link_inertia`](super::Mechanism::link_inertia).
    #[must_use]
    pub fn link_inertia(&self, position: DVec3) -> Option<DMat3> {
        let joints = self.joints_at(position)?;
        let inverse = self.jacobian(joints).inverse();
        inverse.is_finite().then(|| inverse.transpose() * self.joint_inertia(joints) * inverse)
    }

    /// See [`Mechanism::dynamics`](super::Mechanism::dynamics): b = J⁻ᵀ·(n − M·J⁻¹·J̇·q̇).
    #[must_use]
    pub fn dynamics(&self, position: DVec3, velocity: DVec3) -> Option<(DMat3, DVec3)> {
        let joints = self.joints_at(position)?;
        let inverse = self.jacobian(joints).inverse();
        if !inverse.is_finite() {
            return None;
        }
        let motion = self.motion(joints, inverse * velocity);
        let lifted = inverse.transpose() * self.joint_inertia(joints) * inverse;
        Some((lifted, inverse.transpose() * motion.torques - lifted * motion.bent))
    }

    fn motion(&self, joints: DVec3, rates: DVec3) -> Motion {
        let (sine1, cosine1) = joints.x.sin_cos();
        let (sine2, cosine2) = joints.y.sin_cos();
        let (sine3, cosine3) = joints.z.sin_cos();
        let [upper, fore] = self.planar(joints);
        let squares = rates * rates;
        // Outwards and upwards: each arm is drawn towards its joint.
        let drawn = DVec2::new(-cosine2, -sine2) * (self.upper_m * squares.y)
            + DVec2::new(-sine3, cosine3) * (self.fore_m * squares.z);
        let outwards = drawn.x - self.out(joints) * squares.x;
        let sideways = 2.0 * rates.x * (upper.x * rates.y + fore.x * rates.z);
        let bent =
            DVec3::new(sine1 * outwards + cosine1 * sideways, sine1 * sideways - cosine1 * outwards, drawn.y);
        // Christoffel's symbols of the energy: how M₁₁ and M₂₃ change with θ₂ and θ₃.
        let turret_by_upper =
            -2.0 * self.turret_upper * (2.0 * joints.y).sin() - self.coupling * sine2 * sine3;
        let turret_by_fore =
            -2.0 * self.turret_fore * (2.0 * joints.z).sin() + self.coupling * cosine2 * cosine3;
        let between_by_fore = 0.5 * self.coupling * (joints.y - joints.z).cos();
        let torques = DVec3::new(
            (turret_by_upper * rates.y + turret_by_fore * rates.z) * rates.x,
            between_by_fore * squares.z - 0.5 * turret_by_upper * squares.x,
            -between_by_fore * squares.y - 0.5 * turret_by_fore * squares.x,
        );
        Motion { bent, torques }
    }
}
