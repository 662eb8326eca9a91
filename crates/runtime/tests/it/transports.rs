//! What is expected of every transport, in real time and in virtual time.

use std::io;

use cotouch_net::{MAX_DATAGRAM, MAX_SEALED, Rejections, Route, Text, Ticket, Unwelcome};
use cotouch_runtime::clock;
use cotouch_runtime::transport::{
    self, Arrival, DynTransport, Impaired, KINDS, MAX_WAIT, RouteError, Secured, Transport, Unreached,
    VirtualNetwork,
};
use cotouch_scene::load;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;
use cotouch_scene::time::LocalTime;

const MILLISECOND: i64 = 1_000_000;
/// A busy computer may take its time.
const PATIENCE_NS: i64 = 5_000 * MILLISECOND;

/// Two ends of one transport, and the clock that they live by.
struct Pair<'a, T: ?Sized> {
    near: &'a T,
    far: &'a T,
    now: &'a dyn Fn() -> LocalTime,
    /// Bytes of the longest datagram that they carry.
    longest: usize,
}

impl<T: Transport + ?Sized> Pair<'_, T> {
    /// What `far` receives next.
    fn receive(&self) -> Option<(Arrival, Vec<u8>)> {
        let mut buffer = [0; MAX_SEALED + 1];
        let patience = (self.now)().plus_ns(PATIENCE_NS);
        while (self.now)() < patience {
            let now = (self.now)();
            self.near.send_due(now);
            if let Some(arrival) = self.far.receive(now, &mut buffer).unwrap() {
                return Some((arrival, buffer[..arrival.length].to_vec()));
            }
        }
        None
    }

    fn conforms(&self) {
        let (near, far) = (self.near.route().unwrap(), self.far.route().unwrap());
        assert_ne!(near, far, "every end has a route of its own");
        assert_eq!(self.near.route().unwrap(), near, "a route does not change");
        self.carries_datagrams_unchanged(near, far);
        self.answers_reach_the_sender(near);
        self.routes_from_anywhere_do_no_harm();
        self.what_does_not_fit_is_cut_off(far);
    }

    fn delays_what_it_sends(&self, latency_s: f64) {
        let (near, far) = (self.near.route().unwrap(), self.far.route().unwrap());
        self.carries_datagrams_unchanged(near, far);
        self.routes_from_anywhere_do_no_harm();
        let sent = (self.now)();
        self.near.send(sent, far, b"timed").unwrap();
        let (arrival, _) = self.receive().expect("a datagram arrives");
        assert!(arrival.at.since(sent) >= (latency_s * 1e9) as i64);
    }

    fn carries_datagrams_unchanged(&self, near: Route, far: Route) {
        let longest: Vec<u8> = (0..self.longest).map(|index| index as u8).collect();
        for bytes in [b"a".as_slice(), &longest, &[0; 40]] {
            let before = (self.now)();
            self.near.send(before, far, bytes).unwrap();
            let (arrival, received) = self.receive().expect("a datagram arrives");
            assert_eq!((arrival.from, received.as_slice()), (near, bytes));
            assert!(arrival.at >= before && arrival.at <= (self.now)());
        }
    }

    fn answers_reach_the_sender(&self, near: Route) {
        let back = Pair { near: self.far, far: self.near, ..*self };
        self.far.send((self.now)(), near, b"answer").unwrap();
        assert_eq!(back.receive().expect("an answer arrives").1, b"answer");
    }

    fn routes_from_anywhere_do_no_harm(&self) {
        for name in ["", ":", "nobody:at/home", "\u{1f}:\0"] {
            let route = Route::Named(Text::from(name).unwrap());
            let now = (self.now)();
            // Held back and lost later, or lost at once.
            let _: io::Result<()> = self.near.send(now, route, b"lost");
            self.near.send_due(now);
        }
    }

    fn what_does_not_fit_is_cut_off(&self, far: Route) {
        self.near.send((self.now)(), far, b"longer").unwrap();
        let patience = (self.now)().plus_ns(PATIENCE_NS);
        let mut short = [0; 4];
        while (self.now)() < patience {
            self.near.send_due((self.now)());
            if let Some(arrival) = self.far.receive((self.now)(), &mut short).unwrap() {
                assert_eq!((arrival.length, &short), (4, b"long"));
                return;
            }
        }
        panic!("a datagram arrives");
    }
}

