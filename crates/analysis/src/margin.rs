//! How far gains, delay, rates and loss are from instability.
//!
//! Each is changed alone, the rest of the scene staying as it is, until the worst contact mode turns unstable.

mod delay;
mod gains;
mod loss;
mod rates;

use cotouch_scene::Scene;
use serde::Serialize;

use crate::stability::analyze;
use crate::sweep::SweepError;
use crate::verdict::Stability;

/// Serialises to the document of `cotouch analyze margin`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Of the scene as it is. Margins of an unstable scene are `None`, and its lists empty.
    pub stable: bool,
    /// Of the scene as it is, as in [`Stability`].
    pub spectral_radius: f64,
    /// The largest delay up to which the scene stays stable from its present delay upwards, in network periods; as
    /// `link.delay_periods` it is the whole delay, not what may be added: its whole part is stable as that key's value,
    /// and the next whole number is not. The fraction is in ticks: a sample used that many ticks later. `None` where
    /// no delay that a scene can have is too long, or where it cannot be told; `notes` says which.
    pub delay_periods: Option<f64>,
    /// The probability, the same and independent for every packet, from which on the mean square of the state no longer
    /// dies out; 1 where only the loss of everything does that. A packet carries all samples from one host to another;
    /// the receiver goes on with what it had. `None` as above.
    pub loss_rate: Option<f64>,
    /// Every spring and damper that acts and is not 0.
    pub gains: Vec<GainMargin>,
    /// The network rate and the haptic rate.
    pub rates: Vec<RateMargin>,
    /// What to know about these numbers, in plain sentences.
    pub notes: Vec<String>,
}

/// How far one gain is from instability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GainMargin {
    /// A scene key. Keys that follow from it follow.
    pub key: String,
    /// Its value in the scene.
    pub value: f64,
    /// The smallest factor above 1 at which the scene turns unstable, up to 10⁴ or the largest allowed value.
    pub factor: Option<f64>,
    /// The largest factor below 1 at which it does, down to 10⁻⁴; 0 where only leaving the gain out altogether does.
    pub lower_factor: Option<f64>,
}

/// How low one rate may be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateMargin {
    /// A scene key.
    pub key: String,
    /// The lowest rate down to which the scene stays stable, among those with a whole number N of haptic ticks a
    /// network step: the network rate as haptic rate over N with N rising, the haptic rate as N times the network rate
    /// with N falling. `None` where no such rate was found to be too low. A delay in network periods takes longer
    /// at a lower network rate.
    pub hz: Option<f64>,
    /// `hz` over the scene's rate.
    pub factor: Option<f64>,
}

fn go_on(wanted: bool) -> Result<(), SweepError> {
    if wanted { Ok(()) } else { Err(SweepError::GivenUp) }
}

/// A margin, or why there is none.
pub(crate) type Found<T> = Result<T, String>;

/// All margins of a scene, on all cores. `progress` is told the share that is done, and says whether to go on.
///
/// # Errors
/// When the scene cannot be analysed, or `progress` said no.
pub fn margins(scene: &Scene, progress: &(dyn Fn(f64) -> bool + Sync)) -> Result<Margins, SweepError> {
    let verdict = analyze(scene)?;
    let mut margins = Margins {
        stable: verdict.stable,
        spectral_radius: verdict.spectral_radius,
        delay_periods: None,
        loss_rate: None,
        gains: Vec::new(),
        rates: Vec::new(),
        notes: Vec::new(),
    };
    if !verdict.stable {
        margins.notes.push(which_is_unstable(&verdict));
        return Ok(margins);
    }
    margins.gains =
        gains::margins(scene, verdict.states * verdict.modes.len(), &|share| progress(0.6 * share))?;
    margins.delay_periods = noted(delay::margin(scene)?, &mut margins.notes);
    if margins.delay_periods.is_some() && scene.schedule().steps_per_pattern() != 1 {
        margins.notes.push(
            "Delays were tried in whole periods only, because a network period is no whole number of ticks."
                .to_owned(),
        );
    }
    go_on(progress(0.7))?;
    margins.rates = rates::margins(scene, &mut margins.notes)?;
    go_on(progress(0.8))?;
    let loss = noted(loss::margin(scene, &|share| progress(0.8 + 0.2 * share))?, &mut margins.notes);
    margins.loss_rate = loss.map(|limit| limit.unwrap_or(1.0));
    if loss == Some(None) {
        margins.notes.push(format!(
            "The mean square dies out up to a loss of {} %; when everything is lost, nothing ties the parts.",
            100.0 * loss::HIGHEST
        ));
    }
    progress(1.0);
    Ok(margins)
}

fn noted<T>(found: Found<T>, notes: &mut Vec<String>) -> Option<T> {
    found.map_err(|note| notes.push(note)).ok()
}

fn which_is_unstable(verdict: &Stability) -> String {
    let worst = verdict.modes.iter().filter(|mode| !mode.stable);
    let worst = worst.max_by(|a, b| a.spectral_radius.total_cmp(&b.spectral_radius));
    let contacts = worst.map_or(&[][..], |mode| &mode.contacts[..]);
    let contacts = if contacts.is_empty() {
        "without contact".to_owned()
    } else {
        format!("with contact {}", contacts.join(" + "))
    };
    let alone = if verdict.modes.len() > 1 { format!(" ({contacts})") } else { String::new() };
    format!(
        "The scene is unstable as it is: spectral radius {:.6} a pattern{alone}. There are no margins.",
        verdict.spectral_radius
    )
}

/// Whether a variant of a scene is stable; `None` where it is too large to be analysed.
fn is_stable(scene: &Scene) -> Result<Option<bool>, SweepError> {
    match analyze(scene) {
        Ok(verdict) => Ok(Some(verdict.stable)),
        Err(error) if error.is_too_large() => Ok(None),
        Err(error) => Err(error.into()),
    }
}
