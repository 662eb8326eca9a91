use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::SpringDamper;
use cotouch_scene::with_override;

use super::*;
use crate::loop_spec::{BodyId, Delay, Dynamics, LINE, Line, LoopBody, Motion, Plant, Signal};

const MASS_KG: f64 = 0.5;
const DAMPING: f64 = 2.0;
const STIFFNESS: f64 = 200.0;

/// Ticks and network steps so fast that the closed forms of continuous time hold to a few thousandths.
fn scene(settings: &[&str]) -> Scene {
    let rates = ["rates.control_hz=20000", "rates.network_hz=20000", "link.delay_periods=0"];
    let settings: Vec<_> = rates.iter().chain(settings).map(|setting| setting.parse().unwrap()).collect();
    cotouch_scene::load("single-axis", &settings).unwrap()
}

/// One mass at each host, drawn to what it knows of the other by a spring, damped against the ground.
fn two_masses(scene: &Scene) -> LoopSpec {
    let mut spec = LoopSpec::new(scene.schedule());
    let hosts = [HostIndex(0), HostIndex(1)];
    let spring = |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
    for host in hosts {
        let name = |quantity| Coordinate::Own { host, part: Part::HAND, quantity };
        let states = vec![name(Quantity::Position(Axis::X)), name(Quantity::Velocity(Axis::X))];
        let dynamics = Dynamics::Plant(Plant::mass(MASS_KG, spring(0.0, DAMPING)));
        spec.body(LoopBody { states, axes: LINE, dynamics });
    }
    for (host, from) in [(0, 1), (1, 0)] {
        let line = spec.line(Line {
            host: hosts[host],
            from: hosts[from],
            part: Part::HAND,
            signal: Signal::Motion(BodyId(from)),
            delay: Delay::NONE,
        });
        spec.pull(BodyId(host), Motion::Held(line), spring(STIFFNESS, 0.0));
    }
    spec
}

fn row(scene: &Scene, duration_s: f64, direction: OutageDirection) -> Outage {
    let outages = SessionOutages::new(scene, &two_masses(scene)).rows(&[duration_s], &|_| true).unwrap();
    outages.rows.into_iter().find(|row| row.direction == direction).unwrap()
}

/// A mass that 1 N pushes and a spring of stiffness k draws to 0, after so long: where it is and how fast.
fn moved((x, v): (f64, f64), k: f64, duration_s: f64) -> (f64, f64) {
    let decay = DAMPING / (2.0 * MASS_KG);
    if k == 0.0 {
        let end = 1.0 / DAMPING;
        let left = (-2.0 * decay * duration_s).exp();
        return (x + end * duration_s + (v - end) * (1.0 - left) / (2.0 * decay), end + (v - end) * left);
    }
    let (rest, w) = (1.0 / k, (k / MASS_KG - decay * decay).sqrt());
    let (away, swing) = (x - rest, (v + decay * (x - rest)) / w);
    let (sine, cosine) = (w * duration_s).sin_cos();
    let left = (-decay * duration_s).exp();
    let place = left * (away * cosine + swing * sine);
    (rest + place, -decay * place + left * w * (swing * cosine - away * sine))
}

/// The largest `stiffness·x` of such a mass from a start on.
fn largest(start: (f64, f64), k: f64) -> f64 {
    (0..20_000)
        .map(|tick| k * moved(start, k, f64::from(tick) * 1e-4).0)
        .fold(0.0, |most, x| most.max(x.abs()))
}

fn assert_near(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 0.01, "{found} instead of {expected}");
}

/// Both push away from each other: each is held by where the other was, and then by where it is.
#[test]
fn two_masses_that_push_apart_while_samples_are_held() {
    let scene = scene(&[]);
    for duration_s in [0.02, 0.1, 0.2] {
        let outage = row(&scene, duration_s, OutageDirection::Both);
        assert_eq!(outage.lets_go_after_s, None);
        let held = moved((0.0, 0.0), STIFFNESS, duration_s);
        // By symmetry the other is as far on the other side: twice the spring.
        assert_near(outage.peak_force_n_per_n, largest(held, 2.0 * STIFFNESS));
        assert_near(outage.undisturbed_force_n_per_n, largest((0.0, 0.0), 2.0 * STIFFNESS));
        let [one, other] = &outage.worst.pushes[..] else { panic!("two hands") };
        assert_eq!(one.force_n[0] * other.force_n[0], -1.0);
        // Independent pushes: the sum and the difference of two move each for itself, with half of the mean square.
        assert!(outage.expected_force_n_per_n <= outage.peak_force_n_per_n);
        assert!(outage.expected_force_n_per_n >= outage.peak_force_n_per_n / 2.0_f64.sqrt());
    }
}

