//! One host, pure: what one tick and one network step do, in every architecture.
//!
//! [`model::HostModel`] holds what does not change, [`state::HostState`] what does, as a plain value. [`step`] has the
//! three phases of an instant: sample, play out (and, at a server, respond), tick. Two architectures (thesis §4.1):
//!
//! - *distributed*: host `i` keeps a copy `o_i` of every body and evaluates
//!   `f_i = K₁₁(h_i, o_i) + Σ_j K₁₂(h̄_j, o_i) + K_o·Σ_j (ō_j − o_i)`, with bars for held samples;
//! - *centralized*: host 1 keeps the one world, evaluates `f = K₁(h_1, o) + Σ_j K₂(h̄_j, o)`, and sends each finger of
//!   every client its `−K₂(h̄_j, o)`, which the client holds.
//!
//! On a body without a surface `K(h, o) = K·(h − o)`, a coupler to its centre; on one with a surface it is a contact
//! ([`cotouch_world::touch`]): coupler and friction where the finger touches, nothing elsewhere. Bodies also meet
//! walls and each other. A soft body is touched through local models ([`cotouch_world::local`]), own fingers and held
//! ones, while its simulation runs elsewhere at its own rate ([`soft`]).
//!
//! ```
//! use cotouch_host::{model::HostModel, state::HostState};
//! use cotouch_scene::{geometry::Reading, load, names::HostIndex};
//! use glam::DVec3;
//!
//! let scene = load("single-axis", &[])?;
//! let host = HostModel::new(&scene, HostIndex::FIRST);
//! let mut state = HostState::new(&host);
//! let finger = [Reading::point(DVec3::X * 0.001, DVec3::ZERO)].into_iter().collect();
//! assert!(host.sample(&mut state, 0, &finger).is_some());
//! host.play_out(&mut state, 0);
//! assert_eq!(host.tick(&mut state, 0, &finger).device[0].force.x, -3.0);
//! # Ok::<(), cotouch_scene::SceneErrors>(())
//! ```

mod bodies;
mod centralized;
mod contact_table;
mod contacts;
pub mod coordinates;
mod coordination;
mod couplers;
pub mod model;
pub mod output;
mod peers;
mod samples;
mod slots;
pub mod soft;
mod soft_fingers;
pub mod state;
pub mod step;
mod touching;
