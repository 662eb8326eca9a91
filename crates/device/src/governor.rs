//! The one gate that every force passes on its way to a device.
//!
//! Whatever comes in, NaN and nonsense included, what comes out is finite, `|f| ≤ F_max`, and changes by at most
//! `slew·T` a tick. When nothing acts, it is what was requested, bit for bit.

use cotouch_scene::geometry::{Reading, Wrench};
use cotouch_scene::scene::{SceneValues, SpringDamper};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::acted::Acted;
use crate::device::DeviceLimits;

/// How much more than `slew·T` a tick admits, so that the default, F_max·rate, admits F_max after rounding.
const SLEW_SLACK: f64 = 1.0 + 1e-12;

/// The passivity controller brakes with at most this damping, N·s/m. A spring of stiffness K that is rendered with period
/// T lacks K·T/2 (Colgate & Schenkel 1997): at 1 kHz this is enough for 20 kN/m. Much more would itself be unstable, with
/// a hand and device of 0.1 kg from 200 N·s/m.
const LARGEST_BRAKE_N_S_PER_M: f64 = 10.0;

/// Where "no limit" ends, in N, N·m or N/s.
const LARGEST_LIMIT: f64 = 1e12;

/// The governor's constants. A tick is [`govern`](Self::govern).
///
/// In order: what is not finite becomes a latched fault; what is rendered at every finger whatever it touches
/// ([`HandImpedance::rendered`](cotouch_scene::scene::HandImpedance::rendered)), `f − k·(x − x_start) − b_g·v`; the passivity
/// controller, if asked for, `f − b·v` with `b·v²·T` what the port's observer misses, at most 10 N·s/m; F_max, direction
/// kept; fading in (soft start) or out (release); slew. Fading follows the smooth step `3s² − 2s³` and is a factor on
/// the force in the soft start, and on the force of the moment in which the release began in a release, so that a
/// release does not depend on requests any more. A release once begun is finished; after it, and only when nothing
/// asks for it any more, forces come back through a soft start.
#[derive(Clone, Debug, PartialEq)]
pub struct Governor {
    max_force_n: f64,
    max_torque_n_m: f64,
    force_step_n: f64,
    torque_step_n_m: f64,
    rendered: SpringDamper,
    passivity_control: bool,
    period_s: f64,
    soft_start_ticks: u32,
    release_ticks: u32,
    watchdog_ticks: u32,
}

/// The governor's state: a plain value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GovernorState {
    /// What it is doing.
    pub phase: GovernorPhase,
    /// What it let through last.
    pub commanded: Wrench,
    /// Ticks on end without a fresh request.
    pub stale_ticks: u32,
    /// The first fault since the start or the last [`clear_fault`](Self::clear_fault).
    pub fault: Option<GovernorFault>,
}

/// What a governor is doing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GovernorPhase {
    /// Forces fade in from nothing.
    SoftStart {
        /// Ticks since it began.
        ticks: u32,
    },
    /// Forces pass, within the limits.
    Open,
    /// Forces fade out to nothing.
    Releasing {
        /// Ticks since it began.
        ticks: u32,
        /// The wrench from which.
        from: Wrench,
    },
    /// No force passes at all.
    Released,
}

/// Why a governor released for good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GovernorFault {
    /// A request (or a request with what is rendered besides) was not a number.
    RequestNotFinite,
    /// A device's reading was not a number.
    ReadingNotFinite,
}

/// What a governor is told at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GovernorInput {
    /// The wrench to be rendered.
    pub requested: Wrench,
    /// The device's reading at this tick.
    pub reading: Reading,
    /// From where the finger starts to where it reads, m.
    pub from_start: DVec3,
    /// Whether the user, the session's end or a watchdog elsewhere wants the force gone.
    pub stop: bool,
    /// Whether the links that the force depends on are up.
    pub link_ok: bool,
    /// Whether `requested` was computed for this tick, and is not the last one once more.
    pub fresh: bool,
    /// What the session has given at this finger more than it had taken, J
    /// ([`PortEnergy::deficit_j`](crate::energy::PortEnergy::deficit_j)): what a passivity controller brakes for.
    pub deficit_j: f64,
}

