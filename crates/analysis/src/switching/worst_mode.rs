//! What of a contact mode an adversary wants to know: how fast its worst motion swings, and what pumps it.

use cotouch_matrix::eigenvectors;
use cotouch_scene::names::Coordinate;
use nalgebra::Complex;

use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;

/// Larger states are not looked into: eigenvectors take a second.
const MAX_STATES: usize = 400;

/// The motion of a loop that dies out most slowly.
#[derive(Clone, Debug)]
pub(super) struct WorstMotion {
    /// How often it swings, Hz: up to what a pattern cannot tell.
    pub(super) hz: f64,
    /// w with wᵀ·Φ = λ·wᵀ: by how much each coordinate excites it.
    pub(super) weights: Vec<(Coordinate, Complex<f64>)>,
}

/// Of a loop with these eigenvalues; none where nothing swings, the loop is too large or its state outgrows floating point.
pub(super) fn worst_motion(spec: &LoopSpec, eigenvalues: &[Complex<f64>]) -> Option<WorstMotion> {
    let layout = Layout::new(spec, Registers::PerReceiver);
    if layout.coordinates.len() > MAX_STATES {
        return None;
    }
    let swinging = eigenvalues.iter().copied().filter(|value| value.im > 0.0);
    let largest = swinging.max_by(|one, other| one.norm().total_cmp(&other.norm()))?;
    let transposed = stepping::lift(spec, &layout).transpose();
    let vectors = eigenvectors(&transposed, largest, 1)?;
    let weights = layout.coordinates.iter().enumerate().map(|(place, &name)| (name, vectors[(place, 0)]));
    Some(WorstMotion {
        hz: largest.arg() / (std::f64::consts::TAU * spec.pattern_s()),
        weights: weights.collect(),
    })
}
