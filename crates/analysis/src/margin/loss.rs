//! How many packets may be lost.
//!
//! Every packet from one host to another is lost with the same probability p, independently of all others; the receiver
//! goes on with what it had. Over one pattern the state is then multiplied by one of several maps `A_o`, each with its
//! probability, and its second moment `X = E[z·zᵀ]` by the linear operator
//!
//! ```text
//! X → Σ_o probability(o)·A_o·X·A_oᵀ
//! ```
//!
//! which keeps positive semidefinite matrices so; the mean square dies out iff the largest eigenvalue of this operator,
//! which is real (Perron, Frobenius; Krein & Rutman 1948), is below 1. It is found by Arnoldi's iteration on
//! matrices. What all `A_o` leave as it is (moving everything) is removed first.
//!
//! Where samples of motions are all that is sent, once a pattern, a lost packet changes rows that no other packet
//! changes, so the maps are `A_0 + Σ_l lost_l·D_l`, and with `Ā = A_0 + p·Σ_l D_l` the operator is
//! `X → Ā·X·Āᵀ + p·(1 − p)·Σ_l D_l·X·D_lᵀ` for any number of packets. Else every combination of losses is taken.

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use nalgebra::{DMatrix, DVector};

use super::Found;
use crate::check::check;
use crate::compile::compile;
use crate::crossing::crossing;
use crate::deflate::deflate;
use crate::eigenvalues::{EigenvalueError, balance, eigenvalues};
use crate::evaluator::PointVerdict;
use crate::lift::layout::Layout;
use crate::lift::stepping::lift_with_losses;
use crate::loop_spec::{LoopSpec, Signal};
use crate::rigid::Structure;
use crate::stability::AnalysisError;
use crate::sweep::SweepError;

/// Combinations of losses are taken one by one up to so many packets a pattern.
const MOST_PACKETS: usize = 8;
/// Second moments of larger states take too long.
const MOST_STATES: usize = 120;
/// Losses that are looked at before the one that matters is narrowed down.
const LOOKS: u32 = 24;
/// As good as everything is lost.
const HIGHEST: f64 = 0.9999;
/// Of a probability.
const ACCURACY: f64 = 1e-9;
/// A largest eigenvalue this little above 1 is 1 but for rounding.
const NEUTRAL: f64 = 1e-10;

pub(super) fn margin(scene: &Scene, progress: &dyn Fn(f64)) -> Result<Found<f64>, SweepError> {
    let modes = compile(scene);
    let mut lowest = HIGHEST;
    let mut is_limited = false;
    for (index, mode) in modes.iter().enumerate() {
        let moments = match SecondMoments::new(&mode.spec).map_err(SweepError::from)? {
            Ok(moments) => moments,
            Err(note) => return Ok(Err(note)),
        };
        if let Some(rate) = moments.critical_below(lowest).map_err(AnalysisError::from)? {
            (lowest, is_limited) = (rate, true);
        }
        progress((index + 1) as f64 / modes.len() as f64);
    }
    Ok(if is_limited {
        Ok(lowest)
    } else {
        Err(format!("The scene stays stable in the mean square up to a loss of {} %.", 100.0 * HIGHEST))
    })
}

/// How second moments change over a pattern.
struct SecondMoments {
    maps: Maps,
    size: usize,
}

enum Maps {
    /// `A_0` and the `D_l`.
    Sum(DMatrix<f64>, Vec<DMatrix<f64>>),
    /// The maps with the number of lost packets in each, and the number of all packets.
    Each(Vec<(i32, DMatrix<f64>)>, i32),
}

impl SecondMoments {
    fn new(spec: &LoopSpec) -> Result<Found<Self>, AnalysisError> {
        check(spec)?;
        let layout = Layout::with_memory(spec);
        if layout.coordinates.len() > MOST_STATES {
            return Ok(Err(format!(
                "The loss margin is only computed for loops of up to {MOST_STATES} states; this one has {}.",
                layout.coordinates.len()
            )));
        }
        let packets = packets(spec);
        let is_sum = spec.schedule.steps_per_pattern() == 1
            && spec.lines.iter().all(|line| matches!(line.signal, Signal::Motion(_)));
        if !is_sum && packets.len() > MOST_PACKETS {
            return Ok(Err(format!(
                "The loss margin is only computed for up to {MOST_PACKETS} packets a pattern where forces are sent or several network steps make a pattern; here are {}.",
                packets.len()
            )));
        }
        let lift = |lost: &dyn Fn(usize) -> bool| {
            lift_with_losses(spec, &layout, &|step, line| {
                let line = &spec.lines[line.0];
                let packet = Packet { step, from: line.from, to: line.host };
                packets.iter().position(|&other| other == packet).is_some_and(lost)
            })
        };
        let whole = lift(&|_| false);
        let mut maps = if is_sum {
            let one = |packet: usize| lift(&|other| other == packet);
            (0..packets.len()).map(one).collect()
        } else {
            (1..1_usize << packets.len())
                .map(|set| lift(&|packet| set >> packet & 1 == 1))
                .collect::<Vec<_>>()
        };
        let structure = Structure::new(spec, &layout, &whole);
        maps.insert(0, whole);
        let maps = without_common(maps, structure.rigid);
        let size = maps[0].nrows();
        let maps = if is_sum {
            let differences = maps[1..].iter().map(|map| map - &maps[0]).collect();
            Maps::Sum(maps[0].clone(), differences)
        } else {
            let lost = |set: usize| set.count_ones() as i32;
            Maps::Each(
                maps.into_iter().enumerate().map(|(set, map)| (lost(set), map)).collect(),
                packets.len() as i32,
            )
        };
        Ok(Ok(Self { maps, size }))
    }

