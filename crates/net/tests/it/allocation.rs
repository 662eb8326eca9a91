//! What says that it does not allocate does not.

use std::net::SocketAddr;

use cotouch_net::{
    Config, Endpoint, Entry, Event, MAX_DATAGRAM, PlayOutBuffer, SimulatedLink, StartWhen, StatePacket,
    decode_state, encode_state,
};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment, PlayOut};
use cotouch_scene::time::{LocalTime, SessionTime};
use cotouch_testkit::allocations;

fn packet(step: u64) -> StatePacket {
    let hand = Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() };
    let object = Entry::Object { object: 0, pose: Pose::default(), twist: Twist::default() };
    StatePacket { step, entries: [hand, object].into_iter().collect() }
}

#[test]
fn packets_pass_wire_link_and_play_out_without_allocation() {
    let impairment = Impairment { latency_s: 0.02, jitter_s: 0.005, duplicate_rate: 0.1, ..Impairment::NONE };
    let mut link = SimulatedLink::new(&impairment, 1, HostIndex(0), HostIndex(1));
    let mut buffer = PlayOutBuffer::new(PlayOut::Scheduled, 3).clone();
    let mut run = |steps: std::ops::Range<u64>| {
        for step in steps {
            let now = step as i64 * 7_812_500;
            let mut bytes = [0; MAX_DATAGRAM];
            let length = encode_state(1, HostIndex(0), SessionTime(now), &packet(step), &mut bytes).unwrap();
            link.send(now, &bytes[..length]);
            while let Some((_, bytes)) = link.poll_delivery(now) {
                buffer.insert(decode_state(bytes).unwrap().2);
            }
            buffer.due_at_step(step);
        }
    };
    run(0..1000);
    assert_eq!(allocations(|| run(1000..5000)), 0);
    assert!(buffer.counts().used > 3000);
}

fn config(seed: u64) -> Config {
    Config {
        scene_hash: 1,
        scene_text: String::new(),
        control_hz: "1024".parse().unwrap(),
        network_hz: "128".parse().unwrap(),
        names: vec!["a".to_owned(), "b".to_owned()],
        architecture: Architecture::Distributed,
        play_out: PlayOut::Scheduled,
        play_out_periods: vec![1; 2],
        peer_timeout_ns: 1_000_000_000,
        plausibility: None,
        user: None,
        start: StartWhen::Hosts(2),
        start_delay_ns: 1_000_000,
        join_timeout_ns: 5_000_000_000,
        routes_are_proven: false,
        seed,
    }
}

#[test]
fn states_and_pings_pass_endpoints_without_allocation() {
    let [a, b] = ["10.0.0.1:1", "10.0.0.2:1"].map(|text| text.parse::<SocketAddr>().unwrap().into());
    let mut server = Endpoint::serve(config(1), LocalTime(0));
    let mut client = Endpoint::join(config(2), a, LocalTime(0));
    let mut received = 0;
    let mut run = |milliseconds: std::ops::Range<i64>| {
        for now in milliseconds.map(|ms| LocalTime(ms * 1_000_000)) {
            server.handle_timeout(now);
            client.handle_timeout(now);
            let step = (now.0 / 7_812_500) as u64;
            let _ = server.send_state_to_all(&packet(step));
            let _ = client.send_state(&packet(step), HostIndex(0));
            for _ in 0..4 {
                while let Some(transmit) = client.poll_transmit() {
                    server.handle_datagram(now, b, &transmit.bytes);
                }
                while let Some(transmit) = server.poll_transmit() {
                    client.handle_datagram(now, a, &transmit.bytes);
                }
            }
            for endpoint in [&mut server, &mut client] {
                while let Some(event) = endpoint.poll_event() {
                    received += u64::from(matches!(event, Event::State { .. }));
                }
            }
        }
    };
    run(0..2000);
    assert_eq!(allocations(|| run(2000..6000)), 0);
    assert!(received > 1000, "{received}");
}
