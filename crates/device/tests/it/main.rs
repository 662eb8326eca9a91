//! What `cotouch-device` promises from outside, in one program.

mod conformance;
mod devices;
mod governor;
mod guided;
mod no_allocation;
mod passivity;
mod reactions;
mod support;
mod user;
