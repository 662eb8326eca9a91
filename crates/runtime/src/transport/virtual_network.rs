//! Datagrams over simulated links, in virtual time.

use std::cell::RefCell;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};

use cotouch_net::{Route, SimulatedLink};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::LocalTime;

use super::interface::{Arrival, Transport};

const FIRST_PORT: u16 = 10_000;

/// The simulated links between all hosts of a session. A plain value: a copy does the same as the original.
#[derive(Clone, Debug)]
pub struct VirtualNetwork {
    users: u8,
    /// From host `i` to host `j` at `i·users + j`.
    links: Vec<RefCell<SimulatedLink>>,
}

impl VirtualNetwork {
    /// The links of `scene`, with its seed.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let ways = scene.hosts().flat_map(|from| scene.hosts().map(move |to| (from, to)));
        let link = |(from, to)| SimulatedLink::new(scene.impairment(from, to), scene.session.seed, from, to);
        Self { users: scene.session.users, links: ways.map(link).map(RefCell::new).collect() }
    }

    /// The end of one host.
    #[must_use]
    pub const fn end(&self, host: HostIndex) -> VirtualEnd<'_> {
        VirtualEnd { network: self, host }
    }

    /// Where a host is reached: an address, so that datagrams with routes in them are as long as they would be over UDP.
    #[must_use]
    pub fn route(host: HostIndex) -> Route {
        SocketAddr::from((Ipv4Addr::LOCALHOST, FIRST_PORT + u16::from(host.0))).into()
    }

    /// The link from one host to another.
    pub fn link_mut(&mut self, from: HostIndex, to: HostIndex) -> &mut SimulatedLink {
        let way = self.way(from, to);
        self.links[way].get_mut()
    }

    /// The receivers of what has arrived by `now`, by sender and then by receiver. The next one is told when the one before
    /// has received.
    pub fn receivers(&self, now: LocalTime) -> impl Iterator<Item = HostIndex> {
        let receivers = self.links.iter().zip(HostIndex::all(self.users).cycle());
        receivers.flat_map(move |(link, to)| {
            let has_arrived = move || link.borrow().next_delivery().is_some_and(|at| at <= now.0);
            std::iter::from_fn(move || has_arrived().then_some(to))
        })
    }

    /// When the next datagram arrives.
    #[must_use]
    pub fn next_delivery(&self) -> Option<LocalTime> {
        self.links.iter().filter_map(|link| link.borrow().next_delivery()).min().map(LocalTime)
    }

    fn way(&self, from: HostIndex, to: HostIndex) -> usize {
        from.index() * usize::from(self.users) + to.index()
    }
}

/// One host's end of a [`VirtualNetwork`].
#[derive(Clone, Copy, Debug)]
pub struct VirtualEnd<'a> {
    network: &'a VirtualNetwork,
    host: HostIndex,
}

impl Transport for VirtualEnd<'_> {
    fn route(&self) -> io::Result<Route> {
        Ok(VirtualNetwork::route(self.host))
    }

    fn send(&self, now: LocalTime, to: Route, bytes: &[u8]) -> io::Result<()> {
        let to = HostIndex::all(self.network.users).find(|&host| VirtualNetwork::route(host) == to);
        let to = to.ok_or(io::ErrorKind::Unsupported)?;
        self.network.links[self.network.way(self.host, to)].borrow_mut().send(now.0, bytes);
        Ok(())
    }

    fn set_session_origin(&self, origin: LocalTime) {
        let ways = HostIndex::all(self.network.users).map(|to| self.network.way(self.host, to));
        ways.for_each(|way| self.network.links[way].borrow_mut().set_session_origin(origin.0));
    }

    fn receive(&self, now: LocalTime, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        let receive = |from| {
            let mut link = self.network.links[self.network.way(from, self.host)].borrow_mut();
            let (at, bytes) = link.poll_delivery(now.0)?;
            let length = bytes.len().min(buffer.len());
            buffer[..length].copy_from_slice(&bytes[..length]);
            Some(Arrival { at: LocalTime(at), from: VirtualNetwork::route(from), length })
        };
        Ok(HostIndex::all(self.network.users).find_map(receive))
    }
}