impl GovernorInput {
    /// A fresh request with all well, nothing to brake for, at a finger that is where it starts.
    #[must_use]
    pub fn healthy(requested: Wrench, reading: Reading) -> Self {
        let from_start = DVec3::ZERO;
        Self { requested, reading, from_start, stop: false, link_ok: true, fresh: true, deficit_j: 0.0 }
    }
}

/// What a governor decided at a tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GovernorOutput {
    /// What goes to the device.
    pub commanded: Wrench,
    /// What acted on it.
    pub acted: Acted,
}

impl Governor {
    /// A governor for a device in a scene, called once a haptic tick. The lower of the scene's and the device's largest force
    /// counts; torque may change in the same proportion as force. A limit that is no number, or negative, is 0.
    #[must_use]
    pub fn new(scene: &SceneValues, device: DeviceLimits) -> Self {
        let (limits, control) = (&scene.governor, scene.rates.control_hz);
        let max_force_n = sound(limits.max_force_n).min(sound(device.max_force_n));
        let max_torque_n_m = sound(device.max_torque_n_m);
        let force_step_n = sound(limits.max_slew_n_per_s) / control.hz() * SLEW_SLACK;
        let ticks = |seconds: f64| u32::try_from(control.ticks_in(seconds)).unwrap_or(u32::MAX);
        let torque_share = if force_step_n < max_force_n { force_step_n / max_force_n } else { SLEW_SLACK };
        Self {
            max_force_n,
            max_torque_n_m,
            force_step_n,
            torque_step_n_m: if max_torque_n_m == 0.0 { 0.0 } else { max_torque_n_m * torque_share },
            rendered: scene.hand_impedance().rendered,
            passivity_control: limits.passivity_control,
            period_s: control.period_s(),
            soft_start_ticks: ticks(limits.soft_start_s),
            release_ticks: ticks(limits.release_s),
            watchdog_ticks: ticks(limits.watchdog_s),
        }
    }

    /// The state before the first tick: no force, soft start to come.
    #[must_use]
    pub fn start(&self) -> GovernorState {
        GovernorState { phase: self.faded_in(0), commanded: Wrench::default(), stale_ticks: 0, fault: None }
    }

    /// One haptic tick. A tick that a late loop skips is not made up for: fading takes a little longer, and the force
    /// changes by no more than in any other tick. No allocation, no lock, bounded work.
    pub fn govern(&self, state: &mut GovernorState, input: &GovernorInput) -> GovernorOutput {
        let mut force = self.with_impedance(input);
        let brake_n_s_per_m = self.brake_n_s_per_m(input);
        if brake_n_s_per_m != 0.0 {
            force.force -= input.reading.twist.linear * brake_n_s_per_m;
        }
        state.notice(input, &force);
        let mut causes = self.causes(state, input);
        let phase = self.begin_phase(state, !causes.is_empty());
        let (target, acted) = match phase {
            GovernorPhase::Open => self.limited(force),
            GovernorPhase::SoftStart { ticks } => {
                let (force, acted) = self.limited(force);
                let gain = smooth_step(f64::from(ticks) / f64::from(self.soft_start_ticks));
                (scaled(force, gain), acted | Acted::SOFT_START)
            }
            GovernorPhase::Releasing { ticks, from } => (self.faded_out(ticks, from), Acted::RELEASE),
            GovernorPhase::Released => (Wrench::default(), Acted::RELEASE),
        };
        let (commanded, slewed) = self.slewed(state.commanded, target);
        state.commanded = commanded;
        state.phase = self.end_phase(phase, commanded);
        causes.set(Acted::PASSIVITY, brake_n_s_per_m != 0.0);
        GovernorOutput { commanded, acted: causes | acted | slewed }
    }

