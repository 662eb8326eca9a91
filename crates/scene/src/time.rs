//! Time as an argument: instants in nanoseconds, exact rational rates, and which tick does which network step.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// An instant on one computer's monotonic clock, in nanoseconds since an arbitrary origin of that computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct LocalTime(pub i64);

/// An instant on the clock that all hosts of a session agree on, in nanoseconds since tick 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SessionTime(pub i64);

macro_rules! instant {
    ($name:ident) => {
        impl $name {
            /// This instant, `nanoseconds` later.
            #[must_use]
            pub const fn plus_ns(self, nanoseconds: i64) -> Self {
                Self(self.0.saturating_add(nanoseconds))
            }
            /// Nanoseconds from `earlier` to this instant (negative when `earlier` is later).
            #[must_use]
            pub const fn since(self, earlier: Self) -> i64 {
                self.0.saturating_sub(earlier.0)
            }
            /// Seconds since the origin.
            #[must_use]
            pub fn as_secs_f64(self) -> f64 {
                self.0 as f64 * 1e-9
            }
        }
    };
}
instant!(LocalTime);
instant!(SessionTime);

/// An exact rate in hertz: `numerator / denominator`, in lowest terms, both positive.
///
/// A decimal such as `"7.8125"` and a fraction such as `"1024/10"` are both taken exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rate {
    numerator: u64,
    denominator: u64,
}

/// Why a text or a pair of numbers is not a [`Rate`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a rate is a positive number such as 1024 or 7.8125, or a fraction such as \"1024/10\", with at most 12 digits a side; found {found:?}"
)]
pub struct RateError {
    /// The text that was found.
    pub found: String,
}

const LARGEST_RATE_TERM: u64 = 1_000_000_000_000;

impl Default for Rate {
    /// 1 Hz.
    fn default() -> Self {
        Self { numerator: 1, denominator: 1 }
    }
}

impl Rate {
    /// `numerator / denominator` hertz.
    ///
    /// # Errors
    /// When either is zero or exceeds 10¹².
    pub fn new(numerator: u64, denominator: u64) -> Result<Self, RateError> {
        let allowed = 1..=LARGEST_RATE_TERM;
        if !allowed.contains(&numerator) || !allowed.contains(&denominator) {
            return Err(RateError { found: format!("{numerator}/{denominator}") });
        }
        let divisor = greatest_common_divisor(numerator, denominator);
        Ok(Self { numerator: numerator / divisor, denominator: denominator / divisor })
    }

    /// Ticks in `denominator` seconds.
    #[must_use]
    pub const fn numerator(self) -> u64 {
        self.numerator
    }

    /// Seconds in which `numerator` ticks happen.
    #[must_use]
    pub const fn denominator(self) -> u64 {
        self.denominator
    }

    /// The rate in hertz.
    #[must_use]
    pub fn hz(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    /// The period in seconds.
    #[must_use]
    pub fn period_s(self) -> f64 {
        self.denominator as f64 / self.numerator as f64
    }

    /// The fewest ticks that last for `seconds` (0 or more): what a time in a scene means in ticks, wherever it is needed.
    #[must_use]
    pub fn ticks_in(self, seconds: f64) -> u64 {
        (seconds * self.hz()).ceil() as u64
    }

    /// The instant of tick `index`, rounded to the nearest nanosecond from the index: nothing accumulates.
    #[must_use]
    pub fn instant(self, index: u64) -> SessionTime {
        // Sessions shorter than centuries fit 64 bits, whose division is several times faster.
        if let Some(scaled) = self.denominator.checked_mul(1_000_000_000).and_then(|ns| ns.checked_mul(index))
            && let Some(rounded) = scaled.checked_add(self.numerator / 2)
        {
            return SessionTime((rounded / self.numerator) as i64);
        }
        let scaled = u128::from(index) * u128::from(self.denominator) * 1_000_000_000;
        let numerator = u128::from(self.numerator);
        SessionTime(((scaled + numerator / 2) / numerator) as i64)
    }

    /// The first tick whose instant is not before `time`.
    #[must_use]
    pub fn first_tick_at(self, time: SessionTime) -> u64 {
        let last = self.last_tick_at(time);
        if self.instant(last) < time { last + 1 } else { last }
    }

    /// The last tick whose instant is not after `time` (0 before the session starts).
    #[must_use]
    pub fn last_tick_at(self, time: SessionTime) -> u64 {
        if time.0 <= 0 {
            return 0;
        }
        let estimate = (time.0 as u128 * u128::from(self.numerator)
            / (u128::from(self.denominator) * 1_000_000_000)) as u64;
        // The instants are rounded to nanoseconds, so the estimate can be one tick off either way.
        let mut tick = estimate.saturating_sub(1);
        while self.instant(tick + 1) <= time {
            tick += 1;
        }
        tick
    }
}

const fn greatest_common_divisor(mut a: u64, mut b: u64) -> u64 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl fmt::Display for Rate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.denominator == 1 {
            write!(formatter, "{}", self.numerator)
        } else {
            write!(formatter, "{}/{}", self.numerator, self.denominator)
        }
    }
}

