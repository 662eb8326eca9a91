//! One host, pure: what one tick and one network step do, in every architecture.

mod centralized;
mod distributed;
pub mod model;
pub mod state;
pub mod step;
