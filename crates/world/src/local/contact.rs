//! How a finger meets a soft surface, sticks to it, slides along it and comes off it.

use cotouch_soft::MaterialPoint;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::gains::LocalGains;
use super::model::SoftContactModel;
use super::surface::{SurfaceInUse, material};
use crate::proxy::{ProxyState, SurfacePoint};

/// The way along a curved surface is corrected at most so often in one tick.
const MAX_CORRECTIONS: usize = 4;

/// Slips shorter than this (m) are none.
const MIN_SLIP_M: f64 = 1e-12;

/// Numbers that a law may remember of one contact ([`LocalContact::memory`]).
pub const LAW_MEMORY: usize = 6;

/// A number that a law remembers of a contact. They differ in what becomes of them where the finger comes off, and in what
/// bounds friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawState {
    /// The integral's force along the normal, N. It is part of every force and of the push that bounds friction; where the
    /// finger comes off it drains, and what is left counts where the finger touches again.
    Integral,
    /// A number of [`LocalContact::memory`], from 0, in whichever unit. Nothing but the law looks at it; it is zero whenever
    /// the finger begins to touch.
    Memory(u8),
}

/// Where a finger touches a soft body, and what its local model remembers: a plain value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocalContact {
    /// Whether the finger touches.
    pub touching: bool,
    /// Whether the finger slid in the last tick.
    pub sliding: bool,
    /// The point of the surface that holds it; where it came off, the last one.
    pub anchor: MaterialPoint,
    /// The triangle of the anchor.
    pub triangle: u32,
    /// From the anchor to where the finger's centre is held, m.
    pub offset: DVec3,
    /// Outward, unit. While the integral's force drains: its direction.
    pub normal: DVec3,
    /// The integral's force along the normal, N. It is part of every law's force, so that nothing jumps where a session
    /// changes its law; only laws with an integral change it.
    pub integral_n: f64,
    /// How much of the integral's force a tick of draining takes away, N; 0 while it touches.
    pub drain_n: f64,
    /// The force on the finger in the last tick, N.
    pub force: DVec3,
    /// The proxy of a finger that is free.
    pub proxy: ProxyState,
    /// What laws with further state remember while the finger touches; zero when it begins to.
    pub memory: [f64; LAW_MEMORY],
}

/// What is known of one finger and the surface in one tick.
#[derive(Clone, Copy, Debug)]
pub struct ContactInput<'a> {
    /// Constants of all contacts.
    pub model: &'a SoftContactModel,
    /// Gains of the contact in the present slow period.
    pub gains: &'a LocalGains,
    /// The surface as it is in this tick.
    pub surface: &'a SurfaceInUse<'a>,
    /// The finger's centre x_h, m.
    pub centre: DVec3,
    /// The finger's velocity, m/s.
    pub velocity: DVec3,
}

impl LocalContact {
    /// A number that a law remembers of it.
    ///
    /// # Panics
    /// When there is no such number.
    pub fn state_mut(&mut self, state: LawState) -> &mut f64 {
        match state {
            LawState::Integral => &mut self.integral_n,
            LawState::Memory(number) => &mut self.memory[usize::from(number)],
        }
    }

    /// A contact for good: holds the surface's point that is nearest to `centre` (m).
    pub fn hold_nearest(&mut self, model: &SoftContactModel, surface: &SurfaceInUse, centre: DVec3) {
        let Some(nearest) = surface.latest.nearest_point(centre) else { return };
        *self = Self { touching: true, ..Self::default() };
        self.place(model, &nearest, centre - nearest.point);
    }

    /// Looks whether a free finger at `centre` (m) touches; then it is anchored there.
    pub fn meet(&mut self, model: &SoftContactModel, surface: &SurfaceInUse, centre: DVec3) {
        // The proxy knows the latest surface; the one in use may still be on its way there.
        let ahead = ahead(model, surface, centre);
        let Some(probe) = surface.latest.probe(&mut self.proxy, centre + ahead, model.radius_m) else {
            return;
        };
        let held = self.proxy.triangle().and_then(|at| surface.latest.nearest_on(at, probe.point));
        let (Some(point), Some(proxy)) = (held, self.proxy.proxy()) else { return };
        let mut begun = Self { touching: true, drain_n: 0.0, ..*self };
        begun.anchor = material(&point);
        begun.triangle = point.triangle;
        begun.offset = proxy - point.point;
        begun.normal = probe.normal;
        if begun.depth_m(surface, centre) <= 0.0 {
            return;
        }
        begun.integral_n = (self.integral_n * self.normal.dot(probe.normal)).max(0.0);
        *self = begun;
    }

    /// e = x_a + o − x_h, m.
    #[must_use]
    pub fn stretch(&self, surface: &SurfaceInUse, centre: DVec3) -> DVec3 {
        surface.at(&self.anchor) + self.offset - centre
    }

