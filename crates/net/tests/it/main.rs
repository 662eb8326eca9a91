//! What `cotouch-net` promises from outside, in one program.

mod allocation;
mod net;
mod secure;
mod session;
mod trust;
mod wire;
