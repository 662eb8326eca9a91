//! A simulated user: one or more fingers on devices, following scripts.

use std::sync::Arc;

use cotouch_scene::geometry::{Pose, Reading, Readings, Wrench, Wrenches};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

use arrayvec::ArrayVec;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::device::{Device, DeviceLimits, ScriptProgress, WorldView};
use crate::error::DeviceError;
use crate::finger::{FingerError, FingerModel, FingerState};
use crate::script::{Drive, PlaceInScript, Script, ScriptState, Touch};
use crate::switch::{ForceSwitch, SoftwareSwitch, check_finite};

/// Most ticks that a user catches up in one read (a quarter of an hour at 1 kHz).
pub const MAX_TICKS_AHEAD: u64 = 1_000_000;

/// What does not change about a user: fingers and scripts.
#[derive(Clone, Debug, PartialEq)]
pub struct UserModel {
    fingers: Vec<FingerModel>,
    /// Each with the fingers that follow it: the user's, then the own ones of fingers.
    scripts: Vec<(Script, ArrayVec<usize, MAX_FINGERS>)>,
}

/// A user's state at the instant of `tick`, before anything is written there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UserState {
    /// The tick of whose instant the rest speaks.
    pub tick: u64,
    /// The fingers' state or constants, one a finger.
    pub fingers: ArrayVec<FingerState, MAX_FINGERS>,
    /// How far the scripts are: the user's, if a finger follows it, then the own ones of fingers.
    pub scripts: ArrayVec<ScriptState, MAX_FINGERS>,
}

impl UserModel {
    /// The user at `host` of a scene.
    ///
    /// # Errors
    /// When the scene's hand is none (a checked one is).
    ///
    /// # Panics
    /// When the scene has no such host.
    pub fn new(scene: &Scene, host: HostIndex) -> Result<Self, FingerError> {
        let user = &scene.users[host.index()];
        let own = |finger: usize| !user.fingers[finger].script.is_empty();
        let count = user.fingers.len().min(MAX_FINGERS);
        let common: ArrayVec<usize, MAX_FINGERS> = (0..count).filter(|&finger| !own(finger)).collect();
        let mut scripts = Vec::new();
        if !common.is_empty() {
            scripts.push((Script::new(scene, host, None), common));
        }
        for finger in (0..count).filter(|&finger| own(finger)) {
            scripts.push((Script::new(scene, host, Some(finger)), [finger].into_iter().collect()));
        }
        let fingers = (0..count).map(|finger| {
            let script = scripts.iter().find(|(_, fingers)| fingers.contains(&finger));
            let (script, _) = script.expect("each finger follows a script");
            FingerModel::new(
                scene.hand_impedance(),
                &scene.device,
                scene.space,
                user.fingers[finger].position_m,
                script.tracking(),
                script.period_s(),
            )
        });
        Ok(Self { fingers: fingers.collect::<Result<_, _>>()?, scripts })
    }

    /// The fingers' state or constants, one a finger.
    #[must_use]
    pub fn fingers(&self) -> &[FingerModel] {
        &self.fingers
    }

    /// The state at `tick` of a user whose fingers rest at `positions` (m), sees `bodies` and begins the scripts.
    #[must_use]
    pub fn at_rest(&self, tick: u64, positions: &[DVec3], bodies: &[Pose]) -> UserState {
        let at_rest = |(model, &position): (&FingerModel, &DVec3)| model.at_rest(position);
        let fingers: ArrayVec<_, MAX_FINGERS> = self.fingers.iter().zip(positions).map(at_rest).collect();
        let mut state = UserState { tick, fingers, scripts: ArrayVec::new() };
        self.begin_scripts(&mut state, bodies);
        state
    }

    fn touches(&self, fingers: &[FingerState], members: &[usize]) -> ArrayVec<Touch, MAX_FINGERS> {
        members.iter().map(|&finger| self.fingers[finger].touch(&fingers[finger])).collect()
    }

    /// What the devices report.
    #[must_use]
    pub fn readings(&self, state: &UserState) -> Readings {
        self.fingers.iter().zip(&state.fingers).map(|(model, state)| model.reading(state)).collect()
    }

    /// Advances `state`, at which the devices report `readings`, by one haptic period under the held forces, with the user
    /// seeing `bodies`. No allocation, no lock, bounded work.
    pub fn step(&self, state: &mut UserState, readings: &[Reading], bodies: &[Pose]) {
        let drives = self.drives(state, bodies);
        state.move_fingers(&self.fingers, readings, &drives);
    }

    /// How far the scripts are.
    pub(crate) fn script_progress(&self, state: &UserState) -> ScriptProgress {
        let mut scripts = self.scripts.iter().zip(&state.scripts);
        if !self.scripts.iter().any(|(script, _)| script.has_actions()) {
            ScriptProgress::None
        } else if scripts.all(|((script, _), state)| script.is_over(state)) {
            ScriptProgress::Over
        } else {
            ScriptProgress::Running
        }
    }

