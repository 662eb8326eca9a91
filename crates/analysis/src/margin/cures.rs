//! Which single change makes an unstable scene stable.

use cotouch_scene::time::Rate;
use cotouch_scene::{Scene, with_override};

use super::found::{Cure, go_on};
use super::scan::{Look, Scan, Turn};
use crate::crossing::crossing;
use crate::gains::{Gain, acting_gains};
use crate::stability::analyze_settled;
use crate::sweep::SweepError;
use crate::variants::{Contacts, Variants};
use crate::verdict::{PointVerdict, Stability};

/// Gains are changed by factors of up to a hundred, either way: ln of that.
const FARTHEST: f64 = 4.605_170_185_988_092;
/// Into so many parts that range is divided at first.
const PARTS: usize = 20;
/// Looks closer than this (in ln of the factor) are not divided further.
const FINEST: f64 = 1e-2;
/// At most so many looks, each way.
const MAX_LOOKS: usize = 60;
/// Of a limit, relative.
const ACCURACY: f64 = 1e-4;
/// How far beyond the limit a cure lies, in ln of the factor: the first that every contact mode bears.
const INSIDE: [f64; 3] = [0.05, 0.02, 0.01];
/// So often contact modes that a cure makes unstable are added to those that it has to make stable.
const ROUNDS: usize = 4;
/// Haptic rates are raised in steps of a quarter of an octave, up to four times the present one.
const RATE_STEPS: i32 = 8;
/// What the body is made of is not anybody's to choose.
const MATERIAL: &str = "soft.young_pa";

/// The smallest change of each value that makes the scene stable, smallest first. Nothing where the largest motion is not
/// to be cured so.
pub(super) fn cures(
    scene: &Scene,
    verdict: &Stability,
    progress: &dyn Fn(f64) -> bool,
) -> Result<Vec<Cure>, SweepError> {
    let unstable =
        verdict.modes.iter().filter(|mode| !mode.stable).map(|mode| mode.contacts.clone()).collect();
    let search = Search { scene, variants: Variants::default(), unstable };
    let gains: Vec<Gain> = acting_gains(scene).into_iter().filter(|gain| gain.key != MATERIAL).collect();
    let mut found = Vec::new();
    for (done, &gain) in gains.iter().enumerate() {
        let wanted = || progress(0.9 * done as f64 / gains.len() as f64);
        for sign in [1.0, -1.0] {
            found.extend(search.of_gain(gain, sign, &wanted)?);
        }
    }
    go_on(progress(0.9))?;
    found.extend(search.of_delay()?);
    go_on(progress(0.95))?;
    found.extend(search.of_network_rate()?);
    found.extend(search.of_control_rate()?);
    found.sort_by(|one: &(f64, Cure), other| one.0.total_cmp(&other.0));
    let mut cures: Vec<Cure> = Vec::new();
    for (_, cure) in found {
        if cures.iter().all(|smaller| smaller.key != cure.key) {
            cures.push(cure);
        }
    }
    Ok(cures)
}

/// How large a change is, and the change.
type Sized = (f64, Cure);

struct Search<'a> {
    scene: &'a Scene,
    variants: Variants,
    /// The contact modes that have to become stable.
    unstable: Vec<Contacts>,
}

