//! Where a tracking hand wants to be: paths whose position, velocity and acceleration never jump.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A point of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// m/s².
    pub acceleration: DVec3,
}

impl Target {
    /// At `position`, at rest.
    #[must_use]
    pub const fn at(position: DVec3) -> Self {
        Self { position, velocity: DVec3::ZERO, acceleration: DVec3::ZERO }
    }

    /// `centre + amplitude·sin(ωt + phase)`, `angle` being ωt + phase.
    pub(crate) fn on_sinusoid(centre: DVec3, amplitude: DVec3, rate_rad_per_s: f64, angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        let offset = amplitude * sine;
        Self {
            position: centre + offset,
            velocity: amplitude * (rate_rad_per_s * cosine),
            acceleration: offset * (-rate_rad_per_s * rate_rad_per_s),
        }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            position: self.position + other.position,
            velocity: self.velocity + other.velocity,
            acceleration: self.acceleration + other.acceleration,
        }
    }

    pub(crate) fn minus(self, other: Self) -> Self {
        Self {
            position: self.position - other.position,
            velocity: self.velocity - other.velocity,
            acceleration: self.acceleration - other.acceleration,
        }
    }
}

/// An offset that dies out within a set time along the path of least jerk: the fifth-degree polynomial from given
/// position, velocity and acceleration to rest at zero (Flash & Hogan 1985, appendix).
///
/// Added to any path, it lets that path begin where the last one was. From rest it is the minimum-jerk reach
/// `d·(10s³ − 15s⁴ + 6s⁵)` with peak speed 1.875·d/T.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transition {
    /// The offset at the beginning.
    pub from: Target,
    /// Seconds until it is gone.
    pub duration_s: f64,
}

impl Transition {
    /// The offset `elapsed_s` after the beginning.
    #[must_use]
    pub fn offset(&self, elapsed_s: f64) -> Target {
        let total = self.duration_s;
        if elapsed_s >= total {
            return Target::default();
        }
        let (s, rest) = (elapsed_s / total, 1.0 - elapsed_s / total);
        let (rest2, rest3) = (rest * rest, rest * rest * rest);
        let (x, v, a) =
            (self.from.position, self.from.velocity * total, self.from.acceleration * (total * total));
        Target {
            position: (x * (1.0 + s * (3.0 + 6.0 * s)) + v * (s * (1.0 + 3.0 * s)) + a * (0.5 * s * s))
                * rest3,
            velocity: (x * (-30.0 * s * s) + v * (1.0 + s * (2.0 - 15.0 * s)) + a * (s * (1.0 - 2.5 * s)))
                * (rest2 / total),
            acceleration: (x * (-60.0 * s * (1.0 - 2.0 * s))
                + v * (-12.0 * s * (3.0 - 5.0 * s))
                + a * (1.0 - s * (8.0 - 10.0 * s)))
                * (rest / (total * total)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The classical form, from 0 to d.
    fn minimum_jerk(d: f64, s: f64) -> f64 {
        d * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    }

    #[test]
    fn from_rest_it_is_the_minimum_jerk_reach() {
        let (d, duration_s) = (0.25, 0.8);
        let transition = Transition { from: Target::at(DVec3::X * -d), duration_s };
        for step in 0..=100 {
            let s = f64::from(step) / 100.0;
            let x = d + transition.offset(s * duration_s).position.x;
            assert!((x - minimum_jerk(d, s)).abs() < 1e-15, "{s}");
        }
        let peak = transition.offset(0.5 * duration_s).velocity.x;
        assert!((peak - 1.875 * d / duration_s).abs() < 1e-15);
        assert_eq!(transition.offset(0.0), transition.from);
        assert_eq!(transition.offset(duration_s), Target::default());
    }

    #[test]
    fn it_begins_as_told_ends_at_rest_and_its_derivatives_are_its_derivatives() {
        let from = Target {
            position: DVec3::new(0.1, -0.2, 0.3),
            velocity: DVec3::new(-1.0, 0.5, 2.0),
            acceleration: DVec3::new(3.0, -4.0, 5.0),
        };
        let transition = Transition { from, duration_s: 0.5 };
        let begin = transition.offset(0.0);
        assert!((begin.position - from.position).length() < 1e-15);
        assert!((begin.velocity - from.velocity).length() < 1e-15);
        assert!((begin.acceleration - from.acceleration).length() < 1e-14);
        let end = transition.offset(0.5 - 1e-9);
        assert!(
            end.position.length() < 1e-20
                && end.velocity.length() < 1e-14
                && end.acceleration.length() < 1e-6
        );
        let h = 1e-5;
        for step in 1..50 {
            let t = f64::from(step) * 0.01 - 0.001;
            let (before, here, after) =
                (transition.offset(t - h), transition.offset(t), transition.offset(t + h));
            let velocity = (after.position - before.position) / (2.0 * h);
            let acceleration = (after.velocity - before.velocity) / (2.0 * h);
            assert!((velocity - here.velocity).length() < 1e-7, "{t}");
            assert!((acceleration - here.acceleration).length() < 1e-5, "{t}");
        }
    }
}
