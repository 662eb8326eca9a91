//! Every built-in scene with a soft object, through a host's ticks: all fingers press, and come off.

use crate::common::Rig;
use cotouch_host::SlowInput;
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::Scene;
use cotouch_scene::geometry::{Pose, Reading, Readings, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_testkit::scenes::{built_in, edited, local_model_kinds};
use glam::DVec3;

/// Where a finger is: outside, `depth_m` deep, or between.
#[derive(Clone, Copy)]
struct Path {
    outside: DVec3,
    inside: DVec3,
}

impl Path {
    /// From a finger's start straight to the surface.
    fn new(rig: &Rig, start: DVec3, radius_m: f64, depth_m: f64) -> Self {
        let frame = rig.slow.rest_frame();
        let point = frame.surface.nearest_point(start).unwrap();
        let outside = point.point + point.outward * (radius_m + 0.005);
        Self { outside, inside: point.point + point.outward * (radius_m - depth_m) }
    }

    fn at(&self, share: f64) -> DVec3 {
        self.outside.lerp(self.inside, share)
    }
}

/// All fingers of a scene on their paths, one user after the other, as the first host sees them.
struct Hands {
    rig: Rig,
    paths: Vec<Vec<Path>>,
}

impl Hands {
    fn new(scene: &Scene, depth_m: f64) -> Self {
        let mut rig = Rig::new(scene);
        for peer in HostIndex::FIRST.others(scene.session.users) {
            rig.state.set_present(peer, true);
            rig.state.peers[peer.index()].fade = 1.0;
        }
        let path = |finger: &cotouch_scene::scene::Finger| {
            Path::new(&rig, finger.position_m, scene.hand.finger_radius_m, depth_m)
        };
        let paths = scene.users.iter().map(|user| user.fingers.iter().map(path).collect()).collect();
        Self { rig, paths }
    }

    /// One tick with every user's fingers so far on their ways.
    fn tick(&mut self, shares: impl Fn(usize) -> f64) {
        let places = |user: usize| -> Vec<DVec3> {
            self.paths[user].iter().map(|path| path.at(shares(user))).collect()
        };
        let Rig { model, state, tick, .. } = &mut self.rig;
        if let Some(step) = model.step_due(state, *tick) {
            for peer in HostIndex::FIRST.others(model.users) {
                model.receive(state, peer, &packet(step, &places(peer.index())));
            }
        }
        model.play_out(state, *tick);
        let own: Readings = places(0).into_iter().map(|finger| Reading::point(finger, DVec3::ZERO)).collect();
        self.rig.tick_with(own);
        assert!(!self.rig.state.diverged);
    }

    fn largest_force_n(&self) -> f64 {
        self.rig.state.soft.contacts.iter().map(|contact| contact.force.length()).fold(0.0, f64::max)
    }
}

fn packet(step: u64, fingers: &[DVec3]) -> StatePacket {
    let hand = |(point, finger): (u8, &DVec3)| Entry::Hand {
        point,
        pose: Pose { position: *finger, ..Pose::default() },
        twist: Twist::default(),
    };
    StatePacket { step, entries: (0..).zip(fingers).map(hand).collect() }
}

/// In within half a second, there for another, out in half a second.
fn press(tick: u32) -> f64 {
    let t = f64::from(tick) / 1000.0;
    (2.0 * t).min(1.0).min(3.0 - 2.0 * t).max(0.0)
}

#[test]
fn every_scene_is_pressed_and_let_go() {
    for name in ["spring", "soft-block", "balloon", "organ"] {
        for kind in local_model_kinds() {
            // A body that swings takes a softer integral than one without inertia.
            let overrides = [
                format!("local_model.kind={kind}"),
                "local_model.stiffness_ratio=0.3".into(),
                "local_model.integral_ratio=0.05".into(),
            ];
            let scene = built_in(name, &overrides.each_ref().map(String::as_str));
            let mut hands = Hands::new(&scene, 0.004);
            let (mut largest_n, mut touched) = (0.0_f64, 0);
            for tick in 0..2000 {
                hands.tick(|_| press(tick));
                largest_n = largest_n.max(hands.largest_force_n());
                if tick == 900 {
                    touched = hands.rig.state.soft.contacts.iter().filter(|contact| contact.touching).count();
                }
            }
            let fingers = hands.rig.state.soft.contacts.len();
            assert_eq!(touched, fingers, "{name}, {kind}");
            assert!(largest_n > 5e-3 && largest_n < 10.0, "{name}, {kind}: {largest_n} N");
            assert!(hands.largest_force_n() == 0.0, "{name}, {kind}: nothing is felt that is not touched");
            assert!(comes_back(&mut hands.rig), "{name}, {kind}: it comes back");
        }
    }
}

/// Whether the body comes back to rest, if it swings first.
fn comes_back(rig: &mut Rig) -> bool {
    let rest = rig.slow.rest_frame();
    let moved_m = |positions: &[DVec3]| {
        let moved = positions.iter().zip(&rest.positions_m).map(|(now, rest)| now.distance(*rest));
        moved.fold(0.0, f64::max)
    };
    (0..600).any(|period| {
        let frame = rig.slow.step(&SlowInput { period: 1000 + period, ..SlowInput::default() });
        moved_m(&frame.positions_m) < 1e-4 && frame.energy.kinetic_j < 1e-6
    })
}

/// The paper's claim (§1): who touches the balloon feels how the other presses it, through the fluid. Of the surface at
/// rest, as a rigid shell has it, the force would not change.
#[test]
fn through_the_balloon_one_user_feels_the_other() {
    for kind in ["p", "compliance"] {
        let kind = format!("local_model.kind={kind}");
        let scene = edited(
            &built_in("balloon", &[&kind, "local_model.stiffness_ratio=0.3", "soft.young_pa=300e3"]),
            |scene| scene.soft.fixed[0].to_m.z = -0.052,
        );
        let mut hands = Hands::new(&scene, 0.008);
        let push_n = |hands: &Hands| hands.rig.output.device[0].force.length();
        for tick in 0..1500 {
            // The own finger rests 2 mm deep, the other is away.
            hands.tick(|user| if user == 0 { (f64::from(tick) / 500.0).min(1.0) * 7.0 / 13.0 } else { 0.0 });
        }
        let alone_n = push_n(&hands);
        for tick in 0..1500 {
            hands.tick(|user| if user == 0 { 7.0 / 13.0 } else { (f64::from(tick) / 500.0).min(1.0) });
        }
        let pressed_n = push_n(&hands);
        assert!(pressed_n > 1.2 * alone_n, "{kind}: {alone_n} N, and {pressed_n} N");
    }
}