/// Where two ends of every kind can listen on one computer.
const LISTENING: &[[&str; 2]] = &[["127.0.0.1:0"; 2]];

fn real_ends() -> Vec<[Box<DynTransport>; 2]> {
    let ends = LISTENING.iter().map(|texts| {
        texts.map(|text| {
            let end = transport::listen(transport::parse(text).unwrap()).unwrap();
            let route = end.route().unwrap();
            assert!(transport::is_local(route));
            transport::connect(route).expect("an end that can reach it");
            end
        })
    });
    ends.collect()
}

#[test]
fn no_kind_is_left_out() {
    for kind in KINDS {
        let is_of_it = |text: &str| match (kind.scheme, transport::parse(text).unwrap()) {
            (Some(scheme), Route::Named(name)) => name.split(':').next() == Some(scheme),
            (scheme, route) => scheme.is_none() && route.socket_address().is_some(),
        };
        assert!(LISTENING.iter().any(|texts| texts.iter().all(|text| is_of_it(text))), "{}", kind.end);
    }
}

/// Receives at one end until `reach`, at the other, has come to an end.
fn receiving<T: Send>(end: &Secured, reach: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let reaching = scope.spawn(reach);
        while !reaching.is_finished() {
            assert_eq!(end.receive(clock::now(), &mut [0; MAX_DATAGRAM]).unwrap(), None);
        }
        reaching.join().unwrap()
    })
}

#[test]
fn a_secured_transport_conforms_over_every_kind_and_lets_nobody_in_without_the_ticket() {
    let patience = std::time::Duration::from_nanos(PATIENCE_NS as u64);
    for [near, far] in real_ends() {
        let far = Secured::serve(far);
        let ticket = far.ticket().unwrap();
        let near = Secured::join(near, ticket, clock::now());
        assert_eq!(receiving(&far, || near.reach_server(patience, &|| true)), Ok(()));
        let pair = Pair { near: &near, far: &far, now: &clock::now, longest: MAX_DATAGRAM };
        pair.conforms();
        // On a busy computer a call is repeated before its answer is there, and the second answer comes too late.
        let rejected = [&near, &far].map(|end| Rejections { repeated: 0, ..end.rejections() });
        assert_eq!(rejected, [Rejections::default(); 2]);
        assert_eq!(far.route().unwrap(), ticket.key.server());
        let slow = Impairment { latency_s: 0.002, ..Impairment::NONE };
        near.impair(&slow, 1, HostIndex(0));
        pair.delays_what_it_sends(slow.latency_s);
    }
    for [near, far] in real_ends() {
        let (far, other) = (Secured::serve(far), Secured::serve(transport::listen(loopback()).unwrap()));
        let wrong = Ticket { address: far.ticket().unwrap().address, ..other.ticket().unwrap() };
        let near = Secured::join(near, wrong, clock::now());
        let reached = receiving(&far, || near.reach_server(patience, &|| true));
        assert_eq!(reached, Err(Unreached::Unwelcome(Unwelcome::Ticket)));
        assert!(far.rejections().without_ticket > 0);
        let another = Secured::join(transport::listen(loopback()).unwrap(), wrong, clock::now());
        assert_eq!(another.reach_server(patience, &|| false), Err(Unreached::Unwanted));
        // Nobody is at that end.
        let lost = near.send(clock::now(), wrong.key.server(), b"lost");
        assert_eq!(lost.unwrap_err().kind(), io::ErrorKind::NotConnected);
    }
}

fn loopback() -> Route {
    transport::parse("127.0.0.1:0").unwrap()
}

