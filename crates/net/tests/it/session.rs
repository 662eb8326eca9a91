//! The session protocol between 2, 3 and 16 endpoints, on links of every kind.

use std::collections::BTreeSet;

use crate::net::{MS, Net, S, config, packet, route};
use cotouch_net::{Endpoint, Event, MAX_DATAGRAM, Refusal, SceneFetch, SendError, StartWhen};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment};
use cotouch_scene::time::{LocalTime, SessionTime};
use proptest::prelude::*;

use Architecture::{Centralized, Distributed};

/// Everyone is there, started with tick 0, and samples in phase.
pub(crate) fn assert_in_phase(net: &Net, users: usize, architecture: Architecture) {
    let origin = net.origin().expect("the server has started");
    for (index, node) in net.nodes.iter().enumerate() {
        let peers = if architecture == Distributed || index == 0 { users - 1 } else { 1 };
        assert_eq!(node.present(), peers, "node {index}: {:#?}", node.story());
        assert_eq!(node.count(|event| matches!(event, Event::PeerJoined { .. })), peers);
        // A burst of losses can be as long as the time-out; whoever was lost by it has come back.
        let lost = node.count(|event| matches!(event, Event::PeerLost { .. }));
        let returned = node.count(|event| matches!(event, Event::PeerReturned { .. }));
        assert_eq!(lost, returned, "node {index}: {:#?}", node.story());
        assert!(!node.has(|event| matches!(event, Event::PeerLeft { .. })));
        assert!(node.has(|event| matches!(event, Event::ClockReady)));
        assert!(node.started().is_some(), "node {index}: {:#?}", node.story());
        let (error, bound) = node.clock_error(net.now, origin).unwrap();
        assert!(error.abs() <= bound, "node {index}: {error} ns off, bound {bound} ns");
    }
}

#[test]
fn all_join_and_start_in_phase_on_a_good_link() {
    let link = Impairment { latency_s: 0.0005, ..Impairment::NONE };
    for architecture in [Centralized, Distributed] {
        for users in [2u8, 3, 16] {
            let mut net = Net::full(users, architecture, link.clone(), 1);
            net.run_for(3 * S);
            assert_in_phase(&net, usize::from(users), architecture);
            let origin = net.origin().unwrap();
            for node in &net.nodes {
                assert!(!node.has(|event| matches!(event, Event::PeerLost { .. })));
                assert_eq!(node.started(), Some(SessionTime(0)));
                assert_eq!(node.sampled.first().map(|&(step, _)| step), Some(0));
                for &(step, truth) in &node.sampled {
                    let ideal = origin + (step as i64 * S + 64) / 128;
                    assert!((truth - ideal).abs() < 200_000, "step {step} {} ns off", truth - ideal);
                }
            }
            let hosts: BTreeSet<_> = net.nodes.iter().map(|node| node.endpoint.host()).collect();
            assert_eq!(hosts.len(), usize::from(users));
        }
    }
}

#[test]
fn states_arrive_unchanged_once_and_from_the_right_host() {
    let link = Impairment {
        latency_s: 0.002,
        jitter_s: 0.002,
        duplicate_rate: 0.2,
        reorder_rate: 0.2,
        ..Impairment::NONE
    };
    let mut net = Net::full(3, Distributed, link, 5);
    net.run_for(5 * S);
    for (receiver, node) in net.nodes.iter().enumerate() {
        let mut seen = BTreeSet::new();
        for (_, event) in &node.events {
            if let Event::State { from, packet: found, .. } = event {
                let sender = net.nodes.iter().position(|node| node.endpoint.host() == Some(*from)).unwrap();
                assert_ne!(sender, receiver);
                assert_eq!(*found, packet(found.step, sender));
                assert!(seen.insert((sender, found.step)), "twice");
            }
        }
        assert!(seen.len() > 800, "{}", seen.len());
        assert!(node.endpoint.counters().duplicates > 50);
    }
}

