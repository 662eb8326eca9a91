//! Which sets of a body's contacts are analysed.

use std::collections::BTreeSet;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

use super::contacts::{BodyContacts, Set, With};
use super::symmetry::{representative, symmetries};
use crate::left_out::LeftOut;
use crate::operating_point::{Reach, hosts_with_copies};

/// With more contacts than this not even their sets are written down.
const MAX_CONTACTS: usize = 16;
/// Fingers and walls of which every set is written down, each touching all copies or none.
const MAX_TOUCHING: usize = 10;

/// The sets of one body's contacts that are analysed, one for each that are alike, the smallest first.
pub(super) struct Sets {
    pub(super) sets: Vec<Set>,
    /// Whether they are all that there can be.
    pub(super) complete: bool,
}

/// What it costs to analyse a set, in cubes of states.
pub(super) struct Costs<'a> {
    /// States with no contact and with all, of the body and what touches it.
    pub(super) states: [usize; 2],
    pub(super) contacts: &'a BodyContacts,
}

impl Costs<'_> {
    fn of(&self, set: &[usize]) -> f64 {
        let all: Set = (0..self.contacts.all.len()).collect();
        let share =
            self.contacts.touching(set).len() as f64 / self.contacts.touching(&all).len().max(1) as f64;
        let [none, full] = self.states.map(|states| states as f64);
        (none + (full - none) * share).powi(3)
    }
}

/// All sets where these cost no more than `budget`; else layer by layer what fits: none, every contact alone, all fingers
/// and all but one or two of them, each user's, then every set of fingers that touch all copies, then every two contacts.
pub(super) fn sets(scene: &Scene, reach: &Reach, costs: &Costs, budget: f64) -> Sets {
    let contacts = costs.contacts;
    let chosen = Chosen { scene, reach, contacts, symmetries: symmetries(scene, reach, contacts) };
    if contacts.all.len() <= MAX_CONTACTS {
        let all = chosen.distinct(subsets(contacts.all.len()));
        if all.iter().map(|set| costs.of(set)).sum::<f64>() <= budget {
            return Sets { sets: in_order(all), complete: true };
        }
    }
    let layers = [
        chosen.distinct(chosen.few().into_iter()),
        chosen.distinct(chosen.with_all_copies().into_iter()),
        chosen.distinct(chosen.pairs()),
    ];
    let mut found = BTreeSet::new();
    let mut left = budget;
    for (number, layer) in layers.into_iter().enumerate() {
        let more: BTreeSet<Set> = layer.difference(&found).cloned().collect();
        let cost: f64 = more.iter().map(|set| costs.of(set)).sum();
        if number == 0 || cost <= left {
            left -= cost;
            found.extend(more);
        }
    }
    Sets { sets: in_order(found), complete: false }
}

/// That not all sets of a body's contacts were analysed.
pub(super) fn left_out(reach: &Reach, contacts: &BodyContacts, analysed: usize) -> LeftOut {
    let name = &reach.bodies[contacts.body].name;
    LeftOut::new(
        format!(
            "Most sets of the {} contacts of fingers and walls with the copies of {name}",
            contacts.all.len()
        ),
        format!("they are too many: {analysed} of them are, and the worst of these were searched from"),
    )
}

fn in_order(sets: BTreeSet<Set>) -> Vec<Set> {
    let mut sets: Vec<Set> = sets.into_iter().collect();
    sets.sort_by_key(Set::len);
    sets
}

fn subsets(of: usize) -> impl Iterator<Item = Set> {
    (0..1_usize << of).map(move |code| (0..of).filter(|&contact| code >> contact & 1 == 1).collect())
}

struct Chosen<'a> {
    scene: &'a Scene,
    reach: &'a Reach,
    contacts: &'a BodyContacts,
    symmetries: Vec<Vec<usize>>,
}

impl Chosen<'_> {
    /// Those that can be, one for each that are alike.
    fn distinct(&self, sets: impl Iterator<Item = Set>) -> BTreeSet<Set> {
        let can_be = |set: &Set| self.contacts.can_be(self.scene, self.reach, set);
        sets.filter(can_be).map(|set| representative(&set, &self.symmetries)).collect()
    }

    /// What all copies have of the fingers and walls for which `is_in` holds.
    fn in_all_copies(&self, is_in: impl Fn(With) -> bool) -> Set {
        (0..self.contacts.all.len()).filter(|&contact| is_in(self.contacts.all[contact].with)).collect()
    }

    fn fingers(&self) -> Vec<With> {
        let all: Set = (0..self.contacts.all.len()).collect();
        let touching = self.contacts.touching(&all);
        touching.into_iter().filter(|with| matches!(with, With::Finger(_))).collect()
    }

    fn user(&self, with: With) -> Option<HostIndex> {
        match with {
            With::Finger(grip) => Some(self.reach.grips[grip].user),
            With::Wall(_) => None,
        }
    }

    /// None, each contact alone, each finger and wall at all copies, all fingers but two or fewer, each user's.
    fn few(&self) -> Vec<Set> {
        let all = 0..self.contacts.all.len();
        let mut sets: Vec<Set> =
            std::iter::once(Vec::new()).chain(all.clone().map(|contact| vec![contact])).collect();
        sets.extend(
            self.contacts
                .touching(&all.collect::<Set>())
                .into_iter()
                .map(|one| self.in_all_copies(|with| with == one)),
        );
        let fingers = self.fingers();
        let is_finger = |with| matches!(with, With::Finger(_));
        sets.push(self.in_all_copies(is_finger));
        for (number, &one) in fingers.iter().enumerate() {
            for &other in &fingers[number..] {
                sets.push(self.in_all_copies(|with| is_finger(with) && with != one && with != other));
            }
        }
        for user in self.scene.hosts() {
            sets.push(self.in_all_copies(|with| self.user(with) == Some(user)));
            sets.push(self.in_all_copies(|with| self.user(with).is_some_and(|of| of != user)));
        }
        for copy in hosts_with_copies(self.scene) {
            let at = |&contact: &usize| self.contacts.all[contact].copy == copy;
            sets.push(
                (0..self.contacts.all.len())
                    .filter(at)
                    .filter(|&contact| is_finger(self.contacts.all[contact].with))
                    .collect(),
            );
        }
        sets
    }

    /// Every set of fingers and walls, each at all copies; nothing where these are too many.
    fn with_all_copies(&self) -> Vec<Set> {
        let all: Set = (0..self.contacts.all.len()).collect();
        let touching = self.contacts.touching(&all);
        if touching.len() > MAX_TOUCHING {
            return Vec::new();
        }
        subsets(touching.len())
            .map(|set| self.in_all_copies(|with| set.iter().any(|&place| touching[place] == with)))
            .collect()
    }

    fn pairs(&self) -> impl Iterator<Item = Set> + '_ {
        let all = self.contacts.all.len();
        (0..all).flat_map(move |one| (one + 1..all).map(move |other| vec![one, other]))
    }
}
