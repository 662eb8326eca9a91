//! What a key is: kind, range, default, unit and one sentence. Reading, `--set`, writing, the JSON Schema and the
//! reference all work from the tables of [`scene`] and [`parts`]; nothing about a key is stated anywhere else.

pub(crate) mod parts;
pub(crate) mod scene;
mod shape;

use crate::time::Rate;
use crate::tree::{Content, Node};
use crate::value::{Value, plain};

/// One key of a table that describes a `T`.
pub(crate) struct Key<T: 'static> {
    /// Dotted, below the table that it is in.
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) fallback: Fallback<T>,
    /// Empty for a number without one.
    pub(crate) unit: &'static str,
    pub(crate) doc: &'static str,
    pub(crate) access: Access<T>,
    /// Whether its stability margin is told, where the unit does not say so.
    margin: Option<bool>,
}

/// Units of springs, and of moduli that make them.
const OF_SPRINGS: [&str; 3] = ["N/m", "N·m/rad", "Pa"];
/// Units of dampers.
const OF_DAMPERS: [&str; 2] = ["N·s/m", "N·m·s/rad"];

/// What a value looks like and in which range it lies; both ends are allowed.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Number {
        min: f64,
        max: f64,
    },
    Count {
        min: u64,
        max: u64,
    },
    /// Hz.
    Rate {
        min: u64,
        max: u64,
    },
    Choice(&'static [&'static str]),
    /// Printable, in characters.
    Text {
        min: usize,
        max: usize,
    },
    Flag,
    /// Each component between `-max` and `max`.
    Vector {
        max: f64,
    },
    /// Three whole numbers: along x, y and z.
    Counts {
        min: u32,
        max: u32,
    },
}

