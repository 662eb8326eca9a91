//! The value of a key, and how the scene's fields take and give one.

use std::fmt;

use glam::DVec3;

use crate::names::HostIndex;
use crate::time::Rate;

/// The value of a scene key. Units are in the key's name.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number, in the unit of its key.
    Number(f64),
    /// A whole number, 0 or more.
    Count(u64),
    /// An exact rate, Hz.
    Rate(Rate),
    /// A text, or one of several words.
    Text(String),
    /// Whether something is so.
    Flag(bool),
    /// A vector in the world frame.
    Vector(DVec3),
}

impl Value {
    /// The value as a number (a rate in hertz), if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Count(count) => Some(*count as f64),
            Self::Rate(rate) => Some(rate.hz()),
            Self::Text(_) | Self::Flag(_) | Self::Vector(_) => None,
        }
    }
}

/// As TOML; reading it back gives the same value, bit for bit.
impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => formatter.write_str(&plain(*number)),
            Self::Count(count) => write!(formatter, "{count}"),
            Self::Rate(rate) if rate.denominator() == 1 => write!(formatter, "{rate}"),
            Self::Rate(rate) => write!(formatter, "\"{rate}\""),
            Self::Text(text) => write!(formatter, "{}", toml::Value::String(text.clone())),
            Self::Flag(flag) => write!(formatter, "{flag}"),
            Self::Vector(DVec3 { x, y: 0.0, z: 0.0 }) => formatter.write_str(&plain(*x)),
            Self::Vector(v) => write!(formatter, "[{}, {}, {}]", plain(v.x), plain(v.y), plain(v.z)),
        }
    }
}

/// The shortest text that reads back as the same number.
pub(crate) fn plain(number: f64) -> String {
    if number.abs() < 1e15 && number.abs() >= 1e-4 || number == 0.0 {
        format!("{number}")
    } else {
        format!("{number:?}")
    }
}

/// A field of a scene. `assign` is given what the key's kind let through, so that a mismatch cannot happen; a test
/// assigns every key.
pub(crate) trait Field {
    fn value(&self) -> Value;
    fn assign(&mut self, value: Value);
}

macro_rules! field {
    ($kind:ty, $variant:ident) => {
        impl Field for $kind {
            fn value(&self) -> Value {
                Value::$variant(self.clone().into())
            }
            fn assign(&mut self, value: Value) {
                if let Value::$variant(value) = value
                    && let Ok(value) = value.try_into()
                {
                    *self = value;
                }
            }
        }
    };
}
field!(f64, Number);
field!(u8, Count);
field!(u32, Count);
field!(u64, Count);
field!(Rate, Rate);
field!(String, Text);
field!(bool, Flag);
field!(DVec3, Vector);

/// Whole numbers along x, y and z.
impl Field for [u32; 3] {
    fn value(&self) -> Value {
        Value::Vector(DVec3::from(self.map(f64::from)))
    }
    fn assign(&mut self, value: Value) {
        if let Value::Vector(vector) = value {
            *self = vector.to_array().map(|component| component as u32);
        }
    }
}

/// Files and overrides count hosts from 1.
impl Field for HostIndex {
    fn value(&self) -> Value {
        Value::Count(u64::from(self.0) + 1)
    }
    fn assign(&mut self, value: Value) {
        if let Value::Count(number) = value {
            *self = Self(u8::try_from(number.saturating_sub(1)).unwrap_or(u8::MAX));
        }
    }
}

/// A field that is one of a few words: what a scene has for it, and what it is until its key is read.
macro_rules! choice {
    ($kind:ident { $($word:literal => $variant:ident),+ }) => {
        impl $kind {
            /// The words that a scene can have for it.
            pub const WORDS: &'static [&'static str] = &[$($word),+];
            /// What these words stand for, in their order.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];
        }
        impl Default for $kind {
            /// The first: what the field holds until its key is read.
            fn default() -> Self {
                Self::ALL[0]
            }
        }
        /// The word that a scene has for it.
        impl std::fmt::Display for $kind {
            fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                formatter.write_str(match self { $(Self::$variant => $word),+ })
            }
        }
        impl $crate::value::Field for $kind {
            fn value(&self) -> $crate::value::Value {
                $crate::value::Value::Text(self.to_string())
            }
            fn assign(&mut self, value: $crate::value::Value) {
                match value {
                    $($crate::value::Value::Text(word) if word == $word => *self = Self::$variant,)+
                    _ => (),
                }
            }
        }
    };
}
pub(crate) use choice;
