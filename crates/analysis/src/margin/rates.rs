//! How slow the network and the haptic loop may become, each alone and both together.
//!
//! Any rates go together, but a ratio of p/q is a pattern of p ticks, which is lifted tick by tick. Where ratios are next to
//! each other, all but few stretches of their patterns are the same, so what a motion grows by per second is a continuous
//! function of the ratio, and each short stretch of ratios can be represented by the one with the shortest pattern in it. The
//! scan that looks for the limit compares growths over the same time.

use cotouch_scene::Scene;
use cotouch_scene::time::{Rate, Schedule};

use super::found::{RateMargin, go_on};
use super::scan::{Look, Scan, Turn};
use crate::crossing::expected_crossing;
use crate::loop_spec::least_common_multiple;
use crate::sweep::SweepError;
use crate::variants::{VariantVerdict, Variants};
use crate::verdict::PointVerdict;

/// Rates are lowered down to this share of the scene's.
const LOWEST: f64 = 1.0 / 64.0;
/// Logarithms of rates that are looked at first lie about so far apart.
const SPACING: f64 = 0.13;
/// Rates closer than this, relative, are not told apart while it is looked for a turn.
const FINEST: f64 = 2e-3;
/// At least so many parts.
const MIN_PARTS: usize = 4;
/// At most so many looks while it is looked for a turn.
const MAX_LOOKS: usize = 150;
/// Of a limit, relative.
const ACCURACY: f64 = 5e-4;
/// Longer patterns are not tried.
const MAX_TICKS: u64 = 1500;
/// Of ratios that are given as logarithms.
const ROUNDING: f64 = 1e-12;

/// What is made slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slower {
    Network,
    Control,
    /// By the same factor.
    Both,
}

/// Limits of rates.
pub(super) struct RateLimits {
    /// Of the network rate and of the haptic rate.
    pub(super) each: Vec<RateMargin>,
    /// Of the haptic rate while the network rate is lowered by the same factor.
    pub(super) together: RateMargin,
}

pub(super) fn limits(
    scene: &Scene,
    notes: &mut Vec<String>,
    progress: &dyn Fn(f64) -> bool,
) -> Result<RateLimits, SweepError> {
    let variants = Variants::default();
    let present = variants.verdict(scene)?;
    let mut limit = |slower: Slower, done: f64| {
        let rates = Rates { scene, slower, variants: &variants };
        let (margin, note) = rates.margin(&present, &|| progress(done / 3.0))?;
        notes.extend(note);
        Ok::<_, SweepError>(margin)
    };
    let each = vec![limit(Slower::Network, 0.0)?, limit(Slower::Control, 1.0)?];
    Ok(RateLimits { each, together: limit(Slower::Both, 2.0)? })
}

/// Variants of a scene with lower rates. Each is known by a ratio: of the haptic rate to the network rate where one of
/// them is lowered; where both are, to that of the soft simulation, or the factor by which they are divided.
struct Rates<'a> {
    scene: &'a Scene,
    slower: Slower,
    variants: &'a Variants,
}

/// The rates of a variant.
#[derive(Clone, Copy, Debug)]
struct Pair {
    control: Rate,
    network: Rate,
}

/// A variant that may be looked at.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// ln of how many times slower.
    place: f64,
    pair: Pair,
    ticks: u64,
}

