//! The adversary: many trajectories in which contacts open and close by themselves, to find one that does not settle.

use cotouch_scene::names::Coordinate;
use cotouch_scene::scene::SceneValues;
use glam::DVec3;
use nalgebra::Complex;
use rayon::prelude::*;
use std::collections::BTreeMap;

use super::arrangement::Arrangement;
use super::ensemble::Ensemble;
use super::fast_force::Strength;
use super::hands::{Known, Plan};
use super::random::Random;
use super::worst_mode::WorstMotion;
use crate::compile::OneSidedLoop;
use crate::loop_spec::BodyId;
use crate::verdict::{HandPolicy, UnsettledMotion};

/// Trajectories that are stepped together.
const COLUMNS: usize = 32;
/// How long hands do what they can to excite the session, s.
const EXCITED_S: f64 = 2.5;
/// How long it may then settle before it is observed, s.
const SETTLING_S: f64 = 1.0;
/// How long it is observed at most, in blocks of a second.
const MAX_BLOCKS: usize = 16;
/// Over so many of the last blocks a force must stay, and as many before.
const LAST_BLOCKS: usize = 4;
/// A force above 8 Hz that is stronger shakes, N rms.
const LEAST_RMS_N: f64 = 0.05;
/// A force that has fallen to less than this share within [`LAST_BLOCKS`] dies out.
const DYING: f64 = 0.8;
/// Beyond this a force grows out of all bounds, N rms.
const BOUNDLESS_N: f64 = 1e3;
/// Pushes that pump, N.
const PUMP_N: f64 = 1.0;
/// Multiplications and additions that are spent, and the fewest and the most ensembles.
const WORK: f64 = 1.5e9;
const ENSEMBLES: std::ops::RangeInclusive<usize> = 2..=12;
/// How long trajectories mostly take, s.
const TYPICAL_S: f64 = 7.0;

/// A session whose contacts switch, and what an adversary knows of it.
pub(super) struct Adversary<'a> {
    pub(super) scene: &'a SceneValues,
    pub(super) session: &'a OneSidedLoop,
    /// Not empty.
    pub(super) arrangements: &'a [Arrangement],
    /// Motions that it tries to feed.
    pub(super) fed: &'a [WorstMotion],
}

/// Trajectories of one ensemble that do not settle, strongest first.
struct Moving {
    arrangement: usize,
    trajectories: Vec<Trajectory>,
}

#[derive(Clone, Copy)]
struct Trajectory {
    policy: HandPolicy,
    hand: usize,
    /// None where it grows out of all bounds.
    rms_n: Option<f64>,
    hz: f64,
}

