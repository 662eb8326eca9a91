//! A whole session in virtual time: one thread, simulated links, the same bytes every time.
//!
//! Hosts, protocol, wire format, governor and recorder are the ones of the real-time run; only clocks, sockets and
//! hands are simulated. Events are taken in the order of their instants; at one instant everything is sampled first,
//! then transmitted and delivered, then used.

use std::io;

use cotouch_device::{Device, SimulatedUser};
use cotouch_net::{Endpoint, Event, MAX_DATAGRAM, SimulatedLink};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::{LocalTime, Rate, SessionTime};
use cotouch_soft::SoftError;

use crate::exchange::RecordSink;
use crate::joining::full_session_endpoint;
use crate::record::TickRecord;
use crate::slow::{SlowPort, is_simulated_at, slow_simulation};
use crate::station::{Punctuality, Station};
use crate::transport::{Transport as _, VirtualEnd, VirtualNetwork};

const NEVER: i64 = i64::MAX;

/// A session whose hosts, links and clocks all live in one value.
pub struct VirtualSession<D = SimulatedUser> {
    control: Rate,
    hosts: Vec<VirtualHost<D>>,
    network: VirtualNetwork,
    now: LocalTime,
    /// When the next packet arrives or an endpoint wants to do something.
    next_network: i64,
}

/// One host of a virtual session.
pub struct VirtualHost<D = SimulatedUser> {
    /// Host, device and governor.
    pub station: Station<D>,
    /// The session protocol.
    pub endpoint: Endpoint,
    next_tick: u64,
    next_due: i64,
}

impl<D: Device> VirtualSession<D> {
    /// A session of `scene` in which `station` makes each host's station. Hosts have yet to join.
    #[must_use]
    pub fn new(scene: &Scene, mut station: impl FnMut(HostIndex) -> Station<D>) -> Self {
        let now = LocalTime(0);
        let hosts = scene.hosts().map(|host| VirtualHost {
            station: station(host),
            endpoint: full_session_endpoint(scene, host, VirtualNetwork::route(HostIndex::FIRST), now),
            next_tick: 0,
            next_due: NEVER,
        });
        Self {
            control: scene.rates.control_hz,
            hosts: hosts.collect(),
            network: VirtualNetwork::new(scene),
            now,
            next_network: 0,
        }
    }

    /// A session of `scene` in which `device` makes each host's device, and what records the host. Soft objects are
    /// simulated by the stations themselves.
    ///
    /// # Errors
    /// When the scene's soft object cannot be simulated.
    pub fn with_devices(
        scene: &Scene,
        mut device: impl FnMut(HostIndex) -> (D, Option<Box<dyn RecordSink + Send>>),
    ) -> Result<Self, SoftError> {
        let simulation = slow_simulation(scene)?;
        Ok(Self::new(scene, |host| {
            let (device, sink) = device(host);
            let station = Station::new(scene, host, device, sink);
            match simulation.clone().filter(|_| is_simulated_at(scene, host)) {
                Some(simulation) => station.with_soft(SlowPort::inline(scene, simulation)),
                None => station,
            }
        }))
    }

    /// The hosts.
    #[must_use]
    pub fn hosts(&self) -> &[VirtualHost<D>] {
        &self.hosts
    }

    /// One host.
    pub fn host_mut(&mut self, host: HostIndex) -> &mut VirtualHost<D> {
        &mut self.hosts[host.index()]
    }

    /// The link from one host to another.
    pub fn link_mut(&mut self, from: HostIndex, to: HostIndex) -> &mut SimulatedLink {
        self.network.link_mut(from, to)
    }

    /// The first tick that some host has not done yet; `None` before all have joined.
    #[must_use]
    pub fn next_tick(&self) -> Option<u64> {
        self.hosts.iter().map(|host| (host.next_due != NEVER).then_some(host.next_tick)).min().flatten()
    }

    /// The true time of the session.
    #[must_use]
    pub fn now(&self) -> LocalTime {
        self.now
    }

    /// The same session, not recorded: what it does leaves the original alone.
    #[cfg(feature = "testing")]
    #[must_use]
    pub fn fork(&self) -> Self
    where
        D: Clone,
    {
        let fork = |host: &VirtualHost<D>| VirtualHost {
            station: host.station.fork(),
            endpoint: host.endpoint.clone(),
            next_tick: host.next_tick,
            next_due: host.next_due,
        };
        Self {
            control: self.control,
            hosts: self.hosts.iter().map(fork).collect(),
            network: self.network.clone(),
            now: self.now,
            next_network: self.next_network,
        }
    }

