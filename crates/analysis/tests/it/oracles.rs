//! Closed forms that share nothing with the tick-by-tick product.

use cotouch_analysis::loop_spec::{Body, Delay, Dynamics, LINE, Line, LoopSpec, Motion, Plant, Signal};
use cotouch_analysis::{analyze_loop, compile};
use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Architecture, Scene, SpringDamper};
use cotouch_scene::time::{Rate, Schedule};
use cotouch_testkit::scenes::{spring, table_6_1, with_ratio};
use nalgebra::{DMatrix, dmatrix};

fn gains(spring: SpringDamper) -> DMatrix<f64> {
    dmatrix![spring.stiffness_n_per_m, spring.damping_n_s_per_m]
}

/// A free mass over `period_s` under a held force.
fn mass(mass_kg: f64, period_s: f64) -> (DMatrix<f64>, DMatrix<f64>) {
    let a = dmatrix![1.0, period_s; 0.0, 1.0];
    (a, dmatrix![period_s * period_s / (2.0 * mass_kg); period_s / mass_kg])
}

/// (4.4): `A^N` and `A^(N−1)·B + … + B`.
fn resample(a: &DMatrix<f64>, b: &DMatrix<f64>, ratio: u32) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut power = DMatrix::identity(a.nrows(), a.nrows());
    let mut sum = DMatrix::zeros(b.nrows(), b.ncols());
    for _ in 0..ratio {
        sum += &power * b;
        power = a * power;
    }
    (power, sum)
}

/// Hand and object of one host at T_c, coupled by `local`; held inputs act on the object through `remote`.
fn host(scene: &Scene, local: SpringDamper, remote: &[SpringDamper]) -> (DMatrix<f64>, DMatrix<f64>) {
    let period_s = scene.rates.control_hz.period_s();
    let ((ah, bh), (ao, bo)) = (mass(scene.hand.mass_kg, period_s), mass(scene.object.mass_kg, period_s));
    let sum = remote.iter().fold(gains(local), |sum, &spring| sum + gains(spring));
    let k = gains(local);
    let mut a = DMatrix::zeros(4, 4);
    a.view_mut((0, 0), (2, 2)).copy_from(&(ah - &bh * &k));
    a.view_mut((0, 2), (2, 2)).copy_from(&(&bh * &k));
    a.view_mut((2, 0), (2, 2)).copy_from(&(&bo * &k));
    a.view_mut((2, 2), (2, 2)).copy_from(&(ao - &bo * sum));
    let mut b = DMatrix::zeros(4, 2 * remote.len());
    for (index, &spring) in remote.iter().enumerate() {
        b.view_mut((2, 2 * index), (2, 2)).copy_from(&(&bo * gains(spring)));
    }
    (a, b)
}

fn assert_close(scene: &Scene, expected: &DMatrix<f64>) {
    let matrix = compile(scene)[0].spec.lift().unwrap().matrix;
    let difference = (&matrix - expected).amax();
    assert!(difference <= 1e-12 * expected.amax(), "off by {difference:e}");
}

#[test]
fn distributed_by_subsystem_resampling() {
    for ratio in [1, 2, 5, 8] {
        let scene = with_ratio(table_6_1(Architecture::Distributed), ratio);
        let coupling = &scene.coupling;
        let (a, b) =
            host(&scene, coupling.hand_object, &[coupling.remote_hand_object, coupling.object_object]);
        let (a, b) = resample(&a, &b, ratio);
        // (4.11): the other host's hand and object are its state.
        let mut closed = DMatrix::zeros(8, 8);
        for (own, other) in [(0, 4), (4, 0)] {
            closed.view_mut((own, own), (4, 4)).copy_from(&a);
            closed.view_mut((own, other), (4, 4)).copy_from(&b);
        }
        assert_close(&scene, &closed);
    }
}

#[test]
fn centralized_by_subsystem_resampling() {
    for ratio in [1, 2, 5, 8] {
        let scene = with_ratio(table_6_1(Architecture::Centralized), ratio);
        let remote = scene.coupling.remote_hand_object;
        let (a, b) = host(&scene, scene.coupling.hand_object, &[remote]);
        let (a, b) = resample(&a, &b, ratio);
        let (a_client, b_client) = mass(scene.hand.mass_kg, scene.rates.network_hz.period_s());
        // (4.8), with the client's force K_2·(X_o − X_h2).
        let mut closed = DMatrix::zeros(6, 6);
        closed.view_mut((0, 0), (4, 4)).copy_from(&a);
        closed.view_mut((0, 4), (4, 2)).copy_from(&b);
        closed.view_mut((4, 2), (2, 2)).copy_from(&(&b_client * gains(remote)));
        closed.view_mut((4, 4), (2, 2)).copy_from(&(a_client - &b_client * gains(remote)));
        assert_close(&scene, &closed);
    }
}

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
        spec.body(Body { states: states.to_vec(), axes: LINE, dynamics })
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
