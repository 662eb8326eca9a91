//! What of a contact mode an adversary wants to know: how fast its worst motion swings, and what pumps it.

use nalgebra::Complex;

use crate::dominant::eigenvectors;
use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;
use crate::poles::analyze_loop;

/// Larger states are not looked into: eigenvectors take a second.
const MAX_STATES: usize = 400;

/// The motion of a loop that dies out most slowly.
#[derive(Clone, Debug)]
pub(super) struct WorstMotion {
    /// How often it swings, Hz; 0 where it does not.
    pub(super) hz: f64,
    /// w with wᵀ·Φ = λ·wᵀ: by how much each coordinate excites it.
    pub(super) weights: Vec<(cotouch_scene::names::Coordinate, Complex<f64>)>,
}

/// Of a loop; none where it is too large, or its state outgrows floating point.
pub(super) fn worst_motion(spec: &LoopSpec) -> Option<WorstMotion> {
    let layout = Layout::new(spec, Registers::PerReceiver);
    if layout.coordinates.len() > MAX_STATES {
        return None;
    }
    let eigenvalues = analyze_loop(spec).ok()?.eigenvalues;
    let largest = eigenvalues.into_iter().max_by(|one, other| one.norm().total_cmp(&other.norm()))?;
    let transposed = stepping::lift(spec, &layout).transpose();
    let vectors = eigenvectors(&transposed, largest, 1)?;
    let weight = |place: usize| Complex::new(vectors[(place, 0)].re, vectors[(place, 0)].im);
    let weights = layout.coordinates.iter().enumerate().map(|(place, &name)| (name, weight(place)));
    Some(WorstMotion {
        hz: largest.arg().abs() / (std::f64::consts::TAU * spec.pattern_s()),
        weights: weights.collect(),
    })
}
