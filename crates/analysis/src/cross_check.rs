//! A verdict held to other ways to the same map: what the analysis found by the product of a loop's ticks, on a state in
//! which receivers share samples and equal users are one, is found again on the whole state by each route of the loop's
//! diagram ([`LiftRoute`]). These share the description of the loop with it, and nothing else.

use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::Scene;
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

use crate::compile::ContactMode;
use crate::diagram::{DiagramError, LiftRoute};
use crate::lift::layout::{Layout, Registers};
use crate::lift::stepping;
use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::poles::{has_outgrown, judge, poles_of};
use crate::rigid::Structure;
use crate::soft::Bodies;
use crate::verdict::{AnalysisError, ModeStability, Stability};
use cotouch_matrix::{EigenvalueError, balance, spectral_radius};

/// With more contact modes than this, only those are checked that are called as the worst one.
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

/// Finds the maps of the contact modes of a scene's settled grasp by every route: of all modes where there are few, else of the worst one of
/// `stability`, which is what [`crate::analyze`] said of this scene. `progress` is told the share that is done.
///
/// # Errors
/// As [`crate::analyze`]. A route that does not apply to a loop, or for which it is too large, says so in its place.
pub fn cross_check(
    scene: &Scene,
    stability: &Stability,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<ModeCheck>, AnalysisError> {
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let modes = worth_checking(modes, stability);
    let (count, done) = (modes.len() * ROUTES.len(), AtomicUsize::new(0));
    let tell = || progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
    modes.into_par_iter().map(|mode| check_mode(mode, &tell)).collect()
}

fn worth_checking(mut modes: Vec<ContactMode>, stability: &Stability) -> Vec<ContactMode> {
    if modes.len() > MAX_MODES {
        let by_radius =
            |a: &&ModeStability, b: &&ModeStability| a.spectral_radius.total_cmp(&b.spectral_radius);
        let is_compiled = |judged: &&ModeStability| modes.iter().any(|mode| mode.contacts == judged.contacts);
        let worst = stability.modes.iter().filter(is_compiled).max_by(by_radius);
        modes.retain(|mode| worst.is_some_and(|worst| worst.contacts == mode.contacts));
    }
    modes
}

fn check_mode(mode: ContactMode, tell: &(dyn Fn() + Sync)) -> Result<ModeCheck, AnalysisError> {
    let layout = Layout::new(&mode.spec, Registers::PerReceiver);
    let spectral_radius = judge(&mode.spec, false)?.spectral_radius;
    let product = Product::new(&mode.spec, &layout);
    let routes = ROUTES.into_iter().map(|(name, route)| {
        let compared =
            product.as_ref().map_err(Clone::clone).and_then(|product| product.compare(&mode.spec, route));
        tell();
        RouteCheck::new(name, compared)
    });
    let routes = routes.collect();
    Ok(ModeCheck { contacts: mode.contacts, states: layout.coordinates.len(), spectral_radius, routes })
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
}

impl Product {
    fn new(spec: &LoopSpec, layout: &Layout) -> Result<Self, Incomparable> {
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
        Ok(Self { balanced, scales, structure })
    }

    /// The spectral radius of a route's map, and how far that map is from the product.
    fn compare(&self, spec: &LoopSpec, route: LiftRoute) -> Result<(f64, f64), Incomparable> {
        let map = spec.lift_by(route)?.matrix;
        let scaled =
            DMatrix::from_fn(map.nrows(), map.ncols(), |i, j| map[(i, j)] * self.scales[j] / self.scales[i]);
        let difference = (scaled - &self.balanced).amax() / self.balanced.amax();
        let loose = if self.structure.loose.is_empty() { 0.0 } else { 1.0 };
        let radius = spectral_radius(&poles_of(map, &self.structure)?).max(loose);
        Ok((radius, difference))
    }
}
