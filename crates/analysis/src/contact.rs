//! The exact first-order change of a contact's force about an operating point.
//!
//! A finger's centre `c` sticks to a body at position `p`, turned by `R`. In the body's frame, with `u = Rᵀ(c − p)`, the
//! outward normal `n(u)`, the depth `d(u)`, the anchor `a` and `P = I − n·nᵀ`, the force on the finger is `R·φ`,
//!
//! ```text
//! φ  = k_N·d·n − k_T·P·(u − a) − (b_N·n·nᵀ + b_T·P)·w,       w = Rᵀ·(ċ − ṗ − ω×(c − p))                Fotoohi Ghiam 2006, (7.3)
//! φ' = −k_N·n·nᵀ − k_T·P + (f_n + k_T·nᵀ(u − a))·C + k_T·n·(Cᵀ(u − a))ᵀ,       C = dn/du, 0 on a flat face
//! ```
//!
//! and with the arm `r = c − p`, the force `F₀` at the operating point, and a small turn θ of the body,
//!
//! ```text
//! δF = J·(δc − δp − θ×r) + θ×F₀ + D·(δċ − δṗ − δω×r),        J = R·φ'·Rᵀ
//! torque on the body: δτ = −(δc − δp)×F₀ − r×δF
//! ```
//!
//! The terms with `F₀` are the geometric stiffness of preload. While a contact slides along `t`, the force is `f_n·(n − μ_k·t)`
//! (7.4), so that the normal force pulls along the surface too; what resists sideways motion only takes energy and is left out.

use cotouch_scene::scene::{BodyImpedance, SpringDamper};
use glam::{DMat3, DQuat, DVec3};

use crate::loop_spec::{Columns, Dof, ForceGains, Motion, Rows};

/// A motion and the ways in which it moves.
pub(crate) type Moving = (Motion, &'static [Dof]);

const POSITION: Columns = Columns { turns: false, velocity: false };
const VELOCITY: Columns = Columns { turns: false, velocity: true };
const TURN: Columns = Columns { turns: true, velocity: false };
const SPIN: Columns = Columns { turns: true, velocity: true };

/// `v×` as a matrix.
pub(crate) fn cross(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}

/// `a·bᵀ`.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `normal·n·nᵀ + tangential·(I − n·nᵀ)`.
fn anisotropic(normal: f64, tangential: f64, n: DVec3) -> DMat3 {
    outer(n, n) * (normal - tangential) + DMat3::IDENTITY * tangential
}

/// Stiffness and damping across and along a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gains {
    pub(crate) normal: SpringDamper,
    pub(crate) tangential: SpringDamper,
}

/// The geometry of a contact in the frame of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Geometry {
    /// Outward, of length 1.
    pub(crate) normal: DVec3,
    /// How the normal turns as the sphere's centre moves, 1/m.
    pub(crate) curvature: DMat3,
    /// From the anchor to the sphere's centre, m.
    pub(crate) stretch: DVec3,
}

/// A force on a point, to first order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearForce {
    /// J, N/m.
    position: DMat3,
    /// D, N·s/m.
    velocity: DMat3,
    /// r, m.
    arm: DVec3,
    /// F₀, N.
    force: DVec3,
}

impl LinearForce {
    /// A contact with a surface that is turned by `orientation` and whose body's centre is `arm` (m, world) from the
    /// sphere's centre; `force` acts on the sphere (N, world).
    pub(crate) fn contact(
        gains: &Gains,
        at: &Geometry,
        orientation: DQuat,
        arm: DVec3,
        force: DVec3,
    ) -> Self {
        let &Geometry { normal, curvature, stretch } = at;
        let (k_n, k_t) = (gains.normal.stiffness_n_per_m, gains.tangential.stiffness_n_per_m);
        let press = (orientation.conjugate() * force).dot(normal);
        let local = curvature * (press + k_t * normal.dot(stretch))
            + outer(normal, curvature.transpose() * stretch) * k_t
            - anisotropic(k_n, k_t, normal);
        let damping = anisotropic(gains.normal.damping_n_s_per_m, gains.tangential.damping_n_s_per_m, normal);
        let turn = DMat3::from_quat(orientation);
        let to_world = |matrix: DMat3| turn * matrix * turn.transpose();
        Self { position: to_world(local), velocity: -to_world(damping), arm, force }
    }

