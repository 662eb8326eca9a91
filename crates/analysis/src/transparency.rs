//! What users perceive of the object: admittance, added damping, equivalent stiffness (Fotoohi Ghiam 2006, ch. 6).
//!
//! One user moves the object while the others are absent, their hosts' copies of it still there (Fig 6.1 (a)–(c)). The
//! user's force acts on the hand; what the hand does is the answer.
//!
//! - [`admittance`]: over frequency, twice. The *slow-rate response* is Fotoohi Ghiam 2006, (6.1): the force is held
//!   over each network period and the hand is read at network instants only, `G(z) = C·(zI − A)⁻¹·B`, `z = e^(jωT_t)`. The
//!   *fundamental* is what a continuous sinusoidal force meets: the hand answers with `e^(jωt)` times something that repeats
//!   with every pattern, of which this is the mean. It is exact too: force and Fourier filter are part of the plant whose
//!   matrix exponential is taken.
//! - [`added_damping`]: (6.2), the limit of F/V for z → 1, from the structure of the loop and not from small frequencies.
//! - [`equivalent_stiffness`]: F/X at rest.
//!
//! Scenes with several directions are looked at along one line ([`Reduction`]), as in Fotoohi Ghiam 2006.
//!
//! # Example
//! Held data brake: the remote user of a centralized session feels (B.10).
//!
//! ```
//! use cotouch_analysis::transparency::{added_damping, closed_forms};
//! use cotouch_scene::names::HostIndex;
//! let settings = ["rates.network_hz=512", "link.delay_periods=0"].map(|setting| setting.parse().unwrap());
//! let scene = cotouch_scene::load("single-axis-centralized", &settings).unwrap();
//! let local = added_damping(&scene, HostIndex(0)).unwrap();
//! let remote = added_damping(&scene, HostIndex(1)).unwrap();
//! assert_eq!(local.damping_n_s_per_m, Some(0.0));
//! let expected = closed_forms::centralized_remote_damping(&scene);
//! assert!((remote.damping_n_s_per_m.unwrap() - expected).abs() < 1e-9);
//! ```

mod alone;
pub mod closed_forms;
mod drift;
mod one_line;
mod response;
mod source;
mod statics;
mod turning;

use std::f64::consts::PI;

use cotouch_scene::Scene;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, SceneValues};
use nalgebra::Complex;
use serde::Serialize;

use crate::check::SpecError;
use crate::loop_spec::LoopSpec;
use crate::poles::analyze_loop;
use crate::verdict::AnalysisError;
use alone::Held;
use drift::{Drift, drift};
use one_line::OneLine;

pub use one_line::Reduction;
pub use turning::TurningDamping;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransparencyError {
    /// The loop cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// What these numbers describe is a rigid object.
    #[error(
        "admittance, added damping and equivalent stiffness are those of a rigid object; this scene has a soft one (soft.model)"
    )]
    Soft,
    /// Not a frequency.
    #[error("frequencies must be positive and finite, in rad/s; found {0}")]
    Frequency(f64),
    /// Nobody of that number.
    #[error("there is no user {found}; the scene has users 1 to {users}")]
    User {
        /// From 1.
        found: u32,
        /// How many there are.
        users: u8,
    },
}

impl From<SpecError> for TransparencyError {
    fn from(error: SpecError) -> Self {
        Self::Analysis(error.into())
    }
}

/// What users feel over frequency; serialises to the document of `cotouch analyze admittance`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Admittance {
    /// Where it was evaluated.
    pub frequency_rad_s: Vec<f64>,
    /// What answers to the force.
    pub quantity: Answer,
    /// Every user, the others absent, in the order of the scene.
    pub users: Vec<UserAdmittance>,
    /// Fig 6.1 (d): hand and object as one mass, continuous in time.
    pub ideal: IdealAdmittance,
    /// π/T_t: beyond it the slow-rate response repeats itself; the fundamental does not.
    pub slow_rate_limit_rad_s: f64,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub notes: Vec<String>,
}

/// What answers to the force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// In free motion, m/s per N.
    Velocity,
    /// Against a wall, m per N.
    Position,
}

