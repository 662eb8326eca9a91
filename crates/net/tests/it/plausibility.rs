//! What samples can be: honest motions pass, whatever is lost of them; what passes is within the stated bounds.

use std::f64::consts::TAU;

use cotouch_net::{Before, Entry, Implausible, Plausibility, StatePacket, What};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::names::HostIndex;
use cotouch_testkit::built_in;
use glam::{DQuat, DVec3};
use proptest::prelude::*;

const ME: HostIndex = HostIndex(0);
const OTHER: HostIndex = HostIndex(1);

fn sample(step: u64, hand: (Pose, Twist), body: (Pose, Twist)) -> StatePacket {
    let hand = Entry::Hand { point: 0, pose: hand.0, twist: hand.1 };
    let body = Entry::Object { object: 0, pose: body.0, twist: body.1 };
    StatePacket { step, entries: [hand, body].into_iter().collect() }
}

fn still() -> (Pose, Twist) {
    (Pose::default(), Twist::default())
}

fn can_be() -> Plausibility {
    Plausibility::new(&built_in("single-axis", &[]))
}

proptest! {
    /// A hand that swings as fast and as suddenly as hands can, whose samples get lost in stretches.
    #[test]
    fn an_honest_swing_passes(
        hz in 0.1..20.0_f64,
        share in 0.0..1.0_f64,
        phase in 0.0..TAU,
        kept in proptest::collection::vec(1_u64..200, 1..40),
    ) {
        let w = TAU * hz;
        let reach_m = share * (10.0 / w).min(500.0 / w.powi(2)).min(2.0);
        let at = |step: u64| {
            let angle = w * step as f64 / 128.0 + phase;
            let twist = Twist { linear: DVec3::X * reach_m * w * angle.cos(), angular: DVec3::ZERO };
            (Pose::at(DVec3::X * reach_m * angle.sin()), twist)
        };
        let (can_be, mut step) = (can_be(), 0);
        let mut last = sample(0, at(0), still());
        for gap in kept {
            step += gap;
            let next = sample(step, at(step), still());
            prop_assert_eq!(can_be.check(OTHER, ME, Some(&Before::sample(&last)), &next), Ok(()));
            last = next;
        }
    }

    /// Whatever is sent, there is no panic, and what passes is where and as fast as the documentation says.
    #[test]
    fn what_passes_is_within_bounds(
        x in prop_oneof![any::<f64>(), -60.0..60.0],
        v in prop_oneof![any::<f64>(), -70.0..70.0],
        body_x in prop_oneof![any::<f64>(), -1100.0..1100.0],
        point in 0..3_u8,
        object in prop_oneof![Just(0_u8), any::<u8>()],
        twice in any::<bool>(),
        step in 1..500_u64,
    ) {
        let twist = Twist { linear: DVec3::X * v, angular: DVec3::ZERO };
        let mut packet = sample(step, still(), still());
        packet.entries[0] = Entry::Hand { point, pose: Pose::at(DVec3::X * x), twist };
        let body = Entry::Object { object, pose: Pose::at(DVec3::X * body_x), twist: Twist::default() };
        packet.entries[1] = body;
        if twice {
            packet.entries.push(body);
        }
        let (can_be, last) = (can_be(), sample(0, still(), still()));
        if can_be.check(OTHER, ME, None, &packet).is_ok() {
            prop_assert!(x.abs() <= 51.0 && v.abs() <= 60.0 && body_x.abs() <= 1e3);
            prop_assert!(point == 0 && object == 0 && !twice);
        }
        if can_be.check(OTHER, ME, Some(&Before::sample(&last)), &packet).is_ok() {
            let t = step as f64 / 128.0;
            // 0.1 kg and 20 N.
            let acceleration = 500.0 + 2.0 * 200.0;
            prop_assert!(x.abs() <= v.abs() * t + acceleration * t * t / 4.0 + 0.02 + 1e-9);
            prop_assert!(v.abs() <= acceleration * t + 1.0 + 1e-9);
        }
    }
}

#[test]
fn a_jump_a_jolt_and_a_turn_are_told_with_what_was_possible() {
    let (can_be, last) = (can_be(), sample(9, still(), still()));
    let refused = |hand, body| {
        can_be.check(OTHER, ME, Some(&Before::sample(&last)), &sample(10, hand, body)).unwrap_err()
    };
    let aside = (Pose::at(DVec3::X * 0.1), Twist::default());
    let Implausible::Jump { what: What::Finger(0), found, allowed } = refused(aside, still()) else {
        panic!()
    };
    // 900 m/s² for a 128th of a second, and 20 mm.
    assert!(found == 0.1 && (allowed - (0.02 + 900.0 / 4.0 / 128.0_f64.powi(2))).abs() < 1e-12);
    assert!(refused(aside, still()).may_be_accident() && !refused(still(), aside).may_be_accident());
    let fast = (Pose::default(), Twist { linear: DVec3::Y * 50.0, angular: DVec3::ZERO });
    assert!(matches!(refused(fast, still()), Implausible::Jolt { what: What::Finger(0), .. }));
    let turned = (Pose { orientation: DQuat::from_rotation_y(3.0), ..Pose::default() }, Twist::default());
    assert!(matches!(refused(still(), turned), Implausible::Twist { what: What::Body(0), .. }));
}
