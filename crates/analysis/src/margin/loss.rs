//! How many packets may be lost.
//!
//! Every packet from one host to another is lost with the same probability p, independently of all others; the receiver
//! goes on with what it had. With v what a receiver holds minus what it would get, and w what is added to the samples that it
//! gets, a pattern is a linear system in which a lost packet l has `w_l = v_l`, and any other `w_l = 0`:
//!
//! ```text
//! x⁺ = A·x + B·w     w_l = λ_l·v_l     λ_l = 1 with probability p, else 0
//! v  = C·x + D·w
//! ```
//!
//! With `w = p·v + δ` the mean map is `Ā = A + p·B·(I − p·D)⁻¹·C`, and δ is white: zero in the mean, one packet's uncorrelated with
//! another's, and for one packet `E[δ_l·δ_lᵀ] = p·(1 − p)·E[v_l·v_lᵀ]`, because what a receiver holds does not depend on
//! whether that very packet arrives. So the mean square dies out iff `Ā` is stable and what comes back of δ's moments is less than
//! they were: the operator
//!
//! ```text
//! W_l → p·(1 − p)·Σ_k [G_k·diag(W)·G_kᵀ]_ll     G_k what the system answers with v, k patterns after an impulse of δ
//! ```
//!
//! has a spectral radius below 1 (a small-gain theorem that is exact for positive operators: Schneider 1965; for noise on channels:
//! Elia 2005). It keeps semidefinite matrices so, and is as small as the packets are, however large the loop is. What losses leave as it is
//! (moving everything) is removed first.

mod lossy_loop;
mod moments;

use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::Scene;
use rayon::prelude::*;

use super::found::{Found, go_on};
use crate::crossing::crossing;
use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::soft::Bodies;
use crate::sweep::SweepError;
use crate::verdict::{AnalysisError, PointVerdict};
use lossy_loop::LossyLoop;
use moments::verdict;

/// Losses that are looked at before the one that matters is narrowed down.
const LOOKS: u32 = 12;
/// As good as everything is lost.
pub(super) const HIGHEST: f64 = 0.9999;
/// Of a probability.
const ACCURACY: f64 = 1e-9;

/// The lowest loss from which on the mean square of some contact mode does not die out; `None` where it does up to
/// [`HIGHEST`].
pub(super) fn margin(
    scene: &Scene,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Found<Option<f64>>, SweepError> {
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let done = AtomicUsize::new(0);
    let looks = LOOKS as usize * modes.iter().filter(|mode| !mode.spec.lines.is_empty()).count();
    let of_mode = |spec: &LoopSpec| -> Result<Found<Option<f64>>, SweepError> {
        if spec.lines.is_empty() {
            return Ok(Ok(None));
        }
        let looked = || {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            go_on(progress(done as f64 / looks as f64))
        };
        match LossyLoop::new(spec).map_err(AnalysisError::from)? {
            Ok(lossy) => critical(&lossy, &looked),
            Err(note) => Ok(Err(note)),
        }
    };
    let found = modes.par_iter().map(|mode| of_mode(&mode.spec)).collect::<Result<Vec<_>, _>>()?;
    let limits = found.into_iter().collect::<Found<Vec<Option<f64>>>>();
    Ok(limits.map(|limits| limits.into_iter().flatten().min_by(f64::total_cmp)))
}

/// The lowest loss from which on the mean square does not die out, where there is one. `looked` is told of each of
/// [`LOOKS`].
fn critical(
    lossy: &LossyLoop,
    looked: &dyn Fn() -> Result<(), SweepError>,
) -> Result<Found<Option<f64>>, SweepError> {
    let at = |rate: f64| verdict(lossy, rate).map_err(AnalysisError::from);
    let unsettled =
        || Ok(Err("A motion that hardly settles, if at all, leaves the loss margin untold.".to_owned()));
    let Some(first) = at(0.0)? else { return unsettled() };
    let mut last = (0.0, first);
    for look in 1..=LOOKS {
        let rate = HIGHEST * (f64::from(look) / f64::from(LOOKS)).powi(2);
        let Some(verdict) = at(rate)? else { return unsettled() };
        looked()?;
        if !verdict.stable {
            let width = rate - last.0;
            let share = crossing(last.1, verdict, ACCURACY / width, |share| {
                at(last.0 + share * width).map(|verdict| verdict.unwrap_or(UNSTABLE))
            })?;
            return Ok(Ok(Some(last.0 + share * width)));
        }
        last = (rate, verdict);
    }
    Ok(Ok(None))
}

/// What stands for a verdict that rounding hides, while a crossing is narrowed down.
const UNSTABLE: PointVerdict = PointVerdict { spectral_radius: 1.0, stable: false };

#[cfg(test)]
mod tests;
