//! Loops that the analysis calls stable settle in the running session, and the others grow, as fast as it says.
//!
//! Gains, delays and rates are drawn at random, with a fixed seed. The hands are moved a hair's breadth; nothing limits
//! what comes of it, and everything that moves is watched from one pattern of ticks and network steps to the next.

use crate::support::{Probe, scene};
use cotouch_analysis::analyze_settled;
use cotouch_scene::scene::Scene;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Loops of each architecture on each side of the line.
const LOOPS: usize = 5;
/// A loop whose spectral radius is nearer 1 than this would take too long to show its side.
const NEAREST: f64 = 0.003;
/// A loop that grows faster than this a pattern leaves too few patterns to measure.
const FASTEST: f64 = 1.3;
/// How far the first hand is moved, m: the loop is linear and rests at exactly zero, so that this may be as little as it takes
/// for a growth by nine orders to stay below every limit.
const MOVE_M: f64 = 1e-12;
/// Draws after which there must have been enough loops of either kind.
const MAX_DRAWS: usize = 2000;

struct Drawn {
    scene: Scene,
    radius: f64,
    label: String,
}

fn between(random: &mut Pcg64Mcg, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random::<f64>())
}

fn one_of<T: Copy>(random: &mut Pcg64Mcg, among: &[T]) -> T {
    among[random.random_range(0..among.len())]
}

fn draw(random: &mut Pcg64Mcg, architecture: &str) -> Drawn {
    let mut settings = vec![
        format!("session.architecture={architecture}"),
        format!("session.users={}", one_of(random, &[2, 2, 3])),
        format!("link.delay_periods={}", one_of(random, &[0, 1, 2, 3])),
        format!("rates.network_hz=1024/{}", one_of(random, &[1, 2, 5, 8])),
        format!("hand.stiffness_n_per_m={}", one_of(random, &[0, 50, 400])),
        format!("hand.damping_n_s_per_m={}", one_of(random, &[0, 1, 3])),
        format!("wall.stiffness_n_per_m={}", one_of(random, &[0, 0, 2000])),
        "governor.max_force_n=1000".to_owned(),
        "governor.max_slew_n_per_s=1e9".to_owned(),
    ];
    for (coupling, stiffness) in
        [("hand_object", 1500.0), ("remote_hand_object", 300.0), ("object_object", 300.0)]
    {
        let stiffness = between(random, stiffness / 4.0, stiffness * 4.0);
        let damping = stiffness * between(random, 0.003, 0.02);
        settings.push(format!("coupling.{coupling}.stiffness_n_per_m={stiffness}"));
        settings.push(format!("coupling.{coupling}.damping_n_s_per_m={damping}"));
    }
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let scene = scene(&settings);
    let radius = analyze_settled(&scene).unwrap().spectral_radius;
    Drawn { scene, radius, label: format!("{} with radius {radius}", settings.join(" ")) }
}

/// What everything that moves does in a session after one hand was moved, pattern by pattern.
struct Watched(Probe);

impl Watched {
    fn new(scene: &Scene) -> Self {
        let mut probe = Probe::at_rest(scene);
        probe.move_hands(MOVE_M);
        Self(probe)
    }

    /// The largest distance between bodies (m), or difference of their speeds (a thousandth of m/s), of `patterns`.
    fn largest(&mut self, patterns: u64) -> f64 {
        let size = |bodies: Vec<(f64, f64)>| {
            let (x, v) = bodies[0];
            let difference = |&(other, speed): &(f64, f64)| (other - x).abs().max((speed - v).abs() * 1e-3);
            bodies.iter().map(difference).fold(0.0, f64::max)
        };
        (0..patterns).map(|_| size(self.0.run_pattern())).fold(0.0, f64::max)
    }
}

fn assert_settles(Drawn { scene, radius, label }: &Drawn) {
    let mut watched = Watched::new(scene);
    let patterns = ((1e-5_f64).ln() / radius.ln()).ceil() as u64;
    let first = watched.largest(patterns.div_ceil(3));
    watched.largest(patterns.div_ceil(3));
    let last = watched.largest(patterns.div_ceil(3));
    assert!(first > 0.0 && last < 0.05 * first, "{label}: from {first} to {last}");
}

fn assert_grows(Drawn { scene, radius, label }: &Drawn) {
    let mut watched = Watched::new(scene);
    let patterns = |times: f64| (times.ln() / radius.ln()).ceil() as u64;
    let window = patterns(10.0);
    watched.largest(patterns(1e4));
    let between = patterns(1e3);
    let before = watched.largest(window);
    watched.largest(between);
    let after = watched.largest(window);
    let measured = (after / before).powf(1.0 / (window + between) as f64);
    assert!(after > 100.0 * before, "{label}: from {before} to {after}");
    assert!((measured / radius - 1.0).abs() < 0.01, "{label}: grew by {measured} a pattern");
    // Near 1 a hundredth would say little.
    assert!((measured.ln() / radius.ln() - 1.0).abs() < 0.1, "{label}: grew by {measured} a pattern");
}

fn check(architecture: &str, seed: u64) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let (mut stable, mut unstable) = (0, 0);
    for _ in 0..MAX_DRAWS {
        let drawn = draw(&mut random, architecture);
        if (drawn.radius - 1.0).abs() < NEAREST || drawn.radius > FASTEST {
            continue;
        }
        if drawn.radius < 1.0 && stable < LOOPS {
            stable += 1;
            assert_settles(&drawn);
        } else if drawn.radius > 1.0 && unstable < LOOPS {
            unstable += 1;
            assert_grows(&drawn);
        } else if stable == LOOPS && unstable == LOOPS {
            break;
        }
    }
    assert_eq!((stable, unstable), (LOOPS, LOOPS));
}

#[test]
fn distributed_loops_settle_or_grow_as_predicted() {
    check("distributed", 1);
}

#[test]
fn centralized_loops_settle_or_grow_as_predicted() {
    check("centralized", 2);
}