impl Adversary<'_> {
    /// The trajectory that keeps moving most, if any does; nothing at all where `wanted` says so.
    pub(super) fn search(&self, wanted: &(dyn Fn() -> bool + Sync)) -> Option<Option<UnsettledMotion>> {
        let count = self.ensembles();
        let run = |index: usize| self.run(index, wanted);
        let moving: Vec<Moving> = (0..count).into_par_iter().map(run).collect::<Option<_>>()?;
        Some(self.found(&moving, count * COLUMNS))
    }

    /// By work and not by time: what is found is the same on every computer.
    fn ensembles(&self) -> usize {
        let contacts = &self.arrangements[0].contacts;
        let work = Ensemble::new(self.session, contacts, 1).work() as f64;
        let ticks = TYPICAL_S * self.session.spec.schedule.control().hz();
        let (least, most) = (self.arrangements.len().max(*ENSEMBLES.start()), *ENSEMBLES.end());
        ((WORK / (work * ticks * COLUMNS as f64)) as usize).clamp(least, most.max(least))
    }

    fn found(&self, moving: &[Moving], tried: usize) -> Option<UnsettledMotion> {
        let each = moving.iter().flat_map(|of| of.trajectories.iter().map(move |one| (of.arrangement, one)));
        let count = each.clone().count();
        // The first of equals.
        let (arrangement, strongest) =
            each.rev().max_by(|one, other| one.1.strength().total_cmp(&other.1.strength()))?;
        let hands = self.scene.users.iter().flat_map(|user| (0..user.fingers.len()).map(move |f| (user, f)));
        let (user, finger) = hands.clone().nth(strongest.hand)?;
        Some(UnsettledMotion {
            user: user.name.clone(),
            finger: finger + 1,
            contacts: self.arrangements[arrangement].names.clone(),
            policy: strongest.policy,
            rms_n: strongest.rms_n,
            hz: strongest.hz,
            moving: count,
            tried,
        })
    }

    /// One ensemble, from its number alone.
    fn run(&self, index: usize, wanted: &(dyn Fn() -> bool + Sync)) -> Option<Moving> {
        let place = index % self.arrangements.len();
        let arrangement = &self.arrangements[place];
        let mut random = Random::new(index as u64);
        let known = self.known(arrangement);
        let plans: Vec<Plan> =
            (0..COLUMNS).map(|column| Plan::new(policy(column, known.axes), &known, &mut random)).collect();
        let mut ensemble = Ensemble::new(self.session, &arrangement.contacts, COLUMNS);
        self.start(&mut ensemble, arrangement, &plans, &mut random);
        let pump = self.pump(&ensemble, index);
        self.excite(&mut ensemble, &plans, &pump, wanted)?;
        let trajectories = self.observe(&mut ensemble, &plans, wanted)?;
        Some(Moving { arrangement: place, trajectories })
    }

    fn known(&self, arrangement: &Arrangement) -> Known {
        let pattern_hz = self.session.spec.pattern_s().recip();
        let alike = |hz: f64| [hz, (pattern_hz - hz).abs(), pattern_hz + hz];
        let swinging = self.fed.iter().map(|motion| motion.hz).filter(|&hz| hz > 0.0);
        Known {
            normals: arrangement.normals.clone(),
            axes: self.session.hands.iter().flatten().next().map_or(0, |&hand| self.axes(hand)),
            slow_hz: swinging.flat_map(alike).collect(),
        }
    }

    fn axes(&self, body: BodyId) -> usize {
        self.session.spec.bodies[body.0].axes.len()
    }

    fn start(&self, ensemble: &mut Ensemble, arrangement: &Arrangement, plans: &[Plan], random: &mut Random) {
        let mut motions: BTreeMap<BodyId, Vec<Vec<f64>>> = BTreeMap::new();
        for (hand, &body) in self.session.hands.iter().flatten().enumerate() {
            let axes = self.axes(body);
            let of = |plan: &Plan| {
                let (place, velocity) = plan.hands[hand];
                (0..axes).map(|axis| place[axis]).chain((0..axes).map(|axis| velocity[axis])).collect()
            };
            motions.insert(body, plans.iter().map(of).collect());
        }
        for &body in self.session.copies.iter().flatten().flatten() {
            let axes = self.session.spec.bodies[body.0].axes;
            let turns = axes.iter().filter(|axis| axis.turns()).count();
            motions.insert(
                body,
                plans.iter().map(|plan| plan.copy(axes.len() - turns, turns, random)).collect(),
            );
        }
        ensemble.start(|body, number, column| motions[&body][column][number]);
        if arrangement.weighs {
            self.weigh_down(ensemble);
        }
        for (column, plan) in plans.iter().enumerate() {
            for (hand, (&force, &rhythm)) in plan.swings.iter().zip(&plan.rhythm).enumerate() {
                if force != DVec3::ZERO {
                    ensemble.swing(hand, column, force, rhythm);
                }
            }
        }
    }

    fn weigh_down(&self, ensemble: &mut Ensemble) {
        let bodies = self.scene.world_bodies();
        for copies in &self.session.copies {
            for (body, &copy) in
                bodies.iter().zip(copies).filter_map(|(body, copy)| Some((body, copy.as_ref()?)))
            {
                for (component, axis) in self.session.spec.bodies[copy.0].axes.iter().enumerate() {
                    if !axis.turns() {
                        let weight_n = body.mass_kg * self.scene.gravity_m_per_s2[axis.axis().index()];
                        ensemble.weigh_down(copy, component, weight_n);
                    }
                }
            }
        }
    }

    /// The weights of the worst motion that this ensemble pumps, by the places of its state.
    fn pump(&self, ensemble: &Ensemble, index: usize) -> Vec<Complex<f64>> {
        let known: BTreeMap<Coordinate, Complex<f64>> = match self.fed.len() {
            0 => BTreeMap::new(),
            count => self.fed[index % count].weights.iter().copied().collect(),
        };
        let weight = |name: &Coordinate| known.get(name).copied().unwrap_or_default();
        ensemble.layout.coordinates.iter().map(weight).collect()
    }

    fn excite(
        &self,
        ensemble: &mut Ensemble,
        plans: &[Plan],
        pump: &[Complex<f64>],
        wanted: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let (re, im): (Vec<f64>, Vec<f64>) = pump.iter().map(|weight| (weight.re, weight.im)).unzip();
        let feeds: Vec<Vec<Complex<f64>>> = self.of_velocities(ensemble, pump);
        let (mut along, mut across) = (vec![0.0; plans.len()], vec![0.0; plans.len()]);
        for _ in 0..self.patterns(EXCITED_S) {
            wanted().then_some(())?;
            ensemble.project(&re, &mut along);
            ensemble.project(&im, &mut across);
            push(ensemble, plans, |hand, axis, column| {
                if plans[column].policy != HandPolicy::Pump {
                    return 0.0;
                }
                // d|y|² = 2·Re(ȳ·wᵀ·B·u), and forces act on velocities.
                let weight = feeds[hand][axis];
                let more = along[column] * weight.re + across[column] * weight.im;
                if more == 0.0 { 0.0 } else { PUMP_N.copysign(more) }
            });
            ensemble.advance();
        }
        ensemble.stop_swinging();
        push(ensemble, plans, |_, _, _| 0.0);
        for _ in 0..self.patterns(SETTLING_S) {
            wanted().then_some(())?;
            ensemble.advance();
        }
        Some(())
    }

    /// The weights of the velocities of every hand.
    fn of_velocities(&self, ensemble: &Ensemble, weights: &[Complex<f64>]) -> Vec<Vec<Complex<f64>>> {
        let of_hand = |hand: &BodyId| {
            let (first, axes) = (ensemble.layout.bodies[hand.0], self.axes(*hand));
            weights[first + axes..first + 2 * axes].to_vec()
        };
        self.session.hands.iter().flatten().map(of_hand).collect()
    }

    fn patterns(&self, seconds: f64) -> u64 {
        (seconds / self.session.spec.pattern_s()).ceil() as u64
    }

    /// Trajectories that do not settle.
    fn observe(
        &self,
        ensemble: &mut Ensemble,
        plans: &[Plan],
        wanted: &(dyn Fn() -> bool + Sync),
    ) -> Option<Vec<Trajectory>> {
        let patterns = self.patterns(1.0);
        let ticks = patterns * self.session.spec.ticks_per_pattern();
        let hands = self.session.hands.iter().flatten().count();
        let mut blocks: Vec<Vec<Strength>> = Vec::new();
        ensemble.observe();
        for _ in 0..MAX_BLOCKS {
            for _ in 0..patterns {
                wanted().then_some(())?;
                ensemble.advance();
            }
            let each = (0..plans.len()).flat_map(|column| (0..hands).map(move |hand| (column, hand)));
            let block: Vec<_> = each.map(|(column, hand)| ensemble.strength(hand, column, ticks)).collect();
            ensemble.end_block();
            let is_settled = block.iter().all(|strength| strength.mean_square <= LEAST_RMS_N * LEAST_RMS_N);
            let is_boundless = block.iter().any(is_boundless);
            blocks.push(block);
            if is_settled || is_boundless {
                break;
            }
        }
        let moving = |column: usize| {
            let hands = (0..hands).filter_map(|hand| {
                let of = |block: &Vec<Strength>| block[column * hands + hand];
                let (rms_n, hz) = stays(&blocks.iter().map(of).collect::<Vec<_>>())?;
                Some(Trajectory { policy: plans[column].policy, hand, rms_n, hz })
            });
            hands.max_by(|one, other| one.strength().total_cmp(&other.strength()))
        };
        Some((0..plans.len()).filter_map(moving).collect())
    }
}

