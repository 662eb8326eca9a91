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
//! which keeps positive semidefinite matrices so; the mean square dies out iff its spectral radius is below 1. With the
//! mean map `Ā` the operator is `X → Ā·X·Āᵀ + S(X)`, where `S(X) = Σ_o probability(o)·(A_o − Ā)·X·(A_o − Ā)ᵀ` keeps
//! semidefinite matrices so as well. So it dies out iff `Ā` is stable and what `S` makes of all that `Ā` leaves of an
//! impulse, `X → S(Σ_k Ā^k·X·(Ā^k)ᵀ)`, has a spectral radius below 1 (a small-gain theorem that is exact for positive
//! operators: Schneider 1965). `S` only reaches samples, so that Arnoldi's iteration finds that radius
//! in a few steps, however slowly the loop itself settles. What all `A_o` leave as it is (moving everything) is removed first.
//!
//! Where samples of motions are all that is sent, once a pattern, a lost packet changes rows that no other packet
//! changes, so the maps are `A_0 + Σ_l lost_l·D_l`, and with `Ā = A_0 + p·Σ_l D_l` the second part is
//! `p·(1 − p)·Σ_l D_l·X·D_lᵀ` for any number of packets. Else every combination of losses is taken.

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::found::{Found, go_on};
use crate::check::check;
use crate::crossing::crossing;
use crate::deflate::deflate;
use crate::eigenvalues::{EigenvalueError, balance, eigenvalues, spectral_radius};
use crate::lift::layout::Layout;
use crate::lift::stepping::lift_with_losses;
use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::rigid::Structure;
use crate::soft::Bodies;
use crate::sweep::SweepError;
use crate::verdict::AnalysisError;
use crate::verdict::PointVerdict;

/// Combinations of losses are taken one by one up to so many packets a pattern.
const MAX_PACKETS: usize = 8;
/// Second moments of larger states take too long.
const MAX_STATES: usize = 80;
/// Losses that are looked at before the one that matters is narrowed down.
const LOOKS: u32 = 12;
/// As good as everything is lost.
pub(super) const HIGHEST: f64 = 0.9999;
/// Of a probability.
const ACCURACY: f64 = 1e-9;
/// A mean map nearer to 1 than this is not told from one that never settles.
const UNSETTLED: f64 = 1e-9;

