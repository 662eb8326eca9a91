//! Gains as shares of K_o, for everything that a scene says of its slow loop.

use cotouch_scene::Scene;
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_world::local::{LawClock, local_law};
use nalgebra::DMatrix;

use cotouch_matrix::{eigenvalues, spectral_radius};

/// K_o may be wrong by this share of itself, either way.
const KO_ERROR: f64 = 0.3;
/// The stiffest way in which several contacts move together gives way by this share of the softest at least.
const MIN_COMPLIANCE: f64 = 0.35;
/// Gains that are tried, in units of K_o, and how finely.
const MAX: f64 = 2.0;
const COARSE: usize = 24;
const HALVINGS: usize = 7;
/// P has no best gain: a softer one is always more stable and feels less. This share of the largest stable one is taken.
const SHARE_OF_LARGEST: f64 = 0.5;

/// `[K_h, INT]` in units of K_o that keep the slow loop of a scene, the hands held still, farthest from instability, for
/// objects whose K_o is wrong by up to 30 % and that give way up to three times less in other directions; INT is 0 but for
/// laws that need [the gains of `pi`](cotouch_world::local::LawNeeds::gains_of_pi).
///
/// The loop, in periods, with compliance c, h = K_h/K_o, i = INT/K_o and the weights' moments m, m₂ (as in
/// [`crate::local_model`]), d the delay of results:
///
/// ```text
/// zero hold      z^d·z·(z−1) + c·(g·(z−1) + i) = 0,   g = h + m·i
/// first hold     z^d·z²·(z−1) + c·(b₁·z² + (b₀−b₁+i·a)·z + i·(1−a) − b₀) = 0
/// ```
#[must_use]
pub fn gain_ratios(scene: &Scene) -> [f64; 2] {
    let slow = SlowPeriods::of(scene);
    match local_law(scene.local_model.kind).needs().gains_of_pi {
        true => slow.best_pi(),
        false => [slow.half_of_largest(), 0.0],
    }
}

struct SlowPeriods {
    /// N.
    ticks: f64,
    moments: [f64; 2],
    hold: SurfaceHold,
    delay: usize,
}

impl SlowPeriods {
    fn of(scene: &Scene) -> Self {
        let local = &scene.local_model;
        let ticks = (scene.rates.control_hz.hz() / scene.rates.simulation_hz.hz()).max(1.0);
        // Σ w_j·j/N and Σ w_j·j·(j−1)/2N².
        let last = (ticks - 1.0) / ticks;
        let moments = match local.returned_force {
            _ if local_law(local.kind).clock() == LawClock::SlowPeriod => [0.0, 0.0],
            ReturnedForce::First => [0.0, 0.0],
            ReturnedForce::Mean => [0.5 * last, last * (ticks - 2.0) / (6.0 * ticks)],
            ReturnedForce::Last => [last, 0.5 * last * (ticks - 2.0) / ticks],
        };
        Self { ticks, moments, hold: local.hold, delay: local.result_delay_periods as usize }
    }

    /// Over all objects that are allowed for.
    fn worst(&self, h: f64, i: f64) -> f64 {
        let (softest, stiffest) = (1.0 / (1.0 - KO_ERROR), MIN_COMPLIANCE / (1.0 + KO_ERROR));
        let between = (softest * stiffest).sqrt();
        [softest, between, stiffest].into_iter().map(|c| self.radius(c, h, i)).fold(0.0, f64::max)
    }

    fn radius(&self, c: f64, h: f64, i: f64) -> f64 {
        let ([m, m2], with_integral) = (self.moments, i > 0.0);
        // Coefficients of c, from that of z⁰ on; and the power of z before z^d·(z − 1).
        let (low, power) = match self.hold {
            SurfaceHold::Zero if with_integral => (vec![i - (h + m * i), h + m * i], 1),
            SurfaceHold::Zero => (vec![h], 1),
            SurfaceHold::First => {
                let a = 0.5 * (self.ticks - 1.0) / self.ticks;
                let (b1, b0) = (h * m + i * m2, h * (1.0 - m) + i * (m - m2));
                if with_integral {
                    (vec![i * (1.0 - a) - b0, b0 - b1 + i * a, b1], 2)
                } else {
                    (vec![b0, b1], 2)
                }
            }
        };
        let degree = self.delay + power + usize::from(with_integral);
        let mut coefficients = vec![0.0; degree];
        low.iter().zip(&mut coefficients).for_each(|(value, sum)| *sum += c * value);
        if with_integral {
            coefficients[degree - 1] -= 1.0;
        }
        largest_root(&coefficients)
    }

