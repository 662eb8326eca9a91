//! Values that a scene's keys are swept through.

use std::str::FromStr;

use cotouch_scene::SceneErrors;
use serde::Serialize;

use crate::verdict::AnalysisError;

/// More values than this in one direction are a slip of the pen.
const MAX_VALUES: usize = 100_000;

/// Rising or falling values, written `LO..HI:COUNT` or, with equal ratios, `LO..HI:COUNT:log`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Grid {
    values: Vec<f64>,
    #[serde(skip)]
    logarithmic: bool,
}

/// One scene key and its values, written `KEY=LO..HI:COUNT[:log]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sweep {
    /// A scene key, dotted.
    pub key: String,
    /// What it is set to.
    pub values: Grid,
}

/// Why there is no sweep, or no answer at one of its points.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// Not of the form.
    #[error("{0:?} is not {1}")]
    Syntax(String, &'static str),
    /// No values, or too many.
    #[error("{0:?} has {1} values; a sweep needs 1 to {MAX_VALUES}")]
    Count(String, String),
    /// Bounds that are no numbers, or that do not bound anything.
    #[error(
        "{0:?} goes from {1} to {2}; both must be finite, different if there are several values, and above 0 for :log"
    )]
    Bounds(String, f64, f64),
    /// The same key twice.
    #[error("{0} is swept twice; the two directions of a map need different keys")]
    Twice(String),
    /// The scene does not allow a value.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// A point cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Whoever asked does not want to know any more.
    #[error("given up before the end")]
    GivenUp,
}

const GRID_FORM: &str = "LO..HI:COUNT or LO..HI:COUNT:log, such as 0..5000:200 or 0.1..100:50:log";
const SWEEP_FORM: &str = "KEY=LO..HI:COUNT or KEY=LO..HI:COUNT:log, such as hand.mass_kg=0.05..0.5:50";

impl Grid {
    /// `count` values from `from` to `to`, with equal differences or equal ratios.
    ///
    /// # Errors
    /// When the bounds or the count make no sense.
    pub fn new(from: f64, to: f64, count: usize, logarithmic: bool) -> Result<Self, SweepError> {
        let written = || format!("{from}..{to}:{count}{}", if logarithmic { ":log" } else { "" });
        if count == 0 || count > MAX_VALUES {
            return Err(SweepError::Count(written(), count.to_string()));
        }
        let bounds = from.is_finite() && to.is_finite() && (count == 1 || from != to);
        if !bounds || (logarithmic && !(from > 0.0 && to > 0.0)) {
            return Err(SweepError::Bounds(written(), from, to));
        }
        let last = (count - 1).max(1) as f64;
        let value = |index: usize| {
            let share = index as f64 / last;
            match index {
                0 => from,
                _ if index + 1 == count => to,
                _ if logarithmic => from * (to / from).powf(share),
                _ => from + share * (to - from),
            }
        };
        Ok(Self { values: (0..count).map(value).collect(), logarithmic })
    }

    /// In order.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Whether neighbours have equal ratios instead of equal differences.
    #[must_use]
    pub const fn is_logarithmic(&self) -> bool {
        self.logarithmic
    }
}

impl SweepError {
    /// The same about all that was written.
    fn of(self, text: &str, form: &'static str) -> Self {
        match self {
            Self::Syntax(..) => Self::Syntax(text.to_owned(), form),
            Self::Count(_, count) => Self::Count(text.to_owned(), count),
            Self::Bounds(_, from, to) => Self::Bounds(text.to_owned(), from, to),
            other => other,
        }
    }
}

impl FromStr for Grid {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let syntax = || SweepError::Syntax(text.to_owned(), GRID_FORM);
        let (bounds, rest) = text.split_once(':').ok_or_else(syntax)?;
        let (count, logarithmic) = match rest.split_once(':') {
            None => (rest, false),
            Some((count, "log")) => (count, true),
            Some(_) => return Err(syntax()),
        };
        let (from, to) = bounds.split_once("..").ok_or_else(syntax)?;
        let number = |part: &str| part.trim().parse::<f64>().map_err(|_| syntax());
        let (from, to) = (number(from)?, number(to)?);
        let count = count.trim().parse().map_err(|_| SweepError::Count(text.to_owned(), count.to_owned()))?;
        Self::new(from, to, count, logarithmic).map_err(|error| error.of(text, GRID_FORM))
    }
}

impl FromStr for Sweep {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let syntax = || SweepError::Syntax(text.to_owned(), SWEEP_FORM);
        let (key, values) = text.split_once('=').ok_or_else(syntax)?;
        let key = key.trim().to_owned();
        if key.is_empty() {
            return Err(syntax());
        }
        Ok(Self { key, values: values.parse().map_err(|error: SweepError| error.of(text, SWEEP_FORM))? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_values() {
        assert_eq!("0..5000:3".parse::<Grid>().unwrap().values(), [0.0, 2500.0, 5000.0]);
        assert_eq!("1..100:3:log".parse::<Grid>().unwrap().values(), [1.0, 10.0, 100.0]);
        assert_eq!("7..7:1".parse::<Grid>().unwrap().values(), [7.0]);
        let sweep: Sweep = "hand.mass_kg=-1e-3..2:2".parse().unwrap();
        assert_eq!((sweep.key.as_str(), sweep.values.values()), ("hand.mass_kg", &[-1e-3, 2.0][..]));
    }

    #[test]
    fn what_is_no_sweep_says_what_is() {
        for (text, words) in [
            ("hand.mass_kg", "KEY=LO..HI:COUNT"),
            ("=0..1:3", "KEY=LO..HI:COUNT"),
            ("a=0..1", "LO..HI:COUNT"),
            ("a=0..1:0", "1 to"),
            ("a=0..1:-2", "1 to"),
            ("a=0..1:3:lin", ":log"),
            ("a=0..1:3:log", "above 0"),
            ("a=1..1:3", "different"),
            ("a=0..inf:3", "finite"),
        ] {
            let error = text.parse::<Sweep>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
