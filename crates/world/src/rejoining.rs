//! How two things that came apart while one could not hear of the other are brought together: not by the coupling between them,
//! which would throw them, but by an offset of that coupling that goes away slowly.
//!
//! Of a coupling with the stretch d (from the one to the other, m or rad) and its rate v only `d − o` and `v − ν` count. As the two
//! hear of each other again, the offset is o := d − s and its rate ν := v − v_s, where s and v_s are the stretch and the rate that
//! counted last (none after a coupling had faded out): the force goes on from what it was. Then, at every tick, with u = min(1, t/T_b),
//! w = min(1, t/T_f), T the period, and L(u) = 1 − 10u³ + 15u⁴ − 6u⁵, the way with the least jerk (Flash & Hogan 1985),
//!
//! ```text
//! fade      ν := (v − v_s)·(1 − 3w² + 2w³)                      what moves fast is not caught at once ...
//! drift     o := o + ν·T                                        ... and comes farther apart meanwhile
//! ratchet   o := o·min(1, max(0, (d − s)·o/|o|²))               what comes together by itself stays together
//! bleed     o := o·L(u)/L(u − T/T_b)                            the rest goes away within T_b
//! ```
//!
//! All of it is in proportion to d, v, s and v_s: twice as far apart is twice the force.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::coupler::Stretch;

/// How quickly couplings are brought together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RejoiningPace {
    /// T/T_b; none where couplings bring together what came apart at once.
    bleed_per_tick: Option<f64>,
    /// T/T_f.
    fade_per_tick: f64,
    /// T, s.
    period_s: f64,
}

impl RejoiningPace {
    /// Offsets go away within `rejoin_s` (s; 0: there are none), rates fade out within `fade_s` (s), at ticks that are
    /// `period_s` (s) apart.
    #[must_use]
    pub fn new(rejoin_s: f64, fade_s: f64, period_s: f64) -> Self {
        let bleed_per_tick = (rejoin_s > 0.0).then(|| period_s / rejoin_s.max(period_s));
        Self { bleed_per_tick, fade_per_tick: period_s / fade_s.max(period_s), period_s }
    }

    /// The same, but that offsets go away within the time in which rates fade.
    #[must_use]
    pub fn at_the_pace_of_rates(self) -> Self {
        Self { bleed_per_tick: self.bleed_per_tick.map(|_| self.fade_per_tick), ..self }
    }

    /// Whether there are offsets.
    #[must_use]
    pub fn exists(self) -> bool {
        self.bleed_per_tick.is_some()
    }

    /// Ticks from a meeting until nothing is left of an offset.
    #[must_use]
    pub fn ticks(self) -> u64 {
        let ticks = |per_tick: f64| (per_tick.recip() - 1e-6).ceil() as u64;
        self.bleed_per_tick.map_or(0, |bleed| ticks(bleed).max(ticks(self.fade_per_tick)))
    }
}

/// By how much a coupling's stretch does not count. Begins as none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Offset {
    /// o, m or rad.
    value: DVec3,
    /// s.
    former: DVec3,
    /// v − v_s, m/s or rad/s.
    rate: DVec3,
    /// u and w.
    bled: f64,
    faded: f64,
}

impl Offset {
    /// Of two that hear of each other again `apart` from each other; the stretch that counted until now is `former`.
    #[must_use]
    pub fn met(pace: RejoiningPace, apart: Stretch, former: Stretch) -> Self {
        if !pace.exists() {
            return Self::default();
        }
        let (value, rate) = (apart.position - former.position, apart.velocity - former.velocity);
        Self { value, former: former.position, rate, bled: 0.0, faded: 0.0 }
    }

    /// o and ν: what is to be taken off the stretch and its rate.
    #[must_use]
    pub fn value(&self) -> Stretch {
        Stretch { position: self.value, velocity: self.rate * smooth_left(self.faded) }
    }

    /// Whether nothing is taken off any more.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.value == DVec3::ZERO && self.rate == DVec3::ZERO
    }

    /// One tick on, after which the two are `apart`, m or rad. No allocation.
    pub fn advance(&mut self, pace: RejoiningPace, apart: DVec3) {
        let Some(bleed_per_tick) = pace.bleed_per_tick.filter(|_| !self.is_over()) else { return };
        self.value += self.rate * (smooth_left(self.faded) * pace.period_s);
        self.faded = (self.faded + pace.fade_per_tick).min(1.0);
        if self.faded >= 1.0 {
            self.rate = DVec3::ZERO;
        }
        let before = least_jerk_left(self.bled);
        // Sums of ticks' shares fall short of 1 by their rounding.
        self.bled = (self.bled + bleed_per_tick).min(1.0);
        if self.bled > 1.0 - 0.5 * bleed_per_tick {
            self.bled = 1.0;
        }
        let size = self.value.length();
        if size > 0.0 {
            let along = self.value / size;
            let left = (apart - self.former).dot(along).min(size).max(0.0);
            self.value = along * (left * least_jerk_left(self.bled) / before);
        }
    }
}