/// The value of a key that is not written.
pub(crate) enum Fallback<T: 'static> {
    /// The key must be written.
    Required,
    /// This, spelled as on the command line.
    Is(&'static str),
    /// Another default for each architecture.
    ByArchitecture { distributed: &'static str, centralized: &'static str, of: fn(&T) -> Value },
    /// What the field holds before the keys are read.
    Kept { says: &'static str },
    /// Follows from other keys, also when these are changed later.
    Derived { says: &'static str, of: fn(&T) -> Value },
}

/// How to read and set the field.
pub(crate) struct Access<T: 'static> {
    pub(crate) get: fn(&T) -> Value,
    pub(crate) set: fn(&mut T, Value),
}

/// Access to a field by its path.
macro_rules! at {
    ($($field:ident).+) => {
        $crate::keys::Access {
            get: |owner| $crate::value::Field::value(&owner.$($field).+),
            set: |owner, value| $crate::value::Field::assign(&mut owner.$($field).+, value),
        }
    };
}
pub(crate) use at;

/// What `keys` describe where nothing is written: those with a fixed default first, then those that follow from these.
pub(crate) fn blank<T: Default>(keys: &[Key<T>]) -> T {
    let mut owner = T::default();
    let (following, fixed): (Vec<&Key<T>>, _) = keys.iter().partition(|key| key.is_derived());
    for key in fixed.into_iter().chain(following) {
        key.set_default(&mut owner);
    }
    owner
}

impl<T> Key<T> {
    pub(crate) const fn new(
        name: &'static str,
        kind: Kind,
        fallback: Fallback<T>,
        unit: &'static str,
        doc: &'static str,
        access: Access<T>,
    ) -> Self {
        Self { name, kind, fallback, unit, doc, access, margin: None }
    }

    /// A share of a spring, whose margin is told though its unit is none of a spring's.
    pub(crate) const fn with_margin(mut self) -> Self {
        self.margin = Some(true);
        self
    }

    /// A spring or damper whose margin is not told: no loop of the analysis has it, or its gains are shares of it.
    pub(crate) const fn without_margin(mut self) -> Self {
        self.margin = Some(false);
        self
    }

    /// Whether it is a number whose stability margin is told: a spring, a damper, or what makes one.
    pub(crate) fn has_margin(&self) -> bool {
        let is_spring = || OF_SPRINGS.contains(&self.unit) || self.damps();
        matches!(self.kind, Kind::Number { .. }) && self.margin.unwrap_or_else(is_spring)
    }

    /// Whether it is a damper, by its unit.
    pub(crate) fn damps(&self) -> bool {
        OF_DAMPERS.contains(&self.unit)
    }

    /// What is allowed: follows "it must be".
    pub(crate) fn allowed(&self) -> String {
        match self.kind {
            Kind::Rate { .. } => self.kind.allowed(),
            _ if self.unit.is_empty() => self.kind.allowed(),
            _ => format!("{} ({})", self.kind.allowed(), self.unit),
        }
    }

    /// The value when the key is not written; the keys that it follows from are set in `owner`. `None`: required.
    pub(crate) fn default(&self, owner: &T) -> Option<Value> {
        match &self.fallback {
            Fallback::Required => None,
            Fallback::Is(text) => self.kind.read_word(text),
            Fallback::Kept { .. } => Some((self.access.get)(owner)),
            Fallback::ByArchitecture { of, .. } | Fallback::Derived { of, .. } => Some(of(owner)),
        }
    }

    /// Gives the field its default, if there is one.
    pub(crate) fn set_default(&self, owner: &mut T) {
        if let Some(value) = self.default(owner) {
            (self.access.set)(owner, value);
        }
    }

    /// Whether the default depends on other keys.
    pub(crate) fn is_derived(&self) -> bool {
        matches!(self.fallback, Fallback::ByArchitecture { .. } | Fallback::Derived { .. })
    }

    /// The default in words, for the schema and the reference.
    pub(crate) fn default_in_words(&self) -> String {
        match &self.fallback {
            Fallback::Required => "must be written".to_owned(),
            Fallback::Is("") => "empty".to_owned(),
            Fallback::Is(count) if matches!(self.kind, Kind::Counts { .. }) => {
                format!("[{count}, {count}, {count}]")
            }
            Fallback::Is(text) => (*text).to_owned(),
            Fallback::ByArchitecture { distributed, centralized, .. } => {
                format!("{distributed} distributed, {centralized} centralized")
            }
            Fallback::Kept { says } | Fallback::Derived { says, .. } => (*says).to_owned(),
        }
    }

    /// Whether the key has just the value that follows from other keys.
    pub(crate) fn follows(&self, owner: &T) -> bool {
        matches!(&self.fallback, Fallback::Derived { of, .. } if of(owner) == (self.access.get)(owner))
    }
}

impl Kind {
    /// The value that `node` stands for, if it is of this kind and in range.
    pub(crate) fn read(&self, node: &Node) -> Option<Value> {
        let number = |content: &Content| match *content {
            Content::Integer(value) => Some(value as f64),
            Content::Float { value, .. } => Some(value),
            _ => None,
        };
        let value = match (self, &node.content) {
            (Self::Number { .. }, content) => Value::Number(number(content)?),
            (Self::Count { .. }, Content::Integer(value)) => Value::Count(u64::try_from(*value).ok()?),
            (Self::Rate { .. }, Content::Integer(value)) => Value::Rate(value.to_string().parse().ok()?),
            (Self::Rate { .. }, Content::Float { text, .. } | Content::Text(text)) => {
                Value::Rate(text.parse().ok()?)
            }
            (Self::Choice(_) | Self::Text { .. }, Content::Text(text)) => Value::Text(text.clone()),
            (Self::Flag, Content::Flag(flag)) => Value::Flag(*flag),
            (Self::Vector { .. } | Self::Counts { .. }, Content::List(items)) => {
                let numbers: Option<Vec<f64>> = items.iter().map(|item| number(&item.content)).collect();
                Value::Vector(<[f64; 3]>::try_from(numbers?).ok()?.into())
            }
            (Self::Vector { .. }, content) => Value::Vector(glam::DVec3::X * number(content)?),
            _ => return None,
        };
        self.admit(value)
    }

    /// The value that `number` stands for, if it is of this kind and in range.
    pub(crate) fn read_number(&self, number: f64) -> Option<Value> {
        let value = match self {
            Self::Number { .. } => Value::Number(number),
            // 2^53: beyond it a decimal does not name one whole number.
            Self::Count { .. }
                if number.fract() == 0.0 && (0.0..=9.007_199_254_740_992e15).contains(&number) =>
            {
                Value::Count(number as u64)
            }
            Self::Rate { .. } => Value::Rate(plain(number).parse().ok()?),
            _ => return None,
        };
        self.admit(value)
    }

    /// The value that a word of these tables stands for.
    fn read_word(&self, word: &str) -> Option<Value> {
        Some(match self {
            Self::Number { .. } => Value::Number(word.parse().ok()?),
            Self::Count { .. } => Value::Count(word.parse().ok()?),
            Self::Rate { .. } => Value::Rate(word.parse().ok()?),
            Self::Choice(_) | Self::Text { .. } => Value::Text(word.to_owned()),
            Self::Flag => Value::Flag(word.parse().ok()?),
            Self::Vector { .. } => Value::Vector(glam::DVec3::X * word.parse::<f64>().ok()?),
            Self::Counts { .. } => Value::Vector(glam::DVec3::splat(word.parse().ok()?)),
        })
    }

    /// `value`, if it is in range; −0 becomes 0, so that equal scenes have equal bytes.
    pub(crate) fn admit(&self, value: Value) -> Option<Value> {
        let value = match value {
            Value::Number(number) => Value::Number(number + 0.0),
            Value::Vector(vector) => Value::Vector(vector + glam::DVec3::ZERO),
            other => other,
        };
        let admitted = match (self, &value) {
            (Self::Number { min, max }, Value::Number(number)) => (*min..=*max).contains(number),
            (Self::Count { min, max }, Value::Count(count)) => (*min..=*max).contains(count),
            (Self::Rate { min, max }, Value::Rate(rate)) => within(*rate, *min, *max),
            (Self::Choice(words), Value::Text(word)) => words.contains(&word.as_str()),
            (Self::Text { min, max }, Value::Text(text)) => is_printable(text, *min, *max),
            (Self::Flag, Value::Flag(_)) => true,
            (Self::Vector { max }, Value::Vector(vector)) => {
                vector.to_array().iter().all(|component| component.abs() <= *max)
            }
            (Self::Counts { min, max }, Value::Vector(vector)) => {
                let ends = f64::from(*min)..=f64::from(*max);
                vector.to_array().iter().all(|count| count.fract() == 0.0 && ends.contains(count))
            }
            _ => false,
        };
        admitted.then_some(value)
    }

    /// Follows "it must be".
    fn allowed(&self) -> String {
        match self {
            Self::Number { min, max } => format!("a number from {} to {}", plain(*min), plain(*max)),
            Self::Count { min, max } => format!("a whole number from {min} to {max}"),
            Self::Rate { min, max } => {
                format!("a rate from {min} to {max} Hz, as a number or a fraction such as \"1024/10\"")
            }
            Self::Choice(words) => {
                words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or ")
            }
            Self::Text { min: 0, max } => format!("a printable text of at most {max} characters"),
            Self::Text { min, max } => format!("a printable text of {min} to {max} characters"),
            Self::Flag => "true or false".to_owned(),
            Self::Vector { max } => {
                let max = plain(*max);
                format!("3 numbers, or one along x, from -{max} to {max}")
            }
            Self::Counts { min, max } => format!("3 whole numbers from {min} to {max}"),
        }
    }
}

/// Compared exactly: as whole numbers, not as decimals.
fn within(rate: Rate, min: u64, max: u64) -> bool {
    let (top, bottom) = (u128::from(rate.numerator()), u128::from(rate.denominator()));
    u128::from(min) * bottom <= top && top <= u128::from(max) * bottom
}

/// No control characters, nothing invisible or that turns the direction of text, no blanks at the ends.
fn is_printable(text: &str, min: usize, max: usize) -> bool {
    let hidden = |c: char| {
        c.is_control()
            || matches!(c, '\u{ad}' | '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}')
            || matches!(c, '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}')
    };
    (min..=max).contains(&text.chars().count()) && text.trim() == text && !text.chars().any(hidden)
}

#[cfg(test)]
mod tests;
