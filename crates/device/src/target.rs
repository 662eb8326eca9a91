//! Where a tracking hand wants to be: paths whose position, velocity and acceleration never jump.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A point of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Where the point is, m.
    pub position: DVec3,
    /// How fast it moves, m/s.
    pub velocity: DVec3,
    /// How its velocity changes, m/s².
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

    /// On a straight line from `begin`, its velocity rising to `velocity` (m/s) within `rise_s`.
    pub(crate) fn setting_off(begin: DVec3, velocity: DVec3, elapsed_s: f64, rise_s: f64) -> Self {
        let s = (elapsed_s / rise_s).clamp(0.0, 1.0);
        // The share of the speed is 3s² − 2s³, its integral s³ − s⁴/2.
        let way_s = rise_s * s * s * s * (1.0 - 0.5 * s) + (elapsed_s - rise_s).max(0.0);
        Self {
            position: begin + velocity * way_s,
            velocity: velocity * (s * s * (3.0 - 2.0 * s)),
            acceleration: velocity * (6.0 * s * (1.0 - s) / rise_s),
        }
    }

    /// `begin`, moved by a share of `shift` (m).
    pub(crate) fn shifted(begin: DVec3, shift: DVec3, progress: Progress) -> Self {
        Self {
            position: begin + shift * progress.way,
            velocity: shift * progress.rate_per_s,
            acceleration: shift * progress.change_per_s2,
        }
    }

    /// `begin`, turned about the z axis through `centre` by a share of `angle_rad`.
    pub(crate) fn turned(begin: DVec3, centre: DVec3, angle_rad: f64, progress: Progress) -> Self {
        let (sine, cosine) = (angle_rad * progress.way).sin_cos();
        let (rate, change) = (angle_rad * progress.rate_per_s, angle_rad * progress.change_per_s2);
        let arm = begin - centre;
        let arm = DVec3::new(cosine * arm.x - sine * arm.y, sine * arm.x + cosine * arm.y, arm.z);
        let (sideways, outwards) = (DVec3::new(-arm.y, arm.x, 0.0), DVec3::new(arm.x, arm.y, 0.0));
        Self {
            position: centre + arm,
            velocity: sideways * rate,
            acceleration: sideways * change - outwards * (rate * rate),
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

/// How much of a movement from rest to rest is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress {
    /// The share of the way that is done, 0 to 1.
    pub(crate) way: f64,
    pub(crate) rate_per_s: f64,
    pub(crate) change_per_s2: f64,
}

impl Progress {
    /// Of a minimum-jerk movement, `10s³ − 15s⁴ + 6s⁵`.
    pub(crate) fn minimum_jerk(elapsed_s: f64, duration_s: f64) -> Self {
        if elapsed_s >= duration_s {
            return Self { way: 1.0, rate_per_s: 0.0, change_per_s2: 0.0 };
        }
        let s = (elapsed_s / duration_s).max(0.0);
        let rest = 1.0 - s;
        Self {
            way: s * s * s * (10.0 - 15.0 * s + 6.0 * s * s),
            rate_per_s: 30.0 * s * s * rest * rest / duration_s,
            change_per_s2: 60.0 * s * rest * (1.0 - 2.0 * s) / (duration_s * duration_s),
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
