//! One host's secured layer: who may talk to it, and through which channels.

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use cotouch_scene::time::LocalTime;

use super::channel::{Channel, Opened, Unopened};
use super::frame::{
    InitiationError, Kind, MAX_SEALED, Sealed, SealedTransmit, initiation, rejection, response,
    stamped_message,
};
use super::key::{KEY_BYTES, PublicKey};
use super::noise::{Call, KeyPair, Taken, TicketKeys, call, take_call};
use super::peer::{OpenCall, Peer};
use super::recent::RecentStamps;
use super::rejections::Rejections;
use super::ticket::{SECRET_BYTES, SessionKey};
use super::token_bucket::TokenBucket;
use crate::route::Route;
use crate::wire::{self, DatagramKind, PROTOCOL_VERSION, WireError};

/// Fills bytes with random ones that nobody can foretell, as the operating system's generator does.
pub type Entropy = Box<dyn FnMut(&mut [u8]) + Send>;

/// Most hosts that a node remembers; one more takes the place of the one that has been silent for longest.
const MAX_PEERS: usize = 64;
/// Most channels that wait for a caller's first datagram.
const MAX_UNCONFIRMED: usize = 64;
/// Of one caller: it repeats its call as often before an answer can be there.
const MAX_UNCONFIRMED_OF_ONE: usize = 8;
/// Calls of ticket holders that are taken: so many at once, and one more in so many ns. One costs five multiplications on the curve.
const TAKEN_CALLS: TokenBucket = TokenBucket::new(10_000_000, 256);
/// First messages of others that are answered.
const ANSWERED_STRANGERS: TokenBucket = TokenBucket::new(50_000_000, 20);
/// Datagrams that wait to be sent; more are dropped, as a socket would.
const MAX_TRANSMITS: usize = 256;

/// Why the host that was called does not take the call. Whoever sees a call on its way can make a node believe it, so it is
/// a hint, and another answer counts for more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unwelcome {
    /// Somebody else's ticket.
    #[error(
        "the ticket is not for this session: its server has ended or was started anew; ask for the ticket that it prints now"
    )]
    Ticket,
    /// Another version of the protocol.
    #[error(
        "the server speaks protocol version {server}, this program speaks version {PROTOCOL_VERSION}; install the same version of cotouch on both"
    )]
    Version {
        /// The version that the server speaks.
        server: u16,
    },
}

/// A channel whose caller has not shown yet that it has the keys.
#[derive(Debug)]
struct Unconfirmed {
    caller: PublicKey,
    sent: LocalTime,
    channel: Channel,
}

/// One host's secured layer.
pub struct SecureNode {
    keys: KeyPair,
    key: SessionKey,
    ticket: TicketKeys,
    entropy: Entropy,
    peers: Vec<Peer>,
    /// The oldest first.
    unconfirmed: ArrayVec<Unconfirmed, MAX_UNCONFIRMED>,
    taken_calls: TokenBucket,
    taken_stamps: RecentStamps,
    answered_strangers: TokenBucket,
    transmits: VecDeque<SealedTransmit>,
    unwelcome: Option<(Unwelcome, LocalTime)>,
    rejections: Rejections,
}

impl SecureNode {
    /// The node of a server: it draws a key pair, and the secret of its ticket.
    #[must_use]
    pub fn serve(mut entropy: Entropy) -> Self {
        let keys = KeyPair::new(draw(&mut entropy));
        let secret: [u8; SECRET_BYTES] = draw(&mut entropy);
        let key = SessionKey { server: keys.public, secret };
        Self::new(keys, key, entropy)
    }

    /// The node of a host that joins the session of `key`, whose server is reached at `address`.
    #[must_use]
    pub fn join(key: SessionKey, address: Route, mut entropy: Entropy, now: LocalTime) -> Self {
        let keys = KeyPair::new(draw(&mut entropy));
        let mut node = Self::new(keys, key, entropy);
        let mut server = Peer::new(key.server, now);
        server.address = Some(address);
        node.peers.push(server);
        node
    }

    fn new(keys: KeyPair, key: SessionKey, entropy: Entropy) -> Self {
        Self {
            keys,
            ticket: TicketKeys::new(&key.secret),
            key,
            entropy,
            peers: Vec::with_capacity(MAX_PEERS),
            unconfirmed: ArrayVec::new(),
            taken_calls: TAKEN_CALLS,
            taken_stamps: RecentStamps::new(),
            answered_strangers: ANSWERED_STRANGERS,
            transmits: VecDeque::new(),
            unwelcome: None,
            rejections: Rejections::default(),
        }
    }