/// What one user feels; every list has one element a frequency. An element is not finite where the loop itself
/// swings at exactly that frequency.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UserAdmittance {
    /// The user's name.
    pub name: String,
    /// Whether the loop of this user alone is stable. Where it is not, it never settles into this response.
    pub stable: bool,
    /// Of the slow-rate response, m/s/N or m/N.
    pub magnitude: Vec<f64>,
    /// Of the slow-rate response, −π to π.
    pub phase_rad: Vec<f64>,
    /// Of the exact fundamental, m/s/N or m/N.
    pub fundamental_magnitude: Vec<f64>,
    /// Of the exact fundamental, −π to π.
    pub fundamental_phase_rad: Vec<f64>,
    /// Force over velocity, of the slow-rate response, N·s/m.
    pub impedance_magnitude: Vec<f64>,
    /// Likewise, −π to π.
    pub impedance_phase_rad: Vec<f64>,
}

/// What a user of an ideal system would feel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdealAdmittance {
    /// Of hand (all fingers) and object together.
    pub mass_kg: f64,
    /// m/s/N or m/N.
    pub magnitude: Vec<f64>,
    /// −π to π.
    pub phase_rad: Vec<f64>,
}

/// What held data add to the damping that a user feels; serialises to the document of `cotouch analyze damping`.
///
/// Dampers to the ground that the scene has (`hand`, `object`, `governor`) are in it. In free motion, whatever walls the
/// scene has. A damping is `None` where a spring ties the hand to the ground, so that no force keeps it moving, and where
/// the loop outgrows floating point. It is a limit of (6.1), which an unstable loop has too without ever coming there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AddedDamping {
    /// Who moves the object.
    pub user: String,
    /// (6.2) of the whole model: that user moving, the others absent, V at the network instants.
    pub damping_n_s_per_m: Option<f64>,
    /// (6.2) of the model of Fig 6.3: no hands, the force acts on every copy.
    pub simplified_damping_n_s_per_m: Option<f64>,
    /// As the first, with the mean velocity instead of that at the network instants: what a slow hand feels.
    pub mean_damping_n_s_per_m: Option<f64>,
    /// What the scene's own dampers to the ground (`hand`, `governor`, `object` on every copy) come to, when all moves as
    /// one: part of the above.
    pub dampers_of_scene_n_s_per_m: f64,
    /// Of the session with all hands on the object: the real pole nearest 1 that is not 1 by structure.
    pub drag_pole: Option<f64>,
    /// `object.damping_n_s_per_m` that cancels the simplified damping, as Fotoohi Ghiam 2006 proposes: it is on every
    /// copy.
    pub compensation_n_s_per_m: Option<f64>,
    /// The first damping, with that compensation.
    pub damping_if_compensated_n_s_per_m: Option<f64>,
    /// The drag pole with that compensation.
    pub drag_pole_if_compensated: Option<f64>,
    /// Whether the session is stable with that compensation.
    pub stable_if_compensated: Option<bool>,
    /// Of turning, about each axis about which the first body turns.
    pub turning: Vec<TurningDamping>,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, and why there is no number, in plain sentences.
    pub notes: Vec<String>,
}

/// What users feel at rest; serialises to the document of `cotouch analyze stiffness`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EquivalentStiffness {
    /// In the order of the scene.
    pub users: Vec<UserStiffness>,
    /// What the ideal system has (6.4): the wall's stiffness, and the hand's own.
    pub ideal_n_per_m: f64,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub notes: Vec<String>,
}

/// What one user feels at rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UserStiffness {
    /// The user's name.
    pub name: String,
    /// Force over displacement; 0 where nothing resists.
    pub stiffness_n_per_m: f64,
}

/// At each of `frequencies_rad_s`: velocity over force in free motion, and position over force where the scene has a
/// wall, with the object against it.
///
/// Frequencies may lie beyond π/T_t: there the slow-rate response repeats itself. Where the network period is no whole
/// number of ticks, the force is held from each network instant to the next, and the hand is read at the first network
/// instant of each pattern.
///
/// # Errors
/// When a frequency is not positive, the loop is too large, or the object is soft.
pub fn admittance(scene: &Scene, frequencies_rad_s: &[f64]) -> Result<Admittance, TransparencyError> {
    if scene.soft.exists() {
        return Err(TransparencyError::Soft);
    }
    if let Some(&found) = frequencies_rad_s.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
        return Err(TransparencyError::Frequency(found));
    }
    let line = OneLine::at_wall(scene);
    let quantity = if scene.wall.exists() { Answer::Position } else { Answer::Velocity };
    let spec = line.spec();
    let users = line.scene.hosts().map(|user| {
        let name = line.scene.users[user.index()].name.clone();
        user_admittance(&Held::by_hand(&spec, user), name, quantity, frequencies_rad_s)
    });
    let users = users.collect::<Result<_, _>>()?;
    Ok(Admittance {
        frequency_rad_s: frequencies_rad_s.to_vec(),
        quantity,
        users,
        ideal: ideal_admittance(&line.scene, quantity, frequencies_rad_s),
        slow_rate_limit_rad_s: PI * line.scene.rates.network_hz.hz(),
        reduction: line.reduction,
        notes: line.notes,
    })
}

