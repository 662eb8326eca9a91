//! Soft bodies that are simulated slowly (20 to 60 Hz): one step is a pure function, whatever the technique.
//!
//! Haptics knows a soft body through [`SoftBody`] only, as Barbagli et al. 2003, §2, ask:
//! where its nodes are, what a step under forces at material points does to them, and, if the technique can tell, how
//! compliant it is where it is touched.
//!
//! ```text
//! backward Euler      M·(v⁺ − v) = h·(f_ext + f_int(x + h·v⁺) − C·v⁺),   x⁺ = x + h·v⁺,   C = α·M + β·K
//! quasi-static        f_ext + f_int(x⁺) = 0
//! joint compliance    W = J·K⁻¹·Jᵀ, K at rest, J the weights of the material points
//! ```

mod balloon;
mod body;
mod corotational;
mod elastic;
mod enclosed;
pub mod factor;
mod forces;
mod implicit;
mod inversion;
mod linear;
mod locate;
mod mass_spring;
mod membrane;
mod mesh;
mod point;
mod stiffness;
mod technique;
mod vector;

pub use body::{SoftBody, SoftEnergy, SoftError, SoftState};
pub use corotational::Corotational;
pub use linear::{LinearBody, ReducedBody};
pub use locate::material_point_at;
pub use point::{MaterialPoint, PointForce};
pub use stiffness::{contact_stiffnesses, largest_eigenvalue};
pub use technique::soft_body;