    /// What the scripts ask of the fingers from the state's tick to the next, one drive a finger.
    pub(crate) fn drives(&self, state: &mut UserState, bodies: &[Pose]) -> [Drive; MAX_FINGERS] {
        let mut drives = [Drive::default(); MAX_FINGERS];
        for ((script, members), script_state) in self.scripts.iter().zip(&mut state.scripts) {
            let touches = self.touches(&state.fingers, members);
            let driven = script.drive(script_state, state.tick, &touches, bodies);
            for (&finger, drive) in members.iter().zip(driven) {
                drives[finger] = drive;
            }
        }
        drives
    }

    /// Begins the scripts at the state's tick, from where the fingers are and however they move.
    fn begin_scripts(&self, state: &mut UserState, bodies: &[Pose]) {
        let begin = |(script, members): &(Script, ArrayVec<usize, MAX_FINGERS>)| {
            script.begin(state.tick, &self.touches(&state.fingers, members), bodies)
        };
        let scripts = self.scripts.iter().map(begin).collect();
        state.scripts = scripts;
    }
}

impl UserState {
    /// One period on: each finger as its constants in `fingers` say, drawn as `drives` say. No allocation.
    fn move_fingers(&mut self, fingers: &[FingerModel], readings: &[Reading], drives: &[Drive]) {
        let models = fingers.iter().zip(readings).zip(drives);
        for (((model, reading), drive), finger) in models.zip(&mut self.fingers) {
            model.step(finger, reading, drive);
        }
        self.tick += 1;
    }
}

/// A [`Device`] in the hand of a simulated user: every finger of it renders any force (within its motors' torques) and no
/// torque.
///
/// [`read`](Device::read) reports the state at a tick; [`write`](Device::write) stores the forces and advances the
/// user by exactly one period, to the next tick's instant. A read at a later tick than that first catches up, the
/// last forces and the last view being held: a loop that skipped ticks finds the fingers where they would be (work in
/// proportion to the ticks skipped, at most [`MAX_TICKS_AHEAD`]). Neither allocates nor locks.
///
/// What the user saw last is not part of the state: it is shown anew before every write.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedUser {
    name: String,
    model: UserModel,
    limits: DeviceLimits,
    state: UserState,
    /// At the state, in the scene's world.
    readings: Readings,
    /// In the scene's world.
    seen: Vec<Pose>,
    /// From the scene's world, in which the state is told, to the present one, m.
    moved: DVec3,
    switch: SoftwareSwitch,
}

impl SimulatedUser {
    /// The user at `host` of a scene, whose fingers rest at their start at tick 0.
    ///
    /// # Errors
    /// When the scene's hand is none (a checked one is).
    ///
    /// # Panics
    /// When the scene has no such host.
    pub fn new(scene: &Scene, host: HostIndex) -> Result<Self, FingerError> {
        let model = UserModel::new(scene, host)?;
        let pose = |body: &cotouch_scene::scene::Body| Pose {
            position: body.position_m,
            orientation: glam::DQuat::from_scaled_axis(body.rotation_rad),
        };
        let seen: Vec<Pose> = scene.world_bodies().iter().map(pose).collect();
        let starts: ArrayVec<_, MAX_FINGERS> = model.fingers.iter().map(FingerModel::rest).collect();
        let state = model.at_rest(0, &starts, &seen);
        let readings = model.readings(&state);
        let name = scene.users[host.index()].name.clone();
        let forces = model.fingers.iter().map(FingerModel::everywhere_n);
        let limits = DeviceLimits { max_force_n: forces.fold(f64::INFINITY, f64::min), max_torque_n_m: 0.0 };
        let (moved, switch) = (DVec3::ZERO, SoftwareSwitch::default());
        Ok(Self { name, model, limits, state, readings, seen, moved, switch })
    }

    /// What does not change about the user.
    #[must_use]
    pub fn model(&self) -> &UserModel {
        &self.model
    }

    /// The user's state at the present tick.
    #[must_use]
    pub fn state(&self) -> &UserState {
        &self.state
    }

    /// Where the scripts are: the user's, if a finger follows it, then the own ones of fingers.
    pub fn places_in_scripts(&self) -> impl Iterator<Item = PlaceInScript> {
        self.model.scripts.iter().zip(&self.state.scripts).map(|((script, _), state)| script.place(state))
    }

    /// The fingers' states now; places are in the scene's world (see [`Device::recentre`]).
    #[must_use]
    pub fn states(&self) -> &[FingerState] {
        &self.state.fingers
    }

