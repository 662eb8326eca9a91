//! Admittance over frequency.

use std::f64::consts::PI;

use cotouch_scene::Scene;
use cotouch_scene::scene::SceneValues;
use nalgebra::Complex;
use serde::Serialize;

use super::alone::Held;
use super::error::TransparencyError;
use super::one_line::{OneLine, Reduction, fingers, ideal_stiffness};
use super::response;
use crate::poles::analyze_loop;

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