impl FromStr for Rate {
    type Err = RateError;

    fn from_str(text: &str) -> Result<Self, RateError> {
        let error = || RateError { found: text.to_owned() };
        let (numerator, denominator) = text.split_once('/').unwrap_or((text, "1"));
        let (a, a_scale) = exact_decimal(numerator.trim()).ok_or_else(error)?;
        let (b, b_scale) = exact_decimal(denominator.trim()).ok_or_else(error)?;
        let top = a.checked_mul(b_scale).ok_or_else(error)?;
        let bottom = b.checked_mul(a_scale).ok_or_else(error)?;
        let divisor = greatest_common_divisor(top, bottom).max(1);
        Self::new(top / divisor, bottom / divisor).map_err(|_| error())
    }
}

/// `"7.8125"` as (78125, 10000); exponents are taken too, because a number in a file may have one.
fn exact_decimal(text: &str) -> Option<(u64, u64)> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let fraction = fraction.trim_end_matches('0');
    let is_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() && fraction.is_empty() || !is_digits(whole) || !is_digits(fraction) {
        return None;
    }
    let digits: u64 = format!("0{whole}{fraction}").parse().ok()?;
    let scale = exponent - i32::try_from(fraction.len()).ok()?;
    let power = 10u64.checked_pow(scale.unsigned_abs())?;
    if scale >= 0 { Some((digits.checked_mul(power)?, 1)) } else { Some((digits, power)) }
}

impl Serialize for Rate {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Rate {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Which haptic tick does which network step.
///
/// Network step `k` happens at the first haptic tick at or after `k·T_t`, that is tick `⌈k·T_t/T_c⌉`. With
/// `T_t/T_c = p/q` in lowest terms the pattern repeats every `p` ticks, in which there are `q` network steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Schedule {
    control: Rate,
    network: Rate,
    ticks_per_pattern: u64,
    steps_per_pattern: u64,
}

/// The network rate exceeds the control rate, or the two share too long a pattern.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "the network rate must not exceed the control rate and their pattern must repeat within {LONGEST_PATTERN_TICKS} ticks; found {network} Hz with {control} Hz"
)]
pub struct ScheduleError {
    control: Rate,
    network: Rate,
}

const LONGEST_PATTERN_TICKS: u64 = 1_000_000;

impl Schedule {
    /// The schedule of two rates.
    ///
    /// # Errors
    /// When the network is faster than the control loop, or the pattern is longer than a million ticks.
    pub fn new(control: Rate, network: Rate) -> Result<Self, ScheduleError> {
        let error = ScheduleError { control, network };
        let top = u128::from(control.numerator) * u128::from(network.denominator);
        let bottom = u128::from(control.denominator) * u128::from(network.numerator);
        let (mut a, mut b) = (top, bottom);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        let (p, q) = (top / a, bottom / a);
        if p < q || p > u128::from(LONGEST_PATTERN_TICKS) {
            return Err(error);
        }
        Ok(Self { control, network, ticks_per_pattern: p as u64, steps_per_pattern: q as u64 })
    }