    /// Who this host is, to others.
    #[must_use]
    pub fn route(&self) -> Route {
        self.keys.public.route()
    }

    /// What the ticket of this session proves.
    #[must_use]
    pub const fn session_key(&self) -> SessionKey {
        self.key
    }

    /// Calls the host with the key `to`, unless it is reached already; call again and again until it is.
    pub fn call(&mut self, now: LocalTime, to: Route) {
        if let Some(index) = self.peer_at(now, to) {
            self.peers[index].note_wanted(now);
            self.call_if_due(now, index);
        }
    }

    /// Whether there is a channel to the host with the key `to`.
    #[must_use]
    pub fn is_reached(&self, now: LocalTime, to: Route) -> bool {
        self.peers.iter().any(|peer| peer.route == to && peer.is_reached(now))
    }

    /// Where the host with the key `to` is reached, as the transport knows it.
    #[must_use]
    pub fn address_of(&self, to: Route) -> Option<Route> {
        self.peers.iter().find(|peer| peer.route == to)?.address
    }

    /// Seals a datagram of at most [`MAX_DATAGRAM`](crate::MAX_DATAGRAM) bytes for the host with the key `to` into `out`: where it goes, and how long it
    /// is. `None` when it is lost, there being no channel yet; the host is called then. Does not allocate where there is a channel.
    pub fn seal(
        &mut self,
        now: LocalTime,
        to: Route,
        datagram: &[u8],
        out: &mut [u8; MAX_SEALED],
    ) -> Option<(Route, usize)> {
        let index = self.peer_at(now, to)?;
        let peer = &mut self.peers[index];
        peer.note_wanted(now);
        let sealed = peer.seal(now, Kind::Datagram, datagram, out);
        self.call_if_due(now, index);
        sealed
    }

    /// Takes a datagram that came from `from`. Where it is a host's sealed datagram for the layer above, it is at the start of `out` then,
    /// and who sent it and how long it is are returned. Whatever the bytes are, this does not fail; what is rejected is counted.
    pub fn open(
        &mut self,
        now: LocalTime,
        from: Route,
        bytes: &[u8],
        out: &mut [u8; MAX_SEALED],
    ) -> Option<(Route, usize)> {
        if let Some(sealed) = Sealed::parse(bytes) {
            return self.open_sealed(now, from, &sealed, out);
        }
        match wire::open(bytes) {
            Ok((header, _)) if header.kind == DatagramKind::Initiation => {
                self.take_call(now, from, header.session, bytes);
            }
            Ok((header, body)) if header.kind == DatagramKind::Response => {
                self.take_answer(now, from, header.session, body);
            }
            Ok((header, _)) if header.kind == DatagramKind::Rejection => {
                self.note_unwelcome(now, header.session, Unwelcome::Ticket);
            }
            Err(WireError::Version { found, session, from_newcomer }) => {
                self.take_other_version(now, from, found, session, from_newcomer);
            }
            // The session's own datagrams come sealed or not at all.
            Ok(_) | Err(_) => self.rejections.foreign += 1,
        }
        None
    }

    /// The next datagram to send besides those that were sealed.
    pub fn poll_transmit(&mut self) -> Option<SealedTransmit> {
        self.transmits.pop_front()
    }

