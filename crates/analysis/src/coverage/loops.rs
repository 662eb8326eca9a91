//! The loop of a body and what touches it, and what is said of it.

use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::scene::SceneValues;
use nalgebra::Complex;

use super::hands::{Hand, held};
use crate::compile::compile_at;
use crate::independent::parts;
use crate::loop_spec::{LoopBody, LoopSpec};
use crate::operating_point::{Arrangement, Reach};
use crate::poles::judge;
use crate::verdict::{AnalysisError, is_stable};
use cotouch_matrix::spectral_radius;

/// Contacts that are closed, and how hands are held meanwhile.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) arrangement: Arrangement,
    /// One for each user.
    pub(super) hands: Vec<Hand>,
}

impl Candidate {
    /// Whether it touches where `other` does, in the same way.
    pub(super) fn touches_as(&self, other: &Self) -> bool {
        let at = |candidate: &Self| -> Vec<_> {
            candidate.arrangement.grips.iter().map(|(grip, _)| grip.touches_at()).collect()
        };
        let (one, two) = (&self.arrangement, &other.arrangement);
        (one.slides, one.turned) == (two.slides, two.turned) && at(self) == at(other)
    }
}

/// What the eigenvalues of a loop say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Judged {
    pub(crate) spectral_radius: f64,
    pub(super) stable: bool,
    /// How near it is to oscillating ever more: the largest absolute eigenvalue of those that go round at 1 Hz or faster,
    /// or of all where it is unstable. Slow ones that die out without swinging hide what a change of contacts does.
    pub(super) nearness: f64,
    pub(super) axis: Option<&'static str>,
    /// As in [`ModeStability`](crate::verdict::ModeStability).
    pub(super) toppling_per_s: Option<f64>,
}

impl Judged {
    const NONE: Self =
        Self { spectral_radius: 0.0, stable: true, nearness: 0.0, axis: None, toppling_per_s: None };

    fn and(self, other: Self) -> Self {
        Self {
            spectral_radius: self.spectral_radius.max(other.spectral_radius),
            stable: self.stable && other.stable,
            nearness: self.nearness.max(other.nearness),
            axis: if other.spectral_radius > self.spectral_radius { other.axis } else { self.axis },
            toppling_per_s: [self.toppling_per_s, other.toppling_per_s]
                .into_iter()
                .flatten()
                .reduce(f64::max),
        }
    }
}

/// Slower poles than this do not count as swinging, Hz.
const SWINGS_HZ: f64 = 1.0;

/// Who moves in a part of a loop.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Movers {
    hands: Vec<(HostIndex, u8)>,
    bodies: Vec<usize>,
}

impl Movers {
    fn of(spec: &LoopSpec) -> Self {
        let mut movers = Self::default();
        for LoopBody { states, .. } in &spec.bodies {
            match states.first() {
                Some(&Coordinate::Own { host, part: Part::Hand(finger), .. }) => {
                    movers.hands.push((host, finger))
                }
                Some(&Coordinate::Own { part: Part::Object(body), .. }) => {
                    movers.bodies.push(usize::from(body))
                }
                _ => {}
            }
        }
        movers
    }

    /// Whether the loop is about the contacts: it has the body, or a finger that touches it.
    pub(super) fn take_part_in(&self, arrangement: &Arrangement) -> bool {
        let touches = |&(user, finger): &(HostIndex, u8)| {
            arrangement.grips.iter().any(|(grip, _)| (grip.user, grip.finger) == (user, finger))
        };
        self.bodies.contains(&arrangement.body) || self.hands.iter().any(touches)
    }
}

/// The parts of the loop that a candidate's contacts are in.
pub(super) fn loops(scene: &SceneValues, reach: &Reach, candidate: &Candidate) -> Vec<LoopSpec> {
    let mut parts = whole(scene, reach, candidate);
    parts.retain(|part| takes_part(part, &candidate.arrangement));
    parts
}

/// Whether a part of a loop is about the contacts.
pub(super) fn takes_part(part: &LoopSpec, arrangement: &Arrangement) -> bool {
    Movers::of(part).take_part_in(arrangement)
}

/// All parts of the loop.
pub(super) fn whole(scene: &SceneValues, reach: &Reach, candidate: &Candidate) -> Vec<LoopSpec> {
    let Candidate { arrangement, hands } = candidate;
    let point = reach.point(scene, arrangement);
    let spec = if hands.iter().all(|hand| *hand == Hand::Told) {
        compile_at(scene, &point)
    } else {
        compile_at(&held(scene, hands), &point)
    };
    parts(&spec)
}

/// All parts of a loop in which nothing but `candidate`'s contacts is closed, each with who moves in it.
pub(super) fn all_parts(
    scene: &SceneValues,
    reach: &Reach,
    candidate: &Candidate,
) -> Result<Vec<(Movers, Judged)>, AnalysisError> {
    let parts = whole(scene, reach, candidate);
    parts.iter().map(|part| Ok((Movers::of(part), judge_part(part, true, false)?))).collect()
}

pub(super) fn judge_candidate(
    scene: &SceneValues,
    reach: &Reach,
    candidate: &Candidate,
    with_axis: bool,
) -> Result<Judged, AnalysisError> {
    let parts = loops(scene, reach, candidate);
    let drifts = !candidate.arrangement.grips.is_empty();
    parts.iter().try_fold(Judged::NONE, |worst, part| Ok(worst.and(judge_part(part, with_axis, drifts)?)))
}

/// Where fingers touch a surface (`drifts`), what is loose drifts along it, as a finger does that touches nothing: it does
/// not count.
pub(crate) fn judge_part(part: &LoopSpec, with_axis: bool, drifts: bool) -> Result<Judged, AnalysisError> {
    let verdict = judge(part, with_axis)?;
    let counted = verdict.eigenvalues.len() - if drifts { verdict.loose_parts } else { 0 };
    let poles = &verdict.eigenvalues[..counted];
    let spectral_radius = if poles.is_empty() { verdict.spectral_radius } else { spectral_radius(poles) };
    let stable = is_stable(spectral_radius, if drifts { 0 } else { verdict.loose_parts });
    let slowest = (std::f64::consts::TAU * SWINGS_HZ * part.pattern_s()).min(0.5);
    let swings = |pole: &&Complex<f64>| pole.arg().abs() >= slowest;
    let swinging = poles.iter().filter(swings).map(|pole| pole.norm()).fold(0.0, f64::max);
    let nearness = if stable { swinging } else { spectral_radius.max(1.0) };
    let toppling_per_s = verdict.toppling_per_s.first().copied();
    Ok(Judged { spectral_radius, stable, nearness, axis: verdict.axis, toppling_per_s })
}

/// The worst of several.
pub(super) fn worst(judged: impl Iterator<Item = Judged>) -> Judged {
    judged.fold(Judged::NONE, Judged::and)
}
