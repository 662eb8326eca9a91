//! How far gains, delay, rates and loss are from instability.
//!
//! Each is changed alone, the rest of the scene staying as it is, until the worst contact mode turns unstable.

mod cures;
mod delay;
mod found;
mod gains;
mod loss;
mod rates;
mod scan;

use cotouch_scene::scene::PlayOut;
use cotouch_scene::{Scene, with_override};

use crate::outage::outages;
use crate::stability::analyze_settled;
use crate::sweep::SweepError;
use crate::verdict::Stability;
use found::{Found, go_on};

pub use found::{Cure, DelayAndLoss, GainMargin, Margins, RateMargin};

/// All margins of a scene, and what outages of these durations (s) do, on all cores. `progress` is told the share that is done, and says
/// whether to go on.
///
/// # Errors
/// When the scene cannot be analysed, or `progress` said no.
pub fn margins(
    scene: &Scene,
    outages_s: &[f64],
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Margins, SweepError> {
    let verdict = analyze_settled(scene)?;
    let mut margins = Margins {
        stable: verdict.each_mode_is_stable(),
        spectral_radius: verdict.spectral_radius,
        delay_periods: None,
        loss_rate: None,
        delay_and_loss: Vec::new(),
        gains: Vec::new(),
        rates: Vec::new(),
        rates_together_hz: None,
        rates_together_factor: None,
        outages: Vec::new(),
        cures: Vec::new(),
        notes: Vec::new(),
    };
    if !verdict.each_mode_is_stable() {
        margins.notes.push(which_is_unstable(&verdict));
        margins.cures = cures::cures(scene, &verdict, progress)?;
        if margins.cures.is_empty() {
            margins.notes.push(NO_CURE.to_owned());
        }
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
    let rates = rates::limits(scene, &mut margins.notes, &|share| progress(0.7 + 0.1 * share))?;
    margins.rates = rates.each;
    margins.rates_together_hz = rates.together.hz;
    margins.rates_together_factor = rates.together.factor;
    go_on(progress(0.8))?;
    let loss = noted(loss::margin(scene, &|share| progress(0.8 + 0.1 * share))?, &mut margins.notes);
    margins.loss_rate = loss.map(|limit| limit.unwrap_or(1.0));
    if loss == Some(None) {
        margins.notes.push(format!(
            "The mean square dies out up to a loss of {} %; when everything is lost, nothing ties the parts.",
            100.0 * loss::HIGHEST
        ));
    }
    margins.delay_and_loss = delay_and_loss(scene, &margins, &|share| progress(0.9 + 0.05 * share))?;
    if !outages_s.is_empty() {
        let outages = outages(scene, outages_s, &|share| progress(0.95 + 0.05 * share))?;
        margins.outages = outages.rows;
        margins.notes.extend(outages.notes);
    }
    progress(1.0);
    Ok(margins)
}

const NO_CURE: &str = "No change of a single gain, by factors of up to 100, of the delay or of a rate makes every contact mode stable.";

/// At most so many delays have their loss margins told.
const MAX_DELAYS: u32 = 6;

/// The loss margins of the present delay, which is known, and of longer ones.
fn delay_and_loss(
    scene: &Scene,
    margins: &Margins,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Vec<DelayAndLoss>, SweepError> {
    let present = scene.link.delay_periods;
    let mut rows = vec![DelayAndLoss { delay_periods: present, loss_rate: margins.loss_rate }];
    let Some(limit) = margins.delay_periods.filter(|_| scene.link.play_out == PlayOut::Scheduled) else {
        return Ok(rows);
    };
    let last = (limit.floor() as u32).min(present + MAX_DELAYS - 1);
    for delay_periods in present + 1..=last {
        let done = f64::from(delay_periods - present - 1) / f64::from(last - present);
        let later = with_override(scene, "link.delay_periods", f64::from(delay_periods))?;
        let share = |share: f64| progress(done + share / f64::from(last - present));
        let loss_rate = loss::margin(&later, &share)?.ok().map(|limit| limit.unwrap_or(1.0));
        rows.push(DelayAndLoss { delay_periods, loss_rate });
    }
    Ok(rows)
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
