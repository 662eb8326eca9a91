//! Physiological tremor: a force between 8 and 12 Hz that looks random and is a pure function of time.

use std::f64::consts::TAU;

use glam::DVec3;
use rand::{Rng, RngExt};

/// Sinusoids in the sum.
const COMPONENTS: usize = 16;
const LOWEST_HZ: f64 = 8.0;
const HIGHEST_HZ: f64 = 12.0;
const SPACING_HZ: f64 = (HIGHEST_HZ - LOWEST_HZ) / COMPONENTS as f64;
const FIRST_HZ: f64 = LOWEST_HZ + 0.5 * SPACING_HZ;

/// A sum of 16 sinusoids of equal size with seeded phases at 8.125, 8.375, … 11.875 Hz.
///
/// The root mean square of every axis over any 4 s is exactly what was asked for, nothing lies outside the band, and
/// the amplitude is nearly normally distributed. It repeats after 8 s. As the frequencies are evenly spaced, the sum
/// is a polynomial in `exp(2πj·0.25 Hz·t)`: two sines and a Horner scheme, no state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tremor {
    /// Amplitude·cos(phase) and amplitude·sin(phase) of each sinusoid, each axis, N.
    components: [(DVec3, DVec3); COMPONENTS],
}

impl Tremor {
    /// Tremor of `rms_n` (N) per axis with phases drawn from `random`.
    pub(crate) fn new(rms_n: DVec3, random: &mut impl Rng) -> Self {
        let amplitude = rms_n * (2.0 / COMPONENTS as f64).sqrt();
        let components = std::array::from_fn(|_| {
            let phases: [f64; 3] = std::array::from_fn(|_| TAU * random.random::<f64>());
            (amplitude * DVec3::from(phases.map(f64::cos)), amplitude * DVec3::from(phases.map(f64::sin)))
        });
        Self { components }
    }

    /// The force at `elapsed_s`, N.
    pub(crate) fn force(&self, elapsed_s: f64) -> DVec3 {
        let (sine, cosine) = (TAU * SPACING_HZ * elapsed_s).sin_cos();
        let (mut real, mut imaginary) = (DVec3::ZERO, DVec3::ZERO);
        for (in_phase, quadrature) in self.components.iter().rev() {
            (real, imaginary) = (
                real * cosine - imaginary * sine + *in_phase,
                real * sine + imaginary * cosine + *quadrature,
            );
        }
        let (sine, cosine) = (TAU * FIRST_HZ * elapsed_s).sin_cos();
        real * cosine - imaginary * sine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64;

    const RATE_HZ: f64 = 1000.0;

    fn samples(seed: u64, seconds: usize) -> Vec<DVec3> {
        let tremor = Tremor::new(DVec3::new(0.5, 0.0, 2.0), &mut Pcg64::seed_from_u64(seed));
        (0..seconds * 1000).map(|tick| tremor.force(tick as f64 / RATE_HZ)).collect()
    }

    /// Power of `signal` at `frequency_hz` (one bin of the periodogram; the sum over bins is the mean square).
    fn power(signal: &[f64], frequency_hz: f64) -> f64 {
        let (mut real, mut imaginary) = (0.0, 0.0);
        for (tick, value) in signal.iter().enumerate() {
            let (sine, cosine) = (TAU * frequency_hz * tick as f64 / RATE_HZ).sin_cos();
            real += value * cosine;
            imaginary += value * sine;
        }
        2.0 * (real * real + imaginary * imaginary) / (signal.len() as f64).powi(2)
    }

    #[test]
    fn rms_is_as_asked_in_every_four_seconds() {
        let force = samples(3, 12);
        for start in [0, 1234, 8000] {
            let square: DVec3 = force[start..start + 4000].iter().map(|f| *f * *f).sum::<DVec3>() / 4000.0;
            assert!((square - DVec3::new(0.25, 0.0, 4.0)).length() < 1e-12, "{square}");
        }
    }

    #[test]
    fn everything_lies_between_8_and_12_hz() {
        let force: Vec<f64> = samples(4, 8).iter().map(|f| f.x).collect();
        let bins = |range: std::ops::Range<u32>| -> f64 {
            range.map(|bin| power(&force, f64::from(bin) / 8.0)).sum()
        };
        let inside = bins(64..97);
        assert!((inside - 0.25).abs() < 1e-12, "{inside}");
        assert!(bins(1..64) + bins(97..240) < 1e-24);
        let quarters: Vec<f64> = (0..4).map(|quarter| bins(64 + 8 * quarter..72 + 8 * quarter)).collect();
        assert!(quarters.iter().all(|&share| (share - 0.0625).abs() < 1e-12), "{quarters:?}");
    }

    #[test]
    fn the_seed_decides() {
        assert_eq!(samples(5, 1), samples(5, 1));
        assert_ne!(samples(5, 1), samples(6, 1));
        let long_after = Tremor::new(DVec3::ONE, &mut Pcg64::seed_from_u64(1));
        assert!((long_after.force(0.25) - long_after.force(8.25)).length() < 1e-12);
    }
}