fn scene_network(settings: &[&str]) -> VirtualNetwork {
    let settings: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
    VirtualNetwork::new(&load("single-axis", &settings).unwrap())
}

#[test]
fn every_kind_in_real_time_conforms_bare_and_impaired() {
    let slow = Impairment { latency_s: 0.002, ..Impairment::NONE };
    for [near, far] in real_ends() {
        Pair { near: &*near, far: &*far, now: &clock::now, longest: MAX_SEALED }.conforms();
        let before = clock::now();
        assert_eq!(near.receive(before, &mut [0; 8]).unwrap(), None);
        assert!(clock::now().since(before) < 50 * MAX_WAIT.as_nanos() as i64, "a stop is seen");
        let [near, far] = [near, far].map(Impaired::new);
        let pair = Pair { near: &near, far: &far, now: &clock::now, longest: MAX_SEALED };
        for impairment in [Impairment::NONE, slow.clone(), Impairment::NONE] {
            near.impair(&impairment, 1, HostIndex(0));
            pair.delays_what_it_sends(impairment.latency_s);
        }
    }
}

#[test]
fn virtual_links_conform() {
    for settings in [&[][..], &["link.impairment.latency_s=0.003"]] {
        let network = scene_network(settings);
        let ticking = std::cell::Cell::new(0);
        let now = || {
            ticking.set(ticking.get() + MILLISECOND);
            LocalTime(ticking.get())
        };
        let [near, far] = [0, 1].map(|host| network.end(HostIndex(host)));
        Pair { near: &near, far: &far, now: &now, longest: MAX_DATAGRAM }.conforms();
        let [near, far] = [near, far].map(|end| Impaired::new(Box::new(end)));
        let doubled = Impairment { latency_s: 0.002, ..Impairment::NONE };
        near.impair(&doubled, 1, HostIndex(0));
        let pair = Pair { near: &near, far: &far, now: &now, longest: MAX_DATAGRAM };
        pair.conforms();
        pair.delays_what_it_sends(0.002);
    }
}

#[test]
fn a_wrapped_transport_adds_its_latency_to_the_links() {
    let network = scene_network(&["link.impairment.latency_s=0.003"]);
    let [near, far] = [0, 1].map(|host| network.end(HostIndex(host)));
    let near = Impaired::new(Box::new(near));
    near.impair(&Impairment { latency_s: 0.002, ..Impairment::NONE }, 1, HostIndex(0));
    near.send(LocalTime(0), far.route().unwrap(), b"late").unwrap();
    assert_eq!(network.next_delivery(), None);
    assert_eq!(near.send_due(LocalTime(0)), Some(LocalTime(2 * MILLISECOND)));
    assert_eq!(near.send_due(LocalTime(2 * MILLISECOND)), None);
    assert_eq!(network.next_delivery(), Some(LocalTime(5 * MILLISECOND)));
    assert_eq!(network.receivers(LocalTime(5 * MILLISECOND)).next(), Some(HostIndex(1)));
}

#[test]
fn texts_are_routes_or_say_why_not() {
    for text in ["127.0.0.1:7800", "[::1]:7800"] {
        assert_eq!(transport::parse(text).unwrap().to_string(), text);
    }
    for text in ["", "localhost", "localhost:7800", "nobody:at/home", "127.0.0.1"] {
        let error = transport::parse(text).unwrap_err();
        assert!(matches!(error, RouteError::Address(_)), "{text}");
        assert_eq!(error.to_string(), "invalid socket address syntax");
    }
    let taken = transport::listen(transport::parse("127.0.0.1:0").unwrap()).unwrap();
    let error = transport::listen(taken.route().unwrap()).map(|_| ()).unwrap_err().to_string();
    assert!(error.starts_with(&format!("no UDP socket can be opened at {}: ", taken.route().unwrap())));
    let nowhere = Route::Named(Text::from("nobody:at/home").unwrap());
    let error = transport::connect(nowhere).map(|_| ()).unwrap_err().to_string();
    assert!(error.starts_with("no transport can be opened at nobody:at/home: "), "{error}");
}
