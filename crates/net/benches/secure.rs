//! What keys cost a packet: sealing and opening, beside a datagram's way through the loopback interface without them; and what a
//! first message costs a server, made by a ticket holder and by anybody else.

use std::hint::black_box;
use std::net::{SocketAddr, UdpSocket};

use cotouch_net::{Entropy, MAX_SEALED, Route, SecureNode, SessionKey};
use cotouch_scene::time::LocalTime;
use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// As long as the state of a host with one hand and one object.
const STATE_BYTES: usize = 252;
const NOW: LocalTime = LocalTime(0);

fn entropy(seed: u64) -> Entropy {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    Box::new(move |bytes: &mut [u8]| random.fill(bytes))
}

fn address(last: u8) -> Route {
    SocketAddr::from(([192, 0, 2, last], 1)).into()
}

/// A server, and a host that has a channel to it.
fn pair() -> (SecureNode, SecureNode) {
    let mut server = SecureNode::serve(entropy(1));
    let mut client = SecureNode::join(server.session_key(), address(1), entropy(2), NOW);
    client.call(NOW, server.route());
    for _ in 0..2 {
        while let Some(transmit) = client.poll_transmit() {
            server.open(NOW, address(2), &transmit.bytes, &mut [0; MAX_SEALED]);
        }
        while let Some(transmit) = server.poll_transmit() {
            client.open(NOW, address(1), &transmit.bytes, &mut [0; MAX_SEALED]);
        }
    }
    assert!(server.is_reached(NOW, client.route()));
    (server, client)
}

fn packets(criterion: &mut Criterion) {
    let (mut server, mut client) = pair();
    let (to, state) = (server.route(), [7; STATE_BYTES]);
    let (mut sealed, mut opened) = ([0; MAX_SEALED], [0; MAX_SEALED]);
    criterion.bench_function("secure/seal and open a state", |bencher| {
        bencher.iter(|| {
            let (_, length) = client.seal(NOW, to, black_box(&state), &mut sealed).expect("a channel");
            server.open(NOW, address(2), &sealed[..length], &mut opened).expect("it is whole")
        });
    });
    let foreign = vec![b'x'; STATE_BYTES];
    criterion.bench_function("secure/reject a foreign datagram", |bencher| {
        bencher.iter(|| server.open(NOW, address(2), black_box(&foreign), &mut opened));
    });
    let [near, far] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a socket"));
    let to = far.local_addr().expect("an address");
    criterion.bench_function("secure/bare UDP, send and receive as much", |bencher| {
        bencher.iter(|| {
            near.send_to(black_box(&state), to).expect("it is sent");
            far.recv_from(&mut opened).expect("it arrives")
        });
    });
}

fn first_message(key: SessionKey) -> Vec<u8> {
    let mut node = SecureNode::join(key, address(1), entropy(3), NOW);
    node.call(NOW, key.server());
    node.poll_transmit().expect("a call").bytes.to_vec()
}

fn calls(criterion: &mut Criterion) {
    let mut server = SecureNode::serve(entropy(1));
    let right = first_message(server.session_key());
    let wrong = first_message(SecureNode::serve(entropy(4)).session_key());
    let mut out = [0; MAX_SEALED];
    let mut now = NOW;
    for (whose, call) in [("a ticket holder", right), ("anybody else", wrong)] {
        criterion.bench_function(&format!("secure/a call of {whose}"), |bencher| {
            bencher.iter(|| {
                // A second apart, so that each is taken.
                now = now.plus_ns(1_000_000_000);
                server.open(now, address(2), black_box(&call), &mut out);
                server.poll_transmit().expect("an answer")
            });
        });
    }
}

criterion_group!(benches, packets, calls);
criterion_main!(benches);
