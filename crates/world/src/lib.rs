//! Bodies, contact, walls and virtual couplers, as pure step functions.
//!
//! A *model* holds constants, a *state* is a plain value, and a step is a function of both. Nothing here reads a
//! clock, allocates or fails.
//!
//! * A virtual coupler is a spring and damper between two points: `f = k·(x_b − x_a) + b·(v_b − v_a)` on `a`.
//! * A body of mass `m` under a force `f` held for `T` moves by [`Stepper`]: with *exact hold*
//!   `x += T·v + T²·f/(2m)`, `v += T·f/m`, which is what Fotoohi Ghiam 2006, (3.14)–(3.17), give for a double integrator.
//!   Turning is the same in a plane; in space it keeps the angular momentum.
//! * A sphere that touches a surface is held by [`touch`]: a spring and damper across the surface that never
//!   pulls, another along it, and friction that sticks. Fingers are spheres; bodies meet walls and each other with the
//!   [`Surface::corners`] that stand for them.
//! * A sphere that touches a slowly simulated soft body is held by a local model ([`local`]).
//! * On a line, a wall is a grounded coupler, one-sided or two-sided ([`wall::force`]).
//! * The ground under bodies in a plane resists by Coulomb's law ([`GroundFriction`]).
//!
//! ```
//! use cotouch_scene::geometry::Wrench;
//! use cotouch_scene::scene::{Integrator, SpringDamper};
//! use cotouch_world::{BodyState, Freedom, Stepper, coupler};
//! use glam::DVec3;
//!
//! let stepper = Stepper::new(0.4, 1.0 / 1024.0, Integrator::ExactHold, Freedom::Line(DVec3::X));
//! let mut body = BodyState::at_rest(DVec3::ZERO);
//! let spring = SpringDamper { stiffness_n_per_m: 300.0, damping_n_s_per_m: 10.0 };
//! let pull = coupler::force(spring, coupler::Stretch::between(body.point(), (DVec3::X * 0.01, DVec3::ZERO)));
//! stepper.step(&mut body, &Wrench::force(pull));
//! assert!((body.twist.linear.x - 3.0 / 0.4 / 1024.0).abs() < 1e-15);
//! ```

mod approach;
mod contact;
mod convex;
pub mod coordination;
mod corner;
pub mod coupler;
mod cuboid;
mod ground;
mod hull;
mod linear_block;
pub mod local;
mod probe;
mod proxy;
mod rejoining;
mod rigid;
mod round;
mod shape;
pub mod wall;

pub use approach::{Approach, ApproachSide};
pub use contact::{
    Cancellation, ContactForce, ContactModel, ContactState, Phase, Sphere, touch, touch_plane,
};
pub use corner::{CornerSphere, Corners, MAX_CORNERS};
pub use ground::GroundFriction;
pub use linear_block::LinearBlock;
pub use probe::Probe;
pub use proxy::{MeshSurface, ProxyState, SurfaceError, SurfacePoint};
pub use rejoining::{Offset, RejoiningPace};
pub use rigid::{BodyState, Freedom, Inertia, Stepper};
pub use shape::{Surface, corners};
