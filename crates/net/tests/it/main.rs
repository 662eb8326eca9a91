//! What `cotouch-net` promises from outside, in one program.

mod allocation;
mod net;
mod plausibility;
mod secure;
mod session;
mod trust;
mod wire;