    /// Replaces the state of one finger. What the finger cannot do is left out of position and velocity.
    ///
    /// # Panics
    /// When there is no such finger.
    #[cfg(feature = "testing")]
    pub fn set_state(&mut self, finger: usize, state: FingerState) {
        self.state.fingers[finger] = self.model.fingers[finger].allowed(state);
        self.readings = self.model.readings(&self.state);
    }

    /// Goes back to a state of this user.
    pub fn restore(&mut self, state: UserState) {
        self.state = state;
        self.readings = self.model.readings(&self.state);
    }

    /// Begins anew at `tick`, at rest where the fingers are, with the scripts' first actions: for a user who joins late.
    pub fn restart(&mut self, tick: u64) {
        let places: ArrayVec<_, MAX_FINGERS> = self.states().iter().map(|state| state.position).collect();
        self.restore(self.model.at_rest(tick, &places, &self.seen));
    }

    /// One period on, by the scripts.
    pub(crate) fn step(&mut self) {
        self.model.step(&mut self.state, &self.readings, &self.seen);
        self.readings = self.model.readings(&self.state);
    }

    /// One period on, with `fingers` for constants and drawn as `drives` say; the scripts stand still.
    pub(crate) fn step_driven(&mut self, fingers: &[FingerModel], drives: &[Drive]) {
        self.state.move_fingers(fingers, &self.readings, drives);
        self.readings = self.model.readings(&self.state);
    }

    /// What the scripts ask of the fingers at the present tick; nothing moves on.
    pub(crate) fn asked_by_scripts(&self) -> [Drive; MAX_FINGERS] {
        self.model.drives(&mut self.state.clone(), &self.seen)
    }

    /// Begins the scripts at the present tick, from where the fingers are and however they move.
    pub(crate) fn begin_scripts(&mut self) {
        self.model.begin_scripts(&mut self.state, &self.seen);
    }

    /// From the scene's world to the present one, m.
    pub(crate) fn moved(&self) -> DVec3 {
        self.moved
    }

    /// Goes on to `tick` with as many `step`s as that takes.
    pub(crate) fn catch_up(&mut self, tick: u64, mut step: impl FnMut(&mut Self)) -> Result<(), DeviceError> {
        let at = self.state.tick;
        if tick.checked_sub(at).is_none_or(|ahead| ahead > MAX_TICKS_AHEAD) {
            return Err(DeviceError::TickOutOfReach { asked: tick, at, max_ahead: MAX_TICKS_AHEAD });
        }
        self.obey_switch();
        while self.state.tick < tick {
            step(self);
        }
        Ok(())
    }

    /// What the devices report, in the present world.
    pub(crate) fn shown(&self) -> Readings {
        let mut readings = self.readings.clone();
        for reading in &mut readings {
            reading.pose.position = self.moved + reading.pose.position;
        }
        readings
    }

    /// The devices render `wrenches` from now on.
    pub(crate) fn hold(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        check_finite(wrenches)?;
        for ((model, finger), wrench) in self.model.fingers.iter().zip(&mut self.state.fingers).zip(wrenches)
        {
            finger.held_force = model.rendered(finger.position, wrench.force);
        }
        self.obey_switch();
        Ok(())
    }

    /// No force is held on while it is switched off.
    fn obey_switch(&mut self) {
        if self.switch.is_disabled() {
            self.state.fingers.iter_mut().for_each(|finger| finger.held_force = DVec3::ZERO);
        }
    }
}

impl Device for SimulatedUser {
    fn name(&self) -> &str {
        &self.name
    }

    fn fingers(&self) -> usize {
        self.model.fingers.len()
    }

    /// No torque, and as much force as the motors render everywhere and in every direction: within it the device's own
    /// limit, which depends on where a finger is, never acts.
    fn limits(&self) -> DeviceLimits {
        self.limits
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.switch.handle()
    }

    fn start(&mut self, tick: u64) {
        self.restart(tick);
    }

    /// All fingers are moved alike. What the user sees is from then on told in the moved world, too.
    fn recentre(&mut self, position: DVec3) {
        let Some((model, state)) = self.model.fingers.first().zip(self.state.fingers.first()) else { return };
        self.moved = model.freed(position - state.position);
    }

    fn script_progress(&self) -> ScriptProgress {
        self.model.script_progress(&self.state)
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        for (seen, shown) in self.seen.iter_mut().zip(view.bodies) {
            *seen = Pose { position: shown.position - self.moved, ..*shown };
        }
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        self.catch_up(tick, Self::step)?;
        Ok(self.shown())
    }

    /// One wrench a finger; fingers beyond the last keep theirs.
    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.hold(wrenches)?;
        self.step();
        Ok(())
    }

    fn rendered(&self) -> Wrenches {
        let is_disabled = self.switch.is_disabled();
        let force = |finger: &FingerState| if is_disabled { DVec3::ZERO } else { finger.held_force };
        self.states().iter().map(|finger| Wrench::force(force(finger))).collect()
    }
}
