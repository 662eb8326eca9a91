//! A network of endpoints on one virtual clock: every host has a clock of its own that is off and drifts, and every ordered
//! pair of hosts a simulated link.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use cotouch_net::{
    Config, Endpoint, Entry, Event, Presence, Route, SimulatedLink, StartWhen, StatePacket, Transmit,
};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment, PlayOut};
use cotouch_scene::time::{LocalTime, Rate, SessionTime};
use glam::DVec3;

pub(crate) const MS: i64 = 1_000_000;
pub(crate) const S: i64 = 1_000_000_000;

pub(crate) fn config(users: u8, architecture: Architecture, seed: u64) -> Config {
    Config {
        scene_hash: 0x5ce4e,
        scene_text: "name = \"test\"\n".repeat(200),
        control_hz: "1024".parse().unwrap(),
        network_hz: "128".parse().unwrap(),
        names: (1..=users).map(|user| format!("user{user}")).collect(),
        architecture,
        play_out: PlayOut::Scheduled,
        play_out_periods: vec![1; usize::from(users)],
        peer_timeout_ns: 4 * S,
        user: None,
        start: StartWhen::Hosts(users),
        start_delay_ns: 500 * MS,
        join_timeout_ns: 30 * S,
        seed,
    }
}

pub(crate) struct Node {
    pub(crate) endpoint: Endpoint,
    pub(crate) route: Route,
    pub(crate) alive: bool,
    /// Whether it sends a state every network step once started.
    pub(crate) samples: bool,
    /// With the true time.
    pub(crate) events: Vec<(i64, Event)>,
    /// True time at which each network step was sampled.
    pub(crate) sampled: Vec<(u64, i64)>,
    offset: i64,
    drift: f64,
    next_step: Option<u64>,
}

impl Node {
    pub(crate) fn local(&self, truth: i64) -> LocalTime {
        LocalTime(self.offset + truth + (truth as f64 * self.drift).round() as i64)
    }

    /// The first true time at which the local clock shows `local` or later.
    fn truth(&self, local: LocalTime) -> i64 {
        let wanted = local.0.saturating_sub(self.offset);
        let mut truth = (wanted as f64 / (1.0 + self.drift)) as i64 - 2;
        while self.local(truth) < local && truth < i64::MAX / 4 {
            truth += 1;
        }
        truth
    }

    pub(crate) fn has(&self, wanted: impl Fn(&Event) -> bool) -> bool {
        self.events.iter().any(|(_, event)| wanted(event))
    }

    pub(crate) fn count(&self, wanted: impl Fn(&Event) -> bool) -> usize {
        self.events.iter().filter(|(_, event)| wanted(event)).count()
    }

    pub(crate) fn started(&self) -> Option<SessionTime> {
        self.events.iter().find_map(|(_, event)| match event {
            Event::Started { at } => Some(*at),
            _ => None,
        })
    }

    pub(crate) fn present(&self) -> usize {
        self.endpoint.peers().filter(|peer| peer.presence == Presence::Present).count()
    }

    /// All but states, for comparison and display.
    pub(crate) fn story(&self) -> Vec<String> {
        let told = self.events.iter().filter(|(_, event)| !matches!(event, Event::State { .. }));
        told.map(|(at, event)| format!("{} ms {event:?}", at / MS)).collect()
    }

    /// Session time by this node's map minus that by the server's clock, and the stated bound, ns.
    pub(crate) fn clock_error(&self, truth: i64, origin_truth: i64) -> Option<(i64, i64)> {
        let map = self.endpoint.clock()?;
        let local = self.local(truth);
        Some((map.session(local).0 - (truth - origin_truth), map.error_bound_ns(local)))
    }
}

pub(crate) struct Net {
    /// True time; the server's clock runs exactly with it.
    pub(crate) now: i64,
    pub(crate) nodes: Vec<Node>,
    pub(crate) impairment: Impairment,
    /// Ways on which nothing passes.
    pub(crate) cut: Vec<(usize, usize)>,
    links: BTreeMap<(usize, usize), SimulatedLink>,
    seed: u64,
    rate: Rate,
}

impl Net {
    pub(crate) fn new(server: Config, impairment: Impairment, seed: u64) -> Self {
        let rate = server.network_hz;
        let mut net =
            Self { now: 0, nodes: vec![], impairment, cut: vec![], links: BTreeMap::new(), seed, rate };
        let endpoint = Endpoint::serve(server, LocalTime(7_000 * S));
        net.add(endpoint, 7_000 * S, 0.0);
        net
    }

    /// A server and `users − 1` newcomers with clocks that are off and drift.
    pub(crate) fn full(users: u8, architecture: Architecture, impairment: Impairment, seed: u64) -> Self {
        let mut net = Self::new(config(users, architecture, seed), impairment, seed);
        for user in 1..users {
            net.join(config(users, architecture, seed + u64::from(user)));
        }
        net
    }

    pub(crate) fn join(&mut self, config: Config) -> usize {
        let index = self.nodes.len() as i64;
        let offset = (index * 977 - 3000) * S + index * 123_456_789;
        let drift = [90e-6, -90e-6, 30e-6, 0.0][index as usize % 4];
        let local = LocalTime(offset + self.now + (self.now as f64 * drift).round() as i64);
        let endpoint = Endpoint::join(config, self.nodes[0].route, local);
        self.add(endpoint, offset, drift)
    }