    /// How deep the finger is inside, e_n = e·n, m.
    #[must_use]
    pub fn depth_m(&self, surface: &SurfaceInUse, centre: DVec3) -> f64 {
        self.stretch(surface, centre).dot(self.normal)
    }

    /// Comes off. What the integral has drains, in the direction of the last force (Barbagli et al. 2003, §3.5).
    pub fn come_off(&mut self, input: &ContactInput<'_>) {
        let ContactInput { surface, gains, .. } = input;
        (self.touching, self.sliding, self.memory) = (false, false, [0.0; LAW_MEMORY]);
        // Where it is was just told by the contact; whether other parts of the surface are there, the next probe tells.
        self.proxy = surface.latest.seen_outside(input.centre + surface.to_latest(&self.anchor));
        if self.integral_n <= 0.0 || gains.drain_ticks < 1.0 {
            (self.integral_n, self.drain_n) = (0.0, 0.0);
            return;
        }
        let (direction, force_n) = self.force.normalize_and_length();
        if force_n > 0.0 {
            (self.normal, self.integral_n) = (direction, force_n);
        }
        self.drain_n = self.integral_n / gains.drain_ticks;
    }

    /// One tick of a finger that came off: a part of the integral's force drains.
    pub fn drain(&mut self) {
        self.integral_n = (self.integral_n - self.drain_n).max(0.0);
        if self.integral_n <= 1e-9 * self.drain_n {
            (self.integral_n, self.drain_n) = (0.0, 0.0);
        }
    }

    /// Forgets a finger of which nothing is known; a two-sided contact keeps its anchor.
    pub fn forget(&mut self, model: &SoftContactModel) {
        if model.two_sided {
            (self.integral_n, self.force, self.memory) = (0.0, DVec3::ZERO, [0.0; LAW_MEMORY]);
        } else {
            *self = Self::default();
        }
    }

    /// The force of the spring K_h and of what an integral has, N; where it would leave the cone of friction, the anchor
    /// slides first.
    pub fn spring_force(&mut self, input: &ContactInput<'_>) -> DVec3 {
        let stiffness = input.gains.stiffness_n_per_m;
        let mut stretch = self.stretch(input.surface, input.centre);
        // A contact that slides has another normal afterwards.
        let normal = self.normal;
        if !input.model.two_sided {
            let push_n = stiffness * stretch.dot(normal) + self.integral_n;
            stretch = self.slide(input, stretch, input.model.friction * push_n / stiffness);
        }
        stiffness * stretch + normal * self.integral_n
    }

    /// Lets the anchor slide along the surface, by as much as the stretch along it is more than `max_m`. The stretch that
    /// counts in this tick.
    pub fn slide(&mut self, input: &ContactInput<'_>, stretch: DVec3, max_m: f64) -> DVec3 {
        let (along, size) = self.along(stretch).normalize_and_length();
        self.sliding = size > max_m + MIN_SLIP_M;
        if !self.sliding {
            return stretch;
        }
        let slip = along * (size - max_m);
        let held = input.surface.at(&self.anchor) + self.offset;
        self.drag(input.model, input.surface, held - slip);
        stretch - slip
    }

    /// Moves the anchor so that the finger would be held at about `target` (m), just outside the surface.
    fn drag(&mut self, model: &SoftContactModel, surface: &SurfaceInUse, mut target: DVec3) {
        for _ in 0..MAX_CORRECTIONS {
            let ahead = surface.to_latest(&self.anchor);
            let Some(nearest) = surface.latest.nearest_point(target + ahead) else { return };
            self.place(model, &nearest, target + ahead - nearest.point);
            let held = surface.at(&self.anchor) + self.offset;
            let missed = self.along(target - held);
            if missed.length() <= MIN_SLIP_M {
                return;
            }
            target = held + missed;
        }
    }

    /// Anchors at a point; `away`, from there to the finger's centre, tells the direction.
    fn place(&mut self, model: &SoftContactModel, point: &SurfacePoint, away: DVec3) {
        let (direction, distance) = away.normalize_and_length();
        let outward = if direction.dot(point.outward) < 0.0 { -direction } else { direction };
        let normal = if distance > 1e-9 { outward } else { point.outward };
        self.anchor = material(point);
        self.triangle = point.triangle;
        self.normal = normal;
        self.offset = if model.two_sided { away } else { normal * model.radius_m };
    }

    fn along(&self, vector: DVec3) -> DVec3 {
        vector - self.normal * vector.dot(self.normal)
    }
}

/// From the surface in use near `centre` to the latest one, m.
fn ahead(model: &SoftContactModel, surface: &SurfaceInUse, centre: DVec3) -> DVec3 {
    if surface.share >= 1.0 || surface.latest.distance_at_least(centre) > model.radius_m {
        return DVec3::ZERO;
    }
    let nearest = surface.latest.nearest_point(centre);
    nearest.map_or(DVec3::ZERO, |nearest| surface.to_latest(&material(&nearest)))
}
