//! A network of endpoints on one virtual clock: every host has a clock of its own that is off and drifts, and every ordered
//! pair of hosts a simulated link.

use std::collections::BTreeMap;
use std::net::SocketAddr;

use cotouch_net::{
    Config, Endpoint, Entropy, Entry, Event, MAX_SEALED, Presence, Route, SecureNode, SessionKey,
    SimulatedLink, StartWhen, StatePacket, Transmit,
};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment, PlayOut};
use cotouch_scene::time::{LocalTime, Rate, SessionTime};
use glam::DVec3;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

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
        plausibility: None,
        user: None,
        start: StartWhen::Hosts(users),
        start_delay_ns: 500 * MS,
        join_timeout_ns: 30 * S,
        routes_are_proven: false,
        seed,
    }
}

pub(crate) struct Node {
    pub(crate) endpoint: Endpoint,
    /// Who it is to the session: its key where it is secured, else its address.
    pub(crate) route: Route,
    /// Where it is.
    pub(crate) address: Route,
    pub(crate) secure: Option<SecureNode>,
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

    /// What goes to the network at this instant, and to which address.
    fn outgoing(&mut self, truth: i64) -> Vec<(Route, Vec<u8>)> {
        let local = self.local(truth);
        let mut outgoing = Vec::new();
        while let Some(Transmit { to, bytes }) = self.endpoint.poll_transmit() {
            let Some(secure) = &mut self.secure else {
                outgoing.push((to, bytes.to_vec()));
                continue;
            };
            let mut out = [0; MAX_SEALED];
            if let Some((to, length)) = secure.seal(local, to, &bytes, &mut out) {
                outgoing.push((to, out[..length].to_vec()));
            }
        }
        let own = self.secure.iter_mut().flat_map(|secure| std::iter::from_fn(|| secure.poll_transmit()));
        outgoing.extend(own.map(|transmit| (transmit.to, transmit.bytes.to_vec())));
        outgoing
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
    /// What was sent, from where and to whom, while it is kept.
    pub(crate) tape: Option<Vec<(Route, usize, Vec<u8>)>>,
    links: BTreeMap<(usize, usize), SimulatedLink>,
    seed: u64,
    rate: Rate,
}

impl Net {
    pub(crate) fn new(server: Config, impairment: Impairment, seed: u64) -> Self {
        Self::with(server, impairment, seed, None)
    }

    /// A network whose nodes are secured.
    pub(crate) fn secured(mut server: Config, impairment: Impairment, seed: u64) -> Self {
        server.routes_are_proven = true;
        Self::with(server, impairment, seed, Some(SecureNode::serve(entropy(seed))))
    }

    fn with(server: Config, impairment: Impairment, seed: u64, secure: Option<SecureNode>) -> Self {
        let (rate, links) = (server.network_hz, BTreeMap::new());
        let mut net = Self { now: 0, nodes: vec![], impairment, cut: vec![], tape: None, links, seed, rate };
        let endpoint = Endpoint::serve(server, LocalTime(7_000 * S));
        net.add(endpoint, secure, 7_000 * S, 0.0);
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

    /// As [`Self::full`], with secured nodes.
    pub(crate) fn full_secured(
        users: u8,
        architecture: Architecture,
        impairment: Impairment,
        seed: u64,
    ) -> Self {
        let mut net = Self::secured(config(users, architecture, seed), impairment, seed);
        for user in 1..users {
            net.join(config(users, architecture, seed + u64::from(user)));
        }
        net
    }

    /// The key to the session.
    pub(crate) fn key(&self) -> SessionKey {
        self.nodes[0].secure.as_ref().expect("a secured network").session_key()
    }

    pub(crate) fn join(&mut self, config: Config) -> usize {
        let key = self.nodes[0].secure.as_ref().map(SecureNode::session_key);
        self.join_with(config, key)
    }

    /// A newcomer with this key.
    pub(crate) fn join_with(&mut self, config: Config, key: Option<SessionKey>) -> usize {
        let index = self.nodes.len() as i64;
        let offset = (index * 977 - 3000) * S + index * 123_456_789;
        let drift = [90e-6, -90e-6, 30e-6, 0.0][index as usize % 4];
        let local = LocalTime(offset + self.now + (self.now as f64 * drift).round() as i64);
        let random = entropy(config.seed);
        let secure = key.map(|key| SecureNode::join(key, self.nodes[0].address, random, local));
        let endpoint = Endpoint::join(config, key.map_or(self.nodes[0].route, SessionKey::server), local);
        self.add(endpoint, secure, offset, drift)
    }

    fn add(&mut self, endpoint: Endpoint, secure: Option<SecureNode>, offset: i64, drift: f64) -> usize {
        let index = self.nodes.len();
        let address = SocketAddr::from(([10, 0, (index >> 8) as u8, index as u8], 7700)).into();
        self.nodes.push(Node {
            endpoint,
            route: secure.as_ref().map_or(address, SecureNode::route),
            address,
            secure,
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

    /// Hands a datagram to a node as if it came from the address `from`.
    pub(crate) fn receive(&mut self, node: usize, from: Route, bytes: &[u8]) {
        let local = self.nodes[node].local(self.now);
        let Node { endpoint, secure, .. } = &mut self.nodes[node];
        let Some(secure) = secure else { return endpoint.handle_datagram(local, from, bytes) };
        let mut out = [0; MAX_SEALED];
        if let Some((from, length)) = secure.open(local, from, bytes, &mut out) {
            endpoint.handle_datagram(local, from, &out[..length]);
        }
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
        node.secure.iter_mut().for_each(|secure| secure.handle_timeout(local));
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
        let outgoing = self.nodes[index].outgoing(self.now);
        for (to, bytes) in &outgoing {
            let target = self.nodes.iter().position(|node| node.address == *to);
            let Some(target) = target.filter(|_| self.nodes[index].alive) else { continue };
            if let Some(tape) = &mut self.tape {
                tape.push((self.nodes[index].address, target, bytes.clone()));
            }
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
            self.links.entry(way).or_insert_with(new).send(self.now, bytes);
        }
        !outgoing.is_empty()
    }

    fn deliver(&mut self) -> bool {
        let ways: Vec<_> = self.links.keys().copied().collect();
        let mut busy = false;
        for (from, to) in ways {
            while let Some((_, bytes)) = self.links.get_mut(&(from, to)).unwrap().poll_delivery(self.now) {
                let bytes = bytes.to_vec();
                busy = true;
                if self.nodes[to].alive {
                    self.receive(to, self.nodes[from].address, &bytes);
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
            let call = node.secure.as_ref().and_then(SecureNode::poll_timeout);
            [timeout, sampling, call].into_iter().flatten().map(|local| node.truth(local))
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

/// Random bytes of a seed, for tests to be repeated.
pub(crate) fn entropy(seed: u64) -> Entropy {
    let mut random = Pcg64Mcg::seed_from_u64(seed ^ 0x5ec2e7);
    Box::new(move |bytes: &mut [u8]| random.fill(bytes))
}

/// A state that tells who sent it and when.
pub(crate) fn packet(step: u64, sender: usize) -> StatePacket {
    let pose = Pose::at(DVec3::new(step as f64, sender as f64, 0.1));
    let entry = Entry::Hand { point: sender as u8, pose, twist: Twist::default() };
    StatePacket { step, entries: [entry].into_iter().collect() }
}
