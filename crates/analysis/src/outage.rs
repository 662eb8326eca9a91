//! What hands feel when packets arrive again after an outage.
//!
//! Mean-square stability says that motions die out however many packets are lost at random. It does not say how far copies of a body
//! come apart while nothing arrives, and with what force they come together again. That is a response, not a verdict: the
//! session's own loop, its packets included, is stepped tick by tick from rest through an outage, in which receivers go on with what they
//! hold, and on until what follows has died out, with a unit push at each finger along each axis. The loop is linear, and whose
//! coupling counts by how much at which tick is known beforehand ([`timeline`]), so the answer is exact for a session that is linear:
//!
//! ```text
//! F_i(k) = Σ_j G_ij(k)·p_j            the force at finger i at tick k after pushes p_j from the outage's beginning on
//! peak      max over i, k, |p_j| ≤ 1 of |F_i(k)|     an induced norm, by the best pushes for each direction ([`reach`])
//! expected  max over i, k of √(Σ_j ‖G_ij(k)‖²/d)     E|F|² for independent pushes with E p·pᵀ = I/d, d axes
//! excursion the same as the peak of what comes apart, from the beginning on
//! energy    max over K of Σ_i Σ_{k<K} F_i(k)·(x_i(k+1) − x_i(k))     of the pushes of the peak, from the end of the outage on
//! ```
//!
//! Where hosts bring together slowly what came apart ([`rejoining`]), each trajectory goes its own way, and peak, expectation and energy are
//! those of the patterns in which all fingers push forwards or backwards along an axis, and of the pushes that would be worst otherwise; the peak
//! is then the largest that was found, not a bound.
//!
//! Contacts stay as they are in the settled grasp (those of a host that was taken for gone begin anew in a session), and only what pushes add to its forces is told. The governor's largest force cuts what
//! is told here; from which push on, [`Outage::limited_from_n`] says.

mod found;
mod reach;
mod rejoining;
mod session;
mod stepping;
#[cfg(test)]
mod tests;
mod timeline;

use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_scene::Scene;
use cotouch_scene::limits::MAX_RETRY_S;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::ShapeKind;
use rayon::prelude::*;

use crate::loop_spec::LoopSpec;
use crate::modes::contact_modes;
use crate::soft::Bodies;
use crate::sweep::SweepError;
use session::{FadingSession, drifts};
use stepping::{Response, Stepper};
use timeline::{LostSteps, Silent, Timeline};

pub use found::{FingerPush, Outage, OutageDirection, Outages, WorstReturn};

/// Steps of a pattern at which an outage is looked at to begin.
const MAX_PHASES: i64 = 4;

/// What a row is about.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Asked {
    duration_s: f64,
    direction: OutageDirection,
}

/// One way in which a row may come about.
#[derive(Clone, Copy, Debug)]
struct Variant {
    row: usize,
    silent: Silent,
    lost: LostSteps,
}

/// What outages of these durations (s) do, on all cores: the whole network's, and that of the packets of one host. `progress` is told
/// the share that is done, and says whether to go on.
///
/// # Errors
/// When the scene cannot be analysed, or `progress` said no.
pub fn outages(
    scene: &Scene,
    durations_s: &[f64],
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Outages, SweepError> {
    let (modes, _) = contact_modes(scene, &Bodies::default())?;
    let settled = modes.iter().find(|mode| mode.settled).map(|mode| &mode.spec);
    match settled.filter(|spec| !spec.lines.is_empty()) {
        None => Ok(Outages { rows: Vec::new(), notes: vec![NO_NETWORK.to_owned()] }),
        Some(spec) => SessionOutages::new(scene, spec).rows(durations_s, progress),
    }
}

const NO_NETWORK: &str = "Nothing of the settled grasp crosses the network: an outage changes nothing.";

/// The outages of one session.
struct SessionOutages<'a> {
    scene: &'a Scene,
    session: FadingSession,
    /// Network steps at which an outage may begin.
    phases: Vec<i64>,
    drifts: bool,
}

