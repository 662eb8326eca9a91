//! Which frequencies count.

use arrayvec::ArrayVec;
use cotouch_scene::scene::{Action, Scene};
use glam::DVec3;

/// Above this, force counts as oscillation rather than as what users do, Hz.
const CORNER_HZ: f64 = 8.0;
/// The corner where a script has a tremor, of 8 to 12 Hz: at 12 Hz a sixteenth is left.
const CORNER_BESIDE_TREMOR_HZ: f64 = 24.0;
/// A motion that a script asks for below this frequency is damped enough by the high pass, Hz.
const LOWEST_NOTCH_HZ: f64 = 2.0;
/// Half the width of what is left out around a frequency that a script asks for, as a share of it.
const NOTCH_WIDTH: f64 = 0.2;
/// Frequencies of scripts that are left out one by one; where there are more, what counts begins above the highest of them.
const MAX_NOTCHES: usize = 4;
/// Where it then begins, in units of that frequency: a thirtieth of a force of that frequency is left.
const ABOVE_ASKED: f64 = 2.4;
/// Second-order sections of the high pass: a Butterworth filter of the fourth order.
const SECTIONS: usize = 2;
/// What a filter's memory forgets, N: no force that matters, and enough for numbers not to become subnormal, with which
/// processors take many times as long. Without it they do a minute after a hand has let go.
const FORGOTTEN_N: f64 = 1e-60;
/// All sections.
const MAX_SECTIONS: usize = SECTIONS + MAX_NOTCHES;

/// A filter that lets pass what counts. Its state is a finger's.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Band {
    sections: ArrayVec<Section, MAX_SECTIONS>,
}

/// The state of a [`Band`]'s filter: transposed direct form II.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BandState([[DVec3; 2]; MAX_SECTIONS]);

/// `y = (b0 + b1·z⁻¹ + b2·z⁻²)/(1 + a1·z⁻¹ + a2·z⁻²)·x`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Band {
    /// Without the frequencies that the scene's own scripts ask for.
    pub(super) fn of_scene(scene: &Scene) -> Self {
        let scripts = scene.users.iter().flat_map(|user| {
            let fingers = user.fingers.iter().flat_map(|finger| finger.script.iter());
            user.script.iter().chain(fingers)
        });
        let mut corner_hz = CORNER_HZ;
        let mut asked_hz = Vec::new();
        for action in scripts {
            match action {
                Action::Tremor { rms_n, .. } if *rms_n != DVec3::ZERO => corner_hz = CORNER_BESIDE_TREMOR_HZ,
                Action::Sinusoid { frequency_hz, amplitude_m: amplitude, .. }
                | Action::SinusoidalForce { frequency_hz, amplitude_n: amplitude, .. }
                    if *amplitude != DVec3::ZERO && *frequency_hz >= LOWEST_NOTCH_HZ =>
                {
                    asked_hz.push(*frequency_hz);
                }
                _ => {}
            }
        }
        asked_hz.sort_by(f64::total_cmp);
        asked_hz.dedup();
        if let (Some(&highest_hz), true) = (asked_hz.last(), asked_hz.len() > MAX_NOTCHES) {
            corner_hz = corner_hz.max(ABOVE_ASKED * highest_hz);
            asked_hz.clear();
        }
        Self::new(corner_hz, &asked_hz, scene.rates.control_hz.period_s())
    }

    fn new(corner_hz: f64, left_out_hz: &[f64], period_s: f64) -> Self {
        // The poles of a Butterworth filter of the fourth order (Butterworth 1930): damping ratios of its two sections.
        let pairs = [1.0, 3.0].map(|odd: f64| (odd * std::f64::consts::PI / 8.0).sin());
        let mut sections: ArrayVec<Section, MAX_SECTIONS> =
            pairs.iter().map(|&damping| Section::high_pass(corner_hz, damping, period_s)).collect();
        sections.extend(left_out_hz.iter().map(|&hz| Section::notch(hz, period_s)));
        Self { sections }
    }

    /// The state after a constant input for ever, where the output is zero.
    pub(super) fn settled_at(&self, input: DVec3) -> BandState {
        let mut state = BandState::default();
        let mut input = input;
        for (section, memory) in self.sections.iter().zip(&mut state.0) {
            let gain = section.b.iter().sum::<f64>() / (1.0 + section.a[0] + section.a[1]);
            let output = input * gain;
            *memory = [output - section.b[0] * input, section.b[2] * input - section.a[1] * output];
            input = output;
        }
        state
    }

    pub(super) fn step(&self, state: &mut BandState, input: DVec3) -> DVec3 {
        let through = |input: DVec3, (section, memory): (&Section, &mut [DVec3; 2])| {
            let output = section.b[0] * input + memory[0];
            memory[0] = remembered(section.b[1] * input - section.a[0] * output + memory[1]);
            memory[1] = remembered(section.b[2] * input - section.a[1] * output);
            output
        };
        self.sections.iter().zip(&mut state.0).fold(input, through)
    }
}

