//! A scene's soft body, prepared once for all its contact modes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use cotouch_scene::Scene;
use cotouch_scene::scene::Soft;
use cotouch_scene::time::Rate;
use cotouch_soft::{LinearBody, MaterialPoint, SoftBody, soft_body};
use glam::DVec3;
use nalgebra::DMatrix;

use super::contacts::{Anchor, anchors};
use super::error::SoftAnalysisError;
use super::reduction::{NEGLIGIBLE, NEGLIGIBLE_IN_LOOP, by_krylov};
use super::slow_body::SlowBody;
use crate::loop_spec::LoopBody;

/// A scene's soft body as all its fingers see it.
#[derive(Debug)]
pub(crate) struct Prepared {
    key: Key,
    pub(super) anchors: Vec<Anchor>,
    /// Of all anchors, m/N.
    compliance: DMatrix<f64>,
    linear: LinearBody,
    /// In as few coordinates as a Krylov subspace takes.
    whole: SlowBody,
    /// Of that, what all fingers together can tell.
    body: SlowBody,
    pub(super) converged: bool,
    /// Seen from some of the fingers, in as few coordinates as that takes.
    seen: Mutex<BTreeMap<Vec<usize>, SlowBody>>,
}

/// What a prepared body depends on.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    soft: Soft,
    gravity_m_per_s2: DVec3,
    simulation_hz: Rate,
    fingers_m: Vec<DVec3>,
}

/// Bodies that were prepared before: preparing takes longer than analysing.
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    known: Mutex<Vec<Arc<Prepared>>>,
}

/// Compliance between axes below this share of the whole is rounding.
const UNTIED: f64 = 1e-12;

/// So many are remembered.
const MAX_KNOWN: usize = 8;

impl Bodies {
    pub(crate) fn prepared(&self, scene: &Scene) -> Result<Arc<Prepared>, SoftAnalysisError> {
        let key = Key::new(scene);
        let lock = || self.known.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = lock().iter().find(|known| known.key == key) {
            return Ok(known.clone());
        }
        let prepared = Arc::new(Prepared::new(scene, key)?);
        let mut known = lock();
        known.insert(0, prepared.clone());
        known.truncate(MAX_KNOWN);
        Ok(prepared)
    }
}

impl Key {
    fn new(scene: &Scene) -> Self {
        let fingers = scene.users.iter().flat_map(|user| &user.fingers);
        Self {
            soft: scene.soft.clone(),
            gravity_m_per_s2: scene.gravity_m_per_s2,
            simulation_hz: scene.rates.simulation_hz,
            fingers_m: fingers.map(|finger| finger.position_m).collect(),
        }
    }
}

impl Prepared {
    fn new(scene: &Scene, key: Key) -> Result<Self, SoftAnalysisError> {
        let body = soft_body(scene)?;
        let anchors = anchors(scene, body.rest_m(), body.triangles());
        let points: Vec<MaterialPoint> = anchors.iter().map(|anchor| anchor.point).collect();
        let compliance = body.compliance(&points).ok_or(SoftAnalysisError::NoCompliance)?;
        let linear = at_rest(&*body)?;
        let (whole, converged) = by_krylov(&linear, &points);
        let body = whole.balanced(NEGLIGIBLE_IN_LOOP);
        Ok(Self { key, anchors, compliance, linear, whole, body, converged, seen: Mutex::default() })
    }

    /// The body as it is seen from some of the fingers; all of it where that is none, for then nothing moves but itself.
    pub(super) fn seen_from(&self, fingers: &[usize]) -> SlowBody {
        if fingers.is_empty() {
            return self.whole.seen_from(fingers);
        }
        let lock = || self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = lock().get(fingers) {
            return known.clone();
        }
        let body = self.body.seen_from(fingers).balanced(NEGLIGIBLE);
        lock().insert(fingers.to_vec(), body.clone());
        body
    }

    pub(super) fn exact(&self, fingers: &[usize]) -> Result<SlowBody, SoftAnalysisError> {
        let points: Vec<MaterialPoint> = fingers.iter().map(|&finger| self.anchors[finger].point).collect();
        Ok(SlowBody::exact(&self.linear, &points)?)
    }

    /// Axes along which no finger moves and that do not yield to forces along the others.
    pub(super) fn idle_axes(&self, hands: &[LoopBody]) -> [bool; 3] {
        let moves =
            |axis: usize| hands.iter().any(|hand| hand.axes.iter().any(|dof| dof.axis().index() == axis));
        let (moved, size) = ([0, 1, 2].map(moves), self.compliance.amax());
        let is_tied = |axis: usize, other: usize| {
            let places = |of: usize| (of..self.compliance.nrows()).step_by(3).collect::<Vec<_>>();
            let block = self.compliance.select_rows(&places(axis)).select_columns(&places(other));
            block.amax() > UNTIED * size
        };
        [0, 1, 2].map(|axis| !moved[axis] && !(0..3).any(|other| moved[other] && is_tied(axis, other)))
    }

    /// W of some of the fingers.
    pub(super) fn compliance(&self, fingers: &[usize]) -> DMatrix<f64> {
        let places: Vec<usize> = fingers.iter().flat_map(|finger| 3 * finger..3 * finger + 3).collect();
        self.compliance.select_rows(&places).select_columns(&places)
    }
}

fn at_rest(body: &dyn SoftBody) -> Result<LinearBody, SoftAnalysisError> {
    body.linear().ok_or(SoftAnalysisError::NoLinearisation)
}
