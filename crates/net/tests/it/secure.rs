//! The secured layer: whole sessions through it, and everything that somebody without the keys can do to them.

use std::collections::BTreeMap;

use crate::net::{MS, Net, S, config, entropy, packet, route};
use crate::session::assert_in_phase;
use cotouch_net::{
    Control, Endpoint, Event, Join, MAX_DATAGRAM, MAX_SEALED, PROTOCOL_VERSION, PeerId, Presence, Rejections,
    Route, SecureNode, Text, Unwelcome, encode_control, encode_state, may_be_secured,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment};
use cotouch_scene::time::{LocalTime, SessionTime};
use cotouch_testkit::allocations;
use proptest::prelude::*;

use Architecture::{Centralized, Distributed};

fn latency(latency_s: f64) -> Impairment {
    Impairment { latency_s, ..Impairment::NONE }
}

fn rejections(net: &Net, node: usize) -> Rejections {
    net.nodes[node].secure.as_ref().unwrap().rejections()
}

#[test]
fn all_join_and_start_in_phase_through_keys() {
    for architecture in [Centralized, Distributed] {
        for users in [2u8, 3, 16] {
            let mut net = Net::full_secured(users, architecture, latency(0.0005), 1);
            net.run_for(3 * S);
            assert_in_phase(&net, usize::from(users), architecture);
            for node in 0..usize::from(users) {
                assert_eq!(rejections(&net, node).total(), 0, "{:?}", rejections(&net, node));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// What is refused before anything is locked is what would be rejected as foreign all the same.
    #[test]
    fn first_bytes_tell_what_a_node_would_reject(
        mut bytes in proptest::collection::vec(any::<u8>(), 0..1400),
        magic in proptest::option::of(proptest::sample::select(vec![b"co", b"cs"])),
    ) {
        let head = bytes.len().min(2);
        magic.into_iter().for_each(|magic| bytes[..head].copy_from_slice(&magic[..head]));
        let mut node = SecureNode::serve(entropy(1));
        let opened = node.open(LocalTime(0), route("10.0.0.9:1"), &bytes, &mut [0; MAX_SEALED]);
        prop_assert!(opened.is_none());
        let foreign = Rejections { foreign: 1, ..Rejections::default() };
        prop_assert!(may_be_secured(&bytes) || node.rejections() == foreign);
    }

    /// Whatever the link does, within reason, hosts with keys find each other on it.
    #[test]
    fn any_link_will_do_with_keys(
        latency_s in 0.0..0.1,
        jitter_s in 0.0..0.01,
        loss_rate in 0.0..0.3,
        duplicate_rate in 0.0..0.2,
        users in 2u8..=4,
        seed in any::<u32>(),
    ) {
        let link = Impairment { latency_s, jitter_s, loss_rate, duplicate_rate, ..Impairment::NONE };
        let mut net = Net::full_secured(users, Distributed, link, u64::from(seed));
        net.run_for(15 * S);
        assert_in_phase(&net, usize::from(users), Distributed);
        for node in 0..usize::from(users) {
            let besides_repeated = Rejections { repeated: 0, ..rejections(&net, node) };
            prop_assert_eq!(besides_repeated, Rejections::default());
        }
    }
}

#[test]
fn nothing_of_a_session_is_readable_on_the_way() {
    let mut net = Net::secured(config(2, Distributed, 1), latency(0.001), 1);
    net.tape = Some(Vec::new());
    net.join(config(2, Distributed, 2));
    net.run_for(2 * S);
    net.leave(1, "a secret farewell");
    net.run_for(S);
    let tape = net.tape.take().unwrap();
    let mut seen = BTreeMap::<Vec<u8>, usize>::new();
    for (_, _, bytes) in &tape {
        assert!(may_be_secured(bytes));
        assert!(cotouch_net::decode_state(bytes).is_err() && cotouch_net::decode_control(bytes).is_err());
        let text = String::from_utf8_lossy(bytes);
        assert!(!text.contains("farewell") && !text.contains("user2"));
        // No two datagrams say the same, though many do inside.
        *seen.entry(bytes[14.min(bytes.len())..].to_vec()).or_default() += 1;
    }
    assert!(tape.len() > 300 && seen.values().all(|&count| count == 1));
}

#[test]
fn a_peer_may_move_to_another_address() {
    let mut net = Net::full_secured(3, Distributed, latency(0.003), 2);
    net.run_for(3 * S);
    for roamer in [0, 1, 2] {
        let before = net.nodes[2].endpoint.peers().collect::<Vec<_>>();
        let elsewhere = Route::Named(Text::from(&format!("elsewhere:{roamer}")).unwrap());
        net.nodes[roamer].address = elsewhere;
        net.run_for(2 * S);
        let (who, host) = (net.nodes[roamer].route, net.nodes[roamer].endpoint.host().unwrap());
        for index in (0..3).filter(|&index| index != roamer) {
            let node = &net.nodes[index];
            assert_eq!(node.secure.as_ref().unwrap().address_of(who), Some(elsewhere));
            let peer = node.endpoint.peers().find(|peer| peer.host == host).unwrap();
            assert_eq!((peer.route, peer.presence), (who, Presence::Present));
            assert!(!node.has(|event| matches!(event, Event::PeerLost { .. })), "{:#?}", node.story());
            let heard = node.events.iter().filter(|(at, event)| {
                *at > net.now - S && matches!(event, Event::State { from, .. } if *from == host)
            });
            assert!(heard.count() > 100);
        }
        assert_eq!(net.nodes[2].endpoint.peers().collect::<Vec<_>>(), before, "who they are stays");
    }
}

#[test]
fn two_who_both_move_while_they_cannot_hear_each_other_are_introduced_again() {
    let mut net = Net::full_secured(3, Distributed, latency(0.003), 2);
    net.run_for(3 * S);
    net.cut = vec![(1, 2), (2, 1)];
    for roamer in [1, 2] {
        net.nodes[roamer].address = Route::Named(Text::from(&format!("elsewhere:{roamer}")).unwrap());
    }
    net.run_for(3 * S);
    net.cut.clear();
    net.run_for(3 * S);
    for (me, other) in [(1, 2), (2, 1)] {
        let other = net.nodes[other].endpoint.host().unwrap();
        let states = net.nodes[me].events.iter().filter(|(at, event)| {
            *at > net.now - S && matches!(event, Event::State { from, .. } if *from == other)
        });
        assert!(states.count() > 100, "{:#?}", net.nodes[me].story());
    }
}

/// What three hosts see of a session of six seconds, when `attack` is made on it after three.
fn six_seconds(attack: impl FnOnce(&mut Net)) -> (Vec<Vec<(i64, Event)>>, Vec<Rejections>) {
    let mut net = Net::secured(config(3, Distributed, 1), latency(0.002), 1);
    net.tape = Some(Vec::new());
    net.join(config(3, Distributed, 2));
    net.join(config(3, Distributed, 3));
    net.run_for(3 * S);
    attack(&mut net);
    net.run_for(3 * S);
    let rejections = (0..3).map(|node| rejections(&net, node)).collect();
    (net.nodes.into_iter().take(3).map(|node| node.events).collect(), rejections)
}

/// Asserts that hosts see the same with the attack as without, and returns what they rejected in it.
fn assert_no_trace(attack: impl FnOnce(&mut Net)) -> Vec<Rejections> {
    let (calm, _) = six_seconds(|_| {});
    let (attacked, rejections) = six_seconds(attack);
    assert!(calm.iter().flatten().count() > 3000);
    assert!(calm == attacked, "an attack is seen by the session");
    rejections
}

/// Everything that the session's own protocol can say, from everyone.
fn forged_datagrams(net: &Net) -> Vec<Vec<u8>> {
    let ids: Vec<PeerId> = net.nodes[0].endpoint.peers().map(|peer| peer.id).collect();
    let rate = "128".parse().unwrap();
    let mut controls = vec![
        Control::Join(Join {
            cookie: 0,
            scene_hash: 0x5ce4e,
            control_hz: "1024".parse().unwrap(),
            network_hz: rate,
            name: Some(Text::from("user3").unwrap()),
            padding: ([0; 32], [0; 32]),
        }),
        Control::LeaveReceived,
        Control::RosterReceived { revision: 99 },
        Control::Refuse(cotouch_net::Refusal::Replaced),
        Control::Refuse(cotouch_net::Refusal::Closing),
    ];
    for id in ids {
        controls.push(Control::Leave { id, reason: Text::from("forged").unwrap() });
        for sent_ns in [0, 50 * MS, 5 * S, 1 << 62, i64::MIN] {
            controls.push(Control::Ping { id, sent_ns, ready: true });
            let (received_ns, answered_ns) = (sent_ns, sent_ns);
            controls.push(Control::Pong { id, sent_ns, received_ns, answered_ns });
        }
    }
    let mut datagrams = Vec::new();
    for sender in [None, Some(HostIndex(0)), Some(HostIndex(1)), Some(HostIndex(2))] {
        // The session's number, which only members know, is no secret to this attacker.
        for control in &controls {
            datagrams.push(encode_control(session_of(net), sender, control).unwrap().to_vec());
        }
        if let Some(sender) = sender {
            let mut bytes = [0; MAX_DATAGRAM];
            for step in 380..400 {
                let at = SessionTime((step as i64 * S + 64) / 128);
                let length =
                    encode_state(session_of(net), sender, at, &packet(step, 99), &mut bytes).unwrap();
                datagrams.push(bytes[..length].to_vec());
            }
        }
    }
    datagrams
}

/// The number of the session, as its members have it in every header: drawn by the server from its seed, after the secret of cookies.
fn session_of(net: &Net) -> u64 {
    let mut server = Endpoint::serve(config(3, Distributed, 1), LocalTime(0));
    let mut newcomer = Endpoint::join(config(3, Distributed, 2), net.nodes[0].route, LocalTime(0));
    newcomer.handle_timeout(LocalTime(0));
    let me = route("10.0.0.9:1");
    for _ in 0..3 {
        while let Some(transmit) = newcomer.poll_transmit() {
            server.handle_datagram(LocalTime(0), me, &transmit.bytes);
        }
        while let Some(transmit) = server.poll_transmit() {
            if let Ok((_, Control::Welcome { session, .. })) = cotouch_net::decode_control(&transmit.bytes) {
                return session;
            }
            newcomer.handle_datagram(LocalTime(0), net.nodes[0].route, &transmit.bytes);
        }
    }
    panic!("the server welcomes a newcomer");
}

fn sources(net: &Net) -> Vec<Route> {
    let members = net.nodes.iter().map(|node| node.address);
    members.chain([route("192.0.2.7:9")]).collect()
}

#[test]
fn whoever_knows_the_protocol_but_has_no_key_is_counted() {
    let mut count = 0;
    let found = assert_no_trace(|net| {
        for bytes in forged_datagrams(net) {
            for from in sources(net) {
                for victim in 0..3 {
                    net.receive(victim, from, &bytes);
                }
                count += 1;
            }
        }
    });
    assert!(count > 300);
    assert!(found.iter().all(|found| found.foreign == count && found.total() == count), "{found:?} {count}");
}

#[test]
fn whoever_sends_again_what_was_on_the_way_is_counted() {
    let mut counts = [0; 3];
    let found = assert_no_trace(|net| {
        let tape = net.tape.clone().unwrap();
        for source in sources(net) {
            for (_, _, bytes) in &tape {
                for (victim, count) in counts.iter_mut().enumerate() {
                    net.receive(victim, source, bytes);
                    *count += 1;
                }
            }
        }
    });
    // First messages of members to members are known as old; nothing at all passes.
    for (found, count) in found.iter().zip(counts) {
        assert!(found.repeated > 500 && found.unknown > 1000, "{found:?}");
        assert!(found.total() <= count, "{found:?} of {count}");
    }
}

#[test]
fn whoever_changes_a_bit_on_the_way_is_counted() {
    let mut flipped = 0u64;
    let found = assert_no_trace(|net| {
        let tape = net.tape.clone().unwrap();
        let sealed: Vec<_> = tape.iter().rev().take(60).cloned().collect();
        for (from, victim, bytes) in sealed {
            for bit in 0..bytes.len() * 8 {
                let mut bytes = bytes.clone();
                bytes[bit / 8] ^= 1 << (bit % 8);
                net.receive(victim, from, &bytes);
                flipped += 1;
            }
        }
    });
    assert_eq!(found.iter().map(Rejections::total).sum::<u64>(), flipped);
    assert!(found.iter().all(|found| found.forged > 1000), "{found:?}");
}

#[test]
fn a_spoofed_source_takes_nobody_from_where_they_are() {
    let mut addresses = Vec::new();
    assert_no_trace(|net| {
        // The attacker is quicker than the real one: what it read on the way arrives from elsewhere first, once.
        let tape = net.tape.clone().unwrap();
        for (_, victim, bytes) in tape {
            let mut bytes = bytes.clone();
            let last = bytes.len() - 1;
            bytes[last] ^= 1;
            net.receive(victim, route("192.0.2.7:9"), &bytes);
        }
        let server = net.nodes[0].secure.as_ref().unwrap();
        addresses.extend([1, 2].map(|node: usize| server.address_of(net.nodes[node].route)));
        assert_eq!(addresses, [1, 2].map(|node: usize| Some(net.nodes[node].address)));
    });
}

#[test]
fn a_killed_member_is_not_kept_alive_by_its_recorded_datagrams() {
    let mut net = Net::secured(config(2, Distributed, 1), latency(0.002), 1);
    net.tape = Some(Vec::new());
    net.join(config(2, Distributed, 2));
    net.run_for(3 * S);
    net.kill(1);
    let tape = net.tape.take().unwrap();
    let from = net.nodes[1].address;
    for _ in 0..50 {
        for (_, _, bytes) in tape.iter().filter(|(source, _, _)| *source == from) {
            net.receive(0, from, bytes);
        }
        net.run_for(100 * MS);
    }
    assert!(net.nodes[0].has(|event| *event == Event::PeerLost { host: HostIndex(1) }));
    assert!(!net.nodes[0].has(|event| matches!(event, Event::PeerReturned { .. })));
    assert!(rejections(&net, 0).repeated > 10_000);
}

#[test]
fn a_member_cannot_act_as_another() {
    let mut net = Net::full_secured(3, Distributed, latency(0.002), 1);
    net.run_for(3 * S);
    let [victim, forger] = [1, 2];
    let forged = forged_datagrams(&net);
    let story = net.nodes[victim].story();
    let unheard = |net: &Net, node: usize| {
        let counters = net.nodes[node].endpoint.counters();
        counters.unknown_sender + counters.unexpected + counters.wrong_session
    };
    let before = [0, victim].map(|node| unheard(&net, node));
    let other_host = |bytes: &[u8]| {
        let (header, _) = cotouch_net::open(bytes).unwrap();
        header.sender != net.nodes[forger].endpoint.host()
    };
    let forged: Vec<_> = forged.into_iter().filter(|bytes| other_host(bytes)).collect();
    for bytes in &forged {
        for target in [0, victim] {
            let (now, to) = (net.nodes[forger].local(net.now), net.nodes[target].route);
            let mut out = [0; MAX_SEALED];
            let secure = net.nodes[forger].secure.as_mut().unwrap();
            let (_, length) = secure.seal(now, to, bytes, &mut out).expect("members reach each other");
            net.receive(target, net.nodes[forger].address, &out[..length]);
        }
    }
    for (node, before) in [0, victim].into_iter().zip(before) {
        let heard = forged.len() as u64 - (unheard(&net, node) - before);
        // The server answers a join of a member that is in already; it says nothing new to anybody.
        assert!(heard <= 3, "node {node} listened to {heard} of {} forged datagrams", forged.len());
    }
    net.run_for(2 * S);
    assert_eq!(net.nodes[victim].story(), story);
    assert_in_phase(&net, 3, Distributed);
    let states = net.nodes[0].events.iter().filter_map(|(_, event)| match event {
        Event::State { packet, .. } => Some(packet),
        _ => None,
    });
    assert!(states.clone().count() > 500);
    let mut entries = states.flat_map(|packet| &packet.entries);
    assert!(!entries.any(|entry| matches!(entry, cotouch_net::Entry::Hand { point: 99, .. })));
}

#[test]
fn another_sessions_ticket_is_told_and_leaves_no_trace() {
    let mut net = Net::full_secured(2, Distributed, latency(0.01), 1);
    net.run_for(2 * S);
    let other = SecureNode::serve(entropy(77)).session_key();
    let stranger = net.join_with(config(2, Distributed, 9), Some(other));
    net.run_for(2 * S);
    let found = net.nodes[stranger].secure.as_ref().unwrap().unwelcome();
    assert_eq!(found.map(|(why, _)| why), Some(Unwelcome::Ticket));
    assert!(rejections(&net, 0).without_ticket > 3);
    assert_eq!(net.nodes[0].endpoint.peers().count(), 1);
    // The right server's key with another secret is no better.
    let mut text = net.key().to_string();
    assert!(text.parse() == Ok(net.key()));
    text.replace_range(50..51, if &text[50..51] == "A" { "B" } else { "A" });
    assert!(text.parse::<cotouch_net::SessionKey>().is_err());
}

#[test]
fn a_hint_from_on_the_way_does_not_keep_a_ticket_holder_out() {
    let mut net = Net::secured(config(2, Distributed, 1), latency(0.05), 1);
    net.tape = Some(Vec::new());
    let node = net.join(config(2, Distributed, 2));
    net.run_for(MS);
    // Whoever sees the call can answer it first.
    let (_, _, call) = net.tape.as_ref().unwrap()[0].clone();
    let mut server = SecureNode::serve(entropy(5));
    let mut out = [0; MAX_SEALED];
    server.open(LocalTime(0), net.nodes[node].address, &call, &mut out);
    let rejection = server.poll_transmit().unwrap();
    net.receive(node, net.nodes[0].address, &rejection.bytes);
    assert!(net.nodes[node].secure.as_ref().unwrap().unwelcome().is_some());
    net.run_for(3 * S);
    assert_in_phase(&net, 2, Distributed);
    assert_eq!(net.nodes[node].secure.as_ref().unwrap().unwelcome(), None);
}

#[test]
fn another_version_is_told_in_both_directions() {
    let mut net = Net::secured(config(2, Distributed, 1), latency(0.01), 1);
    net.tape = Some(Vec::new());
    let node = net.join(config(2, Distributed, 2));
    net.run_for(MS);
    let (_, _, call) = net.tape.take().unwrap()[0].clone();
    // What a program of another version says first is answered by our version in the header that all versions read.
    let stranger = route("192.0.2.7:9");
    let mut other = call.clone();
    other[2] = 2;
    let mut server = SecureNode::serve(entropy(5));
    server.open(LocalTime(0), stranger, &other, &mut [0; MAX_SEALED]);
    let answer = server.poll_transmit().expect("an answer");
    assert_eq!((answer.to, &answer.bytes[2..4]), (stranger, &PROTOCOL_VERSION.to_le_bytes()[..]));
    assert!(answer.bytes.len() < 50 && answer.bytes[12..20] == call[12..20]);
    assert_eq!(server.rejections().other_version, 1);
    // The same the other way round; and an answer is never answered.
    let mut theirs = answer.bytes.to_vec();
    theirs[2] = 2;
    net.receive(node, net.nodes[0].address, &theirs);
    let found = net.nodes[node].secure.as_ref().unwrap().unwelcome();
    assert_eq!(found.map(|(why, _)| why), Some(Unwelcome::Version { server: 2 }));
    server.open(LocalTime(0), stranger, &theirs, &mut [0; MAX_SEALED]);
    assert!(server.poll_transmit().is_none());
}

/// How many answers a server gives to these datagrams within one second.
fn answers(server: &mut SecureNode, datagrams: &[Vec<u8>]) -> usize {
    let mut answers = 0;
    for (index, bytes) in datagrams.iter().enumerate() {
        let now = LocalTime(100 * S + index as i64 * S / datagrams.len() as i64);
        server.open(now, route("192.0.2.7:9"), bytes, &mut [0; MAX_SEALED]);
        answers += std::iter::from_fn(|| server.poll_transmit()).count();
    }
    answers
}

/// The first message of a newcomer with this key.
fn first_message(key: cotouch_net::SessionKey, seed: u64) -> Vec<u8> {
    let now = LocalTime(seed as i64);
    let mut node = SecureNode::join(key, route("192.0.2.1:1"), entropy(seed), now);
    node.call(now, key.server());
    node.poll_transmit().expect("a call").bytes.to_vec()
}

#[test]
fn a_flood_of_first_messages_is_answered_at_a_bounded_rate() {
    let mut server = SecureNode::serve(entropy(1));
    let wrong = first_message(SecureNode::serve(entropy(2)).session_key(), 3);
    assert!(answers(&mut server, &vec![wrong.clone(); 50_000]) <= 41);
    assert_eq!(server.rejections().without_ticket, 50_000);
    // What a ticket holder said once, again and again.
    let right = first_message(server.session_key(), 3);
    assert_eq!(answers(&mut server, &vec![right.clone(); 50_000]), 1);
    assert_eq!(server.rejections().repeated, 49_999);
    // And many things that ticket holders have said: as much as 256 at once and one in 10 ms.
    let many: Vec<_> = (10..610).map(|seed| first_message(server.session_key(), seed)).collect();
    let taken = answers(&mut server, &many);
    assert!((256..=356).contains(&taken), "{taken}");
    assert_eq!(server.rejections().throttled, 600 - taken as u64);
    // And through all this a holder of the ticket still comes in a moment later.
    let mut newcomer = SecureNode::join(server.session_key(), route("192.0.2.1:1"), entropy(9), LocalTime(0));
    let (at, me, here) = (LocalTime(102 * S), route("192.0.2.8:1"), newcomer.session_key().server());
    newcomer.call(at, here);
    for _ in 0..2 {
        while let Some(transmit) = newcomer.poll_transmit() {
            server.open(at, me, &transmit.bytes, &mut [0; MAX_SEALED]);
        }
        while let Some(transmit) = server.poll_transmit() {
            newcomer.open(at, route("192.0.2.1:1"), &transmit.bytes, &mut [0; MAX_SEALED]);
        }
    }
    assert!(newcomer.is_reached(at, here) && server.is_reached(at, newcomer.route()));
}

#[test]
fn a_member_that_was_forgotten_for_others_comes_back() {
    let mut net = Net::full_secured(2, Distributed, latency(0.002), 1);
    net.run_for(3 * S);
    net.cut = vec![(0, 1), (1, 0)];
    net.run_for(S);
    // More holders of the ticket than the server remembers.
    let key = net.key();
    for number in 0..70u64 {
        let now = LocalTime(number as i64);
        let mut holder = SecureNode::join(key, net.nodes[0].address, entropy(1000 + number), now);
        let address = route(&format!("192.0.2.9:{}", number + 1));
        holder.call(now, key.server());
        for _ in 0..2 {
            while let Some(transmit) = holder.poll_transmit() {
                net.receive(0, address, &transmit.bytes);
            }
            let server = net.nodes[0].secure.as_mut().unwrap();
            let answers: Vec<_> = std::iter::from_fn(|| server.poll_transmit()).collect();
            for answer in answers.iter().filter(|answer| answer.to == address) {
                holder.open(now, net.nodes[0].address, &answer.bytes, &mut [0; MAX_SEALED]);
            }
        }
        assert!(holder.is_reached(now, key.server()));
    }
    assert_eq!(net.nodes[0].secure.as_ref().unwrap().address_of(net.nodes[1].route), None);
    net.cut.clear();
    net.run_for(4 * S);
    assert_eq!((net.nodes[0].present(), net.nodes[1].present()), (1, 1));
    assert!(!net.nodes[1].has(|event| matches!(event, Event::Refused(_))), "{:#?}", net.nodes[1].story());
}

#[test]
fn a_join_over_a_second_of_round_trip_takes_three() {
    for round_trip_s in [0.6, 1.0] {
        let mut net = Net::secured(config(2, Distributed, 1), latency(round_trip_s / 2.0), 1);
        let node = net.join(config(2, Distributed, 2));
        net.run_for(12 * S);
        let when = |wanted: fn(&Event) -> bool| {
            let node = &net.nodes[node];
            node.events.iter().find(|(_, event)| wanted(event)).map(|(at, _)| *at)
        };
        let welcome = when(|event| matches!(event, Event::Welcome { .. }));
        let started = when(|event| matches!(event, Event::Started { .. }));
        assert!(welcome.is_some_and(|at| at <= 3 * S), "{round_trip_s} {welcome:?}");
        assert!(started.is_some_and(|at| at <= 6 * S), "{round_trip_s} {started:?}");
    }
}

#[test]
fn sealing_and_opening_do_not_allocate() {
    let now = LocalTime(0);
    let mut server = SecureNode::serve(entropy(1));
    let [here, there] = [route("192.0.2.1:1"), route("192.0.2.2:1")];
    let mut client = SecureNode::join(server.session_key(), here, entropy(2), now);
    client.call(now, server.route());
    for _ in 0..2 {
        while let Some(transmit) = client.poll_transmit() {
            server.open(now, there, &transmit.bytes, &mut [0; MAX_SEALED]);
        }
        while let Some(transmit) = server.poll_transmit() {
            client.open(now, here, &transmit.bytes, &mut [0; MAX_SEALED]);
        }
    }
    let (to, longest) = (server.route(), [3; MAX_DATAGRAM]);
    let mut sealed = [0; MAX_SEALED];
    let mut opened = [0; MAX_SEALED];
    let mut pass = || {
        for length in [0, 1, 200, MAX_DATAGRAM] {
            let said = &longest[..length];
            let (_, length) = client.seal(now, to, said, &mut sealed).unwrap();
            let (_, length) = server.open(now, there, &sealed[..length], &mut opened).unwrap();
            assert_eq!(&opened[..length], said);
            // And what comes again, or damaged, does not either.
            assert_eq!(server.open(now, there, &sealed[..length + 31], &mut opened), None);
        }
    };
    pass();
    assert_eq!(allocations(|| (0..100).for_each(|_| pass())), 0);
    assert!(client.seal(now, to, &[0; MAX_DATAGRAM + 1], &mut sealed).is_none(), "too long is lost");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Bytes from anywhere, and recorded ones with changes, neither panic nor keep the others from their work.
    #[test]
    fn hostile_datagrams_do_no_harm_to_keys(
        made_up in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..300), 1..40),
        changed in proptest::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..200),
        prefix in prop_oneof![Just(b"cs".to_vec()), Just(b"co".to_vec()), Just(vec![])],
    ) {
        let mut net = Net::secured(config(2, Distributed, 1), latency(0.001), 1);
        net.tape = Some(Vec::new());
        net.join(config(2, Distributed, 2));
        net.run_for(S / 2);
        let tape = net.tape.take().unwrap();
        for bytes in made_up {
            net.receive(0, net.nodes[1].address, &[prefix.clone(), bytes].concat());
        }
        for (which, place, value) in changed {
            let (from, to, mut bytes) = which.get(&tape).clone();
            let place = place.index(bytes.len());
            bytes[place] = value;
            net.receive(to, from, &bytes);
        }
        net.run_for(2 * S);
        prop_assert_eq!(net.nodes[0].present(), 1);
        prop_assert!(net.nodes[1].started().is_some());
    }
}
