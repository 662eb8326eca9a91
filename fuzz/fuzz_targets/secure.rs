//! A server and a host that has a channel to it, fed by strangers, by somebody on the way who changes what he sees, and by the
//! host itself: no panic, nothing but what the host said comes out, and answers to strangers are bounded.
#![no_main]

use cotouch_net::{Entropy, MAX_DATAGRAM, MAX_SEALED, Route, SecureNode};
use cotouch_scene::time::LocalTime;
use libfuzzer_sys::fuzz_target;

const MILLISECOND: i64 = 1_000_000;

/// Numbers that are the same in every run.
fn entropy(mut state: u64) -> Entropy {
    Box::new(move |bytes| {
        for byte in bytes {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *byte = (state >> 56) as u8;
        }
    })
}

struct Pair {
    server: SecureNode,
    client: SecureNode,
    server_address: Route,
    client_address: Route,
}

impl Pair {
    fn new(now: LocalTime) -> Self {
        let server_address = Route::V4("10.0.0.1:1".parse().unwrap());
        let server = SecureNode::serve(entropy(1));
        let client = SecureNode::join(server.session_key(), server_address, entropy(2), now);
        Self { server, client, server_address, client_address: Route::V4("10.0.0.2:1".parse().unwrap()) }
    }

    /// Hands what the nodes themselves say from one to the other; how much the server said to others.
    fn exchange(&mut self, now: LocalTime) -> usize {
        let mut to_others = 0;
        for _ in 0..3 {
            while let Some(transmit) = self.client.poll_transmit() {
                if transmit.to == self.server_address {
                    self.server.open(now, self.client_address, &transmit.bytes, &mut [0; MAX_SEALED]);
                }
            }
            while let Some(transmit) = self.server.poll_transmit() {
                if transmit.to == self.client_address {
                    self.client.open(now, self.server_address, &transmit.bytes, &mut [0; MAX_SEALED]);
                } else {
                    to_others += 1;
                }
            }
        }
        to_others
    }
}

fuzz_target!(|data: &[u8]| {
    let stranger = Route::V4("10.0.0.3:1".parse().unwrap());
    let mut now = LocalTime(0);
    let mut pair = Pair::new(now);
    let server = pair.server.route();
    pair.client.call(now, server);
    pair.exchange(now);
    let mut out = [0; MAX_SEALED];
    let mut rest = data;
    // Each piece: what to do, how long to wait, how many bytes follow.
    while let [what, wait, length, tail @ ..] = rest {
        let (piece, tail) = tail.split_at(usize::from(*length).min(tail.len()));
        rest = tail;
        now = now.plus_ns(i64::from(*wait) * MILLISECOND);
        pair.client.handle_timeout(now);
        pair.server.handle_timeout(now);
        match what & 3 {
            0 => assert_eq!(pair.server.open(now, stranger, piece, &mut out), None),
            1 => {
                let mut sealed = [0; MAX_SEALED];
                if let Some((_, length)) = pair.client.seal(now, server, b"said", &mut sealed) {
                    let at = usize::from(what >> 2);
                    for (byte, change) in sealed[at.min(length)..length].iter_mut().zip(piece) {
                        *byte ^= change;
                    }
                    let opened = pair.server.open(now, stranger, &sealed[..length], &mut out);
                    let said = opened.map(|(from, length)| (from, &out[..length]));
                    assert!(said.is_none_or(|said| said == (pair.client.route(), &b"said"[..])));
                }
            }
            2 => {
                let said = &piece[..piece.len().min(MAX_DATAGRAM)];
                let mut sealed = [0; MAX_SEALED];
                if let Some((_, length)) = pair.client.seal(now, server, said, &mut sealed) {
                    let address = pair.client_address;
                    let opened = pair.server.open(now, address, &sealed[..length], &mut out);
                    assert_eq!(opened, Some((pair.client.route(), said.len())));
                    assert_eq!(&out[..said.len()], said);
                    assert_eq!(pair.server.open(now, address, &sealed[..length], &mut out), None);
                }
            }
            _ => pair.client.call(now, server),
        }
        assert!(pair.exchange(now) <= 8);
    }
});
