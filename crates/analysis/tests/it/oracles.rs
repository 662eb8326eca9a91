//! Closed forms that share nothing with the tick-by-tick product.

use cotouch_analysis::analyze_loop;
use cotouch_analysis::loop_spec::{Delay, Dynamics, LINE, Line, LoopBody, LoopSpec, Motion, Plant, Signal};
use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::SpringDamper;
use cotouch_scene::time::{Rate, Schedule};
use cotouch_testkit::scenes::spring;

const MASS_KG: f64 = 0.5;
/// Ticks in the delay: the map approaches the continuous loop as they grow.
const TICKS: u64 = 24;

/// Two masses, each pulled by `pull` towards where the other was `delay_s` ago, each braked by `brake`.
fn two_masses(pull: SpringDamper, brake_n_s_per_m: f64, delay_s: f64) -> LoopSpec {
    let rate = Rate::new((TICKS as f64 / delay_s * 1e6).round() as u64, 1_000_000).unwrap();
    let mut spec = LoopSpec::new(Schedule::new(rate, rate).unwrap());
    let bodies = [0, 1].map(|index| {
        let host = HostIndex(index);
        let states =
            [Quantity::X, Quantity::V].map(|quantity| Coordinate::Own { host, part: Part::HAND, quantity });
        let dynamics = Dynamics::Plant(Plant::mass(MASS_KG, spring(0.0, brake_n_s_per_m)));
        spec.body(LoopBody { states: states.to_vec(), axes: LINE, dynamics })
    });
    for (own, other) in [(0, 1), (1, 0)] {
        let line = spec.line(Line {
            host: HostIndex(own as u8),
            from: HostIndex(other as u8),
            part: Part::HAND,
            signal: Signal::Motion(bodies[other]),
            delay: Delay::OnArrival { transit_ticks: TICKS },
        });
        spec.pull(bodies[own], Motion::Held(line), pull);
    }
    spec
}

fn is_stable(spec: &LoopSpec) -> bool {
    let verdict = analyze_loop(spec).unwrap();
    assert_eq!(verdict.rigid_body_poles, 1);
    verdict.stable
}

/// Positions over a delay, dampers to the ground: stable for every delay iff k ≤ b²/(2m), else up to (π − φ)/ω.
#[test]
fn grounded_dampers_with_delayed_positions() {
    let (k, b, m) = (200.0, 6.0, MASS_KG);
    let omega = ((2.0 * k * m - b * b) / (m * m)).sqrt();
    let limit_s = (std::f64::consts::PI - (b * omega).atan2(k - m * omega * omega)) / omega;
    assert!(is_stable(&two_masses(spring(k, 0.0), b, 0.9 * limit_s)));
    assert!(!is_stable(&two_masses(spring(k, 0.0), b, 1.05 * limit_s)));
    let safe = b * b / (2.0 * m);
    assert!(is_stable(&two_masses(spring(0.8 * safe, 0.0), b, 0.3)));
}

/// A relative coupler over a delay: stable up to 2·atan(bω/k)/ω, ω² = 2k/m.
#[test]
fn a_relative_coupler_over_a_delay() {
    let (k, b, m) = (200.0f64, 6.0, MASS_KG);
    let omega = (2.0 * k / m).sqrt();
    let limit_s = 2.0 * (b * omega / k).atan() / omega;
    assert!(is_stable(&two_masses(spring(k, b), 0.0, 0.9 * limit_s)));
    assert!(!is_stable(&two_masses(spring(k, b), 0.0, 1.05 * limit_s)));
}
