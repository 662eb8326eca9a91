//! What a cotouch session is, and the words that all other crates share.
//!
//! A *scene* says who touches what, through which couplings, at which rates, over which links. From that one value the
//! analysis derives the loop, and the virtual-time and real-time runs step it. This crate reads scenes (TOML files,
//! built-in ones, and `--set` overrides), checks every number against a stated range and every key against the others,
//! and reports all problems at once, each in one sentence with its place. A [`scene::Scene`] that exists is valid.
//!
//! ```
//! use cotouch_scene::{Override, load, parse, to_toml};
//!
//! let softer: Override = "coupling.hand_object.stiffness_n_per_m=1e3".parse()?;
//! let scene = load("single-axis", &[softer])?;
//! assert_eq!(scene.coupling.hand_object.stiffness_n_per_m, 1000.0);
//! assert_eq!(parse(&to_toml(&scene), "copy.toml", None, &[])?, scene);
//!
//! let wrong = parse("[hand]\nmass_kg = -0.1", "lab.toml", None, &[]).unwrap_err();
//! assert_eq!(
//!     wrong.to_string(),
//!     "lab.toml:2: hand.mass_kg is -0.1; it must be a number from 0.0001 to 1000 (kg)"
//! );
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What a key is (kind, range, default, unit, meaning) is stated once, in `keys/`; from there come reading, `--set`,
//! [`to_toml`], [`json_schema`] and the [reference](mod@reference). Values that a scene writes stay when its architecture is
//! changed by an override; only couplings that it leaves out take Table 6.1 of Fotoohi Ghiam 2006 for the architecture.
//!
//! Bodies have shapes ([`scene::Shape`]) with mass and inertia ([`MassProperties`]); hulls and meshes come from STL, OBJ and
//! glTF files, which are checked when the scene is read ([`mesh`]).
//!
//! A scene with a soft object ([`scene::Soft`], [`scene::LocalModel`]) has its mesh ([`soft_mesh`]): generated, or from a file.
//!
//! Time and rates: tick k happens at k·T_c; network step j at tick ⌈j·T_t/T_c⌉ ([`time::Schedule`]).
//! Positions, velocities, forces: [`geometry`]. Names of everything in a session's state: [`names`]. What scripts ask of
//! devices: [`ScriptedDemand`].

mod access;
pub mod builtin;
mod check;
mod consistency;
mod demand;
mod error;
pub mod geometry;
mod keys;
pub mod limits;
mod mass;
pub mod mechanism;
pub mod mesh;
mod meshes;
pub mod names;
mod overrides;
mod ranges;
pub mod reference;
pub mod scene;
mod schema;
pub mod soft_mesh;
mod soft_source;
mod source;
pub mod time;
mod tree;
mod unknown;
mod users;
mod value;
mod write;

pub use access::with_override;
pub use demand::{AskedForce, DemandExtent, ScriptedDemand};
pub use error::{Place, Problem, SceneError, SceneErrors};
pub use mass::MassProperties;
pub use overrides::{Override, OverrideError};
pub use scene::Scene;
pub use schema::json_schema;
pub use source::{Source, load, parse, parse_bytes};
pub use value::Value;
pub use write::{link_file, scene_hash, to_toml};