    /// When to call [`Self::handle_timeout`] at the latest; `None` while nothing is due.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<LocalTime> {
        self.peers.iter().filter_map(Peer::call_due).min()
    }

    /// Does what is due. Calling it early or twice does no harm.
    pub fn handle_timeout(&mut self, now: LocalTime) {
        for index in 0..self.peers.len() {
            self.call_if_due(now, index);
        }
    }

    /// Why the server does not take this host's calls, and since when it is known.
    #[must_use]
    pub const fn unwelcome(&self) -> Option<(Unwelcome, LocalTime)> {
        self.unwelcome
    }

    /// What was rejected so far.
    #[must_use]
    pub const fn rejections(&self) -> Rejections {
        self.rejections
    }

    fn is_server(&self) -> bool {
        self.key.server == self.keys.public
    }

    /// The place of the peer with the key that `route` stands for, made if need be.
    fn peer_at(&mut self, now: LocalTime, route: Route) -> Option<usize> {
        let known = self.peers.iter().position(|peer| peer.route == route);
        known.or_else(|| Some(self.peer_with(now, PublicKey::of(route)?)))
    }

    fn peer_with(&mut self, now: LocalTime, key: PublicKey) -> usize {
        if let Some(index) = self.peers.iter().position(|peer| peer.key == key) {
            return index;
        }
        if self.peers.len() < MAX_PEERS {
            self.peers.push(Peer::new(key, now));
            return self.peers.len() - 1;
        }
        let others = self.peers.iter().enumerate().filter(|(_, peer)| peer.key != self.key.server);
        let (silent, _) = others.min_by_key(|(_, peer)| peer.last_heard).expect("all but one are no servers");
        self.peers[silent] = Peer::new(key, now);
        silent
    }

    /// Calls a peer that is wanted and not reached, and asks the server where it is.
    fn call_if_due(&mut self, now: LocalTime, index: usize) {
        let peer = &mut self.peers[index];
        if peer.call_due().is_none_or(|due| now < due) {
            return;
        }
        peer.note_calling(now);
        let key = peer.key;
        if !self.is_server() && key != self.key.server {
            self.say(now, self.key.server, Kind::Whereabouts, &key.0);
        }
        self.make_call(now, index);
    }

    /// Sends a first message to where a peer is, if that is known.
    fn make_call(&mut self, now: LocalTime, index: usize) {
        let Some(address) = self.peers[index].address else { return };
        let number = u64::from_le_bytes(draw(&mut self.entropy));
        let channel = self.free_channel_number();
        let ephemeral = draw(&mut self.entropy);
        let other = self.peers[index].key;
        let (handshake, first) =
            call(&self.keys, &self.ticket, other, ephemeral, Call { sent: now, channel });
        self.peers[index].await_answer(OpenCall { number, channel, handshake });
        let bytes = initiation(number, &first, &mut self.ticket);
        self.transmit(address, &bytes);
    }

    fn take_call(&mut self, now: LocalTime, from: Route, number: u64, bytes: &[u8]) {
        let (message, stamp) = match stamped_message(bytes, &mut self.ticket) {
            Ok(stamped) => stamped,
            Err(InitiationError::Form) => {
                self.rejections.foreign += 1;
                return;
            }
            Err(InitiationError::WithoutTicket) => {
                self.rejections.without_ticket += 1;
                return self.turn_away(now, from, number);
            }
        };
        if self.taken_stamps.contains(&stamp) {
            self.rejections.repeated += 1;
            return;
        }
        if !self.taken_calls.take(now) {
            self.rejections.throttled += 1;
            return;
        }
        self.taken_stamps.remember(stamp);
        let channel = self.free_channel_number();
        let ephemeral = draw(&mut self.entropy);
        let taken = take_call(&self.keys, &self.ticket, ephemeral, message, channel);
        let Some(taken) = taken.filter(|taken| taken.caller != self.keys.public) else {
            self.rejections.forged += 1;
            return;
        };
        let known = self.peers.iter().find(|peer| peer.key == taken.caller);
        if known.and_then(|peer| peer.newest_call).is_some_and(|newest| taken.call.sent <= newest) {
            self.rejections.repeated += 1;
            return;
        }
        let answer = response(number, &taken.answer);
        self.await_confirmation(taken, channel);
        self.transmit(from, &answer);
    }

    /// Keeps a channel until its caller says something through it, at the cost of the oldest ones.
    fn await_confirmation(&mut self, taken: Taken, here: u32) {
        let Taken { caller, call, cipher, .. } = taken;
        let of_caller = |waiting: &Unconfirmed| waiting.caller == caller;
        let is_many = self.unconfirmed.iter().filter(|waiting| of_caller(waiting)).count();
        if is_many >= MAX_UNCONFIRMED_OF_ONE {
            let oldest = self.unconfirmed.iter().position(of_caller).expect("there are many");
            self.unconfirmed.remove(oldest);
        } else if self.unconfirmed.is_full() {
            self.unconfirmed.remove(0);
        }
        let channel = Channel::new(cipher, here, call.channel);
        self.unconfirmed.push(Unconfirmed { caller, sent: call.sent, channel });
    }

    fn take_answer(&mut self, now: LocalTime, from: Route, number: u64, answer: &[u8]) {
        let Some(index) = self.peers.iter().position(|peer| peer.has_called(number)) else {
            let is_late = self.peers.iter().any(|peer| peer.is_done_with(number));
            let Rejections { repeated, unknown, .. } = &mut self.rejections;
            *(if is_late { repeated } else { unknown }) += 1;
            return;
        };
        let peer = &mut self.peers[index];
        let Some(channel) = peer.take_answer(number, answer) else {
            self.rejections.forged += 1;
            return;
        };
        peer.add_channel(now, channel);
        peer.note_heard(now, from, true);
        let key = peer.key;
        if key == self.key.server {
            self.unwelcome = None;
        }
        self.say(now, key, Kind::Confirmation, &[]);
    }

    fn open_sealed(
        &mut self,
        now: LocalTime,
        from: Route,
        sealed: &Sealed<'_>,
        out: &mut [u8; MAX_SEALED],
    ) -> Option<(Route, usize)> {
        let (index, opened) = match self.open_in_channel(now, sealed, out) {
            Some(Ok(opened)) => opened,
            Some(Err(Unopened::Forged)) => {
                self.rejections.forged += 1;
                return None;
            }
            Some(Err(Unopened::Repeated)) => {
                self.rejections.repeated += 1;
                return None;
            }
            None => {
                self.rejections.unknown += 1;
                return None;
            }
        };
        let peer = &mut self.peers[index];
        peer.note_heard(now, from, opened.is_newest);
        let (key, route) = (peer.key, peer.route);
        let said = &out[..opened.length];
        match opened.kind {
            Kind::Datagram => return Some((route, opened.length)),
            Kind::Confirmation => {}
            Kind::Whereabouts => self.introduce(now, key, said),
            Kind::Introduction => self.take_introduction(now, key, said),
        }
        None
    }

    /// Opens a datagram in the channel that it names, which is confirmed by that; the place of the peer.
    fn open_in_channel(
        &mut self,
        now: LocalTime,
        sealed: &Sealed<'_>,
        out: &mut [u8; MAX_SEALED],
    ) -> Option<Result<(usize, Opened), Unopened>> {
        let is_named = |channel: &Channel| channel.here == sealed.channel;
        for (index, peer) in self.peers.iter_mut().enumerate() {
            if let Some(channel) = peer.channels.iter_mut().find(|channel| is_named(channel)) {
                return Some(channel.open(sealed, out).map(|opened| (index, opened)));
            }
        }
        let place = self.unconfirmed.iter().position(|waiting| is_named(&waiting.channel))?;
        let opened = self.unconfirmed[place].channel.open(sealed, out);
        Some(opened.map(|opened| (self.confirm(now, place), opened)))
    }

    /// The caller has shown that it has the keys: it is a peer from now on, whose place is returned.
    fn confirm(&mut self, now: LocalTime, place: usize) -> usize {
        let Unconfirmed { caller, sent, channel } = self.unconfirmed.remove(place);
        self.unconfirmed.retain(|waiting| waiting.caller != caller);
        let index = self.peer_with(now, caller);
        let peer = &mut self.peers[index];
        peer.newest_call = peer.newest_call.max(Some(sent));
        peer.add_channel(now, channel);
        index
    }

    /// As the server: tells two members where the other is. Both call then, so that routers in between let both through.
    fn introduce(&mut self, now: LocalTime, asker: PublicKey, wanted: &[u8]) {
        let Some(wanted) = wanted.try_into().ok().map(PublicKey).filter(|_| self.is_server()) else {
            self.rejections.forged += 1;
            return;
        };
        for (to, about) in [(asker, wanted), (wanted, asker)] {
            let known = self.peers.iter().find(|peer| peer.key == about);
            let Some(address) = known.and_then(|peer| peer.address) else { continue };
            let mut said = [0; MAX_SEALED];
            said[..KEY_BYTES].copy_from_slice(&about.0);
            let address = postcard::to_slice(&address, &mut said[KEY_BYTES..]);
            let length = address.expect("a route has at most 64 bytes and two").len();
            self.say(now, to, Kind::Introduction, &said[..KEY_BYTES + length]);
        }
    }

    /// From the server: where another member is.
    fn take_introduction(&mut self, now: LocalTime, by: PublicKey, said: &[u8]) {
        let read = said.split_first_chunk().and_then(|(&key, address)| {
            let (address, rest) = postcard::take_from_bytes::<Route>(address).ok()?;
            rest.is_empty().then_some((PublicKey(key), address))
        });
        let Some((key, address)) = read.filter(|_| by == self.key.server && !self.is_server()) else {
            self.rejections.forged += 1;
            return;
        };
        if key == by || key == self.keys.public {
            return;
        }
        let server = self.peers.iter().find(|peer| peer.key == by).and_then(|peer| peer.address);
        let address = server.map_or(address, |server| address.relayed_by(server));
        let index = self.peer_with(now, key);
        let peer = &mut self.peers[index];
        // What it said itself is newer than what is said of it.
        if !peer.is_reached(now) && peer.address != Some(address) {
            peer.address = Some(address);
            self.make_call(now, index);
        }
    }

    /// Says something of this layer's own to a peer that is reached.
    fn say(&mut self, now: LocalTime, to: PublicKey, kind: Kind, said: &[u8]) {
        let mut out = [0; MAX_SEALED];
        let peer = self.peers.iter_mut().find(|peer| peer.key == to);
        if let Some((to, length)) = peer.and_then(|peer| peer.seal(now, kind, said, &mut out)) {
            self.transmit(to, &out[..length]);
        }
    }

    fn take_other_version(
        &mut self,
        now: LocalTime,
        from: Route,
        found: u16,
        number: u64,
        from_newcomer: bool,
    ) {
        if from_newcomer {
            // It reads our version in the header, whatever follows.
            self.rejections.other_version += 1;
            self.turn_away(now, from, number);
        } else {
            self.note_unwelcome(now, number, Unwelcome::Version { server: found });
        }
    }

    /// Answers somebody who may not talk to this host: with less than was said, and at a bounded rate.
    fn turn_away(&mut self, now: LocalTime, to: Route, number: u64) {
        if self.answered_strangers.take(now) {
            self.transmit(to, &rejection(number));
        }
    }

    fn note_unwelcome(&mut self, now: LocalTime, number: u64, why: Unwelcome) {
        let server = self.peers.iter().find(|peer| peer.key == self.key.server);
        if server.is_some_and(|server| server.has_called(number)) {
            self.unwelcome.get_or_insert((why, now));
        } else {
            self.rejections.unknown += 1;
        }
    }

    /// A number by which no channel is named here.
    fn free_channel_number(&mut self) -> u32 {
        loop {
            let number = u32::from_le_bytes(draw(&mut self.entropy));
            let confirmed = self.peers.iter().flat_map(|peer| &peer.channels);
            let waiting = self.unconfirmed.iter().map(|waiting| &waiting.channel);
            if confirmed.chain(waiting).all(|channel| channel.here != number) {
                return number;
            }
        }
    }

    fn transmit(&mut self, to: Route, bytes: &[u8]) {
        if self.transmits.len() < MAX_TRANSMITS {
            self.transmits.push_back(SealedTransmit { to, bytes: bytes.iter().copied().collect() });
        }
    }
}

