//! Who is believed to take part, and who may not return: peers that only ping, packets that were held back, hosts that lie.

use crate::net::{MS, Net, S, config};
use cotouch_net::{
    Config, Control, DatagramKind, Endpoint, Event, Plausibility, Presence, Refusal, Roster, encode_control,
    open,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment};

use Architecture::Distributed;

const GOOD: Impairment = Impairment { latency_s: 0.003, ..Impairment::NONE };
const ONE: HostIndex = HostIndex(1);

/// Two hosts that lose each other after a quarter of a second.
fn pair(change: impl Fn(&mut Config)) -> Net {
    let config = |seed| {
        let mut config = config(2, Distributed, seed);
        config.peer_timeout_ns = 250 * MS;
        change(&mut config);
        config
    };
    let mut net = Net::new(config(1), GOOD, 1);
    net.join(config(2));
    net.run_for(3 * S);
    net
}

fn count(net: &Net, event: &Event) -> usize {
    net.nodes[0].count(|other| other == event)
}

fn states(net: &Net) -> Vec<u64> {
    let step = |(_, event): &(i64, Event)| match event {
        Event::State { packet, .. } => Some(packet.step),
        _ => None,
    };
    net.nodes[0].events.iter().filter_map(step).collect()
}

#[test]
fn a_peer_that_only_pings_is_lost_and_returns_with_its_first_sample() {
    let mut net = pair(|_| ());
    let (lost, returned) =
        (Event::PeerLost { host: ONE }, Event::PeerReturned { host: ONE, restarted: false });
    assert_eq!(count(&net, &lost), 0);
    let trips = net.nodes[0].endpoint.statistics(ONE).unwrap().round_trip.count;
    net.nodes[1].samples = false;
    net.run_for(3 * S);
    assert!(net.nodes[0].endpoint.statistics(ONE).unwrap().round_trip.count > trips + 15, "it answers pings");
    assert_eq!((count(&net, &lost), count(&net, &returned)), (1, 0), "{:#?}", net.nodes[0].story());
    net.nodes[1].samples = true;
    net.run_for(S);
    assert_eq!((count(&net, &lost), count(&net, &returned)), (1, 1), "{:#?}", net.nodes[0].story());
}

#[test]
fn before_its_first_sample_pings_tell_that_a_peer_is_there() {
    let mut net = Net::new(config(2, Distributed, 1), GOOD, 1);
    let late = net.join(config(2, Distributed, 2));
    net.nodes[late].samples = false;
    net.run_for(20 * S);
    assert_eq!(net.nodes[0].present(), 1);
    assert_eq!(count(&net, &Event::PeerLost { host: ONE }), 0);
}

/// A link that holds packets for two seconds and lets them go at once, and one that does so a second later still.
#[test]
fn packets_that_were_held_back_are_not_played_as_if_new() {
    let mut net = pair(|_| ());
    net.cut = vec![(1, 0)];
    net.tape = Some(Vec::new());
    net.run_for(2 * S);
    let from = net.nodes[1].address;
    let is_state = |bytes: &[u8]| open(bytes).is_ok_and(|(header, _)| header.kind == DatagramKind::State);
    let tape = net.tape.take().unwrap();
    let held: Vec<_> = tape.into_iter().filter(|(_, to, bytes)| *to == 0 && is_state(bytes)).collect();
    assert!(held.len() > 240);
    let mut later = pair(|_| ());
    later.cut = vec![(1, 0)];
    later.run_for(3 * S);

    let before = states(&net).len();
    held.iter().for_each(|(_, _, bytes)| net.receive(0, from, bytes));
    net.run_for(MS);
    let fresh = states(&net).split_off(before);
    // A quarter of a second, and the one period after which a sample is used.
    assert!((30..=34).contains(&fresh.len()), "{}", fresh.len());
    assert_eq!(net.nodes[0].present(), 1, "the freshest count");

    let before = states(&later).len();
    held.iter().for_each(|(_, _, bytes)| later.receive(0, from, bytes));
    later.run_for(MS);
    assert_eq!(states(&later).len(), before);
    assert_eq!(later.nodes[0].present(), 0, "old packets are no sign of life");
    assert_eq!(later.nodes[0].endpoint.statistics(ONE).unwrap().stale, held.len() as u64);
}

