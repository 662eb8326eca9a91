//! Exact durations: rational numbers of seconds.

use std::fmt;
use std::str::FromStr;

use cotouch_scene::time::Rate;

/// A duration in seconds, exact and not negative: `numerator / denominator` in lowest terms.
///
/// A decimal such as `"0.0005"` and a fraction such as `"1/1024"` are both taken exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Time {
    numerator: u128,
    denominator: u128,
}

/// Why something is not a [`Time`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a time is a number of seconds, 0 or more, such as 0.0005, or a fraction such as \"1/1024\", with at most 12 digits a side; found {found:?}"
)]
pub struct TimeError {
    /// What was found.
    pub found: String,
}

/// Sums and products of times with larger terms than this are refused when a diagram is checked.
const LARGEST_TERM: u128 = 1_000_000_000_000_000_000;

impl Time {
    /// No time.
    pub const ZERO: Self = Self { numerator: 0, denominator: 1 };

    /// `numerator / denominator` seconds.
    ///
    /// # Errors
    /// When the denominator is zero.
    pub fn new(numerator: u64, denominator: u64) -> Result<Self, TimeError> {
        if denominator == 0 {
            return Err(TimeError { found: format!("{numerator}/{denominator}") });
        }
        Ok(Self::reduced(numerator.into(), denominator.into()))
    }

    /// One period of a rate.
    #[must_use]
    pub fn period(rate: Rate) -> Self {
        Self::reduced(rate.denominator().into(), rate.numerator().into())
    }

    /// This many times as long. A product that is too large to be exact is refused when the diagram is checked.
    #[must_use]
    pub fn times(self, factor: u64) -> Self {
        Self::reduced(self.numerator.saturating_mul(factor.into()), self.denominator)
    }

    /// The same, in seconds.
    #[must_use]
    pub fn seconds(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }

    pub(crate) const fn is_zero(self) -> bool {
        self.numerator == 0
    }

    /// Whether sums and products of two such times are exact.
    pub(crate) const fn is_manageable(self) -> bool {
        self.numerator <= LARGEST_TERM && self.denominator <= LARGEST_TERM
    }

    /// `1 / divisor` of this; `None` for 0 or where it is too large to be exact.
    pub(crate) fn divided_by(self, divisor: u128) -> Option<Self> {
        let denominator = self.denominator.checked_mul(divisor).filter(|&product| product > 0)?;
        Some(Self::reduced(self.numerator, denominator))
    }

    /// The longest time of which both are whole multiples; `None` where it is too small to be exact.
    pub(crate) fn common_divisor(self, other: Self) -> Option<Self> {
        let (one, another, denominator) = self.over_one_denominator(other)?;
        Some(Self::reduced(greatest_common_divisor(one, another), denominator))
    }

    /// The shortest time, above 0, that is a whole multiple of both; `None` where it is too large to be exact.
    pub(crate) fn common_multiple(self, other: Self) -> Option<Self> {
        let (one, another, denominator) = self.over_one_denominator(other)?;
        let divisor = greatest_common_divisor(one, another);
        let multiple = one.checked_div(divisor)?.checked_mul(another)?;
        Some(Self::reduced(multiple, denominator))
    }

    /// How many times `unit` this is, where that is a whole number.
    pub(crate) fn in_units_of(self, unit: Self) -> Option<i64> {
        let (one, another, _) = self.over_one_denominator(unit)?;
        let whole = one.checked_rem(another)? == 0;
        whole.then(|| i64::try_from(one / another).ok()).flatten()
    }

    fn over_one_denominator(self, other: Self) -> Option<(u128, u128, u128)> {
        let divisor = greatest_common_divisor(self.denominator, other.denominator);
        let (mine, theirs) = (other.denominator / divisor, self.denominator / divisor);
        let one = self.numerator.checked_mul(mine)?;
        let another = other.numerator.checked_mul(theirs)?;
        Some((one, another, self.denominator.checked_mul(mine)?))
    }

    fn reduced(numerator: u128, denominator: u128) -> Self {
        let divisor = greatest_common_divisor(numerator, denominator);
        Self { numerator: numerator / divisor, denominator: denominator / divisor }
    }
}

const fn greatest_common_divisor(mut a: u128, mut b: u128) -> u128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl fmt::Display for Time {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.denominator {
            1 => write!(formatter, "{} s", self.numerator),
            denominator => write!(formatter, "{}/{denominator} s", self.numerator),
        }
    }
}

impl FromStr for Time {
    type Err = TimeError;

    fn from_str(text: &str) -> Result<Self, TimeError> {
        let error = || TimeError { found: text.to_owned() };
        if text.trim().parse() == Ok(0.0) && !text.trim().starts_with('-') {
            return Ok(Self::ZERO);
        }
        // Rates are read by the same rule; only 0 is none.
        let number: Rate = text.trim().parse().map_err(|_| error())?;
        Self::new(number.numerator(), number.denominator()).map_err(|_| error())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(text: &str) -> Time {
        text.parse().unwrap()
    }

    #[test]
    fn times_are_taken_exactly() {
        assert_eq!(time("0.0005"), Time::new(1, 2000).unwrap());
        assert_eq!(time("2/2048"), Time::period("1024".parse().unwrap()));
        assert_eq!(time("0"), Time::ZERO);
        for text in ["", "-1", "-0", "1/0", "nan", "1/2/3", "one"] {
            assert!(text.parse::<Time>().is_err(), "{text}");
        }
    }

    #[test]
    fn divisors_and_multiples_are_those_of_fractions() {
        let (a, b) = (time("1/1000"), time("1/128"));
        assert_eq!(a.common_divisor(b), Some(time("1/16000")));
        assert_eq!(a.common_multiple(b), Some(time("1/8")));
        assert_eq!(time("1/8").in_units_of(a), Some(125));
        assert_eq!(b.in_units_of(a), None);
        assert_eq!(Time::ZERO.common_divisor(b), Some(b));
        assert_eq!(Time::ZERO.common_multiple(Time::ZERO), None);
    }
}