    /// A contact that slides in `direction` (of length 1, along the surface, body frame) against friction: what changes is
    /// the normal force, δF = (n − μ_k·t)·δf_n with δf_n = −k_N·n·δu − b_N·n·w; the rest as for a contact that sticks.
    pub(crate) fn sliding(
        gains: &Gains,
        at: &Geometry,
        orientation: DQuat,
        arm: DVec3,
        (direction, dynamic_friction, press_n): (DVec3, f64, f64),
    ) -> Self {
        let &Geometry { normal, curvature, .. } = at;
        let along = normal - direction * dynamic_friction;
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = gains.normal;
        let local = curvature * press_n - outer(along, normal) * stiffness_n_per_m;
        let damping = outer(along, normal) * damping_n_s_per_m;
        let turn = DMat3::from_quat(orientation);
        let to_world = |matrix: DMat3| turn * matrix * turn.transpose();
        let force = orientation * (along * press_n);
        Self { position: to_world(local), velocity: -to_world(damping), arm, force }
    }

    /// A spring and a damper to a body's centre, pulling both ways.
    pub(crate) fn bilateral(spring: SpringDamper) -> Self {
        Self {
            position: DMat3::from_diagonal(DVec3::splat(-spring.stiffness_n_per_m)),
            velocity: DMat3::from_diagonal(DVec3::splat(-spring.damping_n_s_per_m)),
            arm: DVec3::ZERO,
            force: DVec3::ZERO,
        }
    }

    /// Adds the force on the point to that on a finger.
    pub(crate) fn on_point(
        &self,
        on: &mut ForceGains,
        axes: &'static [Dof],
        point: Moving,
        body: Option<Moving>,
    ) {
        let rows = Rows { axes, turns: false };
        self.add(on, rows, &[(DMat3::IDENTITY, self.turn(), DMat3::ZERO)], point, body);
    }

    /// Adds the reaction to the force and torque on the body.
    pub(crate) fn on_body(&self, on: &mut ForceGains, axes: &'static [Dof], point: Moving, body: Moving) {
        let (arm, force) = (cross(self.arm), cross(self.force));
        let rows = |turns| Rows { axes, turns };
        self.add(on, rows(false), &[(-DMat3::IDENTITY, -self.turn(), DMat3::ZERO)], point, Some(body));
        self.add(on, rows(true), &[(-arm, -(arm * self.turn()), force)], point, Some(body));
    }

    /// ∂F/∂θ.
    fn turn(&self) -> DMat3 {
        self.position * cross(self.arm) - cross(self.force)
    }

    /// Adds `lever·δF`, with `turn` = `lever·∂F/∂θ` and `more` on top of the position's gain.
    fn add(
        &self,
        on: &mut ForceGains,
        rows: Rows,
        parts: &[(DMat3, DMat3, DMat3)],
        point: Moving,
        body: Option<Moving>,
    ) {
        for &(lever, turn, more) in parts {
            let (position, velocity) = (lever * self.position + more, lever * self.velocity);
            on.add(rows, point, POSITION, &position);
            on.add(rows, point, VELOCITY, &velocity);
            if let Some(body) = body {
                on.add(rows, body, POSITION, &-position);
                on.add(rows, body, VELOCITY, &-velocity);
                on.add(rows, body, TURN, &turn);
                on.add(rows, body, SPIN, &(velocity * cross(self.arm)));
            }
        }
    }