    /// Runs until every host has done all ticks before `tick`; `observe` sees every tick. Gives up, and says so by
    /// `false`, when the hosts have not joined within ten virtual seconds.
    pub fn run_to_tick(&mut self, tick: u64, mut observe: impl FnMut(HostIndex, &TickRecord)) -> bool {
        loop {
            match self.next_tick() {
                Some(next) if next >= tick => return true,
                None if self.now.0 > 10_000_000_000 => return false,
                _ => self.run_next_instant(&mut observe),
            }
        }
    }

    /// Does everything that happens at the next instant at which anything happens.
    pub fn run_next_instant(&mut self, observe: &mut impl FnMut(HostIndex, &TickRecord)) {
        let next_due = self.hosts.iter().map(|host| host.next_due).min().unwrap_or(NEVER);
        self.now = LocalTime(next_due.min(self.next_network).max(self.now.0));
        if self.next_network <= self.now.0 {
            self.run_network();
        }
        if next_due <= self.now.0 {
            self.run_ticks(observe);
        }
    }

    fn run_ticks(&mut self, observe: &mut impl FnMut(HostIndex, &TickRecord)) {
        let due = self.now.0;
        let mut sent = false;
        for host in self.hosts.iter_mut().filter(|host| host.next_due <= due) {
            if let Some(packet) = host.station.begin(host.next_tick) {
                // A packet for a peer that is not there is not sent.
                sent |= host.endpoint.send_state_to_all(&packet).is_ok();
            }
        }
        if sent {
            self.run_network();
        }
        let mut answered = false;
        for host in self.hosts.iter_mut().filter(|host| host.next_due <= due) {
            let endpoint = &mut host.endpoint;
            host.station.respond(|client, packet| answered |= endpoint.send_state(packet, client).is_ok());
        }
        if answered {
            self.run_network();
        }
        for host in self.hosts.iter_mut().filter(|host| host.next_due <= due) {
            let index = host.station.model.host;
            observe(index, host.station.finish(Punctuality::default));
            host.next_tick += 1;
            host.schedule(self.control);
        }
    }

    /// Transmits and delivers until nothing more happens at this instant.
    fn run_network(&mut self) {
        loop {
            let transmitted = self.transmit();
            let delivered = self.deliver();
            if !transmitted && !delivered {
                break;
            }
        }
        let timeouts = self.hosts.iter().filter_map(|host| host.endpoint.poll_timeout()).map(|time| time.0);
        let arrival = self.network.next_delivery().map(|time| time.0);
        self.next_network = timeouts.chain(arrival).min().unwrap_or(NEVER);
    }

    fn transmit(&mut self) -> bool {
        let mut any = false;
        for host in &mut self.hosts {
            let end = self.network.end(host.station.model.host);
            if host.endpoint.poll_timeout().is_some_and(|due| due <= self.now) {
                host.endpoint.handle_timeout(self.now);
                any = true;
            }
            while let Some(transmit) = host.endpoint.poll_transmit() {
                any = true;
                // What is for nobody is lost.
                let _: io::Result<()> = end.send(self.now, transmit.to, &transmit.bytes);
            }
            host.take_events(self.control, end);
        }
        any
    }

    fn deliver(&mut self) -> bool {
        let mut buffer = [0; MAX_DATAGRAM];
        let mut any = false;
        // By sender and then by receiver, as recordings tell of it.
        for to in self.network.receivers(self.now) {
            let Ok(Some(arrival)) = self.network.end(to).receive(self.now, &mut buffer) else { continue };
            any = true;
            let host = &mut self.hosts[to.index()];
            host.endpoint.handle_datagram(arrival.at, arrival.from, &buffer[..arrival.length]);
            host.take_events(self.control, self.network.end(to));
        }
        any
    }
}

impl<D: Device> VirtualHost<D> {
    fn take_events(&mut self, control: Rate, end: VirtualEnd<'_>) {
        while let Some(event) = self.endpoint.poll_event() {
            match event {
                Event::State { from, packet, .. } => self.station.receive(from, &packet),
                Event::PeerJoined { host, .. } | Event::PeerReturned { host, .. } => {
                    self.station.set_present(host, true);
                }
                Event::PeerLeft { host, .. } | Event::PeerLost { host } | Event::Expelled { host, .. } => {
                    self.station.set_present(host, false);
                }
                Event::Started { at } => {
                    self.next_tick = control.first_tick_at(at);
                    self.schedule(control);
                    let clock = self.endpoint.clock();
                    clock.into_iter().for_each(|clock| end.set_session_origin(clock.local(SessionTime(0))));
                }
                _ => {}
            }
        }
    }

    /// The true time of the next tick, by this host's idea of the session's clock.
    fn schedule(&mut self, control: Rate) {
        self.next_due =
            self.endpoint.clock().map_or(NEVER, |clock| clock.local(control.instant(self.next_tick)).0);
    }
}