impl Trajectory {
    fn strength(&self) -> f64 {
        self.rms_n.unwrap_or(f64::INFINITY)
    }
}

fn is_boundless(strength: &Strength) -> bool {
    // What is not a number is beyond all bounds too.
    strength.mean_square.is_nan() || strength.mean_square > BOUNDLESS_N * BOUNDLESS_N
}

/// How strong a force is that does not die out (N rms; none without bounds), and its frequency, from blocks of a second.
fn stays(blocks: &[Strength]) -> Option<(Option<f64>, f64)> {
    let last = blocks.last()?;
    if is_boundless(last) {
        return Some((None, last.hz));
    }
    let before = blocks.len().checked_sub(2 * LAST_BLOCKS)?;
    let mean =
        |blocks: &[Strength]| blocks.iter().map(|block| block.mean_square).sum::<f64>() / blocks.len() as f64;
    let (before, after) = blocks[before..].split_at(LAST_BLOCKS);
    let shakes = after.iter().all(|block| block.mean_square > LEAST_RMS_N * LEAST_RMS_N);
    let stays = mean(after) >= DYING * DYING * mean(before);
    (shakes && stays).then(|| (Some(mean(after).sqrt()), last.hz))
}

/// Constant pushes and more, for every hand.
fn push(ensemble: &mut Ensemble, plans: &[Plan], more: impl Fn(usize, usize, usize) -> f64) {
    let hands = plans.first().map_or(0, |plan| plan.pushes.len());
    for hand in 0..hands {
        for (axis, row) in ensemble.push_with(hand).iter_mut().enumerate() {
            for (column, push) in row.iter_mut().enumerate() {
                *push = plans[column].pushes[hand][axis] + more(hand, axis, column);
            }
        }
    }
}

/// Half of all are throws; nothing slides on a line.
fn policy(column: usize, axes: usize) -> HandPolicy {
    match column % 8 {
        0..=2 => HandPolicy::Throw,
        3 | 4 => HandPolicy::Rhythm,
        5 | 6 => HandPolicy::Pump,
        _ if axes > 1 => HandPolicy::Slide,
        _ => HandPolicy::Throw,
    }
}
