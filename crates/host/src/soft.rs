//! The slow loop of a soft body: what ticks tell it, what it tells them, and the simulation itself.
//!
//! Period p of the slow simulation begins at tick k_p. When the forces that p returns are known, the tick's output has a
//! [`SlowInput`]; [`SlowLoop::step`] makes a [`SlowFrame`] of it, elsewhere and in its own time; at tick
//! k_(p+1+d), d = `local_model.result_delay_periods`, [`HostModel::take_frame`] brings it into use. Before the first tick
//! it takes [`SlowLoop::rest_frame`] over; without any frame there is no force.
//!
//! [`HostModel::take_frame`]: crate::HostModel::take_frame

mod contacts;
mod estimate;
mod frame;
mod input;
mod returned;
mod slow_loop;
mod state;
mod stiffness;

pub(crate) use contacts::{SoftContactOutput, SoftContacts};
pub use frame::SlowFrame;
pub use input::{SlowContact, SlowInput};
pub use slow_loop::SlowLoop;
pub use state::SoftHostState;