/// What is left, 1 to 0, after a share w of the time in which something fades out.
fn smooth_left(w: f64) -> f64 {
    1.0 - w * w * (3.0 - 2.0 * w)
}

/// What is left of a way, 1 to 0, after a share u of the time.
fn least_jerk_left(u: f64) -> f64 {
    1.0 - u * u * u * (10.0 - u * (15.0 - 6.0 * u))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1.0 / 1024.0;

    fn pace() -> RejoiningPace {
        RejoiningPace::new(1.5, 0.25, PERIOD_S)
    }

    fn at(position: DVec3) -> Stretch {
        Stretch { position, velocity: DVec3::ZERO }
    }

    #[test]
    fn what_counts_goes_on_from_what_it_was_and_ends_as_all_of_it() {
        let (apart, former) = (DVec3::new(0.2, -0.1, 0.05), DVec3::new(-0.01, 0.004, 0.0));
        let mut offset = Offset::met(pace(), at(apart), at(former));
        let mut counts = apart - offset.value().position;
        assert!((counts - former).length() < 1e-15);
        let mut largest_step: f64 = 0.0;
        for _ in 0..pace().ticks() {
            offset.advance(pace(), apart);
            largest_step = largest_step.max((apart - offset.value().position - counts).length());
            counts = apart - offset.value().position;
        }
        assert_eq!((counts, offset.is_over()), (apart, true));
        assert!(pace().ticks() == 1536);
        // The fastest instant of a way with the least jerk is 15/8 of its mean speed.
        let bound = PERIOD_S * 15.0 / 8.0 * (apart - former).length() / 1.5;
        assert!(largest_step <= bound * 1.001, "{largest_step} {bound}");
    }

    /// The stretch that counts begins at rest, and is never far from what its own rate makes of it.
    #[test]
    fn what_moves_fast_is_not_caught_at_once() {
        let velocity = DVec3::X * 2.0;
        let mut place = DVec3::X * 0.1;
        let mut offset = Offset::met(pace(), Stretch { position: place, velocity }, Stretch::default());
        let mut before = Stretch::default();
        for tick in 0..pace().ticks() {
            let counts = Stretch {
                position: place - offset.value().position,
                velocity: velocity - offset.value().velocity,
            };
            assert!(
                counts.velocity.x >= before.velocity.x
                    && counts.velocity.x <= 2.0
                    && counts.position.x >= 0.0
            );
            // While its rate fades in, what is bled off besides is little.
            let moved = (counts.position - before.position).x / PERIOD_S;
            assert!(
                tick > 128 || (moved - before.velocity.x).abs() < 0.02 * 2.0,
                "{tick}: {moved} {before:?}"
            );
            before = counts;
            place += velocity * PERIOD_S;
            offset.advance(pace(), place);
        }
        assert!(offset.is_over());
    }

    #[test]
    fn what_came_together_by_itself_stays_together() {
        let mut offset = Offset::met(pace(), at(DVec3::X * 0.1), Stretch::default());
        // So soon nothing is bled yet.
        let is_at = |offset: &Offset, x: f64| (offset.value().position - DVec3::X * x).length() < 1e-7 * x;
        offset.advance(pace(), DVec3::X * 0.04);
        assert!(is_at(&offset, 0.04));
        offset.advance(pace(), DVec3::X * 0.08);
        assert!(is_at(&offset, 0.04), "it never grows");
        offset.advance(pace(), DVec3::X * -0.001);
        assert_eq!(offset.value(), Stretch::default());
        assert!(offset.is_over());
        // A stretch that was there before is none that came about meanwhile.
        let mut offset = Offset::met(pace(), at(DVec3::X * 0.1), at(DVec3::X * 0.03));
        offset.advance(pace(), DVec3::X * 0.06);
        assert!(is_at(&offset, 0.03));
    }

    #[test]
    fn it_is_in_proportion_to_what_it_begins_from() {
        let [mut one, mut twice] = [1.0, 2.0].map(|share| {
            let apart = Stretch { position: share * DVec3::X, velocity: share * DVec3::Z };
            Offset::met(pace(), apart, at(share * DVec3::Y * 0.1))
        });
        for tick in 0..2000 {
            let apart = DVec3::new((f64::from(tick) * 0.01).cos(), 0.3, 0.0);
            one.advance(pace(), apart);
            twice.advance(pace(), 2.0 * apart);
            assert!((2.0 * one.value().position - twice.value().position).length() < 1e-14);
        }
    }

    #[test]
    fn without_a_time_there_is_no_offset() {
        let pace = RejoiningPace::new(0.0, 0.25, PERIOD_S);
        assert_eq!((pace.exists(), pace.ticks()), (false, 0));
        assert!(Offset::met(pace, at(DVec3::X), at(DVec3::Y)).is_over());
    }
}