impl Search<'_> {
    /// Up or down, by the sign. Only modes that are unstable at the scene, or were found to be at a cure, are followed on
    /// the way; at the cure all are judged.
    fn of_gain(&self, gain: Gain, sign: f64, wanted: &dyn Fn() -> bool) -> Result<Option<Sized>, SweepError> {
        let mut followed = self.unstable.clone();
        for _ in 0..ROUNDS {
            let Some(limit) = self.limit(gain, sign, &followed, wanted)? else { return Ok(None) };
            let known = followed.len();
            for inside in INSIDE {
                go_on(wanted())?;
                let value = three_digits(gain.value * (sign * (limit + inside)).exp());
                let Ok(changed) = with_override(self.scene, gain.key, value) else { continue };
                let unstable = self.variants.unstable(&changed)?;
                if unstable.is_empty() {
                    let line = Some(gain.value * (sign * limit).exp());
                    return Ok(self
                        .verified(gain.key, gain.value, value, line, &changed)?
                        .map(|cure| (limit, cure)));
                }
                followed.extend(unstable.into_iter().filter(|contacts| !self.unstable.contains(contacts)));
            }
            followed.sort();
            followed.dedup();
            if followed.len() == known {
                return Ok(None);
            }
        }
        Ok(None)
    }

    /// Where all of these modes first are stable, as ln of the factor.
    fn limit(
        &self,
        gain: Gain,
        sign: f64,
        followed: &[Contacts],
        wanted: &dyn Fn() -> bool,
    ) -> Result<Option<f64>, SweepError> {
        let at = |place: f64| -> Result<PointVerdict, SweepError> {
            let changed = with_override(self.scene, gain.key, gain.value * (sign * place).exp())?;
            Ok(self.variants.verdict_among(&changed, followed)?.verdict)
        };
        let mut look_at = |from: f64, to: f64| {
            let place = 0.5 * (from + to);
            match at(place) {
                Ok(verdict) => Ok(Some(Look { place, verdict })),
                Err(SweepError::Scene(_)) => Ok(None),
                Err(error) => Err(error),
            }
        };
        let scan = Scan { farthest: FARTHEST, parts: PARTS, finest: FINEST, max_looks: MAX_LOOKS };
        let first = Look { place: 0.0, verdict: at(0.0)? };
        let Turn::Between(from, to) = scan.first_turn(first, &mut look_at, wanted)? else { return Ok(None) };
        let width = to.place - from.place;
        let share =
            crossing(from.verdict, to.verdict, ACCURACY / width, |share| at(from.place + share * width))?;
        Ok(Some(from.place + share * width))
    }

    /// The longest delay that is short enough.
    fn of_delay(&self) -> Result<Option<Sized>, SweepError> {
        let key = "link.delay_periods";
        let present = self.scene.link.delay_periods;
        for periods in (0..present).rev() {
            let Ok(changed) = with_override(self.scene, key, f64::from(periods)) else { continue };
            if self.variants.is_stable(&changed)? {
                let size = (f64::from(present + 1) / f64::from(periods + 1)).ln();
                let cure = self.verified(key, f64::from(present), f64::from(periods), None, &changed)?;
                return Ok(cure.map(|cure| (size, cure)));
            }
        }
        Ok(None)
    }

    /// The lowest network rate that is high enough, of those of which a period is a whole number of ticks, and which can be
    /// written with three decimals.
    fn of_network_rate(&self) -> Result<Option<Sized>, SweepError> {
        let schedule = self.scene.schedule();
        let control = self.scene.rates.control_hz;
        let ticks = schedule.ticks_per_pattern().div_ceil(schedule.steps_per_pattern());
        let rates = (1..ticks).rev().filter_map(|ticks| {
            Rate::new(control.numerator(), control.denominator().checked_mul(ticks)?).ok()
        });
        self.of_rate("rates.network_hz", self.scene.rates.network_hz, rates)
    }

    /// The lowest haptic rate that is high enough, of those that are whole multiples of the network rate.
    fn of_control_rate(&self) -> Result<Option<Sized>, SweepError> {
        let network = self.scene.rates.network_hz;
        let ratio = self.scene.rates.control_hz.hz() / network.hz();
        let rates = (1..=RATE_STEPS).filter_map(|step| {
            let ticks = (ratio * 2f64.powf(f64::from(step) / 4.0)).ceil() as u64;
            Rate::new(network.numerator().checked_mul(ticks)?, network.denominator()).ok()
        });
        self.of_rate("rates.control_hz", self.scene.rates.control_hz, rates)
    }

    fn of_rate(
        &self,
        key: &str,
        present: Rate,
        rates: impl Iterator<Item = Rate>,
    ) -> Result<Option<Sized>, SweepError> {
        for rate in rates.filter(|&rate| rate.hz() > present.hz() && is_short(rate)) {
            let changed = self.scene.edit(|changed| match key {
                "rates.network_hz" => changed.rates.network_hz = rate,
                _ => changed.rates.control_hz = rate,
            });
            let Ok(changed) = changed else { continue };
            if self.variants.is_stable(&changed)? {
                let cure = self.verified(key, present.hz(), rate.hz(), None, &changed)?;
                return Ok(cure.map(|cure| ((rate.hz() / present.hz()).ln(), cure)));
            }
        }
        Ok(None)
    }

    /// What the analysis of every mode of the changed scene says; nothing where that is not stable.
    fn verified(
        &self,
        key: &str,
        value: f64,
        to: f64,
        limit: Option<f64>,
        changed: &Scene,
    ) -> Result<Option<Cure>, SweepError> {
        let verdict = analyze_settled(changed)?;
        Ok(verdict.each_mode_is_stable().then(|| Cure {
            key: key.to_owned(),
            value,
            to,
            limit,
            spectral_radius: verdict.spectral_radius,
        }))
    }
}

/// Whether a rate can be written as a decimal with three places: its number in Hz is then a value of its key.
const fn is_short(rate: Rate) -> bool {
    1000 % rate.denominator() == 0
}

fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
