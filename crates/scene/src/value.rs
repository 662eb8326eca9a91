//! The value of a key, and how the scene's fields take and give one.

use std::fmt;

use glam::DVec3;

use crate::names::HostIndex;
use crate::scene::{
    Architecture, Coordination, DeviceKind, Integrator, LocalModelKind, PlayOut, ReturnedForce, ShapeKind,
    SoftMeshKind, SoftModel, Space, StiffnessFrom, SurfaceHold, VelocityEstimate, WallSides,
};
use crate::time::Rate;

/// The value of a scene key. Units are in the key's name.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A whole number.
    Count(u64),
    /// An exact rate, Hz.
    Rate(Rate),
    /// A text, or one of several words.
    Text(String),
    /// Yes or no.
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

/// A word out of a fixed few.
pub(crate) trait Choice {
    const WORDS: &'static [&'static str];
}

macro_rules! choice {
    ($kind:ident { $($word:literal => $variant:ident),+ }) => {
        impl Choice for $kind {
            const WORDS: &'static [&'static str] = &[$($word),+];
        }
        impl Field for $kind {
            fn value(&self) -> Value {
                Value::Text(match self { $(Self::$variant => $word),+ }.to_owned())
            }
            fn assign(&mut self, value: Value) {
                match value {
                    $(Value::Text(word) if word == $word => *self = Self::$variant,)+
                    _ => (),
                }
            }
        }
    };
}
choice!(Architecture { "centralized" => Centralized, "distributed" => Distributed });
choice!(Coordination { "pairwise" => Pairwise, "average" => Average });
choice!(Integrator { "exact-hold" => ExactHold, "semi-implicit-euler" => SemiImplicitEuler });
choice!(PlayOut { "scheduled" => Scheduled, "on-arrival" => OnArrival });
choice!(WallSides { "two" => Two, "one" => One });
choice!(Space { "line" => Line, "plane" => Plane, "space" => Space });
choice!(DeviceKind { "point" => Point, "pantograph" => Pantograph, "phantom" => Phantom });
choice!(VelocityEstimate { "exact" => Exact, "difference" => Difference, "filtered" => Filtered });
choice!(ShapeKind {
    "point" => Point,
    "ball" => Ball,
    "box" => Box,
    "capsule" => Capsule,
    "hull" => Hull,
    "mesh" => Mesh
});
choice!(SoftModel {
    "none" => None,
    "mass-spring" => MassSpring,
    "corotational" => Corotational,
    "balloon" => Balloon
});
choice!(SoftMeshKind {
    "file" => File,
    "beam" => Beam,
    "block" => Block,
    "ball" => Ball,
    "balloon" => Balloon,
    "organ" => Organ,
    "spring" => Spring
});
choice!(LocalModelKind { "hold" => Hold, "p" => P, "pi" => Pi, "compliance" => Compliance });
choice!(StiffnessFrom { "body" => Body, "estimate" => Estimate });
choice!(ReturnedForce { "first" => First, "mean" => Mean, "last" => Last });
choice!(SurfaceHold { "zero" => Zero, "first" => First });