    /// The lowest loss below `highest` from which on the mean square does not die out.
    fn critical_below(&self, highest: f64) -> Result<Option<f64>, EigenvalueError> {
        let mut last = (0.0, PointVerdict { spectral_radius: self.growth(0.0)?, stable: true });
        for look in 1..=LOOKS {
            let rate = highest * (f64::from(look) / f64::from(LOOKS)).powi(2);
            let verdict = self.verdict(rate)?;
            if !verdict.stable {
                let width = rate - last.0;
                let share = crossing(last.1, verdict, ACCURACY / width, |share| {
                    self.verdict(last.0 + share * width)
                })?;
                return Ok(Some(last.0 + share * width));
            }
            last = (rate, verdict);
        }
        Ok(None)
    }

    fn verdict(&self, rate: f64) -> Result<PointVerdict, EigenvalueError> {
        let spectral_radius = self.growth(rate)?;
        Ok(PointVerdict { spectral_radius, stable: spectral_radius < 1.0 + NEUTRAL })
    }

    /// The operator at work.
    fn after_a_pattern(&self, rate: f64, moments: &DMatrix<f64>) -> DMatrix<f64> {
        let through = |map: &DMatrix<f64>| map * moments * map.transpose();
        match &self.maps {
            Maps::Sum(whole, differences) => {
                let mean = differences.iter().fold(whole.clone(), |sum, difference| sum + difference * rate);
                let spread = differences.iter().map(through);
                spread.fold(through(&mean), |sum, next| sum + next * (rate * (1.0 - rate)))
            }
            Maps::Each(maps, packets) => {
                let chance = |lost: i32| rate.powi(lost) * (1.0 - rate).powi(packets - lost);
                let zero = DMatrix::zeros(self.size, self.size);
                maps.iter().fold(zero, |sum, (lost, map)| sum + through(map) * chance(*lost))
            }
        }
    }

    /// The operator's largest eigenvalue.
    fn growth(&self, rate: f64) -> Result<f64, EigenvalueError> {
        const MOST_VECTORS: usize = 60;
        const RESTARTS: usize = 8;
        const RELATIVE: f64 = 1e-12;
        if self.size == 0 {
            return Ok(0.0);
        }
        let mut start = DMatrix::identity(self.size, self.size);
        let mut growth = 0.0;
        for _ in 0..RESTARTS {
            let mut basis = vec![start.normalize()];
            let mut projected = DMatrix::<f64>::zeros(MOST_VECTORS + 1, MOST_VECTORS);
            for count in 1..=MOST_VECTORS {
                let mut next = self.after_a_pattern(rate, &basis[count - 1]);
                let before = next.norm();
                // Twice, because once is not orthogonal enough.
                for _ in 0..2 {
                    for (row, vector) in basis.iter().enumerate() {
                        let share = vector.dot(&next);
                        projected[(row, count - 1)] += share;
                        next -= vector * share;
                    }
                }
                let rest = next.norm();
                let is_invariant = rest <= 1e-14 * before;
                if count.is_multiple_of(5) || is_invariant {
                    let square = projected.view((0, 0), (count, count)).into_owned();
                    let values = eigenvalues(&square)?;
                    let largest = values.iter().map(|value| value.norm()).fold(0.0, f64::max);
                    if is_invariant || (largest - growth).abs() <= RELATIVE * largest {
                        return Ok(largest);
                    }
                    growth = largest;
                }
                projected[(count, count - 1)] = rest;
                basis.push(next / rest);
            }
            // Some steps of the operator itself bring the start nearer to where it tends to.
            for _ in 0..MOST_VECTORS {
                start = self.after_a_pattern(rate, &start).normalize();
            }
        }
        Ok(growth)
    }
}

/// What one host sends to another at one network step of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Packet {
    step: i64,
    from: HostIndex,
    to: HostIndex,
}

fn packets(spec: &LoopSpec) -> Vec<Packet> {
    let steps = 0..spec.schedule.steps_per_pattern() as i64;
    let mut packets: Vec<Packet> = steps
        .flat_map(|step| spec.lines.iter().map(move |line| Packet { step, from: line.from, to: line.host }))
        .collect();
    packets.sort_unstable();
    packets.dedup();
    packets
}

