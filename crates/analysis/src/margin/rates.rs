//! How slow the network and the haptic loop may become.

use cotouch_scene::Scene;
use cotouch_scene::time::Rate;

use super::found::{RateMargin, is_stable};
use crate::sweep::SweepError;

/// Network periods of more ticks are not tried.
const MAX_TICKS: u64 = 256;

pub(super) fn margins(scene: &Scene, notes: &mut Vec<String>) -> Result<Vec<RateMargin>, SweepError> {
    let (control, network) = (scene.rates.control_hz, scene.rates.network_hz);
    let schedule = scene.schedule();
    let (ticks, steps) = (schedule.ticks_per_pattern(), schedule.steps_per_pattern());
    let slower_network = (ticks / steps + 1..=MAX_TICKS).map(|n| {
        let network_hz = Rate::new(control.numerator(), control.denominator() * n).ok()?;
        scene.edit(|slower| slower.rates.network_hz = network_hz).ok()
    });
    let network_hz = lowest(slower_network, |scene| scene.rates.network_hz.hz())?;
    let slower_control = (1..=(ticks - 1) / steps).rev().map(|n| {
        let control_hz = Rate::new(network.numerator() * n, network.denominator()).ok()?;
        scene.edit(|slower| slower.rates.control_hz = control_hz).ok()
    });
    let control_hz = lowest(slower_control, |scene| scene.rates.control_hz.hz())?;
    let mut margin = |key: &str, found: Lowest, present: Rate| {
        let hz = match found {
            Lowest::At(hz) => Some(hz),
            // Not even one step lower.
            Lowest::Present => Some(present.hz()),
            Lowest::NoneTooLow(tried) => {
                let tried = tried.map_or_else(
                    || "no lower rate fits the other one".to_owned(),
                    |hz| format!("the scene is stable down to {hz:.4} Hz, the lowest that was tried"),
                );
                notes.push(format!("No limit of {key} was found: {tried}."));
                None
            }
            Lowest::TooLarge(hz) => {
                notes.push(format!("No limit of {key} was found: at {hz:.4} Hz the loop is too large."));
                None
            }
        };
        RateMargin { key: key.to_owned(), hz, factor: hz.map(|hz| hz / present.hz()) }
    };
    Ok(vec![margin("rates.network_hz", network_hz, network), margin("rates.control_hz", control_hz, control)])
}

enum Lowest {
    At(f64),
    Present,
    /// With the lowest rate that was tried, Hz.
    NoneTooLow(Option<f64>),
    /// At this rate, Hz.
    TooLarge(f64),
}

/// The last of a row of ever slower scenes before the first that is unstable.
fn lowest(
    scenes: impl Iterator<Item = Option<Scene>>,
    hz: impl Fn(&Scene) -> f64,
) -> Result<Lowest, SweepError> {
    let mut last = None;
    for scene in scenes.map_while(|scene| scene) {
        match is_stable(&scene)? {
            Some(true) => last = Some(hz(&scene)),
            Some(false) => return Ok(last.map_or(Lowest::Present, Lowest::At)),
            None => return Ok(Lowest::TooLarge(hz(&scene))),
        }
    }
    Ok(Lowest::NoneTooLow(last))
}
