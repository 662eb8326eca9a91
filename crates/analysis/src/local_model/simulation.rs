//! The nonlinear loop, tick by tick: contact that pushes only, thresholds (10), (11), and the drain on leaving (§3.5).
//!
//! §3.5 writes the error as `e = x_proxy − x_haptic` and calls `e > 0` contact, so its axis points out of the object.
//! Here positions count into it and `e = x_hand − x_surface`; both are the depth of the hand below the surface, and the
//! conditions on `e` and `ė` read the same. The hand enters where `ė > 0`; an `ė` of exactly 0, which (11) leaves open,
//! counts as entering. `ė` is the hand's speed less the surface's while it moves under a first-order hold; a jump of the
//! surface is no speed. The third line of (11) as printed, `θ̄₂/I_tot`, falls as the integral grows, while the text
//! says that θ "grows linearly … up to a certain limit"; here it is `θ̄₂·I_tot/Ī_tot`, which meets the fourth line.

use cotouch_scene::scene::SurfaceHold;

use super::error::LocalModelError;
use super::gains::PiLocalModel;
use super::simulation_loop::SimulationLoop;

/// What happens where the hand is above the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactSides {
    /// Nothing else: the local model pulls.
    TwoSided,
    /// Force and integral are never negative.
    OneSided,
    /// ContactSides is lost where `e ≤ 0`; the integral then falls to 0 linearly, over this time, s (§3.5). Force and
    /// integral are never negative.
    Drained {
        /// A small multiple of the slow period, says Barbagli et al. 2003. 0: at once.
        interval_s: f64,
    },
}

/// θ, which is taken off the error before it is integrated. It is 0 without contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    /// The steady-state error vanishes.
    None,
    /// (10): θ̄, the error that remains at steady state, m.
    Constant(f64),
    /// (11).
    Directional {
        /// θ̄₁, m, while `ė < 0`: large, so that contact is not lost by overshooting.
        leaving_m: f64,
        /// θ̄₂, m, while `ė ≥ 0`: small, because it is what remains at steady state.
        entering_m: f64,
        /// Ī_tot, N: below it the threshold is in proportion to the integral's force.
        full_at_n: f64,
    },
}

/// The loop's constants.
#[derive(Clone, Debug)]
pub struct Simulation {
    model: PiLocalModel,
    slow_loop: SimulationLoop,
    period_s: f64,
    contact: ContactSides,
    threshold: Threshold,
}

/// All that the loop remembers; at rest, the hand on the surface, by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimulationState {
    /// Tick within the slow period.
    tick: usize,
    /// The simulation's last result and the one before, m.
    now_m: f64,
    before_m: f64,
    /// What the simulation gets at the end of the period, so far, N.
    returned_n: f64,
    integral_n: f64,
    hand_m: Option<f64>,
    leaving: Option<Leaving>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Leaving {
    from_n: f64,
    ticks: u64,
    left: u64,
}

/// One haptic tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulationSample {
    /// x_h, m.
    pub hand_m: f64,
    /// m.
    pub surface_m: f64,
    /// On the surface and, the other way, on the hand; held until the next tick. N.
    pub force_n: f64,
    /// The integral's part of it, N.
    pub integral_n: f64,
}

impl Simulation {
    /// `period_s` = T, the haptic period.
    ///
    /// # Errors
    /// When the period is not positive, or an interval or a threshold is negative or not finite.
    pub fn new(
        model: PiLocalModel,
        slow_loop: SimulationLoop,
        period_s: f64,
        contact: ContactSides,
        threshold: Threshold,
    ) -> Result<Self, LocalModelError> {
        let check = |what, found: f64, allowed, is_allowed: bool| {
            if found.is_finite() && is_allowed {
                Ok(())
            } else {
                Err(LocalModelError::Number { what, allowed, found })
            }
        };
        let not_negative = |what, found: f64| check(what, found, "0 or more", found >= 0.0);
        check("the haptic period, s,", period_s, "above 0", period_s > 0.0)?;
        if let ContactSides::Drained { interval_s } = contact {
            not_negative("the interval in which the integral is drained, s,", interval_s)?;
        }
        match threshold {
            Threshold::None => {}
            Threshold::Constant(error_m) => not_negative("a threshold, m,", error_m)?,
            Threshold::Directional { leaving_m, entering_m, full_at_n } => {
                not_negative("a threshold, m,", leaving_m)?;
                not_negative("a threshold, m,", entering_m)?;
                check(
                    "the integral at which a threshold is full, N,",
                    full_at_n,
                    "above 0",
                    full_at_n > 0.0,
                )?;
            }
        }
        Ok(Self { model, slow_loop, period_s, contact, threshold })
    }

