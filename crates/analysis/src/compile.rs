//! From a scene to the sampled-data loops of its contact modes.

mod along_normal;
mod channel;
mod modes;
mod session;

pub use along_normal::along_normal;
pub use modes::{ContactMode, compile};
pub(crate) use modes::{modes, sets_of_fingers};
pub use session::compile_at;
pub(crate) use session::delay;
