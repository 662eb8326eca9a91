//! The names of hosts and of every coordinate of a session's state, shared by the host and the analysis.
//!
//! A coordinate reads like `host1.object.x` or `host1.held.host2.hand.v.age2`. All are in the world
//! frame.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A host, counted from 0. Host `i` serves user `i`; host 0 (shown as `host1`) keeps the session's clock and,
/// in the centralized architecture, is the server.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
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

/// What a coordinate belongs to. The number counts a host's fingers, or the session's bodies, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Part {
    /// A finger of a host's user, with its share of the device. Shown as `hand`, `hand2`, …
    Hand(u8),
    /// A host's copy of a body (in a centralized session, the server's). Shown as `object`, `object2`, …
    Object(u8),
    /// The force that the server sends back to a finger (centralized). Shown as `force`, `force2`, …
    Force(u8),
    /// What a device remembers to tell the velocity of a finger. Shown as `sensor`, `sensor2`, …
    Sensor(u8),
    /// A vector that a coordination scheme adds to samples: 2·[`MAX_CHANNEL_VECTORS`](crate::limits::MAX_CHANNEL_VECTORS) for each body, those for translation
    /// before those for rotation; its components are called forces. Shown as `channel`, `channel2`, …
    Channel(u8),
}

impl Part {
    /// The first finger.
    pub const HAND: Self = Self::Hand(0);
    /// The first body.
    pub const OBJECT: Self = Self::Object(0);
    /// The force on the first finger.
    pub const FORCE: Self = Self::Force(0);
}

/// An axis of the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

impl Axis {
    /// All three.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// As an index into a vector.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// Which number of a part, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Quantity {
    /// Position, m. Shown as `x`, `y`, `z`.
    Position(Axis),
    /// A small turn from the pose about which the loop is linear: a rotation vector, rad. Shown as `rx`, `ry`, `rz`.
    Rotation(Axis),
    /// Velocity, m/s. Shown as `v`, `vy`, `vz`.
    Velocity(Axis),
    /// Angular velocity, rad/s. Shown as `wx`, `wy`, `wz`.
    AngularVelocity(Axis),
    /// Force, N. Shown as `f`, `fy`, `fz`.
    Force(Axis),
}

impl Quantity {
    /// Position along x.
    pub const X: Self = Self::Position(Axis::X);
    /// Velocity along x.
    pub const V: Self = Self::Velocity(Axis::X);
    /// Force along x.
    pub const F: Self = Self::Force(Axis::X);

    const NAMES: [(&'static str, Self); 15] = {
        use Axis::{X, Y, Z};
        [
            ("x", Self::Position(X)),
            ("y", Self::Position(Y)),
            ("z", Self::Position(Z)),
            ("rx", Self::Rotation(X)),
            ("ry", Self::Rotation(Y)),
            ("rz", Self::Rotation(Z)),
            ("v", Self::Velocity(X)),
            ("vy", Self::Velocity(Y)),
            ("vz", Self::Velocity(Z)),
            ("wx", Self::AngularVelocity(X)),
            ("wy", Self::AngularVelocity(Y)),
            ("wz", Self::AngularVelocity(Z)),
            ("f", Self::Force(X)),
            ("fy", Self::Force(Y)),
            ("fz", Self::Force(Z)),
        ]
    };
}

/// One number of a session's state, at the instant of a network step, before anything is sampled at that instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Coordinate {
    /// A body that lives on `host`.
    Own {
        /// Where it lives.
        host: HostIndex,
        /// Hand, object or sensor.
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
    /// What a coordination scheme remembers of the copies of a body at `host` and at `from`, along (or, as a rotation,
    /// about) one axis.
    SchemeMemory {
        /// The host that remembers.
        host: HostIndex,
        /// The peer with the other copy.
        from: HostIndex,
        /// The body's place in the scene's order, from 0.
        object: u8,
        /// A position of the channel for translation, a rotation of that for rotation.
        quantity: Quantity,
        /// Which vector, from 0: those of ticks before those of network steps.
        vector: u8,
    },
    /// The integral's force of a finger slot at a host, N along the contact's normal.
    Integral {
        /// Whose local model.
        host: HostIndex,
        /// Counted over all users' fingers.
        slot: u8,
    },
    /// What a law remembers of a finger slot at a host, besides an integral's force.
    LawMemory {
        /// Whose local model.
        host: HostIndex,
        /// Counted over all users' fingers.
        slot: u8,
        /// Which number, from 0.
        number: u8,
    },
    /// A number of a host's soft body after its last step: displacements, then velocities of its free coordinates (or of
    /// what these were reduced to).
    SoftBody {
        /// Whose body.
        host: HostIndex,
        /// From 0.
        index: u32,
    },
    /// How far a contact is from rest, m, in the frame that came `age` slow periods before the next one; 1 is the last.
    Surface {
        /// Whose frame.
        host: HostIndex,
        /// The contact's finger slot.
        slot: u8,
        /// Along which axis of the world.
        axis: Axis,
        /// Slow periods, 1 or more.
        age: u32,
    },
    /// The force of a contact with which that frame was stepped, N.
    SteppedForce {
        /// Whose frame.
        host: HostIndex,
        /// The contact's finger slot.
        slot: u8,
        /// Along which axis of the world.
        axis: Axis,
        /// Slow periods, 1 or more.
        age: u32,
    },
}

impl Coordinate {
    /// What was sampled, or came, `by` steps or periods before this; what is not of the past stays itself.
    #[must_use]
    pub const fn earlier(mut self, by: u32) -> Self {
        match &mut self {
            Self::Held { age, .. } | Self::Surface { age, .. } | Self::SteppedForce { age, .. } => *age += by,
            Self::Own { .. }
            | Self::SchemeMemory { .. }
            | Self::Integral { .. }
            | Self::LawMemory { .. }
            | Self::SoftBody { .. } => {}
        }
        self
    }
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, index) = match *self {
            Self::Hand(index) => ("hand", index),
            Self::Object(index) => ("object", index),
            Self::Force(index) => ("force", index),
            Self::Sensor(index) => ("sensor", index),
            Self::Channel(index) => ("channel", index),
        };
        match index {
            0 => formatter.write_str(name),
            _ => write!(formatter, "{name}{}", u32::from(index) + 1),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::NAMES.iter().find(|(_, quantity)| quantity == self).map_or("", |(name, _)| name);
        formatter.write_str(name)
    }
}

