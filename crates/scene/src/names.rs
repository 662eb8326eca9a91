//! The names of hosts and of every coordinate of a session's state, shared by the host and the analysis.
//!
//! A coordinate reads like `host1.object.x` or `host1.held.host2.hand.v.age2`. Lengths and speeds are along the
//! scene's axis.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A host, counted from 0. Host `i` serves user `i`; host 0 (shown as `host1`) keeps the session's clock and,
/// in the centralized architecture, is the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct HostIndex(pub u8);

impl HostIndex {
    /// The host that keeps the session's clock; the server of a centralized session.
    pub const FIRST: Self = Self(0);

    /// As an index into a slice with one element a host.
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// All hosts of a session with `users` users.
    pub fn all(users: u8) -> impl Iterator<Item = Self> + Clone {
        (0..users).map(Self)
    }

    /// All hosts but this one.
    pub fn others(self, users: u8) -> impl Iterator<Item = Self> + Clone {
        Self::all(users).filter(move |&other| other != self)
    }
}

impl fmt::Display for HostIndex {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "host{}", u32::from(self.0) + 1)
    }
}

/// What a coordinate belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Part {
    /// The hand (and device) of a host's user.
    Hand,
    /// A host's copy of the object (in a centralized session, the server's object).
    Object,
    /// The force that the server sends back to a user (centralized).
    Force,
}

/// Which number of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Quantity {
    /// Position along the axis, m.
    X,
    /// Velocity along the axis, m/s.
    V,
    /// Force along the axis, N.
    F,
}

/// One number of a session's state, at the instant of a network step, before anything is sampled at that instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Coordinate {
    /// A body that lives on `host`.
    Own {
        /// Where it lives.
        host: HostIndex,
        /// Hand or object.
        part: Part,
        /// Which number.
        quantity: Quantity,
    },
    /// A sample of something of `from` that `host` holds, has queued, or that is still in flight to it. Age `a` at
    /// network step `k` is the sample taken at step `k − a`; `a ≥ 1`.
    Held {
        /// The receiver.
        host: HostIndex,
        /// The sender.
        from: HostIndex,
        /// What was sampled.
        part: Part,
        /// Which number.
        quantity: Quantity,
        /// Network steps since it was sampled.
        age: u32,
    },
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Hand => "hand",
            Self::Object => "object",
            Self::Force => "force",
        })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::X => "x",
            Self::V => "v",
            Self::F => "f",
        })
    }
}

impl fmt::Display for Coordinate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own { host, part, quantity } => write!(formatter, "{host}.{part}.{quantity}"),
            Self::Held { host, from, part, quantity, age } => {
                write!(formatter, "{host}.held.{from}.{part}.{quantity}.age{age}")
            }
        }
    }
}

/// A text that names no coordinate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} names no coordinate; one looks like host1.object.x or host1.held.host2.hand.v.age2")]
pub struct CoordinateError(pub String);

impl FromStr for Coordinate {
    type Err = CoordinateError;

    fn from_str(text: &str) -> Result<Self, CoordinateError> {
        parse_coordinate(text).ok_or_else(|| CoordinateError(text.to_owned()))
    }
}

fn parse_coordinate(text: &str) -> Option<Coordinate> {
    let host = |text: &str| -> Option<HostIndex> {
        let number: u8 = text.strip_prefix("host")?.parse().ok()?;
        Some(HostIndex(number.checked_sub(1)?))
    };
    let part = |text: &str| match text {
        "hand" => Some(Part::Hand),
        "object" => Some(Part::Object),
        "force" => Some(Part::Force),
        _ => None,
    };
    let quantity = |text: &str| match text {
        "x" => Some(Quantity::X),
        "v" => Some(Quantity::V),
        "f" => Some(Quantity::F),
        _ => None,
    };
    match *text.split('.').collect::<Vec<_>>().as_slice() {
        [h, p, q] => Some(Coordinate::Own { host: host(h)?, part: part(p)?, quantity: quantity(q)? }),
        [h, "held", f, p, q, age] => Some(Coordinate::Held {
            host: host(h)?,
            from: host(f)?,
            part: part(p)?,
            quantity: quantity(q)?,
            age: age.strip_prefix("age")?.parse().ok().filter(|&age| age > 0)?,
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for name in [
            "host1.object.x",
            "host16.hand.v",
            "host1.held.host2.hand.v.age2",
            "host2.held.host1.force.f.age1",
        ] {
            assert_eq!(name.parse::<Coordinate>().unwrap().to_string(), name);
        }
        for name in ["", "host0.hand.x", "host1.held.host2.hand.v.age0", "host1.foot.x"] {
            assert!(name.parse::<Coordinate>().is_err(), "{name}");
        }
    }
}
