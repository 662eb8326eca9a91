//! Threads around the protocol of one host.
//!
//! Two threads share the endpoint and a [transport](crate::transport): one waits for what arrives and takes it in; the other
//! sends what the haptic thread leaves for it, and keeps the timers of the protocol and the transport. Datagrams are sealed and opened in these
//! threads, before the protocol's lock is taken where they come in. The haptic thread never locks: it meets them at bounded queues and a latest-value exchange ([`HapticPort`]).

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

use cotouch_net::{ClockMap, Endpoint, Event, Rejections, StatePacket, printable};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::{LocalTime, SessionTime};

use crate::clock;
use crate::failures::{Failures, spawn_essential};
use crate::priority::{HELPER_STACK_BYTES, raise_network_thread};
use crate::transport::{MAX_WAIT, Secured, Transport as _};

/// State packets that may wait for the haptic thread, and for the sender.
const QUEUE: usize = 256;
/// After a failed receive, the next one waits so long.
const AFTER_A_FAILURE: Duration = Duration::from_millis(1);
/// News that wait to be taken.
const MAX_NEWS: usize = 64;

/// What the network tells the haptic thread.
#[expect(clippy::large_enum_variant, reason = "nearly all are states, and a box would be an allocation")]
#[derive(Clone, Debug)]
pub enum Inbound {
    /// A state packet arrived.
    State {
        /// The sender.
        from: HostIndex,
        /// What it said.
        packet: StatePacket,
    },
    /// A peer came or went.
    Presence {
        /// Which.
        peer: HostIndex,
        /// Whether it is there now.
        present: bool,
    },
}

/// What the haptic thread leaves for the network.
#[derive(Clone, Debug)]
pub struct Outbound {
    /// The receiver; `None` means every peer.
    pub to: Option<HostIndex>,
    /// What to say.
    pub packet: StatePacket,
}

/// The haptic thread's ends of the exchange with one host's network threads.
pub struct HapticPort {
    inbound: rtrb::Consumer<Inbound>,
    outbound: rtrb::Producer<Outbound>,
    clock: triple_buffer::Output<Option<ClockMap>>,
    sender: Thread,
    unsent: bool,
}

impl HapticPort {
    /// The next thing that the network has to tell. No lock, no allocation.
    pub fn take_inbound(&mut self) -> Option<Inbound> {
        self.inbound.pop().ok()
    }

    /// Leaves a packet for the sender; it goes out after [`HapticPort::wake_sender`]. No lock, no allocation. When the
    /// sender is so late that the queue is full, the packet is dropped, as a network would.
    pub fn leave(&mut self, to: Option<HostIndex>, packet: StatePacket) {
        self.unsent |= self.outbound.push(Outbound { to, packet }).is_ok();
    }

    /// Wakes the sender if something was left for it. A system call: not within a tick.
    pub fn wake_sender(&mut self) {
        if std::mem::take(&mut self.unsent) {
            self.sender.unpark();
        }
    }

    /// How local time maps to session time; `None` until the session has started.
    pub fn clock(&mut self) -> Option<ClockMap> {
        *self.clock.read()
    }
}

/// The network threads of one host.
pub struct NetworkThreads {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    sender: Thread,
}

struct Shared {
    transport: Secured,
    protocol: Mutex<Protocol>,
    stop: AtomicBool,
    dropped_inbound: AtomicU64,
}

struct Protocol {
    endpoint: Endpoint,
    inbound: rtrb::Producer<Inbound>,
    /// Comings and goings that did not fit into the queue; unlike a state they must not get lost.
    pending: VecDeque<Inbound>,
    clock: triple_buffer::Input<Option<ClockMap>>,
    refusal: Option<String>,
    joined: bool,
    /// What a person wants to know, in words; the oldest go first when nobody takes them.
    news: VecDeque<String>,
    failures: Failures,
}

impl NetworkThreads {
    /// Starts the threads of a host whose `endpoint` speaks through `transport`; `name` is for debuggers. `failures` is told when one
    /// of them panics, and that the session is to end.
    ///
    /// # Errors
    /// When a thread cannot be started.
    pub fn start(
        transport: Secured,
        endpoint: Endpoint,
        name: &str,
        failures: &Failures,
    ) -> io::Result<(Self, HapticPort)> {
        let (inbound_in, inbound_out) = rtrb::RingBuffer::new(QUEUE);
        let (outbound_in, outbound_out) = rtrb::RingBuffer::new(QUEUE);
        let (clock_in, clock_out) = triple_buffer::triple_buffer(&None);
        let protocol = Protocol {
            endpoint,
            inbound: inbound_in,
            pending: VecDeque::new(),
            clock: clock_in,
            refusal: None,
            joined: false,
            news: VecDeque::new(),
            failures: failures.clone(),
        };
        let shared = Arc::new(Shared {
            transport,
            protocol: Mutex::new(protocol),
            stop: AtomicBool::new(false),
            dropped_inbound: AtomicU64::new(0),
        });
        let send = move |shared: &Shared| shared.send_loop(outbound_out);
        let sender = spawn(&format!("{name} send"), "sends", &shared, failures, send)?;
        let receive = |shared: &Shared| shared.receive_loop();
        let receiver = spawn(&format!("{name} recv"), "receives", &shared, failures, receive)?;
        let sender_thread = sender.thread().clone();
        let port = HapticPort {
            inbound: inbound_out,
            outbound: outbound_in,
            clock: clock_out,
            sender: sender_thread.clone(),
            unsent: false,
        };
        Ok((Self { shared, threads: vec![receiver, sender], sender: sender_thread }, port))
    }

