//! What `cotouch-soft` promises from outside, in one program.

mod balloon;
mod common;
mod corotational;
mod factor;
mod linear;
mod mass_spring;
mod spring;
mod stiffness;
