//! One host, pure: what one tick and one network step do, in every architecture.
//!
//! [`model::HostModel`] holds what does not change, [`state::HostState`] what does, as a plain value. [`step`] has the
//! three phases of an instant: sample, play out (and, at a server, respond), tick. Two architectures (thesis §4.1):
//!
//! - *distributed*: host `i` keeps a copy of the object and evaluates
//!   `f_i = K₁₁·(h_i − o_i) + Σ_j K₁₂·(h̄_j − o_i) + K_o·Σ_j (ō_j − o_i)`, with bars for held samples;
//! - *centralized*: host 1 keeps the one object, evaluates `f = K₁·(h_1 − o) + Σ_j K₂·(h̄_j − o)`, and sends each client
//!   its `−K₂·(h̄_j − o)`, which the client holds.
//!
//! ```
//! use cotouch_host::{model::HostModel, state::HostState};
//! use cotouch_scene::{geometry::Reading, load, names::HostIndex};
//! use glam::DVec3;
//!
//! let scene = load("single-axis", &[])?;
//! let host = HostModel::new(&scene, HostIndex::FIRST);
//! let mut state = HostState::new(&host);
//! let hand = Reading::point(DVec3::X * 0.001, DVec3::ZERO);
//! assert!(host.sample(&state, 0, &hand).is_some());
//! host.play_out(&mut state, 0);
//! assert_eq!(host.tick(&mut state, 0, &hand).device.force.x, -3.0);
//! # Ok::<(), cotouch_scene::SceneErrors>(())
//! ```

mod centralized;
mod distributed;
pub mod model;
pub mod state;
pub mod step;
