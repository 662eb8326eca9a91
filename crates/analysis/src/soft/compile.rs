//! From a scene with a soft object to the loops of its contact modes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, LocalModelKind, Soft, WallSides};
use cotouch_scene::time::Rate;
use cotouch_soft::{LinearBody, MaterialPoint, SoftBody, soft_body};
use glam::DVec3;
use nalgebra::DMatrix;

use super::contacts::{Anchor, anchors};
use super::reduction::by_krylov;
use super::slow_body::SlowBody;
use super::{Hand, SoftAnalysisError, SoftLoop, Touch, Way, World};
use crate::compile::{compile_at, delay, sets_of_fingers};
use crate::operating_point::OperatingPoint;

/// With more fingers than this, not every set of them is analysed.
const MOST_SETS: usize = 16;

/// The loop of a scene while a given set of fingers touches.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SoftMode {
    pub(super) contacts: Vec<String>,
    pub(super) of: SoftLoop,
    /// Fingers that touch nothing.
    pub(super) free: Vec<Hand>,
}

/// All modes, and what was left out, in plain sentences.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SoftModes {
    pub(super) modes: Vec<SoftMode>,
    pub(super) notes: Vec<String>,
}

/// A scene's soft body as all its fingers see it.
#[derive(Debug)]
pub(crate) struct Prepared {
    key: Key,
    anchors: Vec<Anchor>,
    /// Of all anchors, m/N.
    compliance: DMatrix<f64>,
    linear: LinearBody,
    body: SlowBody,
    converged: bool,
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
const MOST_KNOWN: usize = 8;

impl Bodies {
    pub(crate) fn of(&self, scene: &Scene) -> Result<Arc<Prepared>, SoftAnalysisError> {
        let key = Key::of(scene);
        let lock = || self.known.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = lock().iter().find(|known| known.key == key) {
            return Ok(known.clone());
        }
        let prepared = Arc::new(Prepared::new(scene, key)?);
        let mut known = lock();
        known.insert(0, prepared.clone());
        known.truncate(MOST_KNOWN);
        Ok(prepared)
    }
}

impl Key {
    fn of(scene: &Scene) -> Self {
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
        let (body, converged) = by_krylov(&linear, &points);
        Ok(Self { key, anchors, compliance, linear, body, converged, seen: Mutex::default() })
    }

    fn seen_from(&self, fingers: &[usize]) -> SlowBody {
        let lock = || self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = lock().get(fingers) {
            return known.clone();
        }
        let body = self.body.seen_from(fingers).balanced();
        lock().insert(fingers.to_vec(), body.clone());
        body
    }

    fn exact(&self, fingers: &[usize]) -> Result<SlowBody, SoftAnalysisError> {
        let points: Vec<MaterialPoint> = fingers.iter().map(|&finger| self.anchors[finger].point).collect();
        Ok(SlowBody::exact(&self.linear, &points)?)
    }

    /// Axes along which no finger moves and that do not yield to forces along the others.
    fn idle_axes(&self, hands: &[Hand]) -> [bool; 3] {
        let moves = |axis: usize| {
            hands.iter().any(|hand| hand.body.axes.iter().any(|dof| dof.axis().index() == axis))
        };
        let (moved, size) = ([0, 1, 2].map(moves), self.compliance.amax());
        let is_tied = |axis: usize, other: usize| {
            let places = |of: usize| (of..self.compliance.nrows()).step_by(3).collect::<Vec<_>>();
            let block = self.compliance.select_rows(&places(axis)).select_columns(&places(other));
            block.amax() > UNTIED * size
        };
        [0, 1, 2].map(|axis| !moved[axis] && !(0..3).any(|other| moved[other] && is_tied(axis, other)))
    }

