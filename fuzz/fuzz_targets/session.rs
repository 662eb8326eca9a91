//! A server and a host that joined it, fed with datagrams from peers and strangers: no panic, bounded replies. It stands behind the
//! secured layer: whatever a member says through its channel arrives here.
#![no_main]

use cotouch_net::{Config, DatagramBytes, Endpoint, HEADER_BYTES, Plausibility, Route, StartWhen, Transmit};
use cotouch_scene::load;
use cotouch_scene::scene::{Architecture, PlayOut, Scene};
use cotouch_scene::time::LocalTime;
use libfuzzer_sys::fuzz_target;
use xxhash_rust::xxh3::xxh3_64;

const MILLISECOND: i64 = 1_000_000;
/// Where a header says what follows.
const KIND: usize = 8;

/// Whose bounds of what can be hold.
fn scene() -> Scene {
    load("single-axis", &["session.users=3".parse().unwrap()]).unwrap()
}

fn config(seed: u64) -> Config {
    Config {
        scene_hash: 1,
        scene_text: "name = \"fuzz\"".to_owned(),
        control_hz: "1024".parse().unwrap(),
        network_hz: "128".parse().unwrap(),
        names: vec!["a".to_owned(), "b".to_owned(), "c".to_owned()],
        architecture: Architecture::Distributed,
        play_out: PlayOut::Scheduled,
        play_out_periods: vec![1; 3],
        peer_timeout_ns: 1_000 * MILLISECOND,
        plausibility: Some(Plausibility::new(&scene())),
        user: None,
        start: StartWhen::Hosts(2),
        start_delay_ns: 100 * MILLISECOND,
        join_timeout_ns: 5_000 * MILLISECOND,
        routes_are_proven: false,
        seed,
    }
}

/// The last datagram that either sent: what its sender says of itself, no fuzzer guesses.
#[derive(Default)]
struct Heads {
    server: Option<DatagramBytes>,
    client: Option<DatagramBytes>,
}

/// Version, sender and session of a peer's own datagram, and the checksum that fits.
fn forge(bytes: &mut [u8], own: Option<&DatagramBytes>) {
    if let Some(own) = own.filter(|_| bytes.len() >= HEADER_BYTES) {
        let kind = bytes[KIND];
        bytes[..HEADER_BYTES].copy_from_slice(&own[..HEADER_BYTES]);
        bytes[KIND] = kind;
        let sum = xxh3_64(&bytes[8..]) as u32;
        bytes[4..8].copy_from_slice(&sum.to_le_bytes());
    }
}

/// Hands all that waits from one to the other.
fn exchange(
    now: LocalTime,
    server: (&mut Endpoint, Route),
    client: (&mut Endpoint, Route),
    heads: &mut Heads,
) {
    for _ in 0..8 {
        while let Some(Transmit { to, bytes }) = client.0.poll_transmit() {
            if to == server.1 {
                server.0.handle_datagram(now, client.1, &bytes);
            }
            heads.client = Some(bytes);
        }
        while let Some(Transmit { to, bytes }) = server.0.poll_transmit() {
            if to == client.1 {
                client.0.handle_datagram(now, server.1, &bytes);
            }
            heads.server = Some(bytes);
        }
    }
    while server.0.poll_event().is_some() || client.0.poll_event().is_some() {}
}

fuzz_target!(|data: &[u8]| {
    let server_route = Route::V4("10.0.0.1:1".parse().unwrap());
    let client_route = Route::V4("10.0.0.2:1".parse().unwrap());
    let stranger = Route::V4("10.0.0.3:1".parse().unwrap());
    let mut now = LocalTime(0);
    let mut server = Endpoint::serve(config(1), now);
    let mut client = Endpoint::join(config(2), server_route, now);
    let mut heads = Heads::default();
    let mut rest = data;
    // Each piece: what to do, how long to wait, how many bytes follow.
    while let [what, wait, length, tail @ ..] = rest {
        let (piece, tail) = tail.split_at(usize::from(*length).min(tail.len()));
        rest = tail;
        now = now.plus_ns(i64::from(*wait) * MILLISECOND);
        server.handle_timeout(now);
        client.handle_timeout(now);
        let mut bytes = piece.to_vec();
        let is_to_server = what >> 1 & 3 != 2;
        if what & 1 != 0 {
            forge(&mut bytes, if is_to_server { heads.client.as_ref() } else { heads.server.as_ref() });
        }
        match what >> 1 & 3 {
            0 => server.handle_datagram(now, stranger, &bytes),
            1 => server.handle_datagram(now, client_route, &bytes),
            2 => client.handle_datagram(now, server_route, &bytes),
            _ => {}
        }
        exchange(now, (&mut server, server_route), (&mut client, client_route), &mut heads);
        assert!(server.peers().count() <= 2 && client.peers().count() <= 2);
    }
});