    /// T, s.
    #[must_use]
    pub const fn period_s(&self) -> f64 {
        self.period_s
    }

    /// One haptic tick: reads the hand, gives the force, and at the end of a slow period lets the simulation answer.
    pub fn tick(&self, state: &mut SimulationState, hand_m: f64) -> SimulationSample {
        let share = self.slow_loop.share_of_way(state.tick);
        let surface_m = share * state.now_m + (1.0 - share) * state.before_m;
        let error_m = hand_m - surface_m;
        self.notice_leaving(state, error_m);
        let integral_n = state.integral_n;
        let force_n = self.force(error_m, integral_n);
        self.integrate(state, error_m, hand_m);
        state.hand_m = Some(hand_m);
        self.return_force(state, force_n);
        SimulationSample { hand_m, surface_m, force_n, integral_n }
    }

    /// All ticks of a trajectory of the hand, from rest.
    pub fn run(&self, hand_m: impl IntoIterator<Item = f64>) -> Vec<SimulationSample> {
        let mut state = SimulationState::default();
        hand_m.into_iter().map(|hand_m| self.tick(&mut state, hand_m)).collect()
    }

    fn force(&self, error_m: f64, integral_n: f64) -> f64 {
        match self.contact {
            ContactSides::TwoSided => self.model.kh_n_per_m() * error_m + integral_n,
            ContactSides::OneSided => (self.model.kh_n_per_m() * error_m + integral_n).max(0.0),
            ContactSides::Drained { .. } => self.model.kh_n_per_m() * error_m.max(0.0) + integral_n,
        }
    }

    /// Starts or ends the drain.
    fn notice_leaving(&self, state: &mut SimulationState, error_m: f64) {
        let ContactSides::Drained { interval_s } = self.contact else { return };
        if error_m > 0.0 {
            state.leaving = None;
        } else if state.leaving.is_none() {
            let ticks = (interval_s / self.period_s).round() as u64;
            state.leaving = Some(Leaving { from_n: state.integral_n, ticks, left: ticks });
            if ticks == 0 {
                state.integral_n = 0.0;
            }
        }
    }

    /// The integral at the next tick.
    fn integrate(&self, state: &mut SimulationState, error_m: f64, hand_m: f64) {
        if let Some(leaving) = &mut state.leaving {
            leaving.left = leaving.left.saturating_sub(1);
            state.integral_n = leaving.from_n * (leaving.left as f64 / leaving.ticks.max(1) as f64);
            return;
        }
        let per_tick = self.model.int_n_per_m() / self.slow_loop.ratio() as f64;
        state.integral_n += per_tick * (error_m - self.threshold(state, error_m, hand_m));
        if self.contact != ContactSides::TwoSided {
            state.integral_n = state.integral_n.max(0.0);
        }
    }

    fn threshold(&self, state: &SimulationState, error_m: f64, hand_m: f64) -> f64 {
        if error_m <= 0.0 {
            return 0.0;
        }
        match self.threshold {
            Threshold::None => 0.0,
            Threshold::Constant(threshold_m) => threshold_m,
            Threshold::Directional { leaving_m, .. } if self.is_leaving(state, hand_m) => leaving_m,
            Threshold::Directional { entering_m, full_at_n, .. } => {
                entering_m * (state.integral_n / full_at_n).clamp(0.0, 1.0)
            }
        }
    }

    /// Whether `ė < 0`.
    fn is_leaving(&self, state: &SimulationState, hand_m: f64) -> bool {
        let hand_moved_m = hand_m - state.hand_m.unwrap_or(hand_m);
        let surface_moved_m = match self.slow_loop.hold() {
            SurfaceHold::Zero => 0.0,
            SurfaceHold::First => (state.now_m - state.before_m) / self.slow_loop.ratio() as f64,
        };
        hand_moved_m < surface_moved_m
    }

    /// The simulation's answer is used from the next period on.
    fn return_force(&self, state: &mut SimulationState, force_n: f64) {
        state.returned_n += self.slow_loop.weights()[state.tick] * force_n;
        state.tick += 1;
        if state.tick == self.slow_loop.ratio() {
            state.before_m = state.now_m;
            state.now_m = state.returned_n / self.model.ko_n_per_m();
            (state.tick, state.returned_n) = (0, 0.0);
        }
    }
}
