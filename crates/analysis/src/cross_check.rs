//! A verdict held to other ways to the same map: what the analysis found by the product of a loop's ticks, on a state in
//! which receivers share samples and equal users are one, is found again on the whole state by each route of the loop's
//! diagram ([`LiftRoute`]). These share the description of the loop with it, and nothing else.

use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::Scene;
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

use crate::compile::ContactMode;
use crate::coverage::{self, CriticalLoop, judge_part};
use crate::diagram::{DiagramError, LiftRoute};
use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::poles::{has_outgrown, judge, poles_of};
use crate::rigid::Structure;
use crate::soft::Bodies;
use crate::verdict::{AnalysisError, ContactPlace};
use cotouch_matrix::{EigenvalueError, balance, spectral_radius};

/// Of a settled grasp with more contact modes than this, none is checked: the verdict's own are.
const MAX_MODES: usize = 8;

/// Numbers in a state in which each receiver keeps its own samples: some ten seconds for the eigenvalues of four maps.
const MAX_STATES: usize = 1000;

const ROUTES: [(&str, LiftRoute); 3] = [
    ("instants", LiftRoute::Stepping),
    ("state-space", LiftRoute::StateSpace),
    ("resampling", LiftRoute::Resampling),
];

/// The map of one contact mode, found in several ways.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeCheck {
    /// The switching contacts that are closed.
    pub contacts: Vec<String>,
    /// Where they touch, if this is not where scripts come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<Vec<ContactPlace>>,
    /// Numbers in the state of the maps that are compared: each receiver has its own copy of every sample.
    pub states: usize,
    /// Largest absolute eigenvalue over one pattern without the rigid-body poles, as the verdict says it.
    pub spectral_radius: f64,
    /// The same by each route.
    pub routes: Vec<RouteCheck>,
}

/// The map of one contact mode, found by one route.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RouteCheck {
    /// `instants` for [`LiftRoute::Stepping`], `state-space`, `resampling`.
    pub name: &'static str,
    /// Largest absolute eigenvalue of this route's map, without the rigid-body poles. `None` where there is no map.
    pub spectral_radius: Option<f64>,
    /// Largest absolute difference between an element of this route's map and of the product of the ticks, over the largest
    /// absolute element of that product; both in the coordinates that balance the product (Osborne 1960), so that units do
    /// not matter. `None` where there is no map.
    pub difference: Option<f64>,
    /// Why there is no map by this route.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Why a loop's map is not compared.
#[derive(Clone, Debug, thiserror::Error)]
enum Incomparable {
    #[error(transparent)]
    Diagram(#[from] DiagramError),
    #[error(transparent)]
    Eigenvalues(#[from] EigenvalueError),
    #[error(
        "the loop has {0} states when each receiver keeps its own samples; at most {MAX_STATES} are checked: check it with \
         fewer users or a shorter delay"
    )]
    TooLarge(usize),
    #[error("the state grows more than 1e120-fold within one pattern: unstable beyond comparison")]
    Outgrown,
}