impl Rates<'_> {
    /// The margin, and what to know about it.
    fn margin(
        &self,
        present: &VariantVerdict,
        wanted: &dyn Fn() -> bool,
    ) -> Result<(RateMargin, Option<String>), SweepError> {
        let farthest = self.farthest();
        let none = RateMargin { key: self.key().to_owned(), hz: None, factor: None };
        if farthest < ROUNDING {
            let note = format!("No limit of {} was found: {}.", self.name(), self.floor().1);
            return Ok((none, Some(note)));
        }
        let scan = Scan {
            farthest,
            parts: ((farthest / SPACING).ceil() as usize).max(MIN_PARTS),
            finest: FINEST,
            max_looks: MAX_LOOKS,
        };
        let verdict = PointVerdict { spectral_radius: self.growth(present), ..present.verdict };
        let first = Look { place: 0.0, verdict };
        let mut look_at = |from: f64, to: f64| self.look_between(from, to);
        match scan.first_turn(first, &mut look_at, wanted)? {
            Turn::Between(stable, unstable) => {
                let (place, note) = self.narrowed(stable, unstable, wanted)?;
                let factor = (-place).exp();
                Ok((RateMargin { hz: Some(factor * self.hz()), factor: Some(factor), ..none }, note))
            }
            Turn::Nowhere(last) => Ok((none, Some(self.no_limit(last, farthest)))),
        }
    }

    fn no_limit(&self, last: Look, farthest: f64) -> String {
        let found = format!(
            "No limit of {} was found: the scene is stable down to {} Hz",
            self.name(),
            significant((-last.place).exp() * self.hz())
        );
        if last.place < farthest * (1.0 - ROUNDING) - ROUNDING {
            format!("{found}; below, loops are too large to be analysed.")
        } else if farthest < LOWEST.ln().abs() {
            format!("{found}; {}.", self.floor().1)
        } else {
            format!("{found}, and no lower rate was looked at.")
        }
    }

    /// The place of the turn between two looks, to [`ACCURACY`], and what to know about it.
    fn narrowed(
        &self,
        mut stable: Look,
        mut unstable: Look,
        wanted: &dyn Fn() -> bool,
    ) -> Result<(f64, Option<String>), SweepError> {
        let mut note = None;
        while unstable.place - stable.place > ACCURACY {
            go_on(wanted())?;
            let eighth = 0.125 * (unstable.place - stable.place);
            match self.look_between(stable.place + eighth, unstable.place - eighth)? {
                Some(look) if look.verdict.stable => stable = look,
                Some(look) => unstable = look,
                None => {
                    let hz = |look: Look| significant((-look.place).exp() * self.hz());
                    note = Some(format!(
                        "The limit of {} is somewhere from {} to {} Hz: between these, loops are too large to be analysed.",
                        self.name(),
                        hz(unstable),
                        hz(stable)
                    ));
                    break;
                }
            }
        }
        let share = expected_crossing(stable.verdict, unstable.verdict);
        Ok((stable.place + share * (unstable.place - stable.place), note))
    }

    /// A look at the variant between two places that has the shortest pattern; `None` where all are too large.
    fn look_between(&self, from: f64, to: f64) -> Result<Option<Look>, SweepError> {
        let Some(candidate) = self.shortest_between(from, to) else { return Ok(None) };
        match self.verdict(candidate.pair) {
            Ok(verdict) => Ok(Some(Look { place: candidate.place, verdict })),
            Err(SweepError::Analysis(error)) if error.is_too_large() => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn shortest_between(&self, from: f64, to: f64) -> Option<Candidate> {
        let ratio_at = |place: f64| self.ratio() * (if self.ratio_falls() { -place } else { place }).exp();
        let (one, other) = (ratio_at(from), ratio_at(to));
        let (least, largest) = (one.min(other) * (1.0 - ROUNDING), one.max(other) * (1.0 + ROUNDING));
        let max_ticks = MAX_TICKS.max(self.ticks(self.present()).unwrap_or(0));
        let mut shortest: Option<Candidate> = None;
        for q in 1..=MAX_TICKS {
            let (first, last) = ((least * q as f64).ceil() as u64, (largest * q as f64).floor() as u64);
            // No pattern is shorter than the numerator of a ratio of rates.
            if first > shortest.map_or(MAX_TICKS, |known| known.ticks) {
                break;
            }
            for p in first..=last {
                let candidate = self.candidate(p, q).filter(|candidate| candidate.ticks <= max_ticks);
                if let Some(candidate) = candidate
                    && shortest.is_none_or(|known| candidate.ticks < known.ticks)
                {
                    shortest = Some(candidate);
                }
            }
        }
        shortest
    }

    fn candidate(&self, p: u64, q: u64) -> Option<Candidate> {
        let pair = self.rates(p, q)?;
        let place = (p as f64 / q as f64 / self.ratio()).ln().abs();
        Some(Candidate { place, pair, ticks: self.ticks(pair)? })
    }

    /// The verdict, with growth as [`Self::growth`] gives it.
    fn verdict(&self, pair: Pair) -> Result<PointVerdict, SweepError> {
        let variant = self.scene.edit(|slower| {
            slower.rates.control_hz = pair.control;
            slower.rates.network_hz = pair.network;
        })?;
        let found = self.variants.verdict(&variant)?;
        Ok(PointVerdict { spectral_radius: self.growth(&found), ..found.verdict })
    }

    /// What the fastest growing motion is multiplied by in a network period of the scene.
    fn growth(&self, found: &VariantVerdict) -> f64 {
        (found.growth_per_s * self.scene.rates.network_hz.period_s()).exp()
    }

    fn present(&self) -> Pair {
        Pair { control: self.scene.rates.control_hz, network: self.scene.rates.network_hz }
    }

    fn key(&self) -> &'static str {
        match self.slower {
            Slower::Network => "rates.network_hz",
            Slower::Control | Slower::Both => "rates.control_hz",
        }
    }

    fn name(&self) -> &'static str {
        match self.slower {
            Slower::Both => "rates.control_hz and rates.network_hz together",
            Slower::Network | Slower::Control => self.key(),
        }
    }

    /// The scene's own rate, of both the haptic one.
    fn hz(&self) -> f64 {
        match self.slower {
            Slower::Network => self.scene.rates.network_hz.hz(),
            Slower::Control | Slower::Both => self.scene.rates.control_hz.hz(),
        }
    }

    /// How low the rate can be at all, Hz, and why.
    fn floor(&self) -> (f64, &'static str) {
        let (network, simulation) = (self.scene.rates.network_hz, self.scene.rates.simulation_hz);
        let of_simulation = (simulation.hz(), "the haptic rate cannot be lower than rates.simulation_hz");
        let of_network = (network.hz(), "the haptic rate alone cannot be lower than rates.network_hz");
        match (self.slower, self.scene.soft.exists()) {
            (Slower::Network, _) | (Slower::Both, false) => (0.0, ""),
            (Slower::Both, true) => of_simulation,
            (Slower::Control, true) if simulation.hz() > network.hz() => of_simulation,
            (Slower::Control, _) => of_network,
        }
    }

    /// ln of how many times slower the slowest variant is.
    fn farthest(&self) -> f64 {
        (self.hz() / self.floor().0.max(LOWEST * self.hz())).ln()
    }

    /// The ratio by which the scene itself is known.
    fn ratio(&self) -> f64 {
        let rates = &self.scene.rates;
        match (self.slower, self.scene.soft.exists()) {
            (Slower::Network | Slower::Control, _) => rates.control_hz.hz() / rates.network_hz.hz(),
            (Slower::Both, true) => rates.control_hz.hz() / rates.simulation_hz.hz(),
            (Slower::Both, false) => 1.0,
        }
    }

    /// Whether that ratio falls where rates do.
    fn ratio_falls(&self) -> bool {
        match self.slower {
            Slower::Network => false,
            Slower::Control => true,
            Slower::Both => self.scene.soft.exists(),
        }
    }

    /// The rates of the variant that is known by p/q; `None` where these have too many digits.
    fn rates(&self, p: u64, q: u64) -> Option<Pair> {
        let Pair { control, network } = self.present();
        let times = |rate: Rate, p: u64, q: u64| {
            Rate::new(rate.numerator().checked_mul(p)?, rate.denominator().checked_mul(q)?).ok()
        };
        Some(match (self.slower, self.scene.soft.exists()) {
            (Slower::Network, _) => Pair { control, network: times(control, q, p)? },
            (Slower::Control, _) => Pair { control: times(network, p, q)?, network },
            (Slower::Both, false) => Pair { control: times(control, q, p)?, network: times(network, q, p)? },
            (Slower::Both, true) => {
                let slower = times(self.scene.rates.simulation_hz, p, q)?;
                let ratio = Schedule::new(control, network).ok()?;
                let network = times(slower, ratio.steps_per_pattern(), ratio.ticks_per_pattern())?;
                Pair { control: slower, network }
            }
        })
    }

    /// How long the pattern of all clocks is; `None` where these cannot go together.
    fn ticks(&self, pair: Pair) -> Option<u64> {
        let ticks = Schedule::new(pair.control, pair.network).ok()?.ticks_per_pattern();
        if !self.scene.soft.exists() {
            return Some(ticks);
        }
        let slow = Schedule::new(pair.control, self.scene.rates.simulation_hz).ok()?.ticks_per_pattern();
        Some(least_common_multiple(ticks, slow))
    }
}

/// A rate in Hz as it is told: limits are known to four digits.
fn significant(hz: f64) -> String {
    let digits = (3 - hz.log10().floor() as i32).clamp(0, 9) as usize;
    format!("{hz:.digits$}")
}