    /// Looks at the protocol, or asks something of it. Never called from the haptic thread.
    pub fn with_endpoint<R>(&self, act: impl FnOnce(&mut Endpoint) -> R) -> R {
        let result = act(&mut self.shared.lock().endpoint);
        self.sender.unpark();
        result
    }

    /// Why the session did not take this host in, if it did not.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        self.shared.lock().refusal.clone()
    }

    /// What has happened since the last call that a person wants to know, in words.
    #[must_use]
    pub fn take_news(&self) -> Vec<String> {
        self.shared.lock().news.drain(..).collect()
    }

    /// Whether the session has taken this host in.
    #[must_use]
    pub fn has_joined(&self) -> bool {
        self.shared.lock().joined
    }

    /// From now on every way out of `from`, which is this host, is impaired so; packets on their way arrive as they would
    /// have. `seed` is for a host whose ways were not impaired before.
    pub fn impair(&self, impairment: &Impairment, seed: u64, from: HostIndex) {
        self.shared.transport.impair(impairment, seed, from);
        self.sender.unpark();
    }

    /// Datagrams that were rejected before the protocol saw them.
    #[must_use]
    pub fn rejections(&self) -> Rejections {
        self.shared.transport.rejections()
    }

    /// How many bytes of datagrams the system keeps until they are received, where it says so.
    #[must_use]
    pub fn receive_buffer_bytes(&self) -> Option<usize> {
        self.shared.transport.receive_buffer_bytes()
    }

    /// State packets that the haptic thread was too late to take.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.shared.dropped_inbound.load(Ordering::Relaxed)
    }

    /// Says goodbye to the peers, waits a moment for their answer, and ends the threads. It is said even where the threads have
    /// failed.
    pub fn leave(mut self, reason: &str) -> Endpoint {
        self.shared.leave(reason);
        for _ in 0..20 {
            if self.with_endpoint(|endpoint| endpoint.is_closed()) {
                break;
            }
            thread::sleep(Duration::from_millis(10));
        }
        self.stop();
        self.shared.lock().endpoint.clone()
    }

    fn stop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.sender.unpark();
        for thread in self.threads.drain(..) {
            // A panic was caught and told by the thread itself.
            let _: thread::Result<()> = thread.join();
        }
    }
}

impl Drop for NetworkThreads {
    fn drop(&mut self) {
        self.stop();
    }
}

