//! What hands do to keep a session moving: thrown, in a rhythm, pumping, sliding; then they push constantly.

use glam::DVec3;

use super::random::Random;
use crate::verdict::HandPolicy;

/// A constant push, N.
const PUSH_N: f64 = 1.0;
/// The fastest throw, m/s, and the fastest turn, rad/s.
const FASTEST_M_PER_S: f64 = 1.0;
const FASTEST_RAD_PER_S: f64 = 5.0;
/// How far hands start from where they touch, m, and copies from each other.
const APART_M: f64 = 0.005;
const COPIES_APART_M: f64 = 0.0005;
/// The slowest and the fastest rhythm, Hz.
const SLOWEST_HZ: f64 = 0.5;
const FASTEST_HZ: f64 = 100.0;

/// What an adversary knows of a session.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// For each hand: the outward normal of what it can touch.
    pub(super) normals: Vec<Option<DVec3>>,
    /// In how many axes points move.
    pub(super) axes: usize,
    /// Frequencies of motions that die out slowly, Hz: what a pattern cannot tell apart.
    pub(super) slow_hz: Vec<f64>,
}

/// One trajectory.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) policy: HandPolicy,
    /// Of each hand, in the end, N.
    pub(super) pushes: Vec<DVec3>,
    /// What each hand does in turns with its opposite before, N.
    pub(super) swings: Vec<DVec3>,
    /// How often, and from which share of a turn on, for each hand.
    pub(super) rhythm: Vec<(f64, f64)>,
    /// Every hand's start: place relative to where it touches (m) and velocity (m/s).
    pub(super) hands: Vec<(DVec3, DVec3)>,
    /// By how much copies move and turn at first, at most: m/s, rad/s.
    speed: f64,
}

impl Plan {
    pub(super) fn new(policy: HandPolicy, known: &Known, random: &mut Random) -> Self {
        let hands = known.normals.len();
        // Slow ones too: a constant push is to them as a weak one is to a fast throw.
        let speed = 10f64.powf(-2.0 * random.share().powi(2));
        let pushes = pushes(known, random);
        let swings = known.normals.iter().zip(&pushes);
        let swings = swings.map(|(normal, &push)| swing(policy, *normal, push, known.axes, random)).collect();
        let common = rhythm(known, random);
        let rhythm = (0..hands).map(|_| (common, 0.5 * random.below(3) as f64)).collect();
        let hands = known.normals.iter().map(|normal| start(*normal, speed, known.axes, random)).collect();
        Self { policy, pushes, swings, rhythm, hands, speed }
    }

    /// Place and velocity of a copy of a body, along and about these many axes that move and turn.
    pub(super) fn copy(&self, moves: usize, turns: usize, random: &mut Random) -> Vec<f64> {
        let place = |axis| if axis < moves { COPIES_APART_M } else { 0.0 };
        let speed = |axis| if axis < moves { FASTEST_M_PER_S } else { FASTEST_RAD_PER_S };
        let axes = 0..moves + turns;
        let most = axes.clone().map(place).chain(axes.map(|axis| self.speed * speed(axis)));
        most.map(|most| most * random.signed()).collect()
    }
}

/// By every hand; by one; by some, more or less; or by none.
fn pushes(known: &Known, random: &mut Random) -> Vec<DVec3> {
    let one = random.below(known.normals.len().max(1));
    let kind = random.below(8);
    let push = |(hand, normal): (usize, &Option<DVec3>)| {
        let share = match kind {
            0 => 0.0,
            1 | 2 => f64::from(u8::from(hand == one)),
            3 => random.share(),
            _ => 1.0,
        };
        normal.map_or(DVec3::ZERO, |normal| -normal * (PUSH_N * share))
    };
    known.normals.iter().enumerate().map(push).collect()
}

fn swing(policy: HandPolicy, normal: Option<DVec3>, push: DVec3, axes: usize, random: &mut Random) -> DVec3 {
    let Some(normal) = normal else { return DVec3::ZERO };
    match policy {
        HandPolicy::Throw | HandPolicy::Pump => DVec3::ZERO,
        // With its push: now twice that, now away; or now that, now nothing.
        HandPolicy::Rhythm => -normal * (PUSH_N * (0.5 + random.share())),
        HandPolicy::Slide => {
            let along = vector(axes, random);
            let along = along - normal * along.dot(normal);
            along.normalize_or_zero() * push.length().max(PUSH_N) * (0.25 + random.share())
        }
    }
}

fn rhythm(known: &Known, random: &mut Random) -> f64 {
    let slow = known.slow_hz.len();
    if slow > 0 && random.share() < 0.5 {
        return known.slow_hz[random.below(slow)].clamp(SLOWEST_HZ, FASTEST_HZ);
    }
    SLOWEST_HZ * (FASTEST_HZ / SLOWEST_HZ).powf(random.share())
}

fn start(normal: Option<DVec3>, speed: f64, axes: usize, random: &mut Random) -> (DVec3, DVec3) {
    let place = normal.map_or(DVec3::ZERO, |normal| normal * (APART_M * random.signed()));
    (place, vector(axes, random) * (FASTEST_M_PER_S * speed))
}

/// Each component from −1 to 1.
fn vector(axes: usize, random: &mut Random) -> DVec3 {
    let mut component = |axis: usize| if axis < axes { random.signed() } else { 0.0 };
    DVec3::new(component(0), component(1), component(2))
}