    /// W of some of the fingers.
    fn compliance(&self, fingers: &[usize]) -> DMatrix<f64> {
        let places: Vec<usize> = fingers.iter().flat_map(|finger| 3 * finger..3 * finger + 3).collect();
        self.compliance.select_rows(&places).select_columns(&places)
    }
}

fn at_rest(body: &dyn SoftBody) -> Result<LinearBody, SoftAnalysisError> {
    body.linear().ok_or(SoftAnalysisError::NoLinearisation)
}

/// Every contact mode: two-sided contacts are always closed; of one-sided ones, every set of fingers.
pub(crate) fn modes(scene: &Scene, bodies: &Bodies) -> Result<SoftModes, SoftAnalysisError> {
    let prepared = bodies.of(scene)?;
    let hands = hands(scene);
    let mut notes = Vec::new();
    let users: Vec<HostIndex> = hands.iter().map(|hand| hand.user).collect();
    let sets = match scene.local_model.sides {
        WallSides::Two => vec![(0..hands.len()).collect()],
        WallSides::One => sets_of_fingers(&users, MOST_SETS, &mut notes),
    };
    if !prepared.converged {
        notes.push(
            "The soft body was reduced to fewer coordinates than its contacts can tell from all.".into(),
        );
    }
    let modes = sets.into_iter().map(|set| SoftMode::new(scene, &prepared, &hands, &set));
    Ok(SoftModes { modes: modes.collect::<Result<_, _>>()?, notes })
}

/// The loop of a scene with every finger in contact, its body in all its coordinates: for comparison with the running
/// session, on small meshes.
///
/// # Errors
/// When the scene has no soft object that can be linearised.
pub fn compile_unreduced(scene: &Scene) -> Result<SoftLoop, SoftAnalysisError> {
    let prepared = Bodies::default().of(scene)?;
    let hands = hands(scene);
    let set: Vec<usize> = (0..hands.len()).collect();
    let body = prepared.exact(&set)?;
    soft_loop(scene, &prepared, &hands, &set, body)
}

impl SoftMode {
    fn new(
        scene: &Scene,
        prepared: &Prepared,
        hands: &[Hand],
        set: &[usize],
    ) -> Result<Self, SoftAnalysisError> {
        let of = soft_loop(scene, prepared, hands, set, prepared.seen_from(set))?;
        let of = SoftLoop { idle_axes: prepared.idle_axes(hands), ..of };
        let name = |&hand: &usize| {
            let Hand { user, finger, .. } = hands[hand];
            format!("{}.finger{}", scene.users[user.index()].name, finger + 1)
        };
        let free = (0..hands.len()).filter(|hand| !set.contains(hand)).map(|hand| hands[hand].clone());
        Ok(Self { contacts: set.iter().map(name).collect(), of, free: free.collect() })
    }
}

fn hands(scene: &Scene) -> Vec<Hand> {
    let bodies = compile_at(scene, &OperatingPoint::free(scene)).bodies;
    let fingers = scene.hosts().flat_map(|user| {
        let count = scene.users[user.index()].fingers.len() as u8;
        (0..count).map(move |finger| (user, finger))
    });
    let damping_n_s_per_m = scene.governor.damping_n_s_per_m;
    let hand = |(slot, ((user, finger), body))| Hand { user, finger, slot, body, damping_n_s_per_m };
    (0..).zip(fingers.zip(bodies)).map(hand).collect()
}

fn soft_loop(
    scene: &Scene,
    prepared: &Prepared,
    hands: &[Hand],
    set: &[usize],
    body: SlowBody,
) -> Result<SoftLoop, SoftAnalysisError> {
    let local = &scene.local_model;
    let hosts: Vec<HostIndex> = match scene.session.architecture {
        Architecture::Centralized => vec![HostIndex::FIRST],
        Architecture::Distributed => scene.hosts().collect(),
    };
    let world = |&host: &HostIndex| world(scene, prepared, hands, set, host, body.clone());
    Ok(SoftLoop {
        network: scene.schedule(),
        slow: scene.slow_schedule(),
        kind: local.kind,
        returned_force: local.returned_force,
        hold: local.hold,
        result_delay_periods: local.result_delay_periods,
        idle_axes: [false; 3],
        worlds: hosts.iter().map(world).collect::<Result<_, _>>()?,
        hands: set.iter().map(|&hand| hands[hand].clone()).collect(),
    })
}

fn world(
    scene: &Scene,
    prepared: &Prepared,
    hands: &[Hand],
    set: &[usize],
    host: HostIndex,
    body: SlowBody,
) -> Result<World, SoftAnalysisError> {
    let local = &scene.local_model;
    let compliance = prepared.compliance(set);
    let stiffnesses = stiffnesses(&compliance)?;
    let or_ratio = |gain: f64, ratio: f64| -> Vec<f64> {
        stiffnesses.iter().map(|ko_n_per_m| if gain > 0.0 { gain } else { ratio * ko_n_per_m }).collect()
    };
    let touch = |(place, &hand): (usize, &usize)| {
        let user = hands[hand].user;
        let away = user != host;
        let centralized = scene.session.architecture == Architecture::Centralized;
        Touch {
            hand: place,
            way: if away { Way::Samples(delay(scene, user, host)) } else { Way::Own },
            force_back: (away && centralized).then(|| delay(scene, host, user)),
            normal: prepared.anchors[hand].normal,
        }
    };
    Ok(World {
        host,
        touches: set.iter().enumerate().map(touch).collect(),
        body,
        kh_n_per_m: or_ratio(local.stiffness_n_per_m, local.stiffness_ratio),
        int_n_per_m: or_ratio(local.integral_n_per_m, local.integral_ratio),
        compliance: (local.kind == LocalModelKind::Compliance).then_some(compliance),
    })
}

/// K_o of every contact of a joint compliance (three rows each), N/m: `1/(λ·c_i)`, `c_i` being the largest eigenvalue of its
/// own compliance and `λ` that of the joint one in units of these.
fn stiffnesses(compliance: &DMatrix<f64>) -> Result<Vec<f64>, SoftAnalysisError> {
    let largest = |matrix: DMatrix<f64>| ((&matrix + matrix.transpose()) * 0.5).symmetric_eigenvalues().max();
    let own = |contact: usize| match largest(compliance.view((3 * contact, 3 * contact), (3, 3)).into()) {
        own if own > 0.0 => Ok(own),
        _ => Err(SoftAnalysisError::Rigid),
    };
    let own: Vec<f64> = (0..compliance.nrows() / 3).map(own).collect::<Result<_, _>>()?;
    if own.is_empty() {
        return Ok(own);
    }
    let scale = DMatrix::from_fn(compliance.nrows(), compliance.ncols(), |row, column| {
        (own[row / 3] * own[column / 3]).sqrt().recip()
    });
    let joint = largest(compliance.component_mul(&scale));
    Ok(own.iter().map(|own| (joint * own).recip()).collect())
}
