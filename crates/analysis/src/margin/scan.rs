//! Where the verdict first turns along a row of variants of a scene.

use super::found::go_on;
use crate::sweep::SweepError;
use crate::verdict::PointVerdict;

/// How many times the doubt must fit between ln ρ and 0, as in maps.
const SAFETY: f64 = 2.0;
/// ln ρ that is 0 but for rounding.
const HAIR: f64 = 1e-9;

/// What is known at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// Of the logarithm of the factor, the amount.
    pub(super) place: f64,
    /// Its spectral radius is over the same time at all places.
    pub(super) verdict: PointVerdict,
}

impl Look {
    fn height(&self) -> f64 {
        self.verdict.spectral_radius.ln().clamp(-40.0, 40.0)
    }
}

/// How closely a row is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scan {
    /// The last place; the first is 0.
    pub(super) farthest: f64,
    /// Into so many equal parts the row is divided at first.
    pub(super) parts: usize,
    /// Looks closer than this are not divided further.
    pub(super) finest: f64,
    /// At most so many looks.
    pub(super) max_looks: usize,
}

/// What a scan found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turn {
    /// The last look with the verdict of the first one, and the next one, which has the other.
    Between(Look, Look),
    /// All looks have the same verdict up to this one, the farthest that is allowed.
    Nowhere(Look),
}

/// Looks somewhere between two places; `None` where nothing there is allowed.
pub(super) type LookAt<'a> = dyn FnMut(f64, f64) -> Result<Option<Look>, SweepError> + 'a;

impl Scan {
    /// Where the verdict first is another one than that of `first`, which is at place 0. Between two looks with the same
    /// verdict it is looked again until how far ln ρ is from straight lines through neighbouring looks leaves no room for
    /// a crossing.
    ///
    /// # Errors
    /// When a look fails, or `wanted` says no.
    pub(super) fn first_turn(
        &self,
        first: Look,
        look_at: &mut LookAt<'_>,
        wanted: &dyn Fn() -> bool,
    ) -> Result<Turn, SweepError> {
        let mut looks = self.first_looks(first, look_at, wanted)?;
        let mut index = 0;
        while index + 1 < looks.len() {
            go_on(wanted())?;
            let (from, to) = (looks[index], looks[index + 1]);
            if from.verdict.stable != to.verdict.stable {
                return Ok(Turn::Between(from, to));
            }
            let width = to.place - from.place;
            let may_divide = width >= self.finest && looks.len() <= self.max_looks;
            let between = if may_divide && !is_clear(&looks, index) {
                look_at(from.place + 0.25 * width, to.place - 0.25 * width)?
            } else {
                None
            };
            match between {
                Some(look) => {
                    looks.insert(index + 1, look);
                    // The new look may cast doubt on what was clear before.
                    index = index.saturating_sub(1);
                }
                None => index += 1,
            }
        }
        Ok(Turn::Nowhere(looks[index]))
    }

    /// Up to the first one with another verdict; fewer where a place is not allowed.
    fn first_looks(
        &self,
        first: Look,
        look_at: &mut LookAt<'_>,
        wanted: &dyn Fn() -> bool,
    ) -> Result<Vec<Look>, SweepError> {
        let spacing = self.farthest / self.parts as f64;
        let mut looks = vec![first];
        for index in 1..=self.parts {
            go_on(wanted())?;
            let place = spacing * index as f64;
            let slack = if index == self.parts { 0.0 } else { 0.125 * spacing };
            let Some(look) = look_at(place - slack, place + slack)? else { break };
            looks.push(look);
            if look.verdict.stable != first.verdict.stable {
                break;
            }
        }
        Ok(looks)
    }
}

/// Whether there is no room for a crossing between a look and the next, which have the same verdict.
fn is_clear(looks: &[Look], index: usize) -> bool {
    let bend = |middle: usize| {
        let [before, here, after] = [middle - 1, middle, middle + 1].map(|at| looks[at]);
        let share = (here.place - before.place) / (after.place - before.place);
        (here.height() - (1.0 - share) * before.height() - share * after.height()).abs()
    };
    let middles = index.max(1)..(index + 2).min(looks.len() - 1);
    let doubt = middles.map(bend).fold(0.0, f64::max);
    let nearest = looks[index].height().abs().min(looks[index + 1].height().abs());
    // Neutral all along: rounding is no reason to look closer.
    nearest > SAFETY * doubt || doubt < HAIR
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at the middle of every interval, and counts.
    fn turn(height: impl Fn(f64) -> f64, last_allowed: f64) -> (Turn, usize) {
        let scan = Scan { farthest: 8.0, parts: 32, finest: 1e-3, max_looks: 300 };
        let mut count = 0;
        let look = |place: f64| {
            let spectral_radius = height(place).exp();
            Look { place, verdict: PointVerdict { spectral_radius, stable: spectral_radius < 1.0 } }
        };
        let mut look_at = |from: f64, to: f64| {
            count += 1;
            let place = 0.5 * (from + to);
            Ok((place <= last_allowed).then(|| look(place)))
        };
        let turn = scan.first_turn(look(0.0), &mut look_at, &|| true).unwrap();
        (turn, count)
    }

    #[test]
    fn a_stretch_of_the_other_verdict_between_looks_is_not_stepped_over() {
        // A third as wide as looks are apart at first.
        let bump = |x: f64| 0.04 - (x - 3.13_f64).abs();
        for sign in [1.0, -1.0] {
            let (found, count) = turn(|x| sign * bump(x).max(-0.3), 8.0);
            let Turn::Between(from, to) = found else { panic!("{found:?}") };
            assert!(bump(from.place) < 0.0 && bump(to.place) > 0.0 && to.place < 3.17, "{found:?}");
            assert!(count < 100, "{count}");
        }
    }

    #[test]
    fn where_nothing_turns_the_farthest_look_is_told() {
        let (found, count) = turn(|_| -0.1, 8.0);
        assert!(matches!(found, Turn::Nowhere(look) if look.place == 8.0) && count == 32, "{found:?}");
        let (found, _) = turn(|x| x - 5.0, 4.0);
        assert!(matches!(found, Turn::Nowhere(look) if look.place <= 4.0 && look.place > 3.7), "{found:?}");
    }

    #[test]
    fn who_does_not_want_to_know_any_more_is_heard() {
        let scan = Scan { farthest: 1.0, parts: 4, finest: 1e-3, max_looks: 10 };
        let mut look_at = |_: f64, _: f64| panic!("nothing is looked at");
        let first = Look { place: 0.0, verdict: PointVerdict::NONE };
        let found = scan.first_turn(first, &mut look_at, &|| false);
        assert!(matches!(found, Err(SweepError::GivenUp)));
    }
}
