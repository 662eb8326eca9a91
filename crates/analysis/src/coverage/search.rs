//! From a set of contacts to the worst that is near it: other places of fingers, contacts that slide, hands that are held
//! otherwise, a body that is turned against a wall, and, where not all sets were analysed, a contact more or less.
//!
//! One thing is changed at a time, each to what brings the loop nearest to swinging ever more, as long as that brings it
//! nearer.

use cotouch_scene::scene::{SceneValues, Space};
use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::contacts::{BodyContacts, Set, all_copies, directions};
use super::hands::{all_ways, ways};
use super::loops::{Candidate, Judged, judge_candidate};
use crate::operating_point::{Copies, Grip, Reach};
use crate::verdict::AnalysisError;

/// Times that each thing is changed at most.
const MAX_ROUNDS: usize = 3;
/// What counts as nearer.
const NEARER: f64 = 1e-9;
/// A body against a wall is turned by such parts of a full turn; a hull or a mesh also onto its faces.
const TURNS: i32 = 8;

/// What is searched, and how much of it at most.
pub(super) struct Search<'a> {
    pub(super) scene: &'a SceneValues,
    pub(super) reach: &'a Reach,
    /// Candidates that may still be analysed.
    pub(super) left: usize,
}

impl Search<'_> {
    /// The worst way in which hands are held meanwhile.
    pub(super) fn by_hands(
        &mut self,
        mut at: (Candidate, Judged),
    ) -> Result<(Candidate, Judged), AnalysisError> {
        let others = self.hands(&at.0);
        self.climb(&mut at, others)?;
        Ok(at)
    }

    /// The worst that is found from a set of contacts.
    pub(super) fn from(
        &mut self,
        contacts: &BodyContacts,
        set: &Set,
        flips: bool,
        begin: (Candidate, Judged),
    ) -> Result<(Candidate, Judged), AnalysisError> {
        let mut at = begin;
        let mut set = set.clone();
        for _ in 0..MAX_ROUNDS {
            let before = at.1.nearness;
            for change in [Self::hands, Self::slides, Self::turns] {
                let others = change(self, &at.0);
                self.climb(&mut at, others)?;
            }
            for finger in 0..at.0.arrangement.grips.len() {
                let others = self.places(&at.0, finger);
                self.climb(&mut at, others)?;
            }
            if flips {
                let others = self.flips(contacts, &set, &at.0);
                let (sets, others): (Vec<Set>, Vec<Candidate>) = others.into_iter().unzip();
                if let Some(taken) = self.climb(&mut at, others)? {
                    set.clone_from(&sets[taken]);
                }
            }
            if at.1.nearness <= before + NEARER || self.left == 0 {
                break;
            }
        }
        Ok(at)
    }

    /// Takes the worst of these where it is worse than what there is; says which.
    fn climb(
        &mut self,
        at: &mut (Candidate, Judged),
        mut others: Vec<Candidate>,
    ) -> Result<Option<usize>, AnalysisError> {
        others.truncate(self.left);
        self.left -= others.len();
        let judge = |other: &Candidate| judge_candidate(self.scene, self.reach, other, false);
        let judged = others.par_iter().map(judge).collect::<Result<Vec<_>, _>>()?;
        let nearest = (0..judged.len()).max_by(|&one, &other| {
            judged[one].nearness.total_cmp(&judged[other].nearness).then(other.cmp(&one))
        });
        let Some(nearest) = nearest.filter(|&one| judged[one].nearness > at.1.nearness + NEARER) else {
            return Ok(None);
        };
        *at = (others.swap_remove(nearest), judged[nearest]);
        Ok(Some(nearest))
    }

    fn hands(&self, at: &Candidate) -> Vec<Candidate> {
        let users = self.scene.users.iter().enumerate();
        let other = |user: usize, hand| {
            let mut other = at.clone();
            other.hands[user] = hand;
            other
        };
        let alone = users.flat_map(|(user, held)| ways(held).into_iter().map(move |hand| other(user, hand)));
        let together = all_ways(&self.scene.users, 0.0);
        let together = together.into_iter().map(|hands| Candidate { hands, ..at.clone() });
        alone.chain(together).collect()
    }

    fn slides(&self, at: &Candidate) -> Vec<Candidate> {
        let all = all_copies(self.scene);
        // A finger at one copy alone is there for a moment, until the copies are together: it does not slide for long.
        let partly =
            |(_, copies): &(Grip, Copies)| *copies != all && !self.reach.bodies[at.arrangement.body].fixed;
        if at.arrangement.grips.is_empty() || at.arrangement.grips.iter().any(partly) {
            return Vec::new();
        }
        let slides = std::iter::once(None).chain(directions(self.scene.space).into_iter().map(Some));
        let other = |slides: Option<DVec3>| {
            let mut other = at.clone();
            other.arrangement.slides = slides;
            other
        };
        slides.map(other).collect()
    }

    fn turns(&self, at: &Candidate) -> Vec<Candidate> {
        let body = at.arrangement.body;
        if at.arrangement.leans.iter().all(|(lean, _)| lean.two_sided) {
            return Vec::new();
        }
        let about = match self.scene.space {
            Space::Line => &[][..],
            Space::Plane => &[DVec3::Z][..],
            Space::Space => &DVec3::AXES[..],
        };
        let parts = about.iter().flat_map(|&axis| {
            (0..TURNS).map(move |eighths| {
                DQuat::from_axis_angle(axis, std::f64::consts::TAU * f64::from(eighths) / f64::from(TURNS))
            })
        });
        let other = |turned: DQuat| {
            let mut other = at.clone();
            other.arrangement.turned = turned;
            let leans = self.reach.leans_turned(self.scene, body, turned);
            for (lean, _) in &mut other.arrangement.leans {
                let same = leans.iter().find(|other| (other.wall, other.body) == (lean.wall, lean.body));
                lean.clone_from(same?);
            }
            Some(other)
        };
        let leans = at.arrangement.leans.iter();
        let onto_faces = leans.flat_map(|(lean, _)| self.reach.turns_onto_faces(self.scene, body, lean.wall));
        parts.chain(onto_faces).filter_map(other).collect()
    }

    fn places(&self, at: &Candidate, finger: usize) -> Vec<Candidate> {
        let elsewhere = self.reach.elsewhere(self.scene, &at.arrangement.grips[finger].0);
        let other = |grip: Grip| {
            let mut other = at.clone();
            other.arrangement.grips[finger].0 = grip;
            other
        };
        elsewhere.into_iter().map(other).collect()
    }

    /// A contact more, or less; fingers stay where they touch.
    fn flips(&self, contacts: &BodyContacts, set: &Set, at: &Candidate) -> Vec<(Set, Candidate)> {
        let flip = |contact: usize| {
            let mut other: Set = set.iter().copied().filter(|&one| one != contact).collect();
            if other.len() == set.len() {
                other.push(contact);
                other.sort_unstable();
            }
            if !contacts.can_be(self.scene, self.reach, &other) {
                return None;
            }
            let mut arrangement = contacts.arrangement(self.scene, self.reach, &other);
            for (grip, _) in &mut arrangement.grips {
                let known = at.arrangement.grips.iter().map(|(known, _)| known);
                if let Some(known) =
                    known.into_iter().find(|known| (known.user, known.finger) == (grip.user, grip.finger))
                {
                    grip.clone_from(known);
                }
            }
            arrangement.slides = at.arrangement.slides;
            Some((other, Candidate { arrangement, hands: at.hands.clone() }))
        };
        (0..contacts.all.len()).filter_map(flip).collect()
    }
}