    /// Adds the force on a point that is fixed to the body (a corner against a wall) to that on the body; here `arm`
    /// goes from the body's centre to the corner, and `force` acts on the body.
    ///
    /// δF = J·(δp + θ×ρ) + D·(δṗ + δω×ρ),  δτ = (θ×ρ)×F₀ + ρ×δF.
    pub(crate) fn on_own_point(&self, on: &mut ForceGains, axes: &'static [Dof], body: Moving) {
        let (arm, force) = (cross(self.arm), cross(self.force));
        for (turns, lever, more) in [(false, DMat3::IDENTITY, DMat3::ZERO), (true, arm, force * arm)] {
            let rows = Rows { axes, turns };
            let (position, velocity) = (lever * self.position, lever * self.velocity);
            on.add(rows, body, POSITION, &position);
            on.add(rows, body, VELOCITY, &velocity);
            on.add(rows, body, TURN, &(more - position * arm));
            on.add(rows, body, SPIN, &-(velocity * arm));
        }
    }
}

/// What one number of each motion adds to the force of a channel between two copies of a body: N/m and N·s/m for
/// translation, N·m/rad and N·m·s/rad for rotation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ChannelGains {
    /// Position and velocity from the own copy to the other.
    pub(crate) apart: [f64; 2],
    /// Position and velocity of the own copy.
    pub(crate) own: [f64; 2],
}

/// Adds the channels between two copies of a body, for translation and for rotation, to the wrench on `near`. How the far
/// copy is turned against the near one (`apart`) is a rotation vector φ, whose derivative is J_l⁻¹(φ)·θ_far − J_r⁻¹(φ)·θ_near;
/// `turned` is how the near one is turned against the scene's start.
pub(crate) fn couple_copies(
    on: &mut ForceGains,
    (near, axes): Moving,
    far: Motion,
    [translation, rotation]: [ChannelGains; 2],
    (apart, turned): (DQuat, DQuat),
) {
    let diagonal = |gain: f64| DMat3::from_diagonal(DVec3::splat(gain));
    let left = inverse_left_jacobian(rotation_vector(apart));
    let own = inverse_left_jacobian(rotation_vector(turned));
    let moves = Rows { axes, turns: false };
    let turns = Rows { axes, turns: true };
    let [k, b] = translation.apart;
    let [k_turn, b_turn] = rotation.apart;
    for (motion, sign, jacobian) in [(far, 1.0, left), (near, -1.0, left.transpose())] {
        let motion = (motion, axes);
        on.add(moves, motion, POSITION, &diagonal(sign * k));
        on.add(moves, motion, VELOCITY, &diagonal(sign * b));
        on.add(turns, motion, TURN, &(jacobian * (sign * k_turn)));
        on.add(turns, motion, SPIN, &diagonal(sign * b_turn));
    }
    on.add(moves, (near, axes), POSITION, &diagonal(translation.own[0]));
    on.add(moves, (near, axes), VELOCITY, &diagonal(translation.own[1]));
    on.add(turns, (near, axes), TURN, &(own * rotation.own[0]));
    on.add(turns, (near, axes), SPIN, &diagonal(rotation.own[1]));
}

/// Adds what ties a body to the ground.
pub(crate) fn tie_to_ground(on: &mut ForceGains, body: Moving, impedance: &BodyImpedance) {
    let rows = |turns| Rows { axes: body.1, turns };
    let spin = DVec3::splat(impedance.rotational_damping_n_m_s_per_rad);
    on.add(rows(false), body, POSITION, &DMat3::from_diagonal(-impedance.stiffness_n_per_m));
    on.add(rows(false), body, VELOCITY, &DMat3::from_diagonal(-impedance.damping_n_s_per_m));
    on.add(rows(true), body, SPIN, &DMat3::from_diagonal(-spin));
}

/// To full precision for small angles too, rad.
fn rotation_vector(quaternion: DQuat) -> DVec3 {
    let shorter = if quaternion.w < 0.0 { -quaternion } else { quaternion };
    let sine = shorter.xyz().length();
    if sine == 0.0 { DVec3::ZERO } else { shorter.xyz() * (2.0 * sine.atan2(shorter.w) / sine) }
}

