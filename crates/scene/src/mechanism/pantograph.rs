//! The planar symmetric five-bar of Campion, Wang & Hayward, "The Pantograph Mk-II: A Haptic Instrument" (IROS 2005).

use glam::{DMat3, DVec2, DVec3};

use super::workspace::Workspace;

/// Two motors side by side, each with a proximal bar; two distal bars from their ends (the elbows) meet at the haptic
/// interface point. The frame's origin is half-way between the motors, x from the left motor to the right one; angles
/// count from x. Elbows point outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pantograph {
    /// Length of the bars on the motors (a₁ = a₄ there), m.
    pub proximal_m: f64,
    /// Length of the bars that meet (a₂ = a₃), m.
    pub distal_m: f64,
    /// Between the motors (a₅), m.
    pub separation_m: f64,
    /// On which side of the line through the elbows the bars meet.
    pub assembly: Assembly,
    /// Mass of a bar per length, kg/m: bars are uniform rods.
    pub bar_kg_per_m: f64,
    /// Inertia of a motor's rotor, kg·m².
    pub rotor_kg_m2: f64,
    /// Where the stops are.
    pub workspace: Workspace,
}

/// On which side of the line through the elbows the bars meet: the two ways to assemble a five-bar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Assembly {
    /// Beyond it, seen from the motors.
    Far,
    /// On the motors' side.
    Near,
}

/// One arm at a place: everything that follows from x alone.
#[derive(Clone, Copy)]
struct Arm {
    /// From motor to elbow, m.
    bar: DVec2,
    /// The elbow's motion per turn of the motor, m/rad.
    turned: DVec2,
    /// From elbow to haptic interface point, m.
    distal: DVec2,
    /// Motor turn per motion of the haptic interface point, rad/m: θ̇ = gradient·v.
    gradient: DVec2,
}

impl Pantograph {
    /// The Mk-II as published: bars of 63 and 75 mm, motors 25 mm apart, 100 mm × 60 mm. Its bars' masses are not; see
    /// [`DESKTOP`](Self::DESKTOP).
    pub const MARK_2: Self = Self {
        proximal_m: 0.063,
        distal_m: 0.075,
        separation_m: 0.025,
        assembly: Assembly::Far,
        bar_kg_per_m: 0.15,
        rotor_kg_m2: 1e-5,
        workspace: Workspace { centre: DVec3::new(0.0, 0.085, 0.0), half_size: DVec3::new(0.05, 0.03, 0.0) },
    };

    /// The Mk-II's proportions at three times its size. The dimensions of the thesis's device, a modified pantograph of
    /// Quanser's (§7.1), are not published; this one has room for the thesis's paths (±0.05 m). Its bars are of
    /// aluminium (10 mm × 5.5 mm: 0.15 kg/m), its rotors those of small direct-drive motors; both are assumptions.
    pub const DESKTOP: Self = Self {
        proximal_m: 0.189,
        distal_m: 0.225,
        separation_m: 0.075,
        workspace: Workspace { centre: DVec3::new(0.0, 0.255, 0.0), half_size: DVec3::new(0.15, 0.09, 0.0) },
        ..Self::MARK_2
    };

    /// The left motor's place is (−x, 0), the right one's (x, 0).
    fn base(&self, right: bool) -> DVec2 {
        DVec2::new(if right { 0.5 * self.separation_m } else { -0.5 * self.separation_m }, 0.0)
    }

    /// See [`Mechanism::position`](super::Mechanism::position): angles of the left and the right motor.
    #[must_use]
    pub fn position(&self, joints: DVec3) -> Option<DVec3> {
        let left = self.base(false) + DVec2::from_angle(joints.x) * self.proximal_m;
        let right = self.base(true) + DVec2::from_angle(joints.y) * self.proximal_m;
        let across = right - left;
        let half_squared = 0.25 * across.length_squared();
        let rise_squared = self.distal_m * self.distal_m - half_squared;
        if rise_squared < 0.0 || half_squared == 0.0 {
            return None;
        }
        let side = across.perp() * (0.5 * (rise_squared / half_squared).sqrt());
        let middle = 0.5 * (left + right);
        let tip = match self.assembly {
            Assembly::Far => middle + side,
            Assembly::Near => middle - side,
        };
        Some(tip.extend(joints.z))
    }

    /// See [`Mechanism::joints_at`](super::Mechanism::joints_at). Where elbows that point outwards belong to the other
    /// [`Assembly`], there are none.
    #[must_use]
    pub fn joints_at(&self, position: DVec3) -> Option<DVec3> {
        let (left, right) = self.arms(position)?;
        Some(DVec3::new(left.bar.to_angle(), right.bar.to_angle(), position.z))
    }

    fn arms(&self, position: DVec3) -> Option<(Arm, Arm)> {
        let tip = position.truncate();
        let (left, right) = (self.arm(tip, false)?, self.arm(tip, true)?);
        let is_far = left.distal.perp_dot(right.distal) > 0.0;
        (is_far == (self.assembly == Assembly::Far)).then_some((left, right))
    }

    /// The arm with its elbow outwards.
    fn arm(&self, tip: DVec2, right: bool) -> Option<Arm> {
        let base = self.base(right);
        let reach = tip - base;
        let squared = reach.length_squared();
        let (l, d) = (self.proximal_m, self.distal_m);
        // The elbow's foot on the line from base to tip, and its distance from that line, in parts of it.
        let foot = 0.5 * (1.0 + (l * l - d * d) / squared);
        let height_squared = l * l / squared - foot * foot;
        if height_squared.is_nan() || height_squared < 0.0 {
            return None;
        }
        let outwards = if right { -reach.perp() } else { reach.perp() };
        let bar = reach * foot + outwards * height_squared.sqrt();
        let (turned, distal) = (bar.perp(), reach - bar);
        let gradient = distal / distal.dot(turned);
        gradient.is_finite().then_some(Arm { bar, turned, distal, gradient })
    }