    /// The haptic rate, 1/T_c.
    #[must_use]
    pub const fn control(&self) -> Rate {
        self.control
    }

    /// The network rate, 1/T_t.
    #[must_use]
    pub const fn network(&self) -> Rate {
        self.network
    }

    /// Ticks after which the pattern of ticks and network steps repeats (`N` when `T_t = N·T_c`).
    #[must_use]
    pub const fn ticks_per_pattern(&self) -> u64 {
        self.ticks_per_pattern
    }

    /// Network steps in one pattern (1 when `T_t = N·T_c`).
    #[must_use]
    pub const fn steps_per_pattern(&self) -> u64 {
        self.steps_per_pattern
    }

    /// The haptic tick at which network step `step` happens.
    #[must_use]
    pub fn tick_of_step(&self, step: u64) -> u64 {
        if let Some(product) = step.checked_mul(self.ticks_per_pattern) {
            return product.div_ceil(self.steps_per_pattern);
        }
        let product = u128::from(step) * u128::from(self.ticks_per_pattern);
        product.div_ceil(u128::from(self.steps_per_pattern)) as u64
    }

    /// The last network step at or before haptic tick `tick`.
    #[must_use]
    pub fn last_step_at(&self, tick: u64) -> u64 {
        if let Some(product) = tick.checked_mul(self.steps_per_pattern) {
            return product / self.ticks_per_pattern;
        }
        (u128::from(tick) * u128::from(self.steps_per_pattern) / u128::from(self.ticks_per_pattern)) as u64
    }

    /// The network step that happens exactly at haptic tick `tick`, if one does.
    #[must_use]
    pub fn step_at(&self, tick: u64) -> Option<u64> {
        let step = self.last_step_at(tick);
        (self.tick_of_step(step) == tick).then_some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_taken_exactly() {
        for (text, numerator, denominator) in
            [("1024", 1024, 1), ("1024/10", 512, 5), ("7.8125", 125, 16), ("1e3", 1000, 1), ("0.5/1.5", 1, 3)]
        {
            let rate: Rate = text.parse().unwrap();
            assert_eq!((rate.numerator(), rate.denominator()), (numerator, denominator), "{text}");
            assert_eq!(rate.to_string().parse::<Rate>().unwrap(), rate);
        }
        for text in ["", "0", "-1", "1/0", "nan", "1/2/3", "1e-400", "1e99", ".", "+5"] {
            assert!(text.parse::<Rate>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_time_in_ticks_is_rounded_up() {
        let rate: Rate = "1024".parse().unwrap();
        let ticks = [0.0, 1e-9, 0.02, 0.5, 0.5 + 1e-9, 1e300].map(|seconds| rate.ticks_in(seconds));
        assert_eq!(ticks, [0, 1, 21, 512, 513, u64::MAX]);
    }

    #[test]
    fn instants_come_from_the_index() {
        let rate: Rate = "1024".parse().unwrap();
        assert_eq!(rate.instant(1), SessionTime(976_563));
        assert_eq!(rate.instant(2), SessionTime(1_953_125));
        assert_eq!(rate.instant(1024 * 3600 * 24), SessionTime(86_400_000_000_000));
        for tick in 0..5000 {
            assert_eq!(rate.last_tick_at(rate.instant(tick)), tick);
            assert_eq!(rate.last_tick_at(rate.instant(tick + 1).plus_ns(-1)), tick);
        }
    }

    #[test]
    fn network_steps_fall_on_the_first_tick_at_or_after() {
        let schedule = Schedule::new("1000".parse().unwrap(), "128".parse().unwrap()).unwrap();
        assert_eq!((schedule.ticks_per_pattern(), schedule.steps_per_pattern()), (125, 16));
        let mut seen = 0;
        for tick in 0..1000 {
            if let Some(step) = schedule.step_at(tick) {
                assert_eq!(step, seen);
                assert_eq!(schedule.tick_of_step(step), tick);
                seen += 1;
            }
        }
        assert_eq!(seen, 128);
        assert!(Schedule::new("100".parse().unwrap(), "128".parse().unwrap()).is_err());
    }
}
