//! All that the users of a scene with rigid bodies can touch, mode by mode.
//!
//! Any finger can touch any body with a surface, whatever its script does: by a device, or by a hand that is taken on the
//! page. Where every host keeps copies, each copy is touched by itself, for copies are not in the same place. A wall can
//! meet each copy, and so can two or three walls that form a corner. A mode is a set of such contacts with one body: what
//! touches another body has no part in its loop. One set is analysed for all that are alike but for who is who or for a
//! reflection, with each finger on the side from which it comes, all contacts sticking and hands held as their scripts say.
//!
//! From the sets that come nearest to swinging ever more, others are searched for what comes nearer: hands that are held
//! otherwise, which is a mode of its own where it is unstable; then fingers elsewhere on the body, contacts that slide, a body
//! that is turned against its wall. What grows there grows only as long as that lasts, so that the scene is left open.

mod contacts;
mod distance;
mod hands;
mod left_out;
mod loops;
mod search;
mod sets;
mod symmetry;

use cotouch_scene::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

use crate::gains::{self, Gain};
use crate::left_out::LeftOut;
use crate::lift::layout::{Layout, Registers};
use crate::loop_spec::LoopSpec;
use crate::operating_point::Reach;
use crate::verdict::{AnalysisError, ContactPlace, ModeStability, Worst, WorstGain};
use contacts::{BodyContacts, Set, names};
use hands::Hand;
use loops::{Candidate, Judged, Movers, all_parts, judge_candidate, loops, worst};
use search::Search;
use sets::{Costs, Sets, sets};

pub(crate) use distance::JudgedSets;
pub(crate) use left_out::of_soft_contact;
pub(crate) use loops::judge_part;

/// What sets of contacts may cost, in cubes of states: some seconds on two cores.
const SETS_BUDGET: f64 = 5e8;
/// The same of what is searched from the worst of them.
const SEARCH_BUDGET: f64 = 2.5e8;
/// Sets from which is searched.
const MAX_SEARCHED: usize = 8;
/// Modes of which the axis is told.
const MAX_WITH_AXIS: usize = 16;
/// By such a share gains are changed to see what that does.
const SMALL_CHANGE: f64 = 1e-4;

/// What was found.
pub(crate) struct Covered {
    /// One for each set of contacts, hands as scripts hold them, none first; then unstable ones with hands that are held otherwise.
    pub(crate) modes: Vec<ModeStability>,
    /// The largest of the modes.
    pub(crate) spectral_radius: f64,
    /// The one that comes nearest to swinging ever more.
    pub(crate) worst: Worst,
    /// What was not analysed.
    pub(crate) left_out: Vec<LeftOut>,
    /// All sets of contacts that were judged.
    pub(crate) judged: JudgedSets,
    /// The loops behind the two figures: of the mode that has the spectral radius, and of what comes nearest to swinging ever more.
    pub(crate) critical: Vec<CriticalLoop>,
}

/// A loop on which a verdict rests.
pub(crate) struct CriticalLoop {
    /// The contacts that are closed.
    pub(crate) contacts: Vec<String>,
    /// Where, if that is not where scripts come from.
    pub(crate) place: Option<Vec<ContactPlace>>,
    /// The part of the loop that has the largest radius.
    pub(crate) spec: LoopSpec,
    /// Whether what is loose drifts along a surface and does not count.
    pub(crate) drifts: bool,
}