#[test]
fn who_sends_what_cannot_be_is_expelled_told_and_not_let_in_again() {
    let scene = cotouch_scene::load("single-axis", &[]).unwrap();
    // The samples of these tests are of another scene.
    let can_be = Plausibility::new(&scene);
    let mut net = pair(|config| config.plausibility = (config.seed == 1).then(|| can_be.clone()));
    let expelled = net.nodes[0].endpoint.expelled();
    assert_eq!(expelled.len(), 1);
    assert_eq!((expelled[0].host, expelled[0].at.is_some()), (ONE, true));
    assert_eq!(states(&net), [0; 0], "nothing of it was used");
    let is_told =
        |event: &Event| matches!(event, Event::PeerLeft { reason, .. } if reason.contains("expelled"));
    assert!(net.nodes[1].has(is_told), "{:#?}", net.nodes[1].story());
    let why = net.nodes[0].has(|event| matches!(event, Event::Implausible { host: ONE, .. }));
    assert!(why && net.nodes[0].has(|event| matches!(event, Event::Expelled { host: ONE, .. })));

    let (now, server) = (net.nodes[1].local(net.now), net.nodes[0].route);
    net.nodes[1].endpoint = Endpoint::join(config(2, Distributed, 77), server, now);
    net.run_for(2 * S);
    let refused = net.nodes[1].has(|event| matches!(event, Event::Refused(Refusal::Expelled { .. })));
    assert!(refused, "{:#?}", net.nodes[1].story());
    assert_eq!(net.nodes[0].endpoint.peers().next().unwrap().presence, Presence::Left);
    // Another host may take the place.
    net.kill(1);
    let other = net.join(config(2, Distributed, 78));
    net.nodes[other].samples = false;
    net.run_for(S);
    assert_eq!(net.nodes[other].endpoint.host(), Some(ONE), "{:#?}", net.nodes[other].story());
}

#[test]
fn a_time_that_no_session_can_have_is_refused() {
    for (origin_s, is_refused) in
        [(5, false), (-3600, false), (120, true), (i64::MIN, true), (i64::MAX, true)]
    {
        // A third host is waited for, so that nothing has begun.
        let mut net = Net::new(config(3, Distributed, 1), GOOD, 1);
        net.tape = Some(Vec::new());
        net.join(config(3, Distributed, 2));
        net.run_for(2 * S);
        assert!(net.nodes[1].has(|event| *event == Event::ClockReady) && net.nodes[1].started().is_none());
        let tape = net.tape.take().unwrap();
        let session = tape.iter().rev().find_map(|(_, _, bytes)| Some(open(bytes).ok()?.0.session)).unwrap();
        let server_now = net.nodes[0].local(net.now).0;
        let origin_ns = Some(server_now.saturating_add(origin_s.saturating_mul(S)));
        let roster = Control::Roster(Roster { revision: 1000, origin_ns, ..Roster::default() });
        let bytes = encode_control(session, Some(HostIndex::FIRST), &roster).unwrap();
        let server = net.nodes[0].route;
        net.inject(1, server, &bytes);
        net.run_for(MS);
        assert_eq!(
            net.nodes[1].has(|event| *event == Event::Refused(Refusal::Time)),
            is_refused,
            "{origin_s} s"
        );
        assert_eq!(net.nodes[1].started().is_some(), !is_refused, "{origin_s} s");
    }
}

#[test]
fn one_whose_world_has_diverged_is_let_go_of() {
    let mut net = pair(|_| ());
    net.nodes[1].samples = false;
    let step = net.nodes[1].sampled.last().unwrap().0 + 1;
    let diverged = cotouch_net::StatePacket { step, ..Default::default() };
    net.nodes[1].endpoint.send_state(&diverged, HostIndex::FIRST).unwrap();
    net.run_for(S);
    let reason = "its world has diverged".to_owned();
    assert_eq!(count(&net, &Event::Expelled { host: ONE, reason }), 1, "{:#?}", net.nodes[0].story());
}