impl fmt::Display for Coordinate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Own { host, part, quantity } => write!(formatter, "{host}.{part}.{quantity}"),
            Self::Held { host, from, part, quantity, age } => {
                write!(formatter, "{host}.held.{from}.{part}.{quantity}.age{age}")
            }
            Self::SchemeMemory { host, from, object, quantity, vector } => {
                let (object, vector) = (Part::Object(*object), u32::from(*vector) + 1);
                write!(formatter, "{host}.memory{vector}.{from}.{object}.{quantity}")
            }
            Self::Integral { host, slot } => write!(formatter, "{host}.integral{}", u32::from(*slot) + 1),
            Self::LawMemory { host, slot, number } => {
                write!(formatter, "{host}.memory{}.{}", u32::from(*slot) + 1, u32::from(*number) + 1)
            }
            Self::SoftBody { host, index } => write!(formatter, "{host}.soft{}", index + 1),
            Self::Surface { host, slot, axis, age } => {
                let (number, axis) = (u32::from(*slot) + 1, Quantity::Position(*axis));
                write!(formatter, "{host}.surface{number}.{axis}.age{age}")
            }
            Self::SteppedForce { host, slot, axis, age } => {
                let (number, axis) = (u32::from(*slot) + 1, Quantity::Position(*axis));
                write!(formatter, "{host}.stepped{number}.{axis}.age{age}")
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
    let part = |text: &str| {
        let (name, number) = text.split_at(text.find(|c: char| c.is_ascii_digit()).unwrap_or(text.len()));
        let index = match number {
            "" => 0,
            "0" | "1" => return None,
            _ => number.parse::<u8>().ok()?.checked_sub(1)?,
        };
        match name {
            "hand" => Some(Part::Hand(index)),
            "object" => Some(Part::Object(index)),
            "force" => Some(Part::Force(index)),
            "sensor" => Some(Part::Sensor(index)),
            "channel" => Some(Part::Channel(index)),
            _ => None,
        }
    };
    let quantity = |text: &str| Quantity::NAMES.iter().find(|(name, _)| *name == text).map(|found| found.1);
    let age = |text: &str| text.strip_prefix("age")?.parse().ok().filter(|&age: &u32| age > 0);
    let counted = |text: &str, name: &str| text.strip_prefix(name)?.parse::<u32>().ok()?.checked_sub(1);
    let slot = |text: &str, name: &str| counted(text, name)?.try_into().ok();
    let axis =
        |text: &str| Axis::ALL.into_iter().find(|&axis| quantity(text) == Some(Quantity::Position(axis)));
    match *text.split('.').collect::<Vec<_>>().as_slice() {
        [h, s] if s.starts_with("integral") => {
            Some(Coordinate::Integral { host: host(h)?, slot: slot(s, "integral")? })
        }
        [h, s] => Some(Coordinate::SoftBody { host: host(h)?, index: counted(s, "soft")? }),
        [h, s, n] if s.starts_with("memory") => Some(Coordinate::LawMemory {
            host: host(h)?,
            slot: slot(s, "memory")?,
            number: counted(n, "")?.try_into().ok()?,
        }),
        [h, p, q] => Some(Coordinate::Own { host: host(h)?, part: part(p)?, quantity: quantity(q)? }),
        [h, s, x, a] => {
            let (host, axis, age) = (host(h)?, axis(x)?, age(a)?);
            match slot(s, "surface") {
                Some(slot) => Some(Coordinate::Surface { host, slot, axis, age }),
                None => Some(Coordinate::SteppedForce { host, slot: slot(s, "stepped")?, axis, age }),
            }
        }
        [h, m, f, p, q] => match part(p)? {
            Part::Object(object) => Some(Coordinate::SchemeMemory {
                host: host(h)?,
                from: host(f)?,
                object,
                quantity: quantity(q)?,
                vector: slot(m, "memory")?,
            }),
            _ => None,
        },
        [h, "held", f, p, q, a] => Some(Coordinate::Held {
            host: host(h)?,
            from: host(f)?,
            part: part(p)?,
            quantity: quantity(q)?,
            age: age(a)?,
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
            "host2.object3.wz",
            "host1.held.host2.hand2.vy.age3",
            "host1.sensor2.y",
            "host1.held.host2.channel3.f.age1",
            "host1.memory2.host3.object2.rx",
            "host2.integral3",
            "host1.soft12",
            "host1.surface2.y.age1",
            "host3.stepped1.z.age2",
        ] {
            assert_eq!(name.parse::<Coordinate>().unwrap().to_string(), name);
        }
        for name in [
            "",
            "host0.hand.x",
            "host1.held.host2.hand.v.age0",
            "host1.foot.x",
            "host1.hand1.x",
            "host1.hand02x.x",
            "host1.integral0",
            "host1.surface1.v.age1",
        ] {
            assert!(name.parse::<Coordinate>().is_err(), "{name}");
        }
    }
}