fn user_admittance(
    held: &Held,
    name: String,
    quantity: Answer,
    frequencies_rad_s: &[f64],
) -> Result<UserAdmittance, TransparencyError> {
    // Refuses what is too large, too.
    let stable = analyze_loop(&held.spec)?.stable;
    let mut user = UserAdmittance {
        name,
        stable,
        magnitude: Vec::new(),
        phase_rad: Vec::new(),
        fundamental_magnitude: Vec::new(),
        fundamental_phase_rad: Vec::new(),
        impedance_magnitude: Vec::new(),
        impedance_phase_rad: Vec::new(),
    };
    for &frequency in frequencies_rad_s {
        let per_second = Complex::new(0.0, frequency);
        let velocity = response::fundamental(held, frequency)?;
        let (slow_rate, fundamental, impedance) = match quantity {
            Answer::Velocity => {
                let slow_rate = response::slow_rate(held, 1, frequency)?;
                (slow_rate, velocity, slow_rate.inv())
            }
            Answer::Position => {
                let slow_rate = response::slow_rate(held, 0, frequency)?;
                (slow_rate, velocity / per_second, (slow_rate * per_second).inv())
            }
        };
        user.magnitude.push(slow_rate.norm());
        user.phase_rad.push(slow_rate.arg());
        user.fundamental_magnitude.push(fundamental.norm());
        user.fundamental_phase_rad.push(fundamental.arg());
        user.impedance_magnitude.push(impedance.norm());
        user.impedance_phase_rad.push(impedance.arg());
    }
    Ok(user)
}

/// `m·s + b + k/s` of one mass with the hand's own damper and spring, and the wall's.
fn ideal_admittance(line: &SceneValues, quantity: Answer, frequencies_rad_s: &[f64]) -> IdealAdmittance {
    let fingers = fingers(line);
    let mass_kg = fingers * line.hand.mass_kg + line.object.mass_kg;
    let damping = fingers * line.hand.damping_n_s_per_m + line.wall.damping_n_s_per_m;
    let stiffness = ideal_stiffness(line);
    let answer = |&frequency: &f64| {
        let per_second = Complex::new(0.0, frequency);
        let velocity = (per_second * mass_kg + damping + per_second.inv() * stiffness).inv();
        if quantity == Answer::Velocity { velocity } else { velocity / per_second }
    };
    let answers: Vec<_> = frequencies_rad_s.iter().map(answer).collect();
    IdealAdmittance {
        mass_kg,
        magnitude: answers.iter().map(|answer| answer.norm()).collect(),
        phase_rad: answers.iter().map(|answer| answer.arg()).collect(),
    }
}

/// Of one user; all have as many.
fn fingers(scene: &SceneValues) -> f64 {
    scene.users.first().map_or(1.0, |user| user.fingers.len() as f64)
}

fn ideal_stiffness(line: &SceneValues) -> f64 {
    line.wall.stiffness_n_per_m + fingers(line) * line.hand.stiffness_n_per_m
}

/// What held data add to the damping that `user` feels, and what Fotoohi Ghiam's compensation does about it.
///
/// # Errors
/// When there is no such user, the loop is too large, or the object is soft.
pub fn added_damping(scene: &Scene, user: HostIndex) -> Result<AddedDamping, TransparencyError> {
    if scene.soft.exists() {
        return Err(TransparencyError::Soft);
    }
    let users = scene.session.users;
    if user.index() >= usize::from(users) {
        return Err(TransparencyError::User { found: u32::from(user.0) + 1, users });
    }
    let OneLine { scene: line, reduction, mut notes } = OneLine::free(scene);
    let Compensated { before, compensation, after } = Compensated::of_session(&line, user)?;
    notes.extend(before.why_none.map(str::to_owned));
    Ok(AddedDamping {
        user: scene.users[user.index()].name.clone(),
        damping_n_s_per_m: before.damping,
        simplified_damping_n_s_per_m: before.simplified,
        mean_damping_n_s_per_m: before.mean_damping,
        dampers_of_scene_n_s_per_m: dampers(&line),
        drag_pole: before.drag_pole,
        compensation_n_s_per_m: compensation,
        damping_if_compensated_n_s_per_m: after.and_then(|after| after.damping),
        drag_pole_if_compensated: after.and_then(|after| after.drag_pole),
        stable_if_compensated: after.map(|after| after.stable),
        turning: turning::about_axes(scene, user)?,
        reduction,
        notes,
    })
}

