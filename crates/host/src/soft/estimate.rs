//! K_o from what forces do, whatever the technique of the simulation is.
//!
//! Before the session every finger's place is pressed for once, on a copy of the body. Then the compliance `w_ij` between
//! slots, along the forces' directions, follows by recursive least squares with forgetting from every period's forces `φ`
//! and displacements `d`:
//!
//! ```text
//! g = P·φ/(λ + φᵀ·P·φ),   w_i ← w_i + g·(d_i − w_i·φ),   P ← (P − g·φᵀ·P)/λ
//! ```
//!
//! The largest eigenvalue stays within a factor of 5 of what was found before the session.

use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use cotouch_soft::{MaterialPoint, PointForce, SoftBody, largest_eigenvalue};
use cotouch_world::MeshSurface;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use super::input::SlowInput;

/// λ: half of what is known is forgotten in 34 periods.
const KEEPS: f64 = 0.98;

/// P before the first force, 1/N².
const START: f64 = 4.0;

/// FingerForces below this (N) tell nothing.
const MIN_FORCE_N: f64 = 1e-4;

/// How far K_o may get from where it was before the session, as a factor.
const MAX_CHANGE: f64 = 5.0;

/// The force (N) of the first try before the session; the second is such that the surface gives way by
/// [`TRY_M`] times the body's size.
const TRY_N: f64 = 1e-3;
const TRY_M: f64 = 1e-3;

/// Periods that a body whose equilibrium is not found is stepped for instead.
const TRY_PERIODS: usize = 120;

#[derive(Clone)]
pub(super) struct ComplianceEstimate {
    /// Where the nodes were before the session, m.
    start_m: Vec<DVec3>,
    /// The compliances w_ij between slots along the forces' directions, m/N.
    compliance: DMatrix<f64>,
    /// The matrix P of the recursive least squares, 1/N².
    spread: DMatrix<f64>,
    /// The largest eigenvalue of all before the session, m/N.
    first_m_per_n: f64,
}

impl ComplianceEstimate {
    /// Presses each of the places of fingers once, straight in.
    pub(super) fn probed(body: &dyn SoftBody, surface: &MeshSurface, places: &[(u8, MaterialPoint)]) -> Self {
        let start_m = body.state().positions_m.clone();
        let slots = places.iter().map(|place| usize::from(place.0) + 1).max().unwrap_or(0);
        let inward = |point: &MaterialPoint| {
            let nearest = surface.nearest_point(point.at(&start_m));
            nearest.map_or(DVec3::NEG_Z, |nearest| -nearest.outward)
        };
        let mut compliance = DMatrix::zeros(slots, slots);
        for (slot, point) in places {
            let (force_n, positions_m) = pressed(body, *point, inward(point));
            for (other, at) in places {
                let moved = (at.at(&positions_m) - at.at(&start_m)).dot(inward(at));
                compliance[(usize::from(*other), usize::from(*slot))] = moved / force_n;
            }
        }
        let first_m_per_n = largest_eigenvalue(&compliance).max(f64::MIN_POSITIVE);
        Self { start_m, compliance, spread: DMatrix::identity(slots, slots) * START, first_m_per_n }
    }

    /// K_o of some slots, N/m.
    pub(super) fn ko_n_per_m(&self, slots: impl Iterator<Item = u8>) -> f64 {
        let slots: Vec<usize> =
            slots.map(usize::from).filter(|&slot| slot < self.compliance.nrows()).collect();
        let part = self.compliance.select_rows(&slots).select_columns(&slots);
        let range = self.first_m_per_n / MAX_CHANGE..=self.first_m_per_n * MAX_CHANGE;
        1.0 / largest_eigenvalue(&part).clamp(*range.start(), *range.end())
    }

    /// Learns from a period: the forces of `input` brought the nodes to `positions_m`.
    pub(super) fn observe(&mut self, positions_m: &[DVec3], input: &SlowInput) {
        let slots = self.compliance.nrows();
        let mut forces = DVector::zeros(slots);
        let mut moved = [None; MAX_SOFT_CONTACTS];
        for contact in &input.contacts {
            let (slot, (direction, force_n)) =
                (usize::from(contact.slot), contact.force_n.normalize_and_length());
            let Some(anchor) = contact.anchor.filter(|_| slot < slots && force_n > MIN_FORCE_N) else {
                continue;
            };
            forces[slot] = force_n;
            moved[slot] = Some((anchor.at(positions_m) - anchor.at(&self.start_m)).dot(direction));
        }
        if forces.amax() == 0.0 {
            return;
        }
        let spread = &self.spread * &forces;
        let gain = &spread / (KEEPS + forces.dot(&spread));
        for (slot, moved_m) in moved.iter().enumerate().take(slots) {
            let Some(moved_m) = moved_m else { continue };
            let error_m = moved_m - self.compliance.row(slot).tr_dot(&forces);
            let mut row = self.compliance.row_mut(slot);
            row += gain.transpose() * error_m;
        }
        self.spread -= &gain * spread.transpose();
        // What no force tells of is not forgotten for ever.
        if self.spread.diagonal().max() < KEEPS * START {
            self.spread /= KEEPS;
        }
    }
}

/// A force (N) along `direction` at a point, and where the nodes (m) of a body at rest are under it.
fn pressed(body: &dyn SoftBody, point: MaterialPoint, direction: DVec3) -> (f64, Vec<DVec3>) {
    let start = body.state().positions_m.as_slice();
    let bounds = start
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(least, most), at| (least.min(*at), most.max(*at)));
    let aim_m = TRY_M * (bounds.1 - bounds.0).length();
    let press = |force_n: f64| {
        let forces = [PointForce { at: point, force_n: direction * force_n }];
        let mut body = body.boxed_clone();
        if body.settle(&forces).is_err() {
            (0..TRY_PERIODS).for_each(|_| body.step(&forces));
        }
        body.state().positions_m.clone()
    };
    let first = press(TRY_N);
    let moved_m = point.at(&first).distance(point.at(start));
    if moved_m <= 0.0 || !moved_m.is_finite() {
        return (TRY_N, first);
    }
    let force_n = TRY_N * aim_m / moved_m;
    (force_n, press(force_n))
}
