//! What margins are, and what their searches share.

use cotouch_scene::Scene;
use serde::Serialize;

use crate::outage::Outage;
use crate::sweep::SweepError;
use crate::variants::Variants;

/// Serialises to the document of `cotouch analyze margin`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Whether each analysed mode of the scene as it is is stable. Margins of an unstable scene are `None`, and its lists empty.
    pub stable: bool,
    /// Of the scene as it is, as in [`Stability`](crate::Stability).
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
    /// How many packets may be lost at longer delays, from the scene's upwards, as far as the delay may grow and no farther
    /// than a few periods.
    pub delay_and_loss: Vec<DelayAndLoss>,
    /// Every spring and damper that acts and is not 0.
    pub gains: Vec<GainMargin>,
    /// The network rate and the haptic rate, each lowered alone.
    pub rates: Vec<RateMargin>,
    /// The haptic rate down to which the scene stays stable where the network rate is lowered by the same factor (one bus
    /// that carries both), Hz; `None` where no limit was found, which `notes` tells.
    pub rates_together_hz: Option<f64>,
    /// The same over the scene's haptic rate.
    pub rates_together_factor: Option<f64>,
    /// What hands feel after no packet arrived for a while.
    pub outages: Vec<Outage>,
    /// Of an unstable scene: single changes that make it stable, the smallest first.
    pub cures: Vec<Cure>,
    /// What to know about these numbers, in plain sentences.
    pub notes: Vec<String>,
}

/// How many packets may be lost at a delay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DelayAndLoss {
    /// As `link.delay_periods`.
    pub delay_periods: u32,
    /// As [`Margins::loss_rate`] at this delay.
    pub loss_rate: Option<f64>,
}

/// A change of one value that makes an unstable scene stable: every contact mode of the changed scene was analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cure {
    /// A scene key. Keys that follow from it follow.
    pub key: String,
    /// Its value in the scene.
    pub value: f64,
    /// What makes the scene stable. A gain is by 5 % beyond `limit`, by 2 or 1 % where it must not be so far; a delay or
    /// a rate is the nearest whole number of periods or of ticks a period.
    pub to: f64,
    /// The value of a gain at which the scene turns stable.
    pub limit: Option<f64>,
    /// Of the changed scene, as in [`Stability`](crate::Stability).
    pub spectral_radius: f64,
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
    /// The rate at which, from the scene's downwards, it first turns unstable, Hz, to 1e-3 of it; rates are looked at
    /// down to 1/64, but the haptic rate no lower than the network rate. `None` where no limit was found: `notes` says how low
    /// it was looked. A delay in network periods takes longer at a lower network rate.
    pub hz: Option<f64>,
    /// `hz` over the scene's rate.
    pub factor: Option<f64>,
}

/// # Errors
/// When who asked does not want to know any more.
pub(super) fn go_on(wanted: bool) -> Result<(), SweepError> {
    if wanted { Ok(()) } else { Err(SweepError::GivenUp) }
}

/// A margin, or why there is none.
pub(super) type Found<T> = Result<T, String>;

/// Whether a variant of a scene is stable; `None` where it is too large to be analysed.
pub(super) fn is_stable(variants: &Variants, scene: &Scene) -> Result<Option<bool>, SweepError> {
    match variants.verdict(scene) {
        Ok(found) => Ok(Some(found.verdict.stable)),
        Err(error) if error.is_too_large() => Ok(None),
        Err(error) => Err(error.into()),
    }
}