    fn add(&mut self, endpoint: Endpoint, offset: i64, drift: f64) -> usize {
        let index = self.nodes.len();
        let address = SocketAddr::from(([10, 0, (index >> 8) as u8, index as u8], 7700));
        self.nodes.push(Node {
            endpoint,
            route: address.into(),
            alive: true,
            samples: true,
            events: vec![],
            sampled: vec![],
            offset,
            drift,
            next_step: None,
        });
        index
    }

    pub(crate) fn kill(&mut self, node: usize) {
        self.nodes[node].alive = false;
    }

    pub(crate) fn leave(&mut self, node: usize, reason: &str) {
        let now = self.nodes[node].local(self.now);
        self.nodes[node].endpoint.leave(now, reason);
    }

    /// Hands in a datagram as if it came from `from`, and returns what is sent in answer at once.
    pub(crate) fn inject(&mut self, node: usize, from: Route, bytes: &[u8]) -> Vec<Transmit> {
        let now = self.nodes[node].local(self.now);
        let endpoint = &mut self.nodes[node].endpoint;
        endpoint.handle_datagram(now, from, bytes);
        std::iter::from_fn(|| endpoint.poll_transmit()).collect()
    }

    pub(crate) fn run_for(&mut self, duration: i64) {
        let end = self.now + duration;
        loop {
            self.step();
            match self.next_instant() {
                Some(next) if next <= end => self.now = next.max(self.now),
                _ => break,
            }
        }
        self.now = end;
    }

    /// All that happens at the present instant.
    fn step(&mut self) {
        loop {
            let mut busy = false;
            for index in 0..self.nodes.len() {
                self.sample(index);
                busy |= self.transmit(index);
            }
            busy |= self.deliver();
            if !busy {
                return;
            }
        }
    }

    fn sample(&mut self, index: usize) {
        let now = self.now;
        let node = &mut self.nodes[index];
        let local = node.local(now);
        if !node.alive {
            return;
        }
        if node.endpoint.poll_timeout().is_some_and(|due| due <= local) {
            node.endpoint.handle_timeout(local);
        }
        while let Some(step) = node.next_step.filter(|_| node.samples) {
            let Some(clock) = node.endpoint.clock() else { break };
            if clock.local(self.rate.instant(step)) > local {
                break;
            }
            node.sampled.push((step, now));
            node.next_step = Some(step + 1);
            let _ = node.endpoint.send_state_to_all(&packet(step, index));
        }
        while let Some(event) = node.endpoint.poll_event() {
            if let Event::Started { at } = event {
                node.next_step = Some((at.0 as u64 * 128).div_ceil(S as u64));
            }
            node.events.push((now, event));
        }
    }

    fn transmit(&mut self, index: usize) -> bool {
        let mut busy = false;
        while let Some(Transmit { to, bytes }) = self.nodes[index].endpoint.poll_transmit() {
            busy = true;
            let target = self.nodes.iter().position(|node| node.route == to);
            let Some(target) = target.filter(|_| self.nodes[index].alive) else { continue };
            if self.cut.contains(&(index, target)) {
                continue;
            }
            let way = (index, target);
            let new = || {
                SimulatedLink::new(
                    &self.impairment,
                    self.seed,
                    HostIndex(index as u8),
                    HostIndex(target as u8),
                )
            };
            self.links.entry(way).or_insert_with(new).send(self.now, &bytes);
        }
        busy
    }

    fn deliver(&mut self) -> bool {
        let mut busy = false;
        for (&(from, to), link) in &mut self.links {
            while let Some((_, bytes)) = link.poll_delivery(self.now) {
                busy = true;
                let from = self.nodes[from].route;
                let node = &mut self.nodes[to];
                if node.alive {
                    let local = node.local(self.now);
                    node.endpoint.handle_datagram(local, from, bytes);
                }
            }
        }
        busy
    }

    fn next_instant(&self) -> Option<i64> {
        let deliveries = self.links.values().filter_map(SimulatedLink::next_delivery);
        let alive = self.nodes.iter().filter(|node| node.alive);
        let timers = alive.flat_map(|node| {
            let sampling = node
                .next_step
                .filter(|_| node.samples)
                .and_then(|step| Some(node.endpoint.clock()?.local(self.rate.instant(step))));
            let timeout = node.endpoint.poll_timeout().filter(|due| due.0 < i64::MAX / 4);
            [timeout, sampling].into_iter().flatten().map(|local| node.truth(local))
        });
        deliveries.chain(timers).min()
    }

    /// True time of tick 0.
    pub(crate) fn origin(&self) -> Option<i64> {
        let clock = self.nodes[0].endpoint.clock()?;
        Some(self.nodes[0].truth(clock.local(SessionTime(0))))
    }
}

pub(crate) fn route(address: &str) -> Route {
    address.parse::<SocketAddr>().unwrap().into()
}

/// A state that tells who sent it and when.
pub(crate) fn packet(step: u64, sender: usize) -> StatePacket {
    let pose = Pose::at(DVec3::new(step as f64, sender as f64, 0.1));
    let entry = Entry::Hand { point: sender as u8, pose, twist: Twist::default() };
    StatePacket { step, entries: [entry].into_iter().collect() }
}