/// Analyses all that can be touched.
pub(crate) fn cover(scene: &Scene) -> Result<Covered, AnalysisError> {
    let reach = Reach::of(scene);
    let study = Study { scene, reach: &reach };
    let nothing = study.nothing()?;
    let bodies: Vec<BodyContacts> =
        (0..reach.bodies.len()).map(|body| BodyContacts::of(scene, &reach, body)).collect();
    let mut left_out = Vec::new();
    left_out::add_of_bodies(&reach, &mut left_out);
    let mut modes = vec![study.mode(&study.untouched(), modes_worst(&nothing))];
    let mut candidates = vec![study.untouched()];
    let mut found = Vec::new();
    let mut incomplete = Vec::new();
    let budget = SETS_BUDGET / bodies.iter().filter(|body| !body.all.is_empty()).count().max(1) as f64;
    for contacts in bodies.iter().filter(|body| !body.all.is_empty()) {
        let Sets { sets, complete } = sets(scene, &reach, &study.costs(contacts), budget);
        if !complete {
            left_out.push(sets::left_out(&reach, contacts, sets.len()));
            incomplete.push(contacts.body);
        }
        found.extend(study.judge_sets(contacts, sets)?);
    }
    found.sort_by(|one, other| other.judged.nearness.total_cmp(&one.judged.nearness));
    for one in &found {
        let candidate = study.told(&bodies[one.body], &one.set);
        modes.push(study.mode(&candidate, study.beside(one.judged, &candidate, &nothing)));
        candidates.push(candidate);
    }
    study.add_axes(&mut modes, &found, &bodies)?;

    let Results { mut lasting, passing } = study.search(&bodies, &found, &incomplete)?;
    lasting.extend(study.other_hands()?);
    for (candidate, judged) in lasting.iter().filter(|(_, judged)| !judged.stable) {
        let mode = study.mode(candidate, *judged);
        if !modes.iter().any(|known| known.contacts == mode.contacts) {
            modes.push(mode);
            candidates.push(candidate.clone());
        }
    }
    if modes.iter().all(|mode| mode.stable) {
        left_out.extend(study.growing(&passing));
    }
    let spectral_radius = modes.iter().map(|mode| mode.spectral_radius).fold(0.0, f64::max);
    let untouched = (study.untouched(), modes_worst(&nothing));
    let searched = lasting.iter().chain(&passing).chain(std::iter::once(&untouched));
    let nearest = searched.max_by(|(_, one), (_, other)| one.nearness.total_cmp(&other.nearness));
    let (nearest, judged) = nearest.unwrap_or(&untouched);
    let worst = study.worst(nearest, *judged);
    let largest = (0..modes.len()).max_by(|&one, &other| {
        modes[one].spectral_radius.total_cmp(&modes[other].spectral_radius).then(other.cmp(&one))
    });
    let headline = largest.map_or(&untouched.0, |mode| &candidates[mode]);
    let critical = study.critical_loops(headline, nearest, &worst)?;
    let judged = study.judged_sets(&bodies, &found, &lasting);
    Ok(Covered { modes, spectral_radius, worst, left_out, judged, critical })
}

fn modes_worst(parts: &[(Movers, Judged)]) -> Judged {
    worst(parts.iter().map(|(_, judged)| *judged))
}

/// A set of one body's contacts.
struct FoundSet {
    body: usize,
    set: Set,
    judged: Judged,
}

/// What a search found.
#[derive(Default)]
struct Results {
    /// Sets of contacts, with hands held in the worst way: they last as long as hands are held so.
    lasting: Vec<(Candidate, Judged)>,
    /// From these on: fingers elsewhere, sliding, a body turned. How long these last depends on what hands do.
    passing: Vec<(Candidate, Judged)>,
}

struct Study<'a> {
    scene: &'a Scene,
    reach: &'a Reach,
}