fn spawn(
    name: &str,
    does: &str,
    shared: &Arc<Shared>,
    failures: &Failures,
    body: impl FnOnce(&Shared) + Send + 'static,
) -> io::Result<JoinHandle<()>> {
    let shared = Arc::clone(shared);
    let thread = thread::Builder::new().name(name.to_owned()).stack_size(HELPER_STACK_BYTES);
    spawn_essential(thread, format!("the thread that {does} packets"), failures.clone(), move || {
        raise_network_thread();
        body(&shared);
    })
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Protocol> {
        self.protocol.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn leave(&self, reason: &str) {
        let now = clock::now();
        let mut protocol = self.lock();
        protocol.endpoint.leave(now, reason);
        self.pump(&mut protocol, now);
    }

    fn receive_loop(&self) {
        let mut datagram = [0; 2048];
        while !self.stop.load(Ordering::Relaxed) {
            // That nothing came is the chance to see a stop.
            let arrival = match self.transport.receive(clock::now(), &mut datagram) {
                Ok(Some(arrival)) => arrival,
                Ok(None) => continue,
                // A transport that fails at once, again and again, must not keep the processor at this priority.
                Err(_) => {
                    thread::sleep(AFTER_A_FAILURE);
                    continue;
                }
            };
            let mut protocol = self.lock();
            protocol.endpoint.handle_datagram(arrival.at, arrival.from, &datagram[..arrival.length]);
            self.pump(&mut protocol, arrival.at);
        }
    }

    fn send_loop(&self, mut outbound: rtrb::Consumer<Outbound>) {
        while !self.stop.load(Ordering::Relaxed) {
            let now = clock::now();
            let wake = {
                let mut protocol = self.lock();
                while let Ok(Outbound { to, packet }) = outbound.pop() {
                    // To a peer that has just gone, nothing is sent; that is all there is to do about it.
                    let _ = match to {
                        None => protocol.endpoint.send_state_to_all(&packet).map(|_| ()),
                        Some(to) => protocol.endpoint.send_state(&packet, to),
                    };
                }
                if protocol.endpoint.poll_timeout().is_some_and(|due| due <= now) {
                    protocol.endpoint.handle_timeout(now);
                }
                self.pump(&mut protocol, now);
                protocol.endpoint.poll_timeout()
            };
            let held_back = self.transport.send_due(now);
            let next = [wake, held_back].into_iter().flatten().min();
            // Not longer, so that it sees a stop and a changed timer.
            let nap = next
                .map_or(MAX_WAIT, |next| Duration::from_nanos(next.since(now).max(0) as u64).min(MAX_WAIT));
            if !nap.is_zero() {
                thread::park_timeout(nap);
            }
        }
    }

    /// Passes on all that the endpoint has to say, to the network and to the haptic thread.
    fn pump(&self, protocol: &mut Protocol, now: LocalTime) {
        while let Some(transmit) = protocol.endpoint.poll_transmit() {
            // A datagram that cannot be sent is a lost datagram, which the protocol is made for.
            let _: io::Result<()> = self.transport.send(now, transmit.to, &transmit.bytes);
        }
        while let Some(event) = protocol.endpoint.poll_event() {
            protocol.take(event, &self.dropped_inbound);
        }
        protocol.retry_pending();
        let clock = protocol.endpoint.clock();
        if *protocol.clock.input_buffer_mut() != clock {
            let origin = clock.as_ref().map(|clock| clock.local(SessionTime(0)));
            origin.into_iter().for_each(|origin| self.transport.set_session_origin(origin));
            protocol.clock.write(clock);
        }
    }
}

impl Protocol {
    fn take(&mut self, event: Event, dropped: &AtomicU64) {
        match event {
            Event::State { from, packet, .. } => {
                let lost = self.inbound.push(Inbound::State { from, packet }).is_err();
                dropped.fetch_add(u64::from(lost), Ordering::Relaxed);
            }
            Event::PeerJoined { host, name } => self.presence(host, true, format!("{name} is here")),
            Event::PeerReturned { host, .. } => {
                let name = self.name_of(host);
                self.presence(host, true, format!("{name} is back"));
            }
            Event::PeerLeft { host, reason } => {
                let name = self.name_of(host);
                self.presence(host, false, format!("{name} has left: {}", printable(&reason)));
            }
            Event::PeerLost { host } => {
                let name = self.name_of(host);
                self.presence(host, false, format!("{name} is lost: nothing is heard any more"));
            }
            Event::Implausible { host, why } => {
                let name = self.name_of(host);
                self.tell(format!("{name} sends what cannot be, which is not used: {why}"));
            }
            Event::Expelled { host, reason } => {
                let name = self.name_of(host);
                self.presence(host, false, format!("{name} was expelled: {reason}"));
            }
            Event::ClockContradicted { by_ns } => {
                let by_ms = by_ns as f64 * 1e-6;
                self.tell(format!(
                    "the server's clock contradicts itself by {by_ms:.1} ms, which is not followed"
                ));
            }
            Event::Refused(reason) => {
                let reason = printable(&reason.to_string());
                if self.joined {
                    self.failures.tell_and_end(format!("the session is lost: {reason}"));
                }
                self.refusal = Some(reason);
            }
            Event::Welcome { name, .. } => {
                self.joined = true;
                self.tell(format!("you are {name}"));
            }
            _ => {}
        }
    }

    fn presence(&mut self, peer: HostIndex, present: bool, news: String) {
        self.tell(news);
        // Only the last word on a peer counts, so that this does not grow while the haptic thread stands still.
        self.pending
            .retain(|waiting| !matches!(waiting, Inbound::Presence { peer: other, .. } if *other == peer));
        self.pending.push_back(Inbound::Presence { peer, present });
    }

    fn name_of(&self, host: HostIndex) -> String {
        let peer = self.endpoint.peers().find(|peer| peer.host == host);
        peer.map_or_else(|| host.to_string(), |peer| peer.name)
    }

    fn tell(&mut self, news: String) {
        if self.news.len() == MAX_NEWS {
            self.news.pop_front();
        }
        self.news.push_back(news);
    }

    fn retry_pending(&mut self) {
        while let Some(event) = self.pending.pop_front() {
            if let Err(rtrb::PushError::Full(event)) = self.inbound.push(event) {
                self.pending.push_front(event);
                break;
            }
        }
    }
}
