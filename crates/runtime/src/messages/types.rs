//! The message types, as prost makes them of the definitions.
#![allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]

include!(concat!(env!("OUT_DIR"), "/cotouch.rs"));