/// J_l⁻¹(φ) = I − ½·φ× + (1/|φ|² − (1 + cos|φ|)/(2·|φ|·sin|φ|))·φ×·φ×; its transpose is J_r⁻¹.
fn inverse_left_jacobian(vector: DVec3) -> DMat3 {
    const SMALL: f64 = 1e-3;
    let angle = vector.length();
    let square = if angle < SMALL {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
    };
    let cross = cross(vector);
    DMat3::IDENTITY - cross * 0.5 + cross * cross * square
}

#[cfg(test)]
mod tests {
    use cotouch_scene::geometry::{Pose, Twist};
    use cotouch_scene::scene::{Shape, ShapeKind};
    use cotouch_world::{ContactModel, ContactState, Phase, Sphere, Surface, touch};

    use super::*;

    /// How the running law changes while a finger slides is what the analysis takes.
    #[test]
    fn a_contact_that_slides_changes_as_the_running_law() {
        let (normal, tangential) = (spring(900.0, 4.0), spring(1300.0, 6.0));
        let (friction, radius_m) = (0.4, 0.008);
        let model = ContactModel {
            normal,
            tangential,
            static_friction: 0.5,
            dynamic_friction: friction,
            stick_speed_m_per_s: 0.005,
            period_s: 1.0 / 1024.0,
            cancellation: None,
        };
        let shape = Shape { kind: ShapeKind::Box, size_m: DVec3::new(0.2, 0.12, 0.05), ..Shape::default() };
        let surface = Surface::new(&shape);
        let pose = Pose { position: DVec3::ZERO, orientation: DQuat::from_rotation_z(0.3) };
        let local = DVec3::new(0.03, 0.06 + radius_m - 0.002, 0.0);
        // Fast along x of the body; the finger came from outside and has slid for long.
        let sliding = |moved: DVec3, faster: DVec3| {
            let mut state = ContactState::default();
            let at = |local: DVec3, velocity: DVec3| Sphere {
                centre: pose.to_world(local) + moved,
                velocity: pose.orientation * velocity + faster,
                radius_m,
            };
            let still = (&pose, &Twist::default());
            let apart =
                touch(&model, &mut state, &surface, still, &at(local + DVec3::Y * 0.01, DVec3::ZERO), 0.0);
            assert!(apart.is_none());
            let mut force = None;
            for tick in (0..40).rev() {
                let before = local - DVec3::X * (1e-3 * f64::from(tick));
                force = touch(&model, &mut state, &surface, still, &at(before, DVec3::X), 0.0);
            }
            assert_eq!(state.phase, Phase::Slide);
            force.unwrap().force
        };
        let press_n = 900.0 * 0.002;
        let geometry = Geometry { normal: DVec3::Y, curvature: DMat3::ZERO, stretch: DVec3::ZERO };
        let law = LinearForce::sliding(
            &Gains { normal, tangential },
            &geometry,
            pose.orientation,
            DVec3::ZERO,
            (DVec3::X, friction, press_n),
        );
        assert!(law.force.distance(sliding(DVec3::ZERO, DVec3::ZERO)) < 1e-9, "{}", law.force);
        for axis in [DVec3::X, DVec3::Y] {
            let (small, across) = (1e-6, pose.orientation * axis);
            let change = (sliding(across * small, DVec3::ZERO) - sliding(-across * small, DVec3::ZERO))
                / (2.0 * small);
            assert!(
                change.distance(law.position * across) < 1e-4,
                "{axis}: {change} {}",
                law.position * across
            );
            let change = (sliding(DVec3::ZERO, across * small) - sliding(DVec3::ZERO, -across * small))
                / (2.0 * small);
            assert!(
                change.distance(law.velocity * across) < 1e-4,
                "{axis}: {change} {}",
                law.velocity * across
            );
        }
    }

    fn spring(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
        SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
    }
}
