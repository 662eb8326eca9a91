//! A simulated hand that holds a device: mass, damping and stiffness, exact between ticks, following a script.

use cotouch_scene::geometry::{Reading, Readings, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Hand, Scene};
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::device::{Device, DeviceError, DeviceLimits, checked};
use crate::plant::Plant;
use crate::script::{Script, ScriptState};

/// Most ticks that a hand catches up in one read (a quarter of an hour at 1 kHz).
pub const MOST_TICKS_AHEAD: u64 = 1_000_000;

/// Where a hand can go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// Along this direction through the origin (of any length but zero). Nothing ever leaves the line.
    Line(DVec3),
    /// Anywhere.
    Space,
}

/// A hand that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandError {
    /// Mass, damping or stiffness.
    #[error(
        "a simulated hand needs a mass above 0 kg and finite damping and stiffness; found {mass_kg} kg, {damping_n_s_per_m} N·s/m and {stiffness_n_per_m} N/m (tracking included)"
    )]
    Impedance {
        /// m_h.
        mass_kg: f64,
        /// b_h and tracking.
        damping_n_s_per_m: f64,
        /// k_h and tracking.
        stiffness_n_per_m: f64,
    },
    /// A line without a direction.
    #[error("a hand on a line needs a finite direction other than zero; found {0}")]
    Direction(DVec3),
}

/// A hand's constants: `m_h·x″ = u − (k_h + k_track)·x − (b_h + b_track)·v` on every free axis, where
/// `u = f_script + k_track·x_target + b_track·v_target + f_device` is held from tick to tick, and between ticks the
/// motion is exact ([`Plant`]). The rest position is the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct HandModel {
    plant: Plant,
    script: Script,
    /// The unit vector of a line.
    direction: Option<DVec3>,
}

/// A hand's state at the instant of `tick`, before anything is written there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HandState {
    /// The tick of whose instant the rest speaks.
    pub tick: u64,
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// The device force that is held if nothing new is written, N.
    pub held_force: DVec3,
    /// How far the script is.
    pub script: ScriptState,
}

impl HandModel {
    /// A hand with the impedance `hand` (and the script's tracking) that moves with `freedom` and follows `script`,
    /// which knows the haptic period.
    ///
    /// # Errors
    /// When the impedance or the line's direction is not one.
    pub fn new(hand: &Hand, freedom: Freedom, script: Script) -> Result<Self, HandError> {
        let mass_kg = hand.mass_kg;
        let damping_n_s_per_m = hand.damping_n_s_per_m + script.tracking().damping_n_s_per_m;
        let stiffness_n_per_m = hand.stiffness_n_per_m + script.tracking().stiffness_n_per_m;
        let is_sound = mass_kg > 0.0
            && mass_kg.is_finite()
            && damping_n_s_per_m.is_finite()
            && stiffness_n_per_m.is_finite();
        if !is_sound {
            return Err(HandError::Impedance { mass_kg, damping_n_s_per_m, stiffness_n_per_m });
        }
        let direction = match freedom {
            Freedom::Space => None,
            Freedom::Line(along) => Some(along.try_normalize().ok_or(HandError::Direction(along))?),
        };
        let plant = Plant::new(mass_kg, damping_n_s_per_m, stiffness_n_per_m, script.period_s());
        Ok(Self { plant, script, direction })
    }

    /// The state at `tick` of a hand that rests at `position` (m) and begins its script.
    #[must_use]
    pub fn at_rest(&self, tick: u64, position: DVec3) -> HandState {
        let position = self.free(position);
        HandState {
            tick,
            position,
            velocity: DVec3::ZERO,
            held_force: DVec3::ZERO,
            script: self.script.begin(tick, position),
        }
    }

