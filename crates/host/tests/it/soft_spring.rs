//! Barbagli et al.'s spring through a host's ticks: the same numbers as Barbagli et al.'s loop written out.

use crate::common::{Rig, SPRING, scene};
use glam::DVec3;

const KO: f64 = 200.0;
const RADIUS_M: f64 = 0.005;
const N: usize = 50;

/// Barbagli et al.'s loop, positions counted into the spring.
struct Loop {
    kh: f64,
    int: f64,
    returned: &'static str,
    first_hold: bool,
    delay: usize,
}

impl Loop {
    /// Force on the spring at every tick, for a hand at `hand` (tick).
    fn forces(&self, ticks: usize, hand: impl Fn(usize) -> f64) -> Vec<f64> {
        let (mut now, mut before, mut integral) = (0.0, 0.0, 0.0);
        let mut results = Vec::new();
        let mut forces: Vec<f64> = Vec::new();
        for tick in 0..ticks {
            let period = tick / N;
            if tick % N == 0 && period > self.delay {
                before = now;
                now = results[period - 1 - self.delay];
            }
            let has_result = period > self.delay;
            let share = if self.first_hold && has_result { (tick % N) as f64 / N as f64 } else { 1.0 };
            let error = hand(tick) - (before + (now - before) * share);
            forces.push(self.kh * error + integral);
            integral += self.int / N as f64 * error;
            if (tick + 1) % N == 0 {
                let of_period = &forces[period * N..];
                let returned = match self.returned {
                    "first" => of_period[0],
                    "mean" => of_period.iter().sum::<f64>() / N as f64,
                    _ => of_period[N - 1],
                };
                results.push(returned / KO);
            }
        }
        forces
    }
}

/// How deep the hand is, m: in at once, then slowly to and fro.
fn hand(tick: usize) -> f64 {
    0.01 + 0.002 * (tick as f64 * 0.01).sin()
}

#[test]
fn ticks_are_the_published_loop() {
    for (kind, kh, int) in [("p", 0.5, 0.0), ("p", 0.95, 0.0), ("pi", 0.5, 0.3), ("pi", 0.2, 0.05)] {
        for returned in ["first", "mean", "last"] {
            for hold in ["zero", "first"] {
                for delay in [0, 1, 2] {
                    let overrides = [
                        format!("local_model.kind={kind}"),
                        format!("local_model.stiffness_ratio={kh}"),
                        format!("local_model.integral_ratio={int}"),
                        format!("local_model.returned_force={returned}"),
                        format!("local_model.hold={hold}"),
                        format!("local_model.result_delay_periods={delay}"),
                        "local_model.sides=two".to_owned(),
                    ];
                    let overrides: Vec<&str> = overrides.iter().map(String::as_str).collect();
                    let mut rig = Rig::new(&scene(SPRING, &overrides));
                    let first_hold = hold == "first";
                    let published = Loop { kh: kh * KO, int: int * KO, returned, first_hold, delay };
                    let expected = published.forces(20 * N, hand);
                    let largest = expected.iter().fold(1.0_f64, |most, force| most.max(force.abs()));
                    for (tick, force) in expected.into_iter().enumerate() {
                        let found = rig.tick(DVec3::X * (hand(tick) - RADIUS_M));
                        let wanted = DVec3::NEG_X * force;
                        let name = format!("{overrides:?} at tick {tick}: {found} for {wanted}");
                        assert!(found.distance(wanted) < 1e-9 * largest, "{name}");
                    }
                }
            }
        }
    }
}
