//! A simulated impairment on every way out of a transport.

use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};

use cotouch_net::{Route, SimulatedLink};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::LocalTime;

use super::interface::{Arrival, Transport};

/// Most destinations with a link of their own; with one more, all links begin anew.
const MAX_DESTINATIONS: usize = 32;

/// A transport whose datagrams go over simulated links before they go out, one link a destination.
pub struct Impaired<T: ?Sized> {
    state: Mutex<State>,
    inner: Box<T>,
}

/// What is impaired, and since when the session's time counts.
struct State {
    /// Nothing before the first impairment.
    ways: Option<Ways>,
    session_origin: Option<LocalTime>,
}

impl<T: Transport + ?Sized> Impaired<T> {
    /// `inner`, with no impairment yet.
    #[must_use]
    pub const fn new(inner: Box<T>) -> Self {
        Self { state: Mutex::new(State { ways: None, session_origin: None }), inner }
    }

    /// From now on every way out meets this impairment; datagrams on their way arrive as they would have. At the first
    /// call `from`, which is this host, and `seed` choose the random numbers.
    pub fn impair(&self, impairment: &Impairment, seed: u64, from: HostIndex) {
        let State { ways, session_origin } = &mut *self.state();
        match ways {
            Some(ways) => ways.change(impairment),
            None if *impairment == Impairment::NONE => {}
            None => {
                let (impairment, session_origin) = (impairment.clone(), *session_origin);
                *ways = Some(Ways { impairment, seed, from, session_origin, links: Vec::new() });
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Transport + ?Sized> Transport for Impaired<T> {
    fn route(&self) -> io::Result<Route> {
        self.inner.route()
    }

    fn receive_buffer_bytes(&self) -> Option<usize> {
        self.inner.receive_buffer_bytes()
    }

    fn send(&self, now: LocalTime, to: Route, bytes: &[u8]) -> io::Result<()> {
        if let Some(ways) = self.state().ways.as_mut().filter(|ways| !ways.are_clear()) {
            ways.send(now, to, bytes);
            return Ok(());
        }
        self.inner.send(now, to, bytes)
    }

    fn set_session_origin(&self, origin: LocalTime) {
        let mut state = self.state();
        state.session_origin = Some(origin);
        state.ways.iter_mut().for_each(|ways| ways.set_session_origin(origin));
        drop(state);
        self.inner.set_session_origin(origin);
    }

    fn receive(&self, now: LocalTime, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        self.inner.receive(now, buffer)
    }

    fn send_due(&self, now: LocalTime) -> Option<LocalTime> {
        let held_back = self.state().ways.as_mut().and_then(|ways| {
            ways.send_due(now, &*self.inner);
            ways.next_due()
        });
        held_back.into_iter().chain(self.inner.send_due(now)).min()
    }
}

/// The impaired ways from one host to everyone.
struct Ways {
    impairment: Impairment,
    seed: u64,
    from: HostIndex,
    session_origin: Option<LocalTime>,
    links: Vec<(Route, SimulatedLink)>,
}

impl Ways {
    fn change(&mut self, impairment: &Impairment) {
        self.impairment = impairment.clone();
        self.links.iter_mut().for_each(|(_, link)| link.set_impairment(impairment));
    }

    fn set_session_origin(&mut self, origin: LocalTime) {
        self.session_origin = Some(origin);
        self.links.iter_mut().for_each(|(_, link)| link.set_session_origin(origin.0));
    }

    /// Whether datagrams meet nothing, and none is on its way.
    fn are_clear(&self) -> bool {
        self.impairment == Impairment::NONE && self.next_due().is_none()
    }

    fn send(&mut self, now: LocalTime, to: Route, bytes: &[u8]) {
        let index = self.links.iter().position(|(other, _)| *other == to).unwrap_or_else(|| {
            if self.links.len() == MAX_DESTINATIONS {
                self.links.clear();
            }
            // Destinations in the order in which they are first used: the same run, the same random numbers.
            let index = HostIndex(self.links.len() as u8);
            let mut link = SimulatedLink::new(&self.impairment, self.seed, self.from, index);
            self.session_origin.iter().for_each(|origin| link.set_session_origin(origin.0));
            self.links.push((to, link));
            self.links.len() - 1
        });
        self.links[index].1.send(now.0, bytes);
    }

    fn send_due(&mut self, now: LocalTime, inner: &(impl Transport + ?Sized)) {
        for (to, link) in &mut self.links {
            while let Some((_, bytes)) = link.poll_delivery(now.0) {
                // A datagram that cannot be sent is a lost datagram, which the protocol is made for.
                let _: io::Result<()> = inner.send(now, *to, bytes);
            }
        }
    }

    fn next_due(&self) -> Option<LocalTime> {
        self.links.iter().filter_map(|(_, link)| link.next_delivery()).min().map(LocalTime)
    }
}
