//! One host, pure: what one tick and one network step do, in every architecture.
//!
//! [`HostModel`] holds what does not change, [`HostState`] what does, as a plain value. A host has three phases of an
//! instant: [`HostModel::sample`], [`HostModel::play_out`] (and, at a server, [`HostModel::respond`]), [`HostModel::tick`].
//! Two architectures (Fotoohi Ghiam 2006, §4.1):
//!
//! - *distributed*: host `i` keeps a copy `o_i` of every body and evaluates
//!   `f_i = K₁₁(h_i, o_i) + Σ_j K₁₂(h̄_j, o_i) + K_o·Σ_j (ō_j − o_i)`, with bars for held samples; the last term is
//!   that of pairwise coordination, one of the schemes of [`cotouch_world::coordination`];
//! - *centralized*: host 1 keeps the one world, evaluates `f = K₁(h_1, o) + Σ_j K₂(h̄_j, o)`, and sends each finger of
//!   every client its `−K₂(h̄_j, o)`, which the client holds.
//!
//! On a body without a surface `K(h, o) = K·(h − o)`, a coupler to its centre; on one with a surface it is a contact
//! ([`cotouch_world::touch`]): coupler and friction where the finger touches, nothing elsewhere. Bodies also meet
//! walls and each other. A soft body is touched through local models ([`cotouch_world::local`]), own fingers and held
//! ones, while its simulation runs elsewhere at its own rate ([`SlowLoop`]).
//!
//! ```
//! use cotouch_host::{HostModel, HostState};
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
mod coordinates;
mod coordination;
mod couplers;
mod model;
mod output;
mod peers;
mod rejoining;
mod samples;
mod soft;
mod soft_fingers;
mod state;
mod step;
mod touching;

pub use contacts::ContactStates;
pub use coordinates::visit_packet;
pub use model::{HostModel, Role};
pub use output::{ContactPoint, ContactRecord, ContactSurface, TickOutput};
pub use peers::PeerState;
pub use rejoining::{BodyOffset, FingerOffset};
pub use soft::{SlowContact, SlowFrame, SlowInput, SlowLoop, SoftHostState};
pub use state::HostState;