    /// The share of the force that the present phase lets through: 1 when open, 0 when released, in between while
    /// forces fade in or out.
    #[must_use]
    pub fn gain(&self, state: &GovernorState) -> f64 {
        let share = |ticks: u32, all: u32| smooth_step((f64::from(ticks) / f64::from(all.max(1))).min(1.0));
        match state.phase {
            GovernorPhase::SoftStart { ticks } => share(ticks, self.soft_start_ticks),
            GovernorPhase::Open => 1.0,
            GovernorPhase::Releasing { ticks, .. } => 1.0 - share(ticks, self.release_ticks),
            GovernorPhase::Released => 0.0,
        }
    }

    /// The request and what is rendered whatever the finger touches.
    fn with_impedance(&self, input: &GovernorInput) -> Wrench {
        let mut wrench = input.requested;
        let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = self.rendered;
        if stiffness_n_per_m != 0.0 {
            wrench.force -= input.from_start * stiffness_n_per_m;
        }
        if damping_n_s_per_m != 0.0 {
            wrench.force -= input.reading.twist.linear * damping_n_s_per_m;
        }
        wrench
    }

    /// The damping that takes away until the next tick what the session has given too much, N·s/m.
    fn brake_n_s_per_m(&self, input: &GovernorInput) -> f64 {
        let speed_squared = input.reading.twist.linear.length_squared();
        let brakes = self.passivity_control && input.deficit_j > 0.0 && speed_squared > 0.0;
        if brakes {
            (input.deficit_j / (speed_squared * self.period_s)).min(LARGEST_BRAKE_N_S_PER_M)
        } else {
            0.0
        }
    }

    /// Everything that asks for a release now.
    fn causes(&self, state: &GovernorState, input: &GovernorInput) -> Acted {
        let mut causes = Acted::empty();
        causes.set(Acted::FAULT, state.fault.is_some());
        causes.set(Acted::STOP, input.stop);
        causes.set(Acted::LINK_LOSS, !input.link_ok);
        causes.set(Acted::WATCHDOG, state.stale_ticks > self.watchdog_ticks);
        causes
    }

    fn begin_phase(&self, state: &GovernorState, release: bool) -> GovernorPhase {
        match state.phase {
            GovernorPhase::SoftStart { .. } | GovernorPhase::Open if release => {
                GovernorPhase::Releasing { ticks: 0, from: state.commanded }
            }
            GovernorPhase::Released if !release => self.faded_in(0),
            phase => phase,
        }
    }

    /// The phase after a tick in `phase`.
    fn end_phase(&self, phase: GovernorPhase, commanded: Wrench) -> GovernorPhase {
        match phase {
            GovernorPhase::SoftStart { ticks } => self.faded_in(ticks + 1),
            GovernorPhase::Releasing { .. } if commanded == Wrench::default() => GovernorPhase::Released,
            GovernorPhase::Releasing { ticks, from } => {
                GovernorPhase::Releasing { ticks: ticks.saturating_add(1), from }
            }
            GovernorPhase::Open | GovernorPhase::Released => phase,
        }
    }

    fn faded_in(&self, ticks: u32) -> GovernorPhase {
        if ticks < self.soft_start_ticks { GovernorPhase::SoftStart { ticks } } else { GovernorPhase::Open }
    }

    fn faded_out(&self, ticks: u32, from: Wrench) -> Wrench {
        let next = ticks.saturating_add(1);
        if next >= self.release_ticks {
            return Wrench::default();
        }
        scaled(from, 1.0 - smooth_step(f64::from(next) / f64::from(self.release_ticks)))
    }

    /// Largest force and torque; the wrench is finite.
    fn limited(&self, wrench: Wrench) -> (Wrench, Acted) {
        let (force, force_acted) = shortened(wrench.force, self.max_force_n);
        let (torque, torque_acted) = shortened(wrench.torque, self.max_torque_n_m);
        let mut acted = Acted::empty();
        acted.set(Acted::FORCE_LIMIT, force_acted);
        acted.set(Acted::TORQUE_LIMIT, torque_acted);
        (Wrench { force, torque }, acted)
    }

