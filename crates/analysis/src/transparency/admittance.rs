//! Admittance over frequency.

use std::f64::consts::PI;

use cotouch_scene::Scene;
use nalgebra::Complex;
use serde::Serialize;

use super::error::TransparencyError;
use super::one_line::Reduction;
use super::response;
use super::user_loops::{AdmittanceQuantity, Ideal, UserLoop, UserLoops};
use crate::poles::analyze_loop;

/// What users feel over frequency; serialises to the document of `cotouch analyze admittance`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Admittance {
    /// Where it was evaluated.
    pub frequency_rad_s: Vec<f64>,
    /// What answers to the force.
    pub quantity: AdmittanceQuantity,
    /// Every user, the others absent, in the order of the scene.
    pub users: Vec<UserAdmittance>,
    /// Of the first user; around a rigid object, of all.
    pub ideal: IdealAdmittance,
    /// π/T_t: beyond it the slow-rate response repeats itself; the fundamental does not.
    pub slow_rate_limit_rad_s: f64,
    /// Whether the scene was brought to one line.
    pub reduction: Reduction,
    /// What was left out or changed, in plain sentences.
    pub notes: Vec<String>,
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
    /// Fig 6.1 (d): hand and rigid object as one mass, continuous in time; or the hand on a soft object's stiffness.
    pub ideal: IdealAdmittance,
}

/// What a user of an ideal system would feel.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct IdealAdmittance {
    /// Of hand (all fingers) and rigid object together.
    pub mass_kg: f64,
    /// m/s/N or m/N.
    pub magnitude: Vec<f64>,
    /// −π to π.
    pub phase_rad: Vec<f64>,
}

/// At each of `frequencies_rad_s`: velocity over force in free motion, and position over force where the scene has a
/// wall, with the object against it, or a soft object, which is held to the ground.
///
/// Frequencies may lie beyond π/T_t: there the slow-rate response repeats itself. Where the network period is no whole
/// number of ticks, the force is held from each network instant to the next, and the hand is read at the first network
/// instant of each pattern.
///
/// # Errors
/// When a frequency is not positive, or the scene cannot be analysed.
pub fn admittance(scene: &Scene, frequencies_rad_s: &[f64]) -> Result<Admittance, TransparencyError> {
    if let Some(&found) = frequencies_rad_s.iter().find(|value| !(value.is_finite() && **value > 0.0)) {
        return Err(TransparencyError::Frequency(found));
    }
    let UserLoops { users, quantity, reduction, notes } = UserLoops::new(scene)?;
    let users = users.into_iter().map(|user| user_admittance(user, quantity, frequencies_rad_s));
    let users = users.collect::<Result<Vec<_>, _>>()?;
    Ok(Admittance {
        frequency_rad_s: frequencies_rad_s.to_vec(),
        quantity,
        ideal: users.first().map(|user| user.ideal.clone()).unwrap_or_default(),
        users,
        slow_rate_limit_rad_s: PI * scene.rates.network_hz.hz(),
        reduction,
        notes,
    })
}

fn user_admittance(
    user: UserLoop,
    quantity: AdmittanceQuantity,
    frequencies_rad_s: &[f64],
) -> Result<UserAdmittance, TransparencyError> {
    let UserLoop { name, held, ideal } = user;
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
        ideal: ideal_admittance(ideal, quantity, frequencies_rad_s),
    };
    for &frequency in frequencies_rad_s {
        let per_second = Complex::new(0.0, frequency);
        let velocity = response::fundamental(&held, frequency)?;
        let (slow_rate, fundamental, impedance) = match quantity {
            AdmittanceQuantity::Velocity => {
                let slow_rate = response::slow_rate(&held, 1, frequency)?;
                (slow_rate, velocity, slow_rate.inv())
            }
            AdmittanceQuantity::Position => {
                let slow_rate = response::slow_rate(&held, 0, frequency)?;
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

/// `m·s + b + k/s`.
fn ideal_admittance(
    ideal: Ideal,
    quantity: AdmittanceQuantity,
    frequencies_rad_s: &[f64],
) -> IdealAdmittance {
    let Ideal { mass_kg, damping_n_s_per_m: damping, stiffness_n_per_m: stiffness } = ideal;
    let answer = |&frequency: &f64| {
        let per_second = Complex::new(0.0, frequency);
        let velocity = (per_second * mass_kg + damping + per_second.inv() * stiffness).inv();
        if quantity == AdmittanceQuantity::Velocity { velocity } else { velocity / per_second }
    };
    let answers: Vec<_> = frequencies_rad_s.iter().map(answer).collect();
    IdealAdmittance {
        mass_kg,
        magnitude: answers.iter().map(|answer| answer.norm()).collect(),
        phase_rad: answers.iter().map(|answer| answer.arg()).collect(),
    }
}