    /// Advances `state` by one haptic period under its held force. No allocation, no lock, bounded work.
    pub fn step(&self, state: &mut HandState) {
        let drive = self.script.drive(&mut state.script, state.tick, state.position);
        let tracking = self.script.tracking();
        let input = drive.force
            + drive.target.position * tracking.stiffness_n_per_m
            + drive.target.velocity * tracking.damping_n_s_per_m
            + state.held_force;
        (state.position, state.velocity) = self.plant.step(state.position, state.velocity, self.free(input));
        state.tick += 1;
    }

    /// The part of a vector along which the hand can move.
    fn free(&self, vector: DVec3) -> DVec3 {
        self.direction.map_or(vector, |direction| direction * direction.dot(vector))
    }
}

/// A [`Device`] in a simulated hand: a point that renders any force and no torque.
///
/// [`read`](Device::read) reports the state at a tick; [`write`](Device::write) stores the device force and advances
/// the hand by exactly one period, to the next tick's instant. A read at a later tick than that first catches up, the
/// last force being held: a loop that skipped ticks finds the hand where it would be (work in proportion to the
/// ticks skipped, at most [`MOST_TICKS_AHEAD`]). Neither allocates nor locks.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedHand {
    name: String,
    model: HandModel,
    state: HandState,
    /// Where the hand's rest position is in the world, m.
    origin: DVec3,
}

impl SimulatedHand {
    /// A hand of `model`, at rest at `position` (m) at tick 0.
    #[must_use]
    pub fn new(name: impl Into<String>, model: HandModel, position: DVec3) -> Self {
        let state = model.at_rest(0, position);
        Self { name: name.into(), model, state, origin: DVec3::ZERO }
    }

    /// The hand of the user at `host` of a scene on a line (along x), at rest at the origin.
    ///
    /// # Errors
    /// When the scene has no sound hand (a checked one has).
    ///
    /// # Panics
    /// When the scene has no such host.
    pub fn of_scene(scene: &Scene, host: HostIndex) -> Result<Self, HandError> {
        let user = &scene.users[host.index()];
        let script = Script::new(user, scene.session.seed, host, scene.rates.control_hz);
        let model = HandModel::new(&scene.hand, Freedom::Line(DVec3::X), script)?;
        Ok(Self::new(user.name.clone(), model, DVec3::ZERO))
    }

    /// The constants.
    #[must_use]
    pub fn model(&self) -> &HandModel {
        &self.model
    }

    /// The state now.
    #[must_use]
    pub fn state(&self) -> &HandState {
        &self.state
    }

    /// Begins anew at `tick`, at rest where the hand is, with the script's first action: for a user who joins late.
    pub fn restart(&mut self, tick: u64) {
        self.state = self.model.at_rest(tick, self.state.position);
    }

    /// Replaces the state. What a hand on a line cannot do is left out of position and velocity.
    pub fn set_state(&mut self, state: HandState) {
        let (position, velocity) = (self.model.free(state.position), self.model.free(state.velocity));
        self.state = HandState { position, velocity, ..state };
    }
}

impl Device for SimulatedHand {
    fn name(&self) -> &str {
        &self.name
    }

    fn limits(&self) -> DeviceLimits {
        DeviceLimits::POINT
    }

    fn start(&mut self, tick: u64) {
        self.restart(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.origin = self.model.free(position) - self.state.position;
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let at = self.state.tick;
        if tick.checked_sub(at).is_none_or(|ahead| ahead > MOST_TICKS_AHEAD) {
            let device = self.name.clone();
            return Err(DeviceError::TickOutOfReach {
                device,
                asked: tick,
                at,
                most_ahead: MOST_TICKS_AHEAD,
            });
        }
        while self.state.tick < tick {
            self.model.step(&mut self.state);
        }
        let reading = Reading::point(self.origin + self.state.position, self.state.velocity);
        Ok([reading].into_iter().collect())
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        for &wrench in wrenches.iter().take(1) {
            self.state.held_force = checked(&self.name, wrench)?.force;
        }
        self.model.step(&mut self.state);
        Ok(())
    }
}