impl<'a> SessionOutages<'a> {
    fn new(scene: &'a Scene, spec: &LoopSpec) -> Self {
        let steps = spec.network_steps() as i64;
        let count = steps.min(MAX_PHASES);
        let session = FadingSession::new(scene, spec);
        let phases = (0..count).map(|phase| phase * steps / count).collect();
        Self { scene, phases, drifts: drifts(&session), session }
    }

    fn rows(
        &self,
        durations_s: &[f64],
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Outages, SweepError> {
        let asked: Vec<Asked> = durations_s.iter().flat_map(|&duration_s| self.asked(duration_s)).collect();
        let variants: Vec<Variant> =
            asked.iter().enumerate().flat_map(|(row, asked)| self.variants(row, *asked)).collect();
        let stepper = Stepper::new(self.scene, &self.session);
        let undisturbed = stepper.response(&Timeline::without_outage(self.scene, 0)).force.size;
        let done = AtomicUsize::new(0);
        let respond = |variant: &Variant| -> Result<(Variant, Timeline, Response), SweepError> {
            let timeline = Timeline::new(self.scene, variant.silent, variant.lost, self.session.fades);
            let response = stepper.response(&timeline);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let goes_on = progress(done as f64 / variants.len() as f64);
            if goes_on { Ok((*variant, timeline, response)) } else { Err(SweepError::GivenUp) }
        };
        let responses = variants.par_iter().map(respond).collect::<Result<Vec<_>, _>>()?;
        let row = |(row, asked): (usize, &Asked)| {
            let of_row = responses.iter().filter(|(variant, ..)| variant.row == row);
            self.row(*asked, &stepper, undisturbed, &of_row.collect::<Vec<_>>())
        };
        let rows: Vec<Outage> = asked.iter().enumerate().filter_map(row).collect();
        Ok(Outages { rows, notes: self.notes(durations_s) })
    }

    /// One way only while hosts that take each other for gone hear each other's pings in time.
    fn asked(&self, duration_s: f64) -> impl Iterator<Item = Asked> {
        let one_way = self.hears_pings() || duration_s < self.scene.session.peer_timeout_s;
        let directions = [Some(OutageDirection::Both), one_way.then_some(OutageDirection::OneWay)];
        directions.into_iter().flatten().map(move |direction| Asked { duration_s, direction })
    }

    fn hears_pings(&self) -> bool {
        self.scene.session.peer_timeout_s > MAX_RETRY_S
    }

    fn variants(&self, row: usize, asked: Asked) -> Vec<Variant> {
        let count = self.lost_steps(asked.duration_s);
        let silent: Vec<Silent> = match asked.direction {
            OutageDirection::Both => vec![Silent::Everybody],
            OutageDirection::OneWay => self.scene.hosts().map(Silent::Only).collect(),
        };
        let variant = |silent: Silent| {
            self.phases.iter().map(move |&first| Variant { row, silent, lost: LostSteps { first, count } })
        };
        silent.into_iter().flat_map(variant).collect()
    }

    /// As many as may fall into that time.
    fn lost_steps(&self, duration_s: f64) -> i64 {
        /// Of a network period: a duration of whole periods has as many steps.
        const ROUNDING: f64 = 1e-9;
        (duration_s * self.scene.rates.network_hz.hz() - ROUNDING).ceil().max(1.0) as i64
    }

    /// None where there is nothing to tell of.
    fn row(
        &self,
        asked: Asked,
        stepper: &Stepper<'_>,
        undisturbed_force_n_per_n: f64,
        responses: &[&(Variant, Timeline, Response)],
    ) -> Option<Outage> {
        let by_force = |one: &&&(Variant, Timeline, Response), other: &&&(Variant, Timeline, Response)| {
            one.2.force.size.total_cmp(&other.2.force.size)
        };
        let (variant, timeline, response) = responses.iter().max_by(by_force)?;
        let largest =
            |of: &dyn Fn(&Response) -> f64| responses.iter().map(|(.., one)| of(one)).fold(0.0, f64::max);
        let period_s = self.scene.rates.control_hz.period_s();
        let seconds = |ticks: i64| ticks as f64 * period_s;
        let peak = response.force.size;
        Some(Outage {
            duration_s: asked.duration_s,
            direction: asked.direction,
            lost_steps: variant.lost.count as u32,
            lets_go_after_s: timeline.lets_go.map(|tick| seconds(tick - timeline.begins)),
            whole_again_after_s: seconds(timeline.is_over - timeline.ends),
            peak_force_n_per_n: peak,
            expected_force_n_per_n: largest(&|response| response.mean_square_n2).sqrt(),
            undisturbed_force_n_per_n,
            excursion_m_per_n: largest(&|response| response.apart.size),
            energy_j_per_n2: stepper.energy_j(timeline, &response.pushes),
            limited_from_n: (peak > 0.0).then(|| self.scene.governor.max_force_n / peak),
            worst: self.worst(*variant, timeline, response)?,
        })
    }

    fn worst(&self, variant: Variant, timeline: &Timeline, response: &Response) -> Option<WorstReturn> {
        let name = |host: HostIndex| self.scene.users[host.index()].name.clone();
        let hand = self.session.hands.get(response.force.place)?;
        let along = ["x", "y", "z"].into_iter().zip(response.force.direction.abs().to_array());
        let (axis, _) = along.max_by(|(_, one), (_, other)| one.total_cmp(other))?;
        let pushes = self.session.hands.iter().zip(&response.pushes).map(|(hand, push)| FingerPush {
            user: name(hand.user),
            finger: hand.finger + 1,
            force_n: push.to_array(),
        });
        Some(WorstReturn {
            user: name(hand.user),
            finger: hand.finger + 1,
            axis,
            after_s: (response.force.tick - timeline.ends) as f64 * self.scene.rates.control_hz.period_s(),
            silent: match variant.silent {
                Silent::Everybody => None,
                Silent::Only(host) => Some(name(host)),
            },
            pushes: pushes.collect(),
        })
    }

    fn touches_surfaces(&self) -> bool {
        self.scene.world_bodies().iter().any(|body| body.shape.kind != ShapeKind::Point)
    }

    fn notes(&self, durations_s: &[f64]) -> Vec<String> {
        let session = &self.scene.session;
        let longest = durations_s.iter().copied().fold(0.0, f64::max);
        let lets_go = longest >= session.peer_timeout_s;
        let mut notes = Vec::new();
        notes.push(if self.drifts {
            "While nothing arrives, nothing ties what a hand holds to what others hold: it drifts away under a constant push.".to_owned()
        } else {
            "While nothing arrives, whatever hands hold is still tied to the ground: it is pushed aside, and does not drift.".to_owned()
        });
        if lets_go && self.session.fades {
            notes.push(format!(
                "A host that is silent for {} s (session.peer_timeout_s) is taken for gone: the coupling to it fades out within {} s \
                 (session.peer_fade_s), and in again as slowly from at most {MAX_RETRY_S} s after the outage on.",
                session.peer_timeout_s, session.peer_fade_s
            ));
        }
        if lets_go && self.session.fades && self.touches_surfaces() {
            notes.push(
                "Fingers of a host that was taken for gone touch anew when it is back; here their contacts are taken to go on, with whatever \
                 stretch they have along the surface: longer outages are told less exactly, of `grasp` as harder than they are."
                    .to_owned(),
            );
        }
        if lets_go && !self.session.fades {
            notes.push(format!(
                "On a soft object the fading of couplings after {} s of silence (session.peer_timeout_s) is not part of the loop: longer \
                 outages are told as if samples were held throughout.",
                session.peer_timeout_s
            ));
        }
        if self.session.fades && session.rejoin_s > 0.0 && longest > session.rejoin_after_s {
            notes.push(format!(
                "What came apart in more than {} s (session.rejoin_after_s) is brought together within {} s (session.rejoin_s): the largest \
                 force is that of the pushes that were tried, forwards and backwards along each axis.",
                session.rejoin_after_s, session.rejoin_s
            ));
        }
        if !self.session.fades && session.rejoin_s > 0.0 && longest > session.rejoin_after_s {
            notes.push(
                "On a soft object it is told as if fingers were at once where they are when packets arrive again: hands feel less.".to_owned(),
            );
        }
        if lets_go && !self.hears_pings() {
            notes.push(format!(
                "One-way outages that are longer than session.peer_timeout_s are not told: at {} s hosts take each other for gone and for \
                 back between two pings.",
                session.peer_timeout_s
            ));
        }
        notes
    }
}