    /// The distal bars and how far they are driven (m²) at `joints`: d·v = s·θ̇ for each arm.
    fn drives(&self, joints: DVec3) -> Option<[(DVec2, f64); 2]> {
        let tip = self.position(joints)?.truncate();
        let drive = |angle: f64, right: bool| {
            let bar = DVec2::from_angle(angle) * self.proximal_m;
            let distal = tip - self.base(right) - bar;
            (distal, distal.dot(bar.perp()))
        };
        Some([drive(joints.x, false), drive(joints.y, true)])
    }

    /// See [`Mechanism::jacobian`](super::Mechanism::jacobian): infinite where the distal bars are in line.
    #[must_use]
    pub fn jacobian(&self, joints: DVec3) -> Option<DMat3> {
        let [(d1, s1), (d2, s2)] = self.drives(joints)?;
        let meets = d1.perp_dot(d2);
        let left = -d2.perp() * (s1 / meets);
        let right = d1.perp() * (s2 / meets);
        let jacobian = DMat3::from_cols(left.extend(0.0), right.extend(0.0), DVec3::Z);
        jacobian.is_finite().then_some(jacobian)
    }

    /// See [`Mechanism::reciprocal_condition`](super::Mechanism::reciprocal_condition); 0 where bars are in line: a
    /// proximal bar with its distal one, or the distal bars with each other.
    #[must_use]
    pub fn reciprocal_condition(&self, joints: DVec3) -> f64 {
        let Some(j) = self.jacobian(joints) else { return 0.0 };
        reciprocal_condition(j.x_axis.truncate(), j.y_axis.truncate())
    }

    /// See [`Mechanism::joint_inertia`](super::Mechanism::joint_inertia).
    #[must_use]
    pub fn joint_inertia(&self, joints: DVec3) -> Option<DMat3> {
        let jacobian = self.jacobian(joints)?;
        Some(jacobian.transpose() * self.link_inertia(self.position(joints)?)? * jacobian)
    }

    /// See [`Mechanism::link_inertia`](super::Mechanism::link_inertia).
    #[must_use]
    pub fn link_inertia(&self, position: DVec3) -> Option<DMat3> {
        let (left, right) = self.arms(position)?;
        Some(self.arm_inertia(&left) + self.arm_inertia(&right))
    }

    /// Of a proximal rod about the motor, with the rotor, kg·m².
    fn proximal_inertia(&self) -> f64 {
        self.rotor_kg_m2 + self.bar_kg_per_m * self.proximal_m.powi(3) / 3.0
    }

    /// A uniform rod whose ends move at u, v has the energy m·(u² + u·v + v²)/6; here u = turned·θ̇, θ̇ = gradient·v.
    fn arm_inertia(&self, arm: &Arm) -> DMat3 {
        let sixth = self.bar_kg_per_m * self.distal_m / 6.0;
        let about_motor = self.proximal_inertia() + 2.0 * sixth * arm.turned.length_squared();
        let (g, e) = (arm.gradient, arm.turned);
        let entry = |a: usize, b: usize| {
            about_motor * g[a] * g[b]
                + sixth * (g[a] * e[b] + e[a] * g[b])
                + if a == b { 2.0 * sixth } else { 0.0 }
        };
        let off = entry(0, 1);
        DMat3::from_cols(DVec3::new(entry(0, 0), off, 0.0), DVec3::new(off, entry(1, 1), 0.0), DVec3::ZERO)
    }

    /// See [`Mechanism::dynamics`](super::Mechanism::dynamics).
    #[must_use]
    pub fn dynamics(&self, position: DVec3, velocity: DVec3) -> Option<(DMat3, DVec3)> {
        let (left, right) = self.arms(position)?;
        let bias = [left, right].map(|arm| self.arm_bias(&arm, velocity.truncate()));
        Some((self.arm_inertia(&left) + self.arm_inertia(&right), (bias[0] + bias[1]).extend(0.0)))
    }

    /// The force that an arm takes while the haptic interface point does not accelerate.
    fn arm_bias(&self, arm: &Arm, velocity: DVec2) -> DVec2 {
        let sixth = self.bar_kg_per_m * self.distal_m / 6.0;
        let rate = arm.gradient.dot(velocity);
        let elbow = arm.turned * rate;
        // The distal bar's length stays: |v − u|² + d·(a − u̇) = 0 with u̇ = turned·θ̈ − bar·θ̇².
        let stretched = (velocity - elbow).length_squared() + arm.distal.dot(arm.bar) * rate * rate;
        let accelerated = stretched / arm.distal.dot(arm.turned);
        let elbow_accelerated = arm.turned * accelerated - arm.bar * (rate * rate);
        let torque = self.proximal_inertia() * accelerated + 2.0 * sixth * arm.turned.dot(elbow_accelerated);
        arm.gradient * torque + elbow_accelerated * sixth
    }
}

/// The smaller singular value of the matrix with columns a, b over the larger one.
pub(super) fn reciprocal_condition(a: DVec2, b: DVec2) -> f64 {
    let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
    let largest_squared = 0.5 * (aa + bb) + (0.5 * (aa - bb)).hypot(ab);
    if largest_squared > 0.0 { a.perp_dot(b).abs() / largest_squared } else { 0.0 }
}