    /// The best pair on a grid that closes in on it.
    fn best_pi(&self) -> [f64; 2] {
        let mut best = ([0.0, 0.0], f64::INFINITY);
        let (mut middle, mut reach) = ([0.5 * MAX, 0.5 * MAX], 0.5 * MAX);
        for round in 0..=HALVINGS {
            let steps = if round == 0 { COARSE } else { 6 };
            for (row, column) in (0..=steps).flat_map(|row| (0..=steps).map(move |column| (row, column))) {
                let place = |index: usize, middle: f64| {
                    (middle + reach * (2.0 * index as f64 / steps as f64 - 1.0)).clamp(0.0, MAX)
                };
                // Without an integral it is another loop.
                let gains = [place(column, middle[0]), place(row, middle[1]).max(1e-3)];
                let radius = self.worst(gains[0], gains[1]);
                if radius < best.1 {
                    best = (gains, radius);
                }
            }
            (middle, reach) = (best.0, if round == 0 { 2.0 * reach / COARSE as f64 } else { 0.5 * reach });
        }
        best.0
    }

    fn half_of_largest(&self) -> f64 {
        let (mut stable, mut unstable) = (0.0, 4.0);
        for _ in 0..40 {
            let middle = 0.5 * (stable + unstable);
            if self.worst(middle, 0.0) < 1.0 { stable = middle } else { unstable = middle }
        }
        SHARE_OF_LARGEST * stable
    }
}

/// Of the monic polynomial with these lower coefficients, a_0 first.
fn largest_root(coefficients: &[f64]) -> f64 {
    let size = coefficients.len();
    let companion = DMatrix::from_fn(size, size, |row, column| {
        if column + 1 == size { -coefficients[row] } else { f64::from(u8::from(row == column + 1)) }
    });
    eigenvalues(&companion).map_or(f64::INFINITY, |values| spectral_radius(&values))
}

#[cfg(test)]
mod tests {
    use cotouch_scene::load;
    use cotouch_testkit::scenes::local_model_kinds;

    use super::*;
    use crate::local_model::{PiLocalModel, SimulationLoop};

    fn scene(settings: &[&str]) -> Scene {
        let overrides: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
        load("spring", &overrides).unwrap()
    }

    #[test]
    fn without_delay_the_radius_is_that_of_the_papers_loop() {
        for (returned, of_paper) in
            [("first", ReturnedForce::First), ("mean", ReturnedForce::Mean), ("last", ReturnedForce::Last)]
        {
            for (hold, hold_of_paper) in [("zero", SurfaceHold::Zero), ("first", SurfaceHold::First)] {
                let settings = [
                    format!("local_model.returned_force={returned}"),
                    format!("local_model.hold={hold}"),
                    "local_model.result_delay_periods=0".to_owned(),
                ];
                let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
                let slow = SlowPeriods::of(&scene(&settings));
                let paper = SimulationLoop::new(50, of_paper, hold_of_paper).unwrap();
                for [h, i] in [[0.3, 0.0], [0.9, 0.0], [0.4, 0.3], [0.2, 1.1], [1.3, 0.2]] {
                    let expected = paper.spectral_radius(&PiLocalModel::new(h, i, 1.0).unwrap());
                    assert!((slow.radius(1.0, h, i) - expected).abs() < 1e-7, "{returned} {hold} {h} {i}");
                }
            }
        }
    }

    #[test]
    fn what_is_chosen_is_stable_with_room_to_spare() {
        for kind in local_model_kinds() {
            for returned in ["first", "mean", "last"] {
                for (hold, delay) in [("zero", "0"), ("zero", "1"), ("first", "0"), ("first", "1")] {
                    let settings = [
                        format!("local_model.kind={kind}"),
                        format!("local_model.returned_force={returned}"),
                        format!("local_model.hold={hold}"),
                        format!("local_model.result_delay_periods={delay}"),
                    ];
                    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
                    let scene = scene(&settings);
                    let gains = gain_ratios(&scene);
                    let worst = SlowPeriods::of(&scene).worst(gains[0], gains[1]);
                    println!("{kind} {returned} {hold} {delay}: {gains:.3?} {worst:.3}");
                    assert!(worst < 0.95, "{settings:?}: {gains:?} {worst}");
                    assert!(gains[0] + gains[1] > 0.05);
                }
            }
        }
    }
}
