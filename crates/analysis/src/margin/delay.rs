//! How old samples may become.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, PlayOut};
use cotouch_scene::{Scene, with_override};

use super::found::{Found, is_stable};
use crate::loop_spec::{Delay, Line, LoopSpec};
use crate::modes::contact_modes;
use crate::poles::analyze_loop;
use crate::soft::Bodies;
use crate::sweep::SweepError;
use crate::variants::Variants;

/// The longest delay that a scene can have, network periods.
const LONGEST: u32 = 64;

pub(super) fn margin(scene: &Scene) -> Result<Found<f64>, SweepError> {
    let schedule = scene.schedule();
    if schedule.steps_per_pattern() != 1 && scene.link.play_out == PlayOut::OnArrival {
        return Ok(Err(
            "The delay margin of samples used on arrival is only computed where a network period is a whole number of ticks.".to_owned(),
        ));
    }
    match scene.link.play_out {
        PlayOut::Scheduled => scheduled(scene),
        PlayOut::OnArrival => on_arrival(scene),
    }
}

fn scheduled(scene: &Scene) -> Result<Found<f64>, SweepError> {
    let variants = Variants::default();
    let mut whole = scene.link.delay_periods;
    loop {
        let next = whole + 1;
        if next > LONGEST {
            return Ok(Err(no_limit()));
        }
        match is_stable(&variants, &with_override(scene, "link.delay_periods", f64::from(next))?)? {
            Some(true) => whole = next,
            Some(false) => break,
            None => return Ok(Err(too_large(&format!("{next} network periods")))),
        }
    }
    let scene = with_override(scene, "link.delay_periods", f64::from(whole))?;
    let ticks = scene.schedule().ticks_per_pattern();
    if scene.schedule().steps_per_pattern() != 1 {
        return Ok(Ok(f64::from(whole)));
    }
    let bodies = Bodies::default();
    let more = last_stable(1..ticks, |more| is_stable_later(&scene, &bodies, more))?;
    Ok(more.map(|more| f64::from(whole) + more as f64 / ticks as f64))
}

fn on_arrival(scene: &Scene) -> Result<Found<f64>, SweepError> {
    let ticks = scene.schedule().ticks_per_pattern();
    let transit = |line: &Line| match line.delay {
        Delay::OnArrival { transit_ticks } | Delay::Scheduled { transit_ticks, .. } => transit_ticks,
    };
    let bodies = Bodies::default();
    let (modes, _) = contact_modes(scene, &bodies)?;
    let present = modes.iter().flat_map(|mode| &mode.spec.lines).map(transit).max().unwrap_or(0);
    let longest = u64::from(LONGEST) * ticks;
    let more = last_stable(1..longest.saturating_sub(present), |more| is_stable_later(scene, &bodies, more))?;
    Ok(more.and_then(|more| {
        let limit = present + more;
        if limit + 1 >= longest { Err(no_limit()) } else { Ok(limit as f64 / ticks as f64) }
    }))
}

fn no_limit() -> String {
    format!("The scene is stable up to the longest delay that a scene can have, {LONGEST} network periods.")
}

fn too_large(delay: &str) -> String {
    format!("The delay margin was not found: with {delay} the loop is too large to be analysed.")
}

/// The last of `candidates` before the first that is not stable; 0 if there is none.
fn last_stable(
    candidates: std::ops::Range<u64>,
    mut is_stable: impl FnMut(u64) -> Result<Option<bool>, SweepError>,
) -> Result<Found<u64>, SweepError> {
    let mut last = 0;
    for candidate in candidates {
        match is_stable(candidate)? {
            Some(true) => last = candidate,
            Some(false) => break,
            None => return Ok(Err(too_large(&format!("{candidate} ticks more")))),
        }
    }
    Ok(Ok(last))
}

/// Whether every contact mode is stable when samples are used `more` ticks later; `None` where one is too large.
fn is_stable_later(scene: &Scene, bodies: &Bodies, more: u64) -> Result<Option<bool>, SweepError> {
    for mode in contact_modes(scene, bodies)?.0 {
        match analyze_loop(&later(scene, mode.spec, more)) {
            Ok(verdict) if verdict.stable => {}
            Ok(_) => return Ok(Some(false)),
            Err(error) if error.is_too_large() => return Ok(None),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(Some(true))
}

/// The loop with samples used `more` ticks later; where scheduled, as `link.delay_periods` would: centralized, those on
/// the way to the server.
fn later(scene: &Scene, mut spec: LoopSpec, more: u64) -> LoopSpec {
    let ticks = spec.schedule.ticks_per_pattern();
    let centralized = scene.session.architecture == Architecture::Centralized;
    for line in &mut spec.lines {
        let (present, is_later) = match line.delay {
            Delay::OnArrival { transit_ticks } => (transit_ticks, true),
            Delay::Scheduled { periods, transit_ticks } => (
                ticks * u64::from(periods).max(transit_ticks.div_ceil(ticks)),
                !centralized || line.host == HostIndex::FIRST,
            ),
        };
        line.delay = Delay::OnArrival { transit_ticks: present + if is_later { more } else { 0 } };
    }
    spec
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;

    #[test]
    fn a_whole_period_later_is_one_delay_period_more() {
        for name in ["single-axis", "single-axis-centralized"] {
            for periods in 0..3 {
                let scene = cotouch_scene::load(name, &[]).unwrap();
                let with =
                    |periods: u32| with_override(&scene, "link.delay_periods", f64::from(periods)).unwrap();
                let radius = |spec: &LoopSpec| analyze_loop(spec).unwrap().spectral_radius;
                let scheduled = radius(&compile(&with(periods + 1))[0].spec);
                let shifted = radius(&later(&scene, compile(&with(periods)).remove(0).spec, 8));
                assert!((scheduled - shifted).abs() < 1e-9, "{name} {periods}: {scheduled} {shifted}");
            }
        }
    }
}
