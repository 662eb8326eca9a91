//! A simulated impairment on a real socket's way out, one link a destination.

use std::collections::HashMap;
use std::net::SocketAddr;

use cotouch_net::link::SimulatedLink;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::LocalTime;

/// Most destinations with a link of their own; packets to any other are passed on at once.
const MOST_DESTINATIONS: usize = 32;

/// The impaired ways from one host to everyone.
pub struct ImpairedWays {
    impairment: Impairment,
    seed: u64,
    from: HostIndex,
    links: HashMap<SocketAddr, SimulatedLink>,
}

impl ImpairedWays {
    /// Every way out of `from` is impaired alike, each with its own random numbers from `seed`.
    #[must_use]
    pub fn new(impairment: Impairment, seed: u64, from: HostIndex) -> Self {
        Self { impairment, seed, from, links: HashMap::new() }
    }

    /// From now on packets meet another impairment; those on their way arrive as they would have.
    pub fn change(&mut self, impairment: &Impairment) {
        self.impairment = impairment.clone();
        self.links.values_mut().for_each(|link| link.set_impairment(impairment));
    }

    /// Whether packets meet nothing, and none is on its way.
    #[must_use]
    pub fn are_clear(&self) -> bool {
        self.impairment == Impairment::NONE && self.next_due().is_none()
    }

    /// Puts a datagram on its way.
    pub fn send(&mut self, now: LocalTime, to: SocketAddr, bytes: &[u8]) {
        if !self.links.contains_key(&to) && self.links.len() == MOST_DESTINATIONS {
            self.links.clear();
        }
        // Destinations in the order in which they are first used: the same run, the same random numbers.
        let index = HostIndex(self.links.len() as u8);
        let link = self
            .links
            .entry(to)
            .or_insert_with(|| SimulatedLink::new(&self.impairment, self.seed, self.from, index));
        link.send(now.0, bytes);
    }

    /// Takes out everything that is due.
    pub fn take_due(&mut self, now: LocalTime, mut send: impl FnMut(SocketAddr, &[u8])) {
        for (to, link) in &mut self.links {
            while let Some((_, bytes)) = link.poll_delivery(now.0) {
                send(*to, bytes);
            }
        }
    }

    /// When the next datagram is due.
    #[must_use]
    pub fn next_due(&self) -> Option<LocalTime> {
        self.links.values().filter_map(SimulatedLink::next_delivery).min().map(LocalTime)
    }
}