/// To the ground, of one user's hand and all copies.
fn dampers(line: &SceneValues) -> f64 {
    let copies = match line.session.architecture {
        Architecture::Centralized => 1.0,
        Architecture::Distributed => f64::from(line.session.users),
    };
    fingers(line) * (line.hand.damping_n_s_per_m + line.governor.damping_n_s_per_m)
        + copies * (line.object.damping_n_s_per_m + line.object.axis_damping_n_s_per_m.x)
}

/// A scene on a line, in free motion, with and without compensation.
struct Compensated {
    before: Viscous,
    /// N·s/m, of every copy.
    compensation: Option<f64>,
    after: Option<Viscous>,
}

/// How a scene on a line brakes.
#[derive(Clone, Copy)]
struct Viscous {
    damping: Option<f64>,
    mean_damping: Option<f64>,
    simplified: Option<f64>,
    drag_pole: Option<f64>,
    stable: bool,
    why_none: Option<&'static str>,
}

impl Compensated {
    /// With hands.
    fn of_session(line: &SceneValues, user: HostIndex) -> Result<Self, TransparencyError> {
        Self::new(line, &|line| Viscous::new(&spec(line), Some(user), user))
    }

    /// Copies that nobody holds.
    fn of_copies(line: &SceneValues, user: HostIndex) -> Result<Self, TransparencyError> {
        Self::new(line, &|line| Viscous::new(&Held::directly(&spec(line), user).spec, None, user))
    }

    fn new(
        line: &SceneValues,
        viscous: &dyn Fn(&SceneValues) -> Result<Viscous, TransparencyError>,
    ) -> Result<Self, TransparencyError> {
        let before = viscous(line)?;
        let Some(simplified) = before.simplified else {
            return Ok(Self { before, compensation: None, after: None });
        };
        let mut compensated = line.clone();
        compensated.object.damping_n_s_per_m -= simplified;
        let compensation = Some(compensated.object.damping_n_s_per_m);
        Ok(Self { before, compensation, after: Some(viscous(&compensated)?) })
    }
}

impl Viscous {
    fn new(spec: &LoopSpec, hand: Option<HostIndex>, user: HostIndex) -> Result<Self, TransparencyError> {
        let session = analyze_loop(spec)?;
        let by_hand = hand.map(|user| drift(&Held::by_hand(spec, user))).transpose()?;
        let simplified = drift(&Held::directly(spec, user))?;
        Ok(Self {
            damping: by_hand.and_then(|drift| drift.damping(|at_instants, _| at_instants)),
            mean_damping: by_hand.and_then(|drift| drift.damping(|_, mean| mean)),
            simplified: simplified.damping(|at_instants, _| at_instants),
            drag_pole: session.drag_pole,
            stable: session.stable,
            why_none: by_hand.and_then(Drift::why_no_damping),
        })
    }
}

fn spec(line: &SceneValues) -> LoopSpec {
    crate::compile::compile(line).swap_remove(0).spec
}

/// Of every user, the others absent, the object against the wall if there is one.
///
/// # Errors
/// When the scene cannot be analysed, or its object is soft.
pub fn equivalent_stiffness(scene: &Scene) -> Result<EquivalentStiffness, TransparencyError> {
    if scene.soft.exists() {
        return Err(TransparencyError::Soft);
    }
    let line = OneLine::at_wall(scene);
    let spec = line.spec();
    crate::check::check(&spec)?;
    let of_user = |user: HostIndex| UserStiffness {
        name: line.scene.users[user.index()].name.clone(),
        stiffness_n_per_m: statics::stiffness(&Held::by_hand(&spec, user)),
    };
    Ok(EquivalentStiffness {
        users: line.scene.hosts().map(of_user).collect(),
        ideal_n_per_m: ideal_stiffness(&line.scene),
        reduction: line.reduction,
        notes: line.notes,
    })
}
