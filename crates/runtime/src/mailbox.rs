//! The way of changed settings to the haptic thread, and back: nothing is made or dropped there.

use crate::change::HostChange;
use crate::haptic_host::HapticHost;

/// The haptic thread's end. A change has one element for each host, in the order of hosts.
pub(crate) struct Mailbox {
    incoming: rtrb::Consumer<Vec<HostChange>>,
    taken: rtrb::Producer<Vec<HostChange>>,
}

/// The other end.
pub(crate) struct Sender {
    outgoing: rtrb::Producer<Vec<HostChange>>,
    taken: rtrb::Consumer<Vec<HostChange>>,
}

/// Both ends, with room for one change.
pub(crate) fn both_ends() -> (Sender, Mailbox) {
    let (outgoing, incoming) = rtrb::RingBuffer::new(1);
    let (back, taken) = rtrb::RingBuffer::new(1);
    (Sender { outgoing, taken }, Mailbox { incoming, taken: back })
}

impl Sender {
    /// Leaves a change for the haptic thread; whether there was room. It is made at the next tick.
    pub(crate) fn send(&mut self, changes: Vec<HostChange>) -> bool {
        while self.taken.pop().is_ok() {}
        self.outgoing.push(changes).is_ok()
    }

    /// Whether the last change has been made.
    pub(crate) fn was_taken(&self) -> bool {
        !self.taken.is_empty()
    }
}

impl Mailbox {
    /// Makes the change that waits, if one does; whether one did. No allocation, no lock; nothing is dropped.
    pub(crate) fn deliver(&mut self, hosts: &mut [HapticHost]) -> bool {
        if self.taken.is_full() {
            return false;
        }
        let Ok(mut changes) = self.incoming.pop() else { return false };
        for (host, change) in hosts.iter_mut().zip(&mut changes) {
            host.station.change(change);
        }
        // There is room, as was asked above.
        let _: Result<(), _> = self.taken.push(changes);
        true
    }
}
