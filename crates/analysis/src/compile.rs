//! From a scene to the sampled-data loops of its contact modes.

mod along_normal;
mod channel;
mod modes;
mod one_sided;
#[cfg(test)]
pub(crate) mod schemes_with_memory;
mod session;

pub use along_normal::along_normal;
#[cfg(test)]
pub(crate) use modes::compile_with_schemes;
pub use modes::{ContactMode, compile};
pub(crate) use modes::{every_finger, modes, sets_of_fingers};
pub(crate) use one_sided::{Affected, OneSidedContact, OneSidedLoop, one_sided};
pub use session::compile_at;
pub(crate) use session::delay;
