//! What `cotouch-analysis` promises from outside, in one program.

mod diagrams;
mod distance;
mod grasp;
mod hand_on_local_model;
mod local_models;
mod maps;
mod margins;
mod naive;
mod naive_grasp;
mod oracles;
mod properties;
mod pushed;
mod routes;
mod seed_values;
mod soft_transparency;
mod toppling;
mod transparency;
mod unmodelled;
mod whole;
mod written_out;
mod written_out_grasp;