impl Study<'_> {
    /// No contact, but for walls that never let go of the first body.
    fn untouched(&self) -> Candidate {
        self.told(&BodyContacts::of(self.scene, self.reach, 0), &[])
    }

    fn told(&self, contacts: &BodyContacts, set: &[usize]) -> Candidate {
        let arrangement = contacts.arrangement(self.scene, self.reach, set);
        Candidate { arrangement, hands: vec![Hand::Told; self.scene.users.len()] }
    }

    /// The parts of the loop without contact.
    fn nothing(&self) -> Result<Vec<(Movers, Judged)>, AnalysisError> {
        all_parts(self.scene, self.reach, &self.untouched())
    }

    /// No contact, with hands that are held otherwise.
    fn other_hands(&self) -> Result<Vec<(Candidate, Judged)>, AnalysisError> {
        let states = self.states(&BodyContacts::of(self.scene, self.reach, 0), &[]).max(1) as f64;
        let ways = hands::all_ways(&self.scene.users, SEARCH_BUDGET / states.powi(3));
        let judge = |hands: Vec<Hand>| {
            let candidate = Candidate { hands, ..self.untouched() };
            let judged = modes_worst(&all_parts(self.scene, self.reach, &candidate)?);
            Ok((candidate, judged))
        };
        ways.into_par_iter().map(judge).collect()
    }

    fn costs<'b>(&self, contacts: &'b BodyContacts) -> Costs<'b> {
        let all: Set = (0..contacts.all.len()).collect();
        let states = [&[][..], &all].map(|set| self.states(contacts, set));
        Costs { states, contacts }
    }

    /// In the loop of a body with these contacts.
    fn states(&self, contacts: &BodyContacts, set: &[usize]) -> usize {
        let parts = loops(self.scene, self.reach, &self.told(contacts, set));
        parts.iter().map(|part| Layout::new(part, Registers::Shared).coordinates.len()).sum()
    }

    fn judge_sets(&self, contacts: &BodyContacts, sets: Vec<Set>) -> Result<Vec<FoundSet>, AnalysisError> {
        let judge = |set: Set| {
            let judged = judge_candidate(self.scene, self.reach, &self.told(contacts, &set), false)?;
            Ok(FoundSet { body: contacts.body, set, judged })
        };
        sets.into_par_iter().filter(|set| !set.is_empty()).map(judge).collect()
    }

    /// All sets, hands as scripts hold them, and what was searched from them for hands that are held otherwise.
    fn judged_sets(
        &self,
        bodies: &[BodyContacts],
        found: &[FoundSet],
        lasting: &[(Candidate, Judged)],
    ) -> JudgedSets {
        let told = found.iter().map(|one| self.told(&bodies[one.body], &one.set));
        let sets = std::iter::once(self.untouched()).chain(told);
        let sets: Vec<_> = sets.chain(lasting.iter().map(|(candidate, _)| candidate.clone())).collect();
        let all = |contacts: &BodyContacts| (0..contacts.all.len()).collect::<Set>();
        let states = bodies.iter().map(|contacts| self.states(contacts, &all(contacts)));
        JudgedSets::new(self.reach.clone(), sets, states.max().unwrap_or(1))
    }

    /// With what has no part in the contacts.
    fn beside(&self, judged: Judged, candidate: &Candidate, nothing: &[(Movers, Judged)]) -> Judged {
        let others = nothing.iter().filter(|(movers, _)| !movers.take_part_in(&candidate.arrangement));
        worst(std::iter::once(judged).chain(others.map(|(_, judged)| *judged)))
    }

    fn mode(&self, candidate: &Candidate, judged: Judged) -> ModeStability {
        ModeStability {
            contacts: self.names(candidate),
            spectral_radius: judged.spectral_radius,
            stable: judged.stable,
            axis: judged.axis,
            toppling_per_s: judged.toppling_per_s,
        }
    }

    fn names(&self, candidate: &Candidate) -> Vec<String> {
        let mut names = names(self.scene, self.reach, &candidate.arrangement);
        for (user, hand) in self.scene.users.iter().zip(&candidate.hands) {
            match hand {
                Hand::Told => {}
                Hand::Taken => names.push(format!("{}'s hand taken on the page", user.name)),
                Hand::OnDevice => names.push(format!("{}'s hand on a device", user.name)),
            }
        }
        names
    }

    /// Which way things move in the first modes after the one without contact, which are the worst.
    fn add_axes(
        &self,
        modes: &mut [ModeStability],
        found: &[FoundSet],
        bodies: &[BodyContacts],
    ) -> Result<(), AnalysisError> {
        let worst: Vec<usize> = (0..found.len().min(MAX_WITH_AXIS)).collect();
        let judge = |&place: &usize| {
            let FoundSet { body, set, .. } = &found[place];
            judge_candidate(self.scene, self.reach, &self.told(&bodies[*body], set), true)
        };
        let judged = worst.par_iter().map(judge).collect::<Result<Vec<_>, _>>()?;
        for (mode, judged) in modes[1..].iter_mut().zip(judged) {
            // Of what has no part in the contacts the axis is the first mode's.
            mode.axis = if mode.spectral_radius > judged.spectral_radius { mode.axis } else { judged.axis };
        }
        Ok(())
    }

    /// The worst that is found from each of the worst sets.
    fn search(
        &self,
        bodies: &[BodyContacts],
        found: &[FoundSet],
        incomplete: &[usize],
    ) -> Result<Results, AnalysisError> {
        let mut results = Results::default();
        for FoundSet { body, set, judged } in found.iter().take(MAX_SEARCHED) {
            let contacts = &bodies[*body];
            let begin = self.told(contacts, set);
            let states = self.states(contacts, set).max(1) as f64;
            let left = (SEARCH_BUDGET / MAX_SEARCHED as f64 / states.powi(3)) as usize;
            let mut search = Search { scene: self.scene, reach: self.reach, left };
            let flips = incomplete.contains(body);
            let with_hands = search.by_hands((begin, *judged))?;
            results.lasting.push(with_hands.clone());
            results.passing.push(search.from(contacts, set, flips, with_hands)?);
        }
        Ok(results)
    }

    /// That something which passes grows while it is there: neither stable nor, as long as nobody saw it last, unstable.
    fn growing(&self, passing: &[(Candidate, Judged)]) -> Option<LeftOut> {
        let growing = passing.iter().filter(|(_, judged)| !judged.stable);
        let (candidate, judged) =
            growing.max_by(|(_, one), (_, other)| one.spectral_radius.total_cmp(&other.spectral_radius))?;
        let pattern_s = loops(self.scene, self.reach, candidate).first()?.pattern_s();
        let places = candidate.arrangement.grips.iter().map(|(grip, _)| {
            let DVec3 { x, y, z } = grip.touches_at() * 1e3;
            format!("{} at ({x:.1}, {y:.1}, {z:.1}) mm", grip.name)
        });
        let places: Vec<String> = places.collect();
        Some(LeftOut::new(
            format!("How long this lasts: {}", self.names(candidate).join(" + ")),
            format!(
                "it grows by {:.4} a period ({:.3} /s) while it does, with {} of {}",
                judged.spectral_radius,
                judged.spectral_radius.ln() / pattern_s,
                places.join(", "),
                self.reach.bodies[candidate.arrangement.body].name
            ),
        ))
    }

    fn worst(&self, candidate: &Candidate, judged: Judged) -> Worst {
        let place = |(grip, _): &(crate::operating_point::Grip, _)| ContactPlace {
            contact: grip.name.clone(),
            body: self.reach.bodies[grip.body].name.clone(),
            at_m: grip.touches_at().to_array(),
        };
        let places: Vec<_> = candidate.arrangement.grips.iter().map(place).collect();
        Worst {
            contacts: self.names(candidate),
            spectral_radius: judged.spectral_radius,
            place: (!places.is_empty()).then_some(places),
            gain: self.worst_gain(candidate),
        }
    }

    /// Of the mode that has the spectral radius and, where it is another one, of the worst that was found.
    fn critical_loops(
        &self,
        headline: &Candidate,
        nearest: &Candidate,
        worst: &Worst,
    ) -> Result<Vec<CriticalLoop>, AnalysisError> {
        let mut loops = Vec::from_iter(self.critical(headline, None)?);
        if self.names(nearest) != self.names(headline) || !nearest.touches_as(headline) {
            loops.extend(self.critical(nearest, worst.place.clone())?);
        }
        Ok(loops)
    }

    /// The part of a candidate's loop that has the largest radius; what has no part in its contacts counts as well.
    fn critical(
        &self,
        candidate: &Candidate,
        place: Option<Vec<ContactPlace>>,
    ) -> Result<Option<CriticalLoop>, AnalysisError> {
        let touches = !candidate.arrangement.grips.is_empty();
        let own = loops(self.scene, self.reach, candidate).into_iter().map(|spec| (spec, touches));
        let untouched = self.untouched();
        let others = loops::whole(
            self.scene,
            self.reach,
            &Candidate { arrangement: untouched.arrangement, hands: candidate.hands.clone() },
        );
        let others = others
            .into_iter()
            .filter(|spec| !loops::takes_part(spec, &candidate.arrangement))
            .map(|spec| (spec, false));
        let radius = |(spec, drifts): (LoopSpec, bool)| {
            Ok((loops::judge_part(&spec, false, drifts)?.spectral_radius, spec, drifts))
        };
        let parts = own.chain(others).map(radius).collect::<Result<Vec<_>, AnalysisError>>()?;
        let largest = parts.into_iter().max_by(|(one, ..), (other, ..)| one.total_cmp(other));
        Ok(largest.map(|(_, spec, drifts)| CriticalLoop {
            contacts: self.names(candidate),
            place,
            spec,
            drifts,
        }))
    }

    /// The gain of which a small share moves a candidate most.
    fn worst_gain(&self, candidate: &Candidate) -> Option<WorstGain> {
        let gains = gains::present(self.scene);
        let slopes: Vec<WorstGain> =
            gains.par_iter().filter_map(|gain| self.slope(candidate, gain)).collect();
        let steepest =
            slopes.into_iter().max_by(|one, other| one.slope.abs().total_cmp(&other.slope.abs()))?;
        (steepest.slope != 0.0).then_some(steepest)
    }

    fn slope(&self, candidate: &Candidate, &Gain { key, value, .. }: &Gain) -> Option<WorstGain> {
        let nearness = |factor: f64| {
            let changed = cotouch_scene::with_override(self.scene, key, value * factor).ok()?;
            Some(judge_candidate(&changed, self.reach, candidate, false).ok()?.nearness)
        };
        let slope = (nearness(1.0 + SMALL_CHANGE)? - nearness(1.0 - SMALL_CHANGE)?) / (2.0 * SMALL_CHANGE);
        // What outgrows floating point has no slope.
        slope.is_finite().then(|| WorstGain { key: key.to_owned(), value, slope })
    }
}

#[cfg(test)]
mod tests;