/// Finds the maps on which the verdict on a scene rests by every route: that of the contact mode with the largest spectral
/// radius, and of what a search found to come nearest to swinging ever more; besides, those of the settled grasp's modes, where
/// there are few. `progress` is told the share that is done.
///
/// # Errors
/// As [`crate::analyze`]. A route that does not apply to a loop, or for which it is too large, says so in its place.
pub fn cross_check(scene: &Scene, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ModeCheck>, AnalysisError> {
    let mut loops = critical(scene)?;
    let (settled, _) = contact_modes(scene, &Bodies::default())?;
    if settled.len() <= MAX_MODES {
        let is_new = |mode: &ContactMode| !loops.iter().any(|known| known.spec == mode.spec);
        let more = settled.into_iter().filter(is_new).collect::<Vec<_>>();
        loops.extend(more.into_iter().map(|ContactMode { contacts, spec, .. }| CriticalLoop {
            contacts,
            place: None,
            spec,
            drifts: false,
        }));
    }
    let (count, done) = (loops.len() * ROUTES.len(), AtomicUsize::new(0));
    let tell = || progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
    loops.into_par_iter().map(|critical| check_loop(critical, &tell)).collect()
}

/// What the verdict rests on.
fn critical(scene: &Scene) -> Result<Vec<CriticalLoop>, AnalysisError> {
    if !scene.soft.exists() {
        return Ok(coverage::cover(scene)?.critical);
    }
    // All modes that there are: the largest is the verdict's.
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let radius = |mode: ContactMode| Ok((judge(&mode.spec, false)?.spectral_radius, mode));
    let judged = modes.into_par_iter().map(radius).collect::<Result<Vec<_>, AnalysisError>>()?;
    let largest = judged.into_iter().max_by(|(one, _), (other, _)| one.total_cmp(other));
    let of_mode =
        |(_, ContactMode { contacts, spec, .. })| CriticalLoop { contacts, place: None, spec, drifts: false };
    Ok(largest.map(of_mode).into_iter().collect())
}

fn check_loop(critical: CriticalLoop, tell: &(dyn Fn() + Sync)) -> Result<ModeCheck, AnalysisError> {
    let CriticalLoop { contacts, place, spec, drifts } = critical;
    let layout = Layout::new(&spec, Registers::PerReceiver);
    let spectral_radius = judge_part(&spec, false, drifts)?.spectral_radius;
    let product = Product::new(&spec, &layout, drifts);
    let routes = ROUTES.into_iter().map(|(name, route)| {
        let compared =
            product.as_ref().map_err(Clone::clone).and_then(|product| product.compare(&spec, route));
        tell();
        RouteCheck::new(name, compared)
    });
    let routes = routes.collect();
    Ok(ModeCheck { contacts, place, states: layout.coordinates.len(), spectral_radius, routes })
}

impl RouteCheck {
    /// From a spectral radius and a difference, or why there are none.
    fn new(name: &'static str, compared: Result<(f64, f64), Incomparable>) -> Self {
        match compared {
            Ok((radius, difference)) => {
                Self { name, spectral_radius: Some(radius), difference: Some(difference), note: None }
            }
            Err(why) => Self { name, spectral_radius: None, difference: None, note: Some(why.to_string()) },
        }
    }
}

/// The product of a loop's ticks, on the whole state.
struct Product {
    /// In the coordinates that balance it.
    balanced: DMatrix<f64>,
    /// Its coordinate over the balanced one.
    scales: Vec<f64>,
    structure: Structure,
    /// As in [`CriticalLoop`].
    drifts: bool,
}

impl Product {
    fn new(spec: &LoopSpec, layout: &Layout, drifts: bool) -> Result<Self, Incomparable> {
        let states = layout.coordinates.len();
        if states > MAX_STATES {
            return Err(Incomparable::TooLarge(states));
        }
        let map = stepping::lift(spec, layout);
        if has_outgrown(&map) {
            return Err(Incomparable::Outgrown);
        }
        let structure = Structure::new(spec, layout, &map);
        let mut balanced = map;
        let scales = balance(&mut balanced);
        Ok(Self { balanced, scales, structure, drifts })
    }

    /// The spectral radius of a route's map, and how far that map is from the product.
    fn compare(&self, spec: &LoopSpec, route: LiftRoute) -> Result<(f64, f64), Incomparable> {
        let map = spec.lift_by(route)?.matrix;
        let scaled =
            DMatrix::from_fn(map.nrows(), map.ncols(), |i, j| map[(i, j)] * self.scales[j] / self.scales[i]);
        let difference = (scaled - &self.balanced).amax() / self.balanced.amax();
        let loose = if self.drifts || self.structure.loose.is_empty() { 0.0 } else { 1.0 };
        let radius = spectral_radius(&poles_of(map, &self.structure)?).max(loose);
        Ok((radius, difference))
    }
}