    fn slewed(&self, last: Wrench, target: Wrench) -> (Wrench, Acted) {
        let (force, force_acted) = towards(last.force, target.force, self.force_step_n, self.max_force_n);
        let (torque, torque_acted) =
            towards(last.torque, target.torque, self.torque_step_n_m, self.max_torque_n_m);
        let mut acted = Acted::empty();
        acted.set(Acted::SLEW_LIMIT, force_acted || torque_acted);
        (Wrench { force, torque }, acted)
    }
}

impl GovernorState {
    /// Whether the force is gone and stays so until a soft start.
    #[must_use]
    pub fn is_released(&self) -> bool {
        self.phase == GovernorPhase::Released
    }

    /// Takes note that the force was switched off from outside: no force is rendered, and when nothing asks for a release forces
    /// come back through a soft start.
    pub fn force_off(&mut self) {
        (self.phase, self.commanded) = (GovernorPhase::Released, Wrench::default());
    }

    /// Forgets a fault, once its cause was seen to: forces come back through a soft start.
    pub fn clear_fault(&mut self) {
        self.fault = None;
    }

    fn notice(&mut self, input: &GovernorInput, force: &Wrench) {
        self.stale_ticks = if input.fresh { 0 } else { self.stale_ticks.saturating_add(1) };
        if self.fault.is_none() {
            self.fault = match (input.reading.is_finite(), force.is_finite()) {
                (true, true) => None,
                (false, _) => Some(GovernorFault::ReadingNotFinite),
                (true, false) => Some(GovernorFault::RequestNotFinite),
            };
        }
    }
}

/// A limit such that differences of limited forces do not overflow; NaN is 0.
fn sound(limit: f64) -> f64 {
    if limit.is_nan() { 0.0 } else { limit.clamp(0.0, LARGEST_LIMIT) }
}

/// From 0 to 1 with no slope at either end.
fn smooth_step(s: f64) -> f64 {
    s * s * (3.0 - 2.0 * s)
}

fn scaled(wrench: Wrench, gain: f64) -> Wrench {
    Wrench { force: wrench.force * gain, torque: wrench.torque * gain }
}

/// A finite vector, made no longer than `longest`, and whether it had to be.
#[inline]
fn shortened(vector: DVec3, longest: f64) -> (DVec3, bool) {
    if vector.length() <= longest { (vector, false) } else { (cut(vector, longest), true) }
}

#[cold]
fn cut(vector: DVec3, longest: f64) -> DVec3 {
    // The largest component first: the length of a huge vector overflows.
    let unit = (vector / vector.abs().max_element()).normalize();
    let short = unit * longest;
    if short.length() > longest { short * (1.0 - 2.0 * f64::EPSILON) } else { short }
}

/// From `last` to `target` in a step of at most `longest_step`, and whether that stopped short. Both are no longer
/// than `longest`, and so is the result.
#[inline]
fn towards(last: DVec3, target: DVec3, longest_step: f64, longest: f64) -> (DVec3, bool) {
    let (step, stopped) = shortened(target - last, longest_step);
    if stopped { (shortened(last + step, longest).0, true) } else { (target, false) }
}

#[cfg(test)]
mod tests {
    use cotouch_scene::scene::GovernorLimits;

    use super::*;

    #[test]
    fn fingers_are_drawn_to_where_they_start_and_braked() {
        let scene = SceneValues {
            governor: GovernorLimits { max_force_n: 8.0, max_slew_n_per_s: 1e6, ..GovernorLimits::default() },
            ..SceneValues::default()
        };
        let rendered = SpringDamper { stiffness_n_per_m: 100.0, damping_n_s_per_m: 2.0 };
        let governor = Governor { rendered, ..Governor::new(&scene, DeviceLimits::NONE) };
        let reading = Reading::point(DVec3::X * 0.3, DVec3::Y);
        let input = GovernorInput {
            from_start: DVec3::X * 0.01,
            ..GovernorInput::healthy(Wrench::force(DVec3::X * 3.0), reading)
        };
        let output = governor.govern(&mut governor.start(), &input);
        assert_eq!(output.commanded.force, DVec3::new(2.0, -2.0, 0.0));
    }
}