/// The lowest loss from which on the mean square of some contact mode does not die out; `None` where it does up to
/// [`HIGHEST`].
pub(super) fn margin(
    scene: &Scene,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Found<Option<f64>>, SweepError> {
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let of_mode = |spec: &LoopSpec| -> Result<Found<Option<f64>>, SweepError> {
        let found = match SecondMoments::new(spec)? {
            Ok(moments) => moments.critical().map_err(AnalysisError::from)?,
            Err(note) => Err(note),
        };
        let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        go_on(progress(done as f64 / modes.len() as f64))?;
        Ok(found)
    };
    let found = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let limits = found.into_iter().collect::<Found<Vec<Option<f64>>>>();
    Ok(limits.map(|limits| limits.into_iter().flatten().min_by(f64::total_cmp)))
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
        if layout.coordinates.len() > MAX_STATES {
            return Ok(Err(format!(
                "The loss margin is only computed for loops of up to {MAX_STATES} states; this one has {}.",
                layout.coordinates.len()
            )));
        }
        let packets = packets(spec);
        let is_sum = spec.network_steps() == 1 && spec.lines.iter().all(|line| line.signal.body().is_some());
        if !is_sum && packets.len() > MAX_PACKETS {
            return Ok(Err(format!(
                "The loss margin is only computed for up to {MAX_PACKETS} packets a pattern where forces are sent or several network steps make a pattern; here are {}.",
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

    /// The lowest loss from which on the mean square does not die out, where there is one.
    fn critical(&self) -> Result<Found<Option<f64>>, EigenvalueError> {
        let unsettled =
            || "A motion that hardly settles, if at all, leaves the loss margin untold.".to_owned();
        let Some(verdict) = self.verdict(0.0)? else { return Ok(Err(unsettled())) };
        let mut last = (0.0, verdict);
        for look in 1..=LOOKS {
            let rate = HIGHEST * (f64::from(look) / f64::from(LOOKS)).powi(2);
            let Some(verdict) = self.verdict(rate)? else { return Ok(Err(unsettled())) };
            if !verdict.stable {
                let width = rate - last.0;
                let share = crossing(last.1, verdict, ACCURACY / width, |share| {
                    self.verdict(last.0 + share * width).map(|verdict| verdict.unwrap_or(UNSTABLE))
                })?;
                return Ok(Ok(Some(last.0 + share * width)));
            }
            last = (rate, verdict);
        }
        Ok(Ok(None))
    }

    /// Whether the mean square dies out, by a number that is 1 where it just does not; `None` where the mean does not
    /// settle, but for rounding.
    fn verdict(&self, rate: f64) -> Result<Option<PointVerdict>, EigenvalueError> {
        let mean = self.mean(rate);
        let of_mean = spectral_radius(&eigenvalues(&mean)?);
        if (of_mean - 1.0).abs() < UNSETTLED {
            return Ok(None);
        }
        if of_mean > 1.0 {
            return Ok(Some(PointVerdict { spectral_radius: of_mean * of_mean, stable: false }));
        }
        let powers = squarings(mean);
        let left = |impulse: &DMatrix<f64>| {
            powers.iter().fold(impulse.clone(), |sum, power| power * &sum * power.transpose() + &sum)
        };
        let spectral_radius = largest_eigenvalue(self.size, |moments| self.spread(rate, &left(moments)))?;
        Ok(Some(PointVerdict { spectral_radius, stable: spectral_radius < 1.0 }))
    }

    /// Ā.
    fn mean(&self, rate: f64) -> DMatrix<f64> {
        match &self.maps {
            Maps::Sum(whole, differences) => {
                differences.iter().fold(whole.clone(), |sum, difference| sum + difference * rate)
            }
            Maps::Each(maps, packets) => {
                let zero = DMatrix::zeros(self.size, self.size);
                maps.iter().fold(zero, |sum, (lost, map)| sum + map * chance(rate, *lost, *packets))
            }
        }
    }

    /// S at work.
    fn spread(&self, rate: f64, moments: &DMatrix<f64>) -> DMatrix<f64> {
        let zero = DMatrix::zeros(self.size, self.size);
        let through = |map: &DMatrix<f64>| map * moments * map.transpose();
        match &self.maps {
            Maps::Sum(_, differences) => {
                differences.iter().map(through).fold(zero, |sum, next| sum + next) * (rate * (1.0 - rate))
            }
            Maps::Each(maps, packets) => {
                let mean = self.mean(rate);
                let part = |(lost, map): &(i32, DMatrix<f64>)| {
                    through(&(map - &mean)) * chance(rate, *lost, *packets)
                };
                maps.iter().map(part).fold(zero, |sum, next| sum + next)
            }
        }
    }
}

/// What stands for a verdict that rounding hides, while a crossing is narrowed down.
const UNSTABLE: PointVerdict = PointVerdict { spectral_radius: 1.0, stable: false };

fn chance(rate: f64, lost: i32, packets: i32) -> f64 {
    rate.powi(lost) * (1.0 - rate).powi(packets - lost)
}

/// The powers 1, 2, 4 and so on of a stable matrix, until nothing is left.
fn squarings(matrix: DMatrix<f64>) -> Vec<DMatrix<f64>> {
    const MAX: usize = 64;
    let mut powers = vec![matrix];
    while let Some(last) = powers.last().filter(|last| last.norm() > 1e-9)
        && powers.len() < MAX
    {
        let square = last * last;
        powers.push(square);
    }
    powers
}

/// The largest eigenvalue of an operator on symmetric matrices that keeps semidefinite ones so, by Arnoldi's iteration: it
/// is real (Perron, Frobenius; Krein & Rutman 1948).
fn largest_eigenvalue(
    size: usize,
    operator: impl Fn(&DMatrix<f64>) -> DMatrix<f64>,
) -> Result<f64, EigenvalueError> {
    const MAX_VECTORS: usize = 60;
    const RESTARTS: usize = 8;
    const RELATIVE: f64 = 1e-11;
    if size == 0 {
        return Ok(0.0);
    }
    let mut start = DMatrix::identity(size, size);
    let mut largest = 0.0;
    for _ in 0..RESTARTS {
        let mut basis = vec![start.normalize()];
        let mut projected = DMatrix::<f64>::zeros(MAX_VECTORS + 1, MAX_VECTORS);
        for count in 1..=MAX_VECTORS {
            let mut next = operator(&basis[count - 1]);
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
            if count.is_multiple_of(3) || is_invariant {
                let values = eigenvalues(&projected.view((0, 0), (count, count)).into_owned())?;
                let found = spectral_radius(&values);
                if is_invariant || (found - largest).abs() <= RELATIVE * found {
                    return Ok(found);
                }
                largest = found;
            }
            projected[(count, count - 1)] = rest;
            basis.push(next / rest);
        }
        // Some steps of the operator itself bring the start nearer to where it tends to.
        for _ in 0..MAX_VECTORS {
            start = operator(&start).normalize();
        }
    }
    Ok(largest)
}

/// What one host sends to another at one network step of a pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Packet {
    step: i64,
    from: HostIndex,
    to: HostIndex,
}

fn packets(spec: &LoopSpec) -> Vec<Packet> {
    let steps = 0..spec.network_steps() as i64;
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
    use crate::compile::compile;
    use crate::poles::analyze_loop;
    use cotouch_testkit::Random;

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

    impl SecondMoments {
        /// The whole operator at work.
        fn after_a_pattern(&self, rate: f64, moments: &DMatrix<f64>) -> DMatrix<f64> {
            let mean = self.mean(rate);
            &mean * moments * mean.transpose() + self.spread(rate, moments)
        }

        /// Its largest eigenvalue, from its matrix: a second way to the verdict.
        fn growth(&self, rate: f64) -> f64 {
            let entries = self.size * self.size;
            let mut operator = DMatrix::zeros(entries, entries);
            for column in 0..entries {
                let mut unit = DMatrix::zeros(self.size, self.size);
                unit[column] = 1.0;
                let after = self.after_a_pattern(rate, &unit);
                operator.column_mut(column).copy_from_slice(after.as_slice());
            }
            spectral_radius(&eigenvalues(&operator).unwrap())
        }
    }

    #[test]
    fn without_loss_it_is_the_square_of_the_spectral_radius() {
        for spec in specs() {
            let radius = analyze_loop(&spec).unwrap().spectral_radius;
            let growth = moments(&spec).growth(0.0);
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
                let moments = DMatrix::from_fn(sum.size, sum.size, |i, j| ((i * j) as f64).cos());
                let after = |of: &SecondMoments| of.after_a_pattern(rate, &moments);
                let (sum, each) = (after(&sum), after(&each));
                assert!((&sum - &each).amax() < 1e-12 * each.amax(), "{}", (sum - each).amax());
            }
        }
    }

    #[test]
    fn the_mean_square_grows_beyond_the_critical_loss() {
        let mut limits = 0;
        for spec in specs() {
            let moments = moments(&spec);
            // Moments of an unstable loop grow without any loss.
            if moments.growth(0.0) >= 1.0 {
                continue;
            }
            if let Some(rate) = moments.critical().unwrap().unwrap() {
                limits += 1;
                assert!(moments.growth(rate * (1.0 - 1e-6)) < 1.0, "{rate}");
                assert!(moments.growth(rate * (1.0 + 1e-6)) > 1.0, "{rate}");
            }
        }
        assert!(limits > 0);
    }

    /// Packets that a seeded generator loses, pattern after pattern: the mean of z·zᵀ is what the operator says.
    #[test]
    fn the_mean_square_is_that_of_simulated_losses() {
        let mut random = Random::new(12_345);
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
                let set =
                    (0..*packets).fold(0, |set, packet| set | usize::from(random.unit() < rate) << packet);
                state = &maps[set].1 * state;
            }
            sum += state.norm_squared();
        }
        let (mean, expected) = (sum / f64::from(runs), expected.trace());
        assert!((mean - expected).abs() < 0.03 * expected, "{mean} {expected}");
    }
}
