//! What `cotouch-world` promises from outside, in one program.

mod common;
mod contact_law;
mod coordination;
mod free_bodies;
mod friction;
mod local_laws;
mod local_models;
mod mesh_contact;
mod no_allocation;
mod proxy;
mod resting;
mod surfaces;