/// Nobody draws at them any more: they drift, until samples arrive again.
#[test]
fn two_masses_that_let_go_of_each_other_drift() {
    let scene = scene(&["session.peer_timeout_s=0.15", "session.peer_fade_s=0", "governor.max_force_n=5"]);
    let duration_s = 0.4;
    let outage = row(&scene, duration_s, OutageDirection::Both);
    assert!((outage.lets_go_after_s.unwrap() - 0.15).abs() < 1e-3);
    let held = moved((0.0, 0.0), STIFFNESS, 0.15);
    let apart = moved(held, 0.0, duration_s - 0.15);
    let force = largest(apart, 2.0 * STIFFNESS);
    assert!(force > 10.0 * outage.undisturbed_force_n_per_n, "{outage:?}");
    assert_near(outage.peak_force_n_per_n, force);
    assert_near(outage.limited_from_n.unwrap(), 5.0 / force);
    // What one knows of the other is where that was at first.
    assert_near(outage.excursion_m_per_n, apart.0);
    // What both springs give until they have come together.
    assert_near(outage.energy_j_per_n2, 2.0 * 0.5 * (2.0 * STIFFNESS) * apart.0.powi(2));
}

/// One goes on hearing the other, which does not hear it.
#[test]
fn one_way_the_deaf_one_alone_is_drawn_to_where_the_other_was() {
    let scene = scene(&[]);
    let (both, one_way) =
        (row(&scene, 0.1, OutageDirection::Both), row(&scene, 0.1, OutageDirection::OneWay));
    assert!(one_way.worst.silent.is_some() && both.worst.silent.is_none());
    assert!(one_way.peak_force_n_per_n < both.peak_force_n_per_n);
    assert!(one_way.peak_force_n_per_n > one_way.undisturbed_force_n_per_n * 0.99);
}

#[test]
fn a_built_in_scene_has_its_rows_and_says_whether_it_drifts() {
    let at_once = "session.rejoin_s=0".parse().unwrap();
    let scene = cotouch_scene::load("single-axis", &[at_once]).unwrap();
    let found = outages(&scene, &[0.0078125, 0.6], &|_| true).unwrap();
    let steps: Vec<_> = found.rows.iter().map(|row| (row.direction, row.lost_steps)).collect();
    let both_ways = [OutageDirection::Both, OutageDirection::OneWay];
    assert_eq!(
        steps,
        [1, 77].into_iter().flat_map(|steps| both_ways.map(|way| (way, steps))).collect::<Vec<_>>()
    );
    assert!(found.notes[0].contains("drifts away"), "{:?}", found.notes);
    // A single lost packet makes hardly a difference; a long outage makes a large one.
    let peaks: Vec<f64> =
        found.rows.iter().map(|row| row.peak_force_n_per_n / row.undisturbed_force_n_per_n).collect();
    assert!(peaks[0] < 1.3 && peaks[2] > 2.5, "{peaks:?}");
    let tied = with_override(&scene, "hand.stiffness_n_per_m", 200.0).unwrap();
    let tied = outages(&tied, &[0.6], &|_| true).unwrap();
    assert!(
        tied.notes[0].contains("does not drift")
            && tied.rows[0].peak_force_n_per_n < found.rows[2].peak_force_n_per_n,
        "{tied:?}"
    );
    assert!(matches!(outages(&scene, &[0.6], &|_| false), Err(SweepError::GivenUp)));
}

#[test]
fn hosts_that_bring_together_slowly_what_came_apart_make_a_return_harmless() {
    let settings = |rejoin: &str| {
        let scene = cotouch_scene::load("single-axis", &[rejoin.parse().unwrap()]).unwrap();
        outages(&scene, &[0.2, 0.6, 3.0], &|_| true).unwrap()
    };
    let (at_once, slowly) = (settings("session.rejoin_s=0"), settings("session.rejoin_s=1.5"));
    for (before, now) in at_once.rows.iter().zip(&slowly.rows) {
        assert!(now.peak_force_n_per_n <= before.peak_force_n_per_n, "{before:?} {now:?}");
        assert!(now.expected_force_n_per_n <= now.peak_force_n_per_n, "{now:?}");
        let added = |row: &Outage| row.peak_force_n_per_n - row.undisturbed_force_n_per_n;
        // One way, the one who is heard goes on following the other: little comes apart.
        let is_both_ways = now.direction == OutageDirection::Both;
        assert!(!is_both_ways || added(now) < 0.5 * added(before), "{before:?} {now:?}");
    }
    assert!(slowly.notes.iter().any(|note| note.contains("session.rejoin_s")), "{:?}", slowly.notes);
}
