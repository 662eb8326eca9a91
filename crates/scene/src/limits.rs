//! How much of everything there may be in a session: what is read is held to it, and all fixed-size state has its size from it.

/// Most users of a session, each on a host of their own.
pub const MAX_USERS: usize = 16;

/// Most bodies of a world, fixed ones included.
pub const MAX_BODIES: usize = 8;

/// Most fingers (haptic interface points) of one user.
pub const MAX_FINGERS: usize = 4;

/// Hosts of a session that do not hear each other try again after so many seconds at most: what has drifted apart while nothing
/// arrived is to wait no longer than it must.
pub const MAX_RETRY_S: f64 = 0.125;

/// Hosts of a session send samples to one that they do not hear for so many seconds after they heard it last; afterwards, once they hear
/// any word of it.
pub const MAX_SILENCE_S: f64 = 60.0;

/// Most entries of a state packet: a user's fingers and the bodies that move, together.
pub const MAX_ENTRIES: usize = 10;

/// Most fingers that touch a soft body, of all users together; as many contacts are solved together.
pub const MAX_SOFT_CONTACTS: usize = 16;

/// Most contacts that a host lists in the output of one tick.
pub const MAX_CONTACTS: usize = 32;

/// Most vectors that a coordination scheme adds to a sample for one channel: of one body, for translation or rotation.
pub const MAX_CHANNEL_VECTORS: usize = 2;

/// Most vectors that a coordination scheme remembers for one channel at ticks, and most at network steps.
pub const MAX_CHANNEL_MEMORY: usize = 4;

/// A body beyond this distance (m) from the origin, or speed (m/s), has left the world.
pub const WORLD_BOUND_M: f64 = 1e3;
