//! Whether what moves does only what it did before: rest, or go on periodically.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, ShapeKind};
use cotouch_world::BodyState;

use crate::record::TickRecord;

/// How long a stretch is, s; two of them are compared.
const STRETCH_S: f64 = 10.0;
/// Bounds that differ by no more than this are the same, m, m/s or a quaternion's components.
const SAME: f64 = 1e-5;
/// Or by this share of their distance from each other: of several frequencies that do not fit into a stretch.
const SAME_SHARE: f64 = 0.01;

/// The bounds between which everything moved, in two stretches of time after another. A motion that has died out, or that has
/// become periodic, keeps its bounds.
pub(super) struct Stillness {
    /// Whether there is something that who drifts on runs into. Else what moves steadily does so for ever.
    has_obstacles: bool,
    looks: u32,
    looks_a_stretch: u32,
    is_steady: bool,
    before: Option<Vec<Bounds>>,
    now: Vec<Bounds>,
    fingers: usize,
}

#[derive(Clone, Copy)]
struct Bounds {
    low: f64,
    high: f64,
}

const NOTHING: Bounds = Bounds { low: f64::INFINITY, high: f64::NEG_INFINITY };

impl Stillness {
    pub(super) fn new(scene: &Scene, look_s: f64) -> Self {
        let bodies = scene.world_bodies();
        let has_surface = bodies.iter().any(|body| body.shape.kind != ShapeKind::Point);
        let has_obstacles = has_surface || scene.soft.exists() || !scene.walls().is_empty();
        let fingers = scene.users.iter().map(|user| user.fingers.len().max(1)).max().unwrap_or(1);
        let numbers = scene.users.len() * (3 * fingers + 7 * bodies.len());
        Self {
            has_obstacles,
            looks: 0,
            looks_a_stretch: (STRETCH_S / look_s).ceil() as u32,
            is_steady: false,
            before: None,
            now: vec![NOTHING; numbers],
            fingers,
        }
    }

    /// Takes in what moves at a host.
    pub(super) fn observe(&mut self, host: HostIndex, record: &TickRecord) {
        let of_host = 3 * self.fingers + 7 * record.bodies.len();
        let Some(bounds) = self.now.get_mut(host.index() * of_host..) else { return };
        let has_obstacles = self.has_obstacles;
        let fingers = record.readings.iter().map(|reading| match has_obstacles {
            true => reading.pose.position,
            false => reading.twist.linear,
        });
        let numbers = fingers.flat_map(|vector| vector.to_array());
        let bodies = record.bodies.iter().flat_map(|body| numbers_of(body, has_obstacles));
        bounds.iter_mut().zip(numbers.chain(bodies)).for_each(|(bounds, number)| bounds.include(number));
    }

    /// Whether the last two whole stretches have kept the same bounds.
    pub(super) fn is_steady(&self) -> bool {
        self.is_steady
    }

    /// Forgets what was: something new happens.
    pub(super) fn begin_anew(&mut self) {
        (self.looks, self.before, self.is_steady) = (0, None, false);
        self.now.fill(NOTHING);
    }

    /// Goes on by one look, and compares where a stretch ends.
    pub(super) fn look(&mut self) {
        self.looks += 1;
        if self.looks < self.looks_a_stretch {
            return;
        }
        self.looks = 0;
        let fresh = vec![NOTHING; self.now.len()];
        let now = std::mem::replace(&mut self.now, fresh);
        self.is_steady =
            self.before.as_ref().is_some_and(|before| before.iter().zip(&now).all(Bounds::agree));
        self.before = Some(now);
    }
}

/// Where a body is, or how it moves.
fn numbers_of(body: &BodyState, place: bool) -> [f64; 7] {
    let [x, y, z] = if place { body.pose.position } else { body.twist.linear }.to_array();
    let [a, b, c, d] = if place { body.pose.orientation.to_array() } else { [0.0; 4] };
    [x, y, z, a, b, c, d]
}

impl Bounds {
    fn include(&mut self, number: f64) {
        (self.low, self.high) = (self.low.min(number), self.high.max(number));
    }

    fn agree((one, other): (&Self, &Self)) -> bool {
        let same = SAME + SAME_SHARE * (one.high - one.low);
        let near = |one: f64, other: f64| one == other || (one - other).abs() <= same;
        near(one.low, other.low) && near(one.high, other.high)
    }
}