fn impairments() -> impl Strategy<Value = Impairment> {
    let numbers =
        (0.0..0.03, 0.0..0.01, 0.0..0.3, 1.0..4.0, 0.0..0.2, 0.0..0.2, prop_oneof![Just(0.0), 1e5..1e6]);
    numbers.prop_map(|(latency_s, jitter_s, loss_rate, burst, reorder_rate, duplicate_rate, limit)| {
        Impairment {
            latency_s,
            jitter_s,
            loss_rate,
            loss_burst_packets: burst,
            reorder_rate,
            duplicate_rate,
            rate_limit_bytes_per_s: limit,
            ..Impairment::NONE
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the link does, within reason: all join, clocks agree within the stated bound, and all samples that
    /// arrive were taken in phase.
    #[test]
    fn any_link_will_do(
        link in impairments(),
        users in 2u8..=3,
        centralized in any::<bool>(),
        seed in any::<u32>(),
    ) {
        let architecture = if centralized { Centralized } else { Distributed };
        let mut net = Net::full(users, architecture, link, u64::from(seed));
        net.run_for(15 * S);
        assert_in_phase(&net, usize::from(users), architecture);
        let origin = net.origin().unwrap();
        for _ in 0..10 {
            net.run_for(S / 3);
            for node in &net.nodes {
                let (error, bound) = node.clock_error(net.now, origin).unwrap();
                prop_assert!(error.abs() <= bound, "{} ns off, bound {} ns", error, bound);
            }
        }
        for node in &net.nodes {
            let ordered = node.sampled.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1 && pair[1].1 >= pair[0].1);
            prop_assert!(ordered);
        }
    }
}

#[test]
fn sixteen_hosts_on_a_bad_link() {
    let link = Impairment {
        latency_s: 0.02,
        jitter_s: 0.005,
        loss_rate: 0.2,
        loss_burst_packets: 2.0,
        reorder_rate: 0.05,
        duplicate_rate: 0.05,
        ..Impairment::NONE
    };
    let mut net = Net::full(16, Distributed, link, 3);
    net.run_for(5 * S);
    assert_in_phase(&net, 16, Distributed);
}

#[test]
fn same_seeds_same_story() {
    let run = || {
        let link = Impairment { latency_s: 0.01, jitter_s: 0.004, loss_rate: 0.2, ..Impairment::NONE };
        let mut net = Net::full(3, Distributed, link, 8);
        net.run_for(6 * S);
        net.nodes.into_iter().map(|node| node.events).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn loss_is_counted_from_gaps() {
    let link = Impairment { latency_s: 0.002, loss_rate: 0.1, loss_burst_packets: 2.0, ..Impairment::NONE };
    let mut net = Net::full(2, Distributed, link, 4);
    net.run_for(60 * S);
    for (me, other) in [(0, 1), (1, 0)] {
        let host = net.nodes[other].endpoint.host().unwrap();
        let found = net.nodes[me].endpoint.statistics(host).unwrap();
        let counts = found.sequence;
        assert_eq!((counts.duplicates, counts.reordered), (0, 0));
        let share = counts.lost as f64 / (counts.lost + counts.received) as f64;
        assert!((0.07..0.13).contains(&share), "{share}");
        let sent = net.nodes[other].endpoint.statistics(HostIndex(me as u8)).unwrap().sent;
        assert!(counts.lost + counts.received <= sent && sent > 7000);
        assert!((found.round_trip.mean_s - 0.004).abs() < 1e-5, "{:?}", found.round_trip);
        // 2 ms are less than a period of 7.8 ms.
        assert_eq!(found.late, 0);
    }
}

#[test]
fn late_samples_are_counted() {
    let link = Impairment { latency_s: 0.012, ..Impairment::NONE };
    let mut net = Net::full(2, Distributed, link, 4);
    net.run_for(5 * S);
    let found = net.nodes[0].endpoint.statistics(HostIndex(1)).unwrap();
    assert!(found.sequence.received > 400 && found.late == found.sequence.received, "{found:?}");
}

#[test]
fn leaving_is_told_to_all() {
    let link = Impairment { latency_s: 0.01, loss_rate: 0.3, loss_burst_packets: 2.0, ..Impairment::NONE };
    for leaver in [0, 1] {
        let mut net = Net::full(3, Distributed, link.clone(), 21);
        net.run_for(6 * S);
        net.leave(leaver, "lunch");
        net.run_for(3 * S);
        let host = net.nodes[leaver].endpoint.host().unwrap();
        assert!(net.nodes[leaver].endpoint.is_closed());
        assert!(net.nodes[leaver].has(|event| *event == Event::Closed));
        for index in (0..3).filter(|&index| index != leaver) {
            let node = &net.nodes[index];
            let left = |event: &Event| matches!(event, Event::PeerLeft { host: h, .. } if *h == host);
            assert_eq!(node.count(left), 1, "{:#?}", node.story());
            assert!(!node.has(|event| matches!(event, Event::PeerLost { .. })));
        }
        let sent = net.nodes[leaver].endpoint.send_state_to_all(&packet(1, 1));
        assert_eq!(sent, Err(SendError::NotJoined));
    }
}

#[test]
fn one_who_left_can_come_back_as_a_newcomer() {
    let mut net = Net::full(2, Distributed, Impairment::NONE, 2);
    net.run_for(2 * S);
    net.leave(1, "coffee");
    net.run_for(S);
    let again = net.join(config(2, Distributed, 77));
    net.run_for(2 * S);
    assert_eq!(net.nodes[again].endpoint.host(), Some(HostIndex(1)));
    assert_eq!(net.nodes[0].count(|event| matches!(event, Event::PeerJoined { .. })), 2);
    assert!(net.nodes[again].started().unwrap() > SessionTime(S));
}

#[test]
fn a_killed_host_is_lost_and_its_name_gives_the_same_index_back() {
    let mut net = Net::full(3, Distributed, Impairment { latency_s: 0.003, ..Impairment::NONE }, 2);
    net.run_for(3 * S);
    let dead = (1..3).find(|&index| net.nodes[index].endpoint.host() == Some(HostIndex(1))).unwrap();
    net.kill(dead);
    net.run_for(6 * S);
    let alive: Vec<_> = (0..3).filter(|&index| index != dead).collect();
    for &index in &alive {
        let lost = |event: &Event| *event == Event::PeerLost { host: HostIndex(1) };
        assert_eq!(net.nodes[index].count(lost), 1, "{:#?}", net.nodes[index].story());
    }
    let mut again = config(3, Distributed, 99);
    again.user = Some("user2".to_owned());
    let again = net.join(again);
    net.run_for(3 * S);
    assert_eq!(net.nodes[again].endpoint.host(), Some(HostIndex(1)));
    assert_eq!(net.nodes[again].present(), 2);
    for &index in &alive {
        let returned = |event: &Event| *event == Event::PeerReturned { host: HostIndex(1), restarted: true };
        assert_eq!(net.nodes[index].count(returned), 1, "{:#?}", net.nodes[index].story());
        assert_eq!(net.nodes[index].present(), 2);
    }
    let origin = net.origin().unwrap();
    let (error, bound) = net.nodes[again].clock_error(net.now, origin).unwrap();
    assert!(error.abs() <= bound);
}

#[test]
fn a_host_that_died_unnoticed_is_replaced() {
    let mut net = Net::full(3, Distributed, Impairment { latency_s: 0.003, ..Impairment::NONE }, 2);
    net.run_for(3 * S);
    let dead = (1..3).find(|&index| net.nodes[index].endpoint.host() == Some(HostIndex(2))).unwrap();
    net.kill(dead);
    let mut again = config(3, Distributed, 99);
    again.user = Some("user3".to_owned());
    let again = net.join(again);
    // Sooner than the time-out of 4 s.
    net.run_for(3 * S);
    assert_eq!(net.nodes[again].endpoint.host(), Some(HostIndex(2)), "{:#?}", net.nodes[again].story());
    for index in (0..3).filter(|&index| index != dead) {
        let node = &net.nodes[index];
        assert_eq!(node.count(|event| *event == Event::PeerLost { host: HostIndex(2) }), 1);
        let returned = |event: &Event| *event == Event::PeerReturned { host: HostIndex(2), restarted: true };
        assert_eq!(node.count(returned), 1, "{:#?}", node.story());
    }
}

#[test]
fn a_replaced_host_that_wakes_up_is_told() {
    let mut net = Net::full(2, Distributed, Impairment { latency_s: 0.003, ..Impairment::NONE }, 2);
    net.run_for(3 * S);
    net.cut = vec![(0, 1), (1, 0)];
    let mut again = config(2, Distributed, 99);
    again.user = Some("user2".to_owned());
    let again = net.join(again);
    net.run_for(3 * S);
    assert_eq!(net.nodes[again].endpoint.host(), Some(HostIndex(1)));
    net.cut.clear();
    net.run_for(2 * S);
    assert!(net.nodes[1].has(|event| *event == Event::Refused(Refusal::Replaced)));
    assert_eq!(net.nodes[0].present(), 1);
    assert_eq!(net.nodes[again].present(), 1);
}

#[test]
fn an_outage_is_a_loss_and_a_return() {
    let mut net = Net::full(2, Distributed, Impairment { latency_s: 0.003, ..Impairment::NONE }, 2);
    net.run_for(3 * S);
    net.cut = vec![(0, 1), (1, 0)];
    net.run_for(6 * S);
    for (me, other) in [(0, 1), (1, 0)] {
        assert!(net.nodes[me].has(|event| *event == Event::PeerLost { host: HostIndex(other) }));
        assert!(
            !net.nodes[me]
                .events
                .iter()
                .any(|(at, event)| { matches!(event, Event::State { .. }) && *at > net.now - 5 * S })
        );
    }
    net.cut.clear();
    net.run_for(2 * S);
    for (me, other) in [(0, 1), (1, 0)] {
        let returned = Event::PeerReturned { host: HostIndex(other), restarted: false };
        assert!(net.nodes[me].has(|event| *event == returned), "{:#?}", net.nodes[me].story());
        let states = net.nodes[me].events.iter().rev().take_while(|(at, _)| *at > net.now - S);
        assert!(states.filter(|(_, event)| matches!(event, Event::State { .. })).count() > 100);
    }
}

#[test]
fn one_who_comes_late_gets_the_running_time() {
    let mut server = config(3, Distributed, 1);
    server.start = StartWhen::Immediately;
    let mut net = Net::new(server, Impairment { latency_s: 0.004, ..Impairment::NONE }, 1);
    net.run_for(5 * S);
    assert_eq!(net.nodes[0].started(), Some(SessionTime(0)));
    let late = net.join(config(3, Distributed, 2));
    net.run_for(2 * S);
    let at = net.nodes[late].started().unwrap();
    assert!((5 * S..6 * S).contains(&at.0), "{at:?}");
    let (error, bound) = net.nodes[late].clock_error(net.now, net.origin().unwrap()).unwrap();
    // Until the drift of 90 ppm is known, mending within a second lags behind it by some 90 µs.
    assert!(error.abs() <= bound && error.abs() < 200_000, "{error} {bound}");
    net.run_for(10 * S);
    let (error, _) = net.nodes[late].clock_error(net.now, net.origin().unwrap()).unwrap();
    assert!(error.abs() < 5_000, "{error}");
}

/// What the newcomer hears.
fn refusal(server: cotouch_net::Config, newcomer: cotouch_net::Config) -> Option<Refusal> {
    let mut net = Net::new(server, Impairment { latency_s: 0.001, ..Impairment::NONE }, 1);
    let node = net.join(newcomer);
    net.run_for(40 * S);
    net.nodes[node].events.iter().find_map(|(_, event)| match event {
        Event::Refused(refusal) => Some(refusal.clone()),
        _ => None,
    })
}

#[test]
fn refusals_say_why() {
    let server = || config(2, Distributed, 1);
    let mut newcomer = config(2, Distributed, 2);
    newcomer.scene_hash = 1;
    let found = refusal(server(), newcomer);
    assert_eq!(found, Some(Refusal::Scene { server: 0x5ce4e, newcomer: 1 }));

    let mut newcomer = config(2, Distributed, 2);
    newcomer.network_hz = "64".parse().unwrap();
    let found = refusal(server(), newcomer).unwrap();
    assert_eq!(found.to_string(), "the rates differ: the server's are 1024 Hz control and 128 Hz network");

    let mut newcomer = config(2, Distributed, 2);
    newcomer.user = Some("nobody".to_owned());
    assert!(matches!(refusal(server(), newcomer), Some(Refusal::UnknownName { .. })));

    let mut newcomer = config(2, Distributed, 2);
    newcomer.user = Some("user1".to_owned());
    assert!(matches!(refusal(server(), newcomer), Some(Refusal::NameTaken { .. })));

    let mut newcomer = config(2, Distributed, 2);
    newcomer.user = Some("x".repeat(1000));
    assert!(matches!(refusal(server(), newcomer), Some(Refusal::UnknownName { .. })));
}

#[test]
fn a_full_session_and_a_taken_name_are_refused() {
    let mut net = Net::full(2, Distributed, Impairment { latency_s: 0.001, ..Impairment::NONE }, 1);
    net.run_for(3 * S);
    let any = net.join(config(2, Distributed, 50));
    let mut named = config(2, Distributed, 51);
    named.user = Some("user2".to_owned());
    let named = net.join(named);
    net.run_for(6 * S);
    assert!(net.nodes[any].has(|event| *event == Event::Refused(Refusal::Full { users: 2 })));
    let taken = |event: &Event| matches!(event, Event::Refused(Refusal::NameTaken { .. }));
    assert!(net.nodes[named].has(taken), "{:#?}", net.nodes[named].story());
    assert_eq!(net.nodes[0].present(), 1);
}

#[test]
fn nobody_there_is_said_so() {
    let mut net = Net::new(config(2, Distributed, 1), Impairment::NONE, 1);
    net.kill(0);
    let node = net.join(config(2, Distributed, 2));
    net.run_for(31 * S);
    assert!(net.nodes[node].has(|event| *event == Event::Refused(Refusal::NoAnswer)));
}

/// The first datagram of a newcomer.
fn join_datagram(seed: u64) -> Vec<u8> {
    let server = route("10.0.0.0:7700");
    let mut endpoint = Endpoint::join(config(2, Distributed, seed), server, LocalTime(0));
    endpoint.handle_timeout(LocalTime(0));
    endpoint.poll_transmit().unwrap().bytes.to_vec()
}

#[test]
fn another_version_is_told_apart() {
    let mut net = Net::new(config(2, Distributed, 1), Impairment::NONE, 1);
    let stranger = route("192.0.2.7:9");
    let mut join = join_datagram(2);
    join[2] = 9;
    let answers = net.inject(0, stranger, &join);
    assert_eq!(answers.len(), 1);
    // The newcomer of version 9 sees ours in the header; here we play one of our version that is answered by a version 9.
    let mut answer = answers[0].bytes.to_vec();
    answer[2] = 9;
    let node = net.join(config(2, Distributed, 2));
    let server = net.nodes[0].route;
    assert!(net.inject(node, stranger, &answer).is_empty());
    net.inject(node, server, &answer);
    net.run_for(MS);
    let told = Event::Refused(Refusal::Version { server: 9, newcomer: cotouch_net::PROTOCOL_VERSION });
    assert!(net.nodes[node].has(|event| *event == told), "{:#?}", net.nodes[node].story());
    // An answer is never answered.
    assert!(net.inject(0, stranger, &answer).is_empty());
}

#[test]
fn strangers_get_one_small_reply_and_leave_no_trace() {
    let mut net = Net::full(2, Distributed, Impairment::NONE, 1);
    net.run_for(2 * S);
    let before = net.nodes[0].endpoint.peers().collect::<Vec<_>>();
    let mut foreign = config(2, Distributed, 9);
    foreign.scene_hash = 3;
    foreign.user = Some("u".repeat(64));
    let mut other = Endpoint::join(foreign, net.nodes[0].route, LocalTime(0));
    other.handle_timeout(LocalTime(0));
    let foreign = other.poll_transmit().unwrap().bytes.to_vec();
    let mut version = join_datagram(4);
    version[3] = 7;
    let mut fetch = SceneFetch::new(net.nodes[0].route, 5, LocalTime(0), S);
    let fetch = fetch.poll_transmit(LocalTime(0)).unwrap().bytes.to_vec();
    for (kind, bytes) in [join_datagram(2), foreign, version, fetch].into_iter().enumerate() {
        for port in 1..200u16 {
            let stranger = std::net::SocketAddr::from(([192, 0, 2, 1], port)).into();
            let replies = net.inject(0, stranger, &bytes);
            assert_eq!(replies.len(), 1, "kind {kind}");
            assert!(replies[0].bytes.len() <= bytes.len() && replies[0].to == stranger, "kind {kind}");
        }
    }
    net.run_for(S);
    assert_eq!(net.nodes[0].endpoint.peers().collect::<Vec<_>>(), before);
}

#[test]
fn strangers_with_a_wrong_session_are_counted_and_dropped() {
    let mut net = Net::full(2, Distributed, Impairment::NONE, 1);
    net.run_for(2 * S);
    let mut bytes = [0; MAX_DATAGRAM];
    let at = SessionTime(0);
    let length = cotouch_net::encode_state(1, HostIndex(1), at, &packet(0, 1), &mut bytes).unwrap();
    let peer = net.nodes[1].route;
    assert!(net.inject(0, peer, &bytes[..length]).is_empty());
    assert_eq!(net.nodes[0].endpoint.counters().wrong_session, 1);
    assert!(net.inject(0, peer, b"hello").is_empty());
    assert_eq!(net.nodes[0].endpoint.counters().malformed, 1);
}

#[test]
fn a_scene_of_many_parts_takes_three_round_trips() {
    let mut server = config(2, Distributed, 1);
    server.scene_text = "name = \"test\"\n".repeat(2200);
    let text = server.scene_text.clone();
    let mut net = Net::new(server, Impairment::NONE, 1);
    let me = route("192.0.2.1:5");
    let mut fetch = SceneFetch::new(net.nodes[0].route, 5, LocalTime(0), 5 * S);
    // What arrives when, after a second of round trip.
    let mut answers = std::collections::VecDeque::new();
    let mut now = LocalTime(0);
    while fetch.result().is_none() {
        while let Some(transmit) = fetch.poll_transmit(now) {
            let replies = net.inject(0, me, &transmit.bytes).into_iter();
            answers.extend(replies.map(|reply| (now.plus_ns(S), transmit.to, reply.bytes)));
        }
        while let Some((_, from, bytes)) = answers.pop_front_if(|(at, _, _)| *at <= now) {
            fetch.handle_datagram(now, from, &bytes);
        }
        let next = answers.front().map(|(at, _, _)| *at).into_iter().chain(fetch.poll_timeout()).min();
        now = next.unwrap_or(now).max(now);
    }
    assert_eq!(fetch.result(), Some(&Ok(text)));
    assert!(now <= LocalTime(3 * S), "29 parts: 8 at once, and two rounds of the others; {now:?}");
}

#[test]
fn the_scene_is_fetched_over_a_bad_link() {
    let mut net = Net::new(config(2, Distributed, 1), Impairment::NONE, 1);
    let text = config(2, Distributed, 1).scene_text;
    let me = route("192.0.2.1:5");
    let mut fetch = SceneFetch::new(net.nodes[0].route, 5, LocalTime(0), 5 * S);
    let (mut now, mut count) = (LocalTime(0), 0);
    while fetch.result().is_none() {
        while let Some(transmit) = fetch.poll_transmit(now) {
            count += 1;
            for reply in net.inject(0, me, &transmit.bytes) {
                if count % 3 == 0 {
                    fetch.handle_datagram(now, transmit.to, &reply.bytes);
                    fetch.handle_datagram(now, transmit.to, &reply.bytes);
                }
            }
        }
        now = fetch.poll_timeout().unwrap_or(now);
    }
    assert_eq!(fetch.result(), Some(&Ok(text)));
    assert!(now < LocalTime(2 * S), "{now:?}");
    let mut alone = SceneFetch::new(net.nodes[0].route, 5, LocalTime(0), 5 * S);
    assert!(alone.poll_transmit(LocalTime(5 * S)).is_none());
    assert!(alone.result().unwrap().as_ref().unwrap_err().to_string().starts_with("no answer"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Bytes from anywhere, sealed or not, neither panic nor keep the others from their work.
    #[test]
    fn hostile_datagrams_do_no_harm(
        attacks in proptest::collection::vec((any::<bool>(), proptest::collection::vec(any::<u8>(), 0..300)), 1..40),
        flips in proptest::collection::vec((0usize..200, 1u8..), 1..40),
    ) {
        let mut net = Net::full(2, Distributed, Impairment { latency_s: 0.001, ..Impairment::NONE }, 1);
        net.run_for(S / 2);
        for (as_peer, bytes) in &attacks {
            let from = if *as_peer { net.nodes[1].route } else { route("192.0.2.7:9") };
            net.inject(0, from, bytes);
        }
        for (at, flip) in &flips {
            let mut join = join_datagram(3);
            let at = at % join.len();
            join[at] ^= flip;
            net.inject(0, route("192.0.2.7:9"), &join);
        }
        net.run_for(2 * S);
        prop_assert_eq!(net.nodes[0].present(), 1);
        prop_assert!(net.nodes[1].started().is_some());
    }
}
