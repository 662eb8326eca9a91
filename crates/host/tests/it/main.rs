//! What `cotouch-host` promises from outside, in one program.

mod common;
mod contacts;
mod coordination;
mod instants;
mod soft_contacts;
mod soft_no_allocation;
mod soft_scenes;
mod soft_spring;
