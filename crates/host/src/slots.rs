//! How the couplers of a host are numbered: room for every finger and body of the own user, then the same, and two for
//! each of its copies, for every host.

use cotouch_scene::limits::{MAX_BODIES, MAX_FINGERS};
use cotouch_scene::names::HostIndex;

/// Couplers of one user's fingers, with a number to each pair of finger and body.
const PAIRS: u16 = (MAX_FINGERS * MAX_BODIES) as u16;

/// Couplers to one peer: to its fingers, to its copies, and to how these are turned.
const PER_PEER: u16 = PAIRS + 2 * MAX_BODIES as u16;

/// The numbering at one host.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CouplerSlots {
    host: HostIndex,
}

impl CouplerSlots {
    pub(crate) const fn new(host: HostIndex) -> Self {
        Self { host }
    }

    /// Couplers of a session with so many users are numbered below this.
    pub(crate) fn count(users: u8) -> usize {
        usize::from(PAIRS) + usize::from(users) * usize::from(PER_PEER)
    }

    /// The coupler between a finger and a body.
    pub(crate) fn finger(self, host: HostIndex, finger: usize, body: usize) -> u16 {
        let pair = (finger * MAX_BODIES + body) as u16;
        if host == self.host { pair } else { first_slot(host) + pair }
    }

    /// The coupler to a peer's copy of a body.
    pub(crate) fn copy(peer: HostIndex, body: usize) -> u16 {
        first_slot(peer) + PAIRS + body as u16
    }

    /// The coupler to how a peer's copy of a body is turned.
    pub(crate) fn rotation(peer: HostIndex, body: usize) -> u16 {
        Self::copy(peer, body) + MAX_BODIES as u16
    }
}

fn first_slot(peer: HostIndex) -> u16 {
    PAIRS + u16::from(peer.0) * PER_PEER
}