fn draw<const N: usize>(entropy: &mut Entropy) -> [u8; N] {
    let mut bytes = [0; N];
    entropy(&mut bytes);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64Mcg;
    use std::net::SocketAddr;

    fn entropy(seed: u64) -> Entropy {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        Box::new(move |bytes: &mut [u8]| random.fill(bytes))
    }

    fn address(number: usize) -> Route {
        SocketAddr::from(([192, 0, 2, number as u8], 1)).into()
    }

    /// A server and two members, all of whom have reached each other at one instant.
    struct Trio {
        nodes: Vec<SecureNode>,
        now: LocalTime,
    }

    impl Trio {
        fn new() -> Self {
            let now = LocalTime(0);
            let mut nodes = vec![SecureNode::serve(entropy(0))];
            let key = nodes[0].session_key();
            nodes.extend([1, 2].map(|seed| SecureNode::join(key, address(0), entropy(seed), now)));
            let mut trio = Self { nodes, now };
            let [server, first, second] = [0, 1, 2].map(|node: usize| trio.nodes[node].route());
            for (node, to) in [(1, server), (2, server), (1, second), (2, first)] {
                trio.nodes[node].call(now, to);
                trio.deliver();
            }
            assert!(trio.nodes[1].is_reached(now, second) && trio.nodes[2].is_reached(now, first));
            trio
        }

        fn deliver(&mut self) {
            for _ in 0..6 {
                for from in 0..self.nodes.len() {
                    while let Some(transmit) = self.nodes[from].poll_transmit() {
                        let to = (0..self.nodes.len()).find(|&to| address(to) == transmit.to);
                        let Some(to) = to else { continue };
                        self.nodes[to].open(self.now, address(from), &transmit.bytes, &mut [0; MAX_SEALED]);
                    }
                }
            }
        }

        /// Has a node say something of the layer's own, and returns how much the receiver rejected of it.
        fn say(&mut self, from: usize, to: usize, kind: Kind, said: &[u8]) -> u64 {
            let before = self.nodes[to].rejections();
            let key = self.nodes[to].keys.public;
            self.nodes[from].say(self.now, key, kind, said);
            self.deliver();
            self.nodes[to].rejections().total() - before.total()
        }
    }

    fn introduction(key: PublicKey, address: &Route) -> Vec<u8> {
        [key.0.to_vec(), postcard::to_allocvec(address).unwrap()].concat()
    }

    #[test]
    fn only_the_server_says_where_others_are() {
        let mut trio = Trio::new();
        let (server, second) = (trio.nodes[0].keys.public, trio.nodes[2].keys.public);
        let elsewhere = address(99);
        for about in [server, second, PublicKey([9; KEY_BYTES])] {
            let said = introduction(about, &elsewhere);
            assert_eq!(trio.say(2, 1, Kind::Introduction, &said), 1, "a member introduces nobody");
            assert_eq!(trio.say(2, 0, Kind::Introduction, &said), 1);
        }
        assert_eq!(trio.say(2, 1, Kind::Whereabouts, &server.0), 1, "and is not asked");
        // The server's word does not take a peer from where it was heard, and what it says must read.
        assert_eq!(trio.say(0, 1, Kind::Introduction, &introduction(second, &elsewhere)), 0);
        assert_eq!(trio.nodes[1].address_of(second.route()), Some(address(2)));
        let whole = introduction(PublicKey([9; KEY_BYTES]), &elsewhere);
        for length in 0..whole.len() {
            assert_eq!(trio.say(0, 1, Kind::Introduction, &whole[..length]), 1, "{length}");
        }
        assert_eq!(trio.say(0, 1, Kind::Introduction, &[&whole[..], &[0]].concat()), 1);
        for said in [&[][..], &[1; KEY_BYTES - 1], &[1; KEY_BYTES + 1]] {
            assert_eq!(trio.say(2, 0, Kind::Whereabouts, said), 1);
        }
    }

    #[test]
    fn the_newest_first_message_of_a_member_is_the_only_one_that_counts() {
        let mut trio = Trio::new();
        let now = trio.now;
        let (key, server) = (trio.nodes[0].session_key(), trio.nodes[0].route());
        // As one that has forgotten its channel would: the same keys, a later call.
        let mut again = SecureNode::join(key, address(0), entropy(1), now.plus_ns(5));
        assert_eq!(again.route(), trio.nodes[1].route());
        again.call(now.plus_ns(5), server);
        let call = again.poll_transmit().unwrap();
        let mut out = [0; MAX_SEALED];
        trio.nodes[0].open(now, address(1), &call.bytes, &mut out);
        let answer = trio.nodes[0].poll_transmit().expect("an answer");
        again.open(now, address(0), &answer.bytes, &mut out);
        let confirmation = again.poll_transmit().unwrap();
        trio.nodes[0].open(now, address(1), &confirmation.bytes, &mut out);
        // The same first message again is known, and so is another one of the same host that is not newer.
        trio.nodes[0].open(now, address(1), &call.bytes, &mut out);
        let (mut first, mut others) = (Some(entropy(1)), entropy(50));
        let random = move |bytes: &mut [u8]| match &mut first.take() {
            Some(same) => same(bytes),
            None => others(bytes),
        };
        let mut older = SecureNode::join(key, address(0), Box::new(random), now);
        assert_eq!(older.route(), again.route());
        for sent_ns in [0, 4, 5] {
            older.make_call(now.plus_ns(sent_ns), 0);
            let call = older.poll_transmit().unwrap();
            trio.nodes[0].open(now, address(1), &call.bytes, &mut out);
        }
        assert!(trio.nodes[0].poll_transmit().is_none());
        assert_eq!(trio.nodes[0].rejections(), Rejections { repeated: 4, ..Rejections::default() });
        assert!(trio.nodes[0].unconfirmed.is_empty());
        older.make_call(now.plus_ns(6), 0);
        let call = older.poll_transmit().unwrap();
        trio.nodes[0].open(now, address(1), &call.bytes, &mut out);
        assert!(trio.nodes[0].poll_transmit().is_some());
    }
}