impl Section {
    /// `s²/(s² + 2·ζ·ω·s + ω²)` by the bilinear transform with the corner pre-warped.
    fn high_pass(corner_hz: f64, damping: f64, period_s: f64) -> Self {
        let w = warped(corner_hz, period_s);
        let norm = 1.0 / (1.0 + 2.0 * damping * w + w * w);
        Self {
            b: [norm, -2.0 * norm, norm],
            a: [2.0 * (w * w - 1.0) * norm, (1.0 - 2.0 * damping * w + w * w) * norm],
        }
    }

    /// `(s² + ω²)/(s² + 2·width·ω·s + ω²)`, likewise.
    fn notch(hz: f64, period_s: f64) -> Self {
        let w = warped(hz, period_s);
        let norm = 1.0 / (1.0 + 2.0 * NOTCH_WIDTH * w + w * w);
        let middle = 2.0 * (w * w - 1.0) * norm;
        Self {
            b: [(1.0 + w * w) * norm, middle, (1.0 + w * w) * norm],
            a: [middle, (1.0 - 2.0 * NOTCH_WIDTH * w + w * w) * norm],
        }
    }
}

fn remembered(force_n: DVec3) -> DVec3 {
    DVec3::select(force_n.abs().cmplt(DVec3::splat(FORGOTTEN_N)), DVec3::ZERO, force_n)
}

fn warped(hz: f64, period_s: f64) -> f64 {
    // Below about four ticks a cycle a corner cannot be told from the tick itself.
    (std::f64::consts::PI * (hz * period_s).min(0.25)).tan()
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1.0 / 1024.0;

    /// Of the output over the last of two seconds of a sinusoid, per unit amplitude.
    fn gain(band: &Band, hz: f64) -> f64 {
        let mut state = band.settled_at(DVec3::ZERO);
        let mut sum = 0.0;
        for tick in 0..2048 {
            let output =
                band.step(&mut state, DVec3::X * (f64::from(tick) * T * hz * std::f64::consts::TAU).sin());
            sum += if tick < 1024 { 0.0 } else { output.length_squared() };
        }
        (sum / 512.0).sqrt()
    }

    #[test]
    fn what_users_do_is_left_out_and_what_is_faster_passes() {
        let band = Band::new(CORNER_HZ, &[], T);
        // |H| of a Butterworth high pass: (f/f_c)⁴/√(1 + (f/f_c)⁸).
        for hz in [2.0, 4.0, 8.0, 16.0, 100.0] {
            let ratio = (hz / CORNER_HZ).powi(4);
            let expected = ratio / (1.0 + ratio * ratio).sqrt();
            assert!((gain(&band, hz) / expected - 1.0).abs() < 0.02, "{hz} Hz: {}", gain(&band, hz));
        }
    }

    #[test]
    fn a_frequency_that_a_script_asks_for_is_left_out() {
        let band = Band::new(CORNER_HZ, &[20.0], T);
        assert!(gain(&band, 20.0) < 1e-3, "{}", gain(&band, 20.0));
        assert!(gain(&band, 40.0) > 0.95);
    }

    #[test]
    fn a_scene_leaves_out_all_that_its_scripts_ask_for_and_nothing_that_has_no_strength() {
        let band = |actions: &[(f64, f64)]| {
            let force = |&(newtons, frequency_hz): &(f64, f64)| Action::SinusoidalForce {
                amplitude_n: DVec3::X * newtons,
                frequency_hz,
                phase_rad: 0.0,
                duration_s: 1.0,
            };
            let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
            let edited = scene.edit(|scene| scene.users[0].script = actions.iter().map(force).collect());
            Band::of_scene(&edited.expect("a script like any"))
        };
        assert_eq!(band(&[(0.0, 13.0), (0.0, 14.0)]), Band::new(CORNER_HZ, &[], T));
        assert_eq!(band(&[(1.0, 13.0), (2.0, 13.0)]), Band::new(CORNER_HZ, &[13.0], T));
        let asked_hz = [2.5, 3.0, 3.5, 4.0, 20.0];
        let many = band(&asked_hz.map(|hz| (1.0, hz)));
        asked_hz.iter().for_each(|&hz| assert!(gain(&many, hz) < 0.035, "{hz} Hz: {}", gain(&many, hz)));
        assert!(gain(&many, 100.0) > 0.95);
    }

    #[test]
    fn what_has_died_out_is_forgotten_before_it_becomes_slow() {
        let band = Band::new(CORNER_HZ, &[20.0], T);
        let mut state = band.settled_at(DVec3::ZERO);
        band.step(&mut state, DVec3::new(3.0, 1e-3, 0.0));
        for second in 0..60 {
            for _ in 0..1024 {
                let output = band.step(&mut state, DVec3::ZERO);
                let numbers = state.0.as_flattened().iter().chain([&output]).flat_map(|of| of.to_array());
                assert!(numbers.clone().all(|number| !number.is_subnormal()), "in second {second}");
            }
        }
        assert_eq!(state.0, BandState::default().0);
    }

    #[test]
    fn a_constant_force_is_nothing() {
        for notches in [&[][..], &[20.0, 50.0]] {
            let band = Band::new(CORNER_HZ, notches, T);
            let mut state = band.settled_at(DVec3::new(3.0, -2.0, 1.0));
            for _ in 0..100 {
                assert!(band.step(&mut state, DVec3::new(3.0, -2.0, 1.0)).length() < 1e-12);
            }
        }
    }
}