/// The maps in a well-scaled basis, without the directions of `candidates` that all of them leave as they are.
fn without_common(mut maps: Vec<DMatrix<f64>>, candidates: Vec<DVector<f64>>) -> Vec<DMatrix<f64>> {
    let scales = balance(&mut maps[0].clone());
    for map in &mut maps {
        for (index, &scale) in scales.iter().enumerate() {
            map.column_mut(index).scale_mut(scale);
            map.row_mut(index).scale_mut(scale.recip());
        }
    }
    let unscale = |vector: &DVector<f64>| DVector::from_fn(vector.len(), |i, _| vector[i] / scales[i]);
    let mut vectors: Vec<_> = candidates.iter().map(unscale).collect();
    vectors.reverse();
    while let Some(vector) = vectors.pop() {
        let stays = |map: &DMatrix<f64>| {
            (map * &vector - &vector).norm() <= 1e-9 * (1.0 + map.norm()) * vector.norm()
        };
        if !maps.iter().all(stays) {
            continue;
        }
        let mut reflection = None;
        for map in &mut maps {
            let (reduced, by) = deflate(map, &vector);
            (*map, reflection) = (reduced, Some(by));
        }
        for later in &mut vectors {
            *later = reflection.as_ref().map_or_else(|| later.clone(), |by| by.deflate_vector(later));
        }
    }
    maps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::analyze_loop;

    fn specs() -> Vec<LoopSpec> {
        let load = |name: &str, periods: f64| {
            let scene = cotouch_scene::load(name, &[]).unwrap();
            let scene = cotouch_scene::with_override(&scene, "link.delay_periods", periods).unwrap();
            compile(&scene).remove(0).spec
        };
        ["single-axis", "single-axis-centralized"]
            .into_iter()
            .flat_map(|name| [0.0, 1.0, 2.0].map(|periods| load(name, periods)))
            .collect()
    }

    fn moments(spec: &LoopSpec) -> SecondMoments {
        SecondMoments::new(spec).unwrap().unwrap()
    }

    #[test]
    fn without_loss_it_is_the_square_of_the_spectral_radius() {
        for spec in specs() {
            let radius = analyze_loop(&spec).unwrap().spectral_radius;
            let growth = moments(&spec).growth(0.0).unwrap();
            assert!((growth - radius * radius).abs() < 1e-9, "{growth} {}", radius * radius);
        }
    }

    #[test]
    fn losses_add_up_as_said() {
        for spec in &specs()[..3] {
            let sum = moments(spec);
            let layout = Layout::with_memory(spec);
            let packets = packets(spec);
            let all: Vec<_> = (0..1_usize << packets.len())
                .map(|set| {
                    lift_with_losses(spec, &layout, &|step, line| {
                        let line = &spec.lines[line.0];
                        let packet = Packet { step, from: line.from, to: line.host };
                        set >> packets.iter().position(|&p| p == packet).unwrap() & 1 == 1
                    })
                })
                .collect();
            let rigid = Structure::new(spec, &layout, &all[0]).rigid;
            let maps = without_common(all, rigid).into_iter().enumerate();
            let maps = maps.map(|(set, map)| (set.count_ones() as i32, map)).collect();
            let each = SecondMoments { size: sum.size, maps: Maps::Each(maps, packets.len() as i32) };
            for rate in [0.1, 0.5, 0.9] {
                let (sum, each) = (sum.growth(rate).unwrap(), each.growth(rate).unwrap());
                assert!((sum - each).abs() < 1e-9 * each, "{sum} {each}");
            }
        }
    }

    #[test]
    fn the_mean_square_grows_beyond_the_critical_loss() {
        let mut limits = 0;
        for spec in specs() {
            let moments = moments(&spec);
            // Moments of an unstable loop grow without any loss.
            if moments.growth(0.0).unwrap() >= 1.0 {
                continue;
            }
            if let Some(rate) = moments.critical_below(HIGHEST).unwrap() {
                limits += 1;
                assert!(moments.growth(rate * (1.0 - 1e-6)).unwrap() < 1.0, "{rate}");
                assert!(moments.growth(rate * (1.0 + 1e-6)).unwrap() > 1.0, "{rate}");
            }
        }
        assert!(limits > 0);
    }

    /// Packets that a seeded generator loses, pattern after pattern: the mean of z·zᵀ is what the operator says.
    #[test]
    fn the_mean_square_is_that_of_simulated_losses() {
        let mut seed = 12_345_u64;
        let mut number = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let spec = &specs()[4];
        let moments = moments(spec);
        let Maps::Each(maps, packets) = &moments.maps else { panic!("forces are sent") };
        let (rate, patterns, runs) = (0.3, 12, 20_000);
        let start = DVector::from_fn(moments.size, |i, _| if i % 3 == 0 { 1.0 } else { -0.5 });
        let expected =
            (0..patterns).fold(&start * start.transpose(), |m, _| moments.after_a_pattern(rate, &m));
        let mut sum = 0.0;
        for _ in 0..runs {
            let mut state = start.clone();
            for _ in 0..patterns {
                let set = (0..*packets).fold(0, |set, packet| set | usize::from(number() < rate) << packet);
                state = &maps[set].1 * state;
            }
            sum += state.norm_squared();
        }
        let (mean, expected) = (sum / f64::from(runs), expected.trace());
        assert!((mean - expected).abs() < 0.03 * expected, "{mean} {expected}");
    }
}
