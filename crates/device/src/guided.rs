//! A simulated user whose fingers a pointer draws, while there is one: how a browser's mouse or touch takes part.
//!
//! A pointer says now and then where each finger is to be. What draws the finger, by a [`pointer_spring`], is a target that
//! goes there smoothly: no faster than 1 m/s, through a critically damped second-order filter with its
//! corner at 6 Hz. The target is outside of the loop; the spring is in it, as a script's tracking is.
//!
//! Nothing jumps. When a pointer takes the hand, its target begins where the spring gives just the force that the script
//! gave; when it lets go, the target comes to rest. A hand whose script repeats then lets what the spring still pulls with fade
//! out, and its script begins anew from where the fingers are; any other hand stays there and keeps its grip, until a pointer
//! takes it again or the session begins anew: its script would be out of step with the others'. Without a pointer the user is a [`SimulatedUser`], bit for bit.

use std::f64::consts::TAU;
use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Scene, SceneValues, SpringDamper};
use glam::DVec3;

use crate::device::{Device, DeviceLimits, ScriptProgress, WorldView};
use crate::error::{DeviceError, DeviceOpenError, no_parameters};
use crate::finger::{FingerError, FingerModel, FingerState};
use crate::guide::{Guide, Targets};
use crate::plant::SecondOrderPlant;
use crate::script::Drive;
use crate::setup::DeviceSetup;
use crate::switch::ForceSwitch;
use crate::target::{Progress, Target};
use crate::user::SimulatedUser;

/// The corner of the filter through which a target goes, Hz: a pointer that speaks 20 times a second is smooth.
const POINTER_CORNER_HZ: f64 = 6.0;

/// How fast a target moves at most, m/s.
const POINTER_MAX_SPEED_M_PER_S: f64 = 1.0;

/// How far from the origin a target may be on every axis, m.
pub const POINTER_REACH_M: f64 = 10.0;

/// After a pointer has gone, its target has so long to come to rest, s.
pub const POINTER_STOP_S: f64 = 0.3;

/// Then what the spring still pulls with fades out within this time, s.
pub const POINTER_FADE_S: f64 = 0.3;

/// What `--device` says before the colon.
pub(crate) const NAME: &str = "hand";

/// The device of a spec `hand`, which takes no parameters.
pub(crate) fn open(parameters: &str, setup: DeviceSetup<'_>) -> Result<Box<dyn Device>, DeviceOpenError> {
    no_parameters(NAME, parameters)?;
    let DeviceSetup { scene, host, guide } = setup;
    Ok(Box::new(GuidedUser::new(scene, host, guide)?))
}

/// The spring from a pointer to each finger of the user at `host`: the scene's `tracking`, or a usual one where the scene
/// has none. It is a part of the loop.
///
/// # Panics
/// When the scene has no such host.
#[must_use]
pub fn pointer_spring(scene: &Scene, host: HostIndex) -> SpringDamper {
    scene.users[host.index()].pointer_spring()
}

/// `scene` as the analysis must see it while pointers move the hands of `hosts`: their fingers are tracked by [`pointer_spring`].
/// What scripts say of forces stays, for it sets how hard fingers press on what they hold.
#[must_use]
pub fn guided_scene(scene: &Scene, hosts: &[HostIndex]) -> Scene {
    let guide = |guided: &mut SceneValues| {
        for &host in hosts.iter().filter(|host| host.index() < scene.users.len()) {
            let user = &mut guided.users[host.index()];
            user.tracking = pointer_spring(scene, host);
            let own = user.fingers.iter_mut().map(|finger| &mut finger.script);
            let own = own.filter(|script| !script.is_empty());
            for script in own.chain([&mut user.script]) {
                if !script.iter().any(Action::tracks) {
                    script.push(Action::Hold { duration_s: 1.0 });
                }
            }
        }
    };
    scene.edit(guide).expect("a user who is tracked may hold")
}

/// A [`SimulatedUser`] that follows its script, or a [`Guide`] while that has targets.
pub struct GuidedUser<G> {
    user: SimulatedUser,
    guide: G,
    guided: GuidedModel,
    drawing: Drawing,
}

/// What does not change about a user whom a pointer guides.
struct GuidedModel {
    /// As the user's own, with the spring for their tracking.
    fingers: Vec<FingerModel>,
    /// Of each finger, whether its script tracks too.
    scripts_track: Vec<bool>,
    /// What a target goes through: its input, times the stiffness, is where it is to be.
    filter: SecondOrderPlant,
    filter_stiffness: f64,
    /// How far behind, in time, the filter follows what moves steadily.
    lag_s: f64,
    /// Whether the script begins anew by itself.
    repeats: bool,
    /// How far a target moves at most in a tick, m.
    max_step_m: f64,
    period_s: f64,
}

/// What draws the fingers.
enum Drawing {
    Script,
    Pointer(Followers),
    /// The pointer has gone; since so many ticks.
    Stopping(Followers, u32),
    /// The pointer has gone, and what it held is held on.
    Holding(Followers),
    /// What is left of the spring's stretch when fading began, and the target's velocity then; since so many ticks.
    Fading(Followers, u32),
}

type Followers = ArrayVec<Follower, MAX_FINGERS>;

/// What draws one finger on its way to a pointer's target.
#[derive(Clone, Copy, Debug)]
struct Follower {
    /// Where the pointer wants it, m.
    goal: DVec3,
    /// What the filter is given: on its way to the goal, m.
    aim: DVec3,
    /// What the finger is drawn to; while fading, what is left of it from the finger.
    target: Target,
}

impl<G: Guide> GuidedUser<G> {
    /// The user at `host` of a scene.
    ///
    /// # Errors
    /// As for [`SimulatedUser::new`].
    ///
    /// # Panics
    /// When the scene has no such host.
    pub fn new(scene: &Scene, host: HostIndex, guide: G) -> Result<Self, FingerError> {
        let user = SimulatedUser::new(scene, host)?;
        let guided = GuidedModel::new(scene, host, user.model().fingers())?;
        Ok(Self { user, guide, guided, drawing: Drawing::Script })
    }

    /// The simulated user, with the state of the fingers.
    #[must_use]
    pub fn user(&self) -> &SimulatedUser {
        &self.user
    }

    /// Takes up what the guide says at this tick.
    fn heed_guide(&mut self) {
        let targets = self.guide.targets();
        let drawing = std::mem::replace(&mut self.drawing, Drawing::Script);
        self.drawing = match (targets, drawing) {
            (None, Drawing::Pointer(followers)) => Drawing::Stopping(self.guided.stopping(followers), 0),
            (None, drawing) => drawing,
            (
                Some(targets),
                Drawing::Pointer(followers) | Drawing::Stopping(followers, _) | Drawing::Holding(followers),
            ) => Drawing::Pointer(self.guided.sent(followers, &targets, self.user.moved())),
            (Some(targets), drawing) => {
                let followers = self.guided.taking_over(&self.user, &drawing);
                Drawing::Pointer(self.guided.sent(followers, &targets, self.user.moved()))
            }
        };
    }
}

impl<G: Guide> Device for GuidedUser<G> {
    fn name(&self) -> &str {
        self.user.name()
    }

    fn fingers(&self) -> usize {
        self.user.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        self.user.limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.user.force_switch()
    }

    fn start(&mut self, tick: u64) {
        self.user.start(tick);
        self.drawing = Drawing::Script;
    }

    fn recentre(&mut self, position: DVec3) {
        self.user.recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.user.observe(view);
    }

    fn is_guided(&self) -> bool {
        true
    }

    /// A hand that is held on has done all that it does by itself.
    fn script_progress(&self) -> ScriptProgress {
        match &self.drawing {
            Drawing::Script => self.user.script_progress(),
            Drawing::Holding(_) => ScriptProgress::Over,
            Drawing::Pointer(_) | Drawing::Stopping(..) | Drawing::Fading(..) => ScriptProgress::Running,
        }
    }

    /// Nothing any more once the pointer has gone, unless what it held is held on.
    fn pointer_targets(&self) -> Targets {
        let followers = match &self.drawing {
            Drawing::Pointer(followers) | Drawing::Holding(followers) => followers,
            Drawing::Stopping(followers, _) if !self.guided.repeats => followers,
            _ => return Targets::new(),
        };
        followers.iter().map(|follower| self.user.moved() + follower.target.position).collect()
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let Self { user, guided, drawing, .. } = self;
        user.catch_up(tick, |user| guided.step(user, drawing))?;
        self.heed_guide();
        Ok(self.user.shown())
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.user.hold(wrenches)?;
        self.guided.step(&mut self.user, &mut self.drawing);
        Ok(())
    }

    fn rendered(&self) -> Wrenches {
        self.user.rendered()
    }
}

impl GuidedModel {
    fn new(scene: &Scene, host: HostIndex, fingers: &[FingerModel]) -> Result<Self, FingerError> {
        let (period_s, rate_rad_per_s) = (scene.rates.control_hz.period_s(), TAU * POINTER_CORNER_HZ);
        let guided = |finger: &FingerModel| {
            let (rest, spring) = (finger.rest(), pointer_spring(scene, host));
            FingerModel::new(scene.hand_impedance(), &scene.device, scene.space, rest, spring, period_s)
        };
        let filter_stiffness = rate_rad_per_s * rate_rad_per_s;
        Ok(Self {
            fingers: fingers.iter().map(guided).collect::<Result<_, _>>()?,
            scripts_track: fingers.iter().map(FingerModel::tracks).collect(),
            filter: SecondOrderPlant::new(1.0, 2.0 * rate_rad_per_s, filter_stiffness, period_s),
            filter_stiffness,
            lag_s: 2.0 / rate_rad_per_s,
            repeats: scene.users[host.index()].repeat,
            max_step_m: POINTER_MAX_SPEED_M_PER_S * period_s,
            period_s,
        })
    }

    /// Targets at which the spring pulls each finger just as it is pulled now. They stay where a script's were; where it
    /// had none, they go to the finger.
    fn taking_over(&self, user: &SimulatedUser, drawing: &Drawing) -> Followers {
        let script = user.asked_by_scripts();
        let fingers = self.fingers.iter().zip(user.states()).enumerate();
        let follower = |(index, (guided, state)): (usize, (&FingerModel, &FingerState))| {
            let (model, drive) = match drawing {
                Drawing::Fading(left, ticks) => (guided, self.faded(index, &left[index], state, *ticks)),
                _ => (&user.model().fingers()[index], script[index]),
            };
            let (goal, velocity) = if model.tracks() {
                (drive.target.position, drive.target.velocity)
            } else {
                (state.position, state.velocity)
            };
            let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = guided.tracking();
            let by_damper = (velocity - state.velocity) * damping_n_s_per_m;
            let stretch = (model.pull(state, &drive) - guided.freed(by_damper)) / stiffness_n_per_m;
            let position = state.position + stretch;
            let target = Target { velocity, ..Target::at(position) };
            // So far ahead the filter neither speeds up nor brakes.
            let aim = position + velocity * self.lag_s;
            Follower { goal: guided.reachable(goal), aim, target }
        };
        fingers.map(follower).collect()
    }

    /// Sends targets to where a pointer says, told in a world that has `moved` (m) from the scene's.
    fn sent(&self, mut followers: Followers, targets: &Targets, moved: DVec3) -> Followers {
        let reach = DVec3::splat(POINTER_REACH_M);
        for ((follower, model), &target) in followers.iter_mut().zip(&self.fingers).zip(targets) {
            if target.is_finite() {
                follower.goal = model.reachable(target.clamp(-reach, reach) - moved);
            }
        }
        followers
    }

    /// Targets that go no further.
    fn stopping(&self, mut followers: Followers) -> Followers {
        for follower in &mut followers {
            follower.goal = follower.aim;
        }
        followers
    }

    /// Goes on by one haptic period.
    fn step(&self, user: &mut SimulatedUser, drawing: &mut Drawing) {
        match drawing {
            Drawing::Script => user.step(),
            Drawing::Pointer(followers) | Drawing::Holding(followers) => {
                self.step_to_targets(user, followers);
            }
            Drawing::Stopping(followers, ticks) => {
                self.step_to_targets(user, followers);
                *ticks += 1;
                if f64::from(*ticks) * self.period_s >= POINTER_STOP_S {
                    *drawing = if self.repeats {
                        Drawing::Fading(what_is_left(followers, user.states()), 0)
                    } else {
                        Drawing::Holding(std::mem::take(followers))
                    };
                }
            }
            Drawing::Fading(left, ticks) => {
                let drive = |(index, (left, state))| self.faded(index, left, state, *ticks);
                let drives: ArrayVec<Drive, MAX_FINGERS> =
                    left.iter().zip(user.states()).enumerate().map(drive).collect();
                user.step_driven(&self.fingers, &drives);
                *ticks += 1;
                if f64::from(*ticks) * self.period_s >= POINTER_FADE_S {
                    user.begin_scripts();
                    *drawing = Drawing::Script;
                }
            }
        }
    }

    /// One period on for fingers, and then for the targets that they are drawn to.
    fn step_to_targets(&self, user: &mut SimulatedUser, followers: &mut Followers) {
        let drive = |follower: &Follower| Drive { force: DVec3::ZERO, target: follower.target };
        let drives: ArrayVec<Drive, MAX_FINGERS> = followers.iter().map(drive).collect();
        user.step_driven(&self.fingers, &drives);
        for Follower { goal, aim, target } in followers {
            *aim += (*goal - *aim).clamp_length_max(self.max_step_m);
            let Target { position, velocity, .. } = *target;
            (target.position, target.velocity) =
                self.filter.step(position, velocity, *aim * self.filter_stiffness);
        }
    }

    /// What still draws a finger in `state` so many ticks after fading began. In the end it is what a script begins with:
    /// tracking of a place at rest, or nothing, not even the damper.
    fn faded(&self, finger: usize, left: &Follower, state: &FingerState, ticks: u32) -> Drive {
        let share = 1.0 - Progress::minimum_jerk(f64::from(ticks) * self.period_s, POINTER_FADE_S).way;
        let position = state.position + left.target.position * share;
        let last = if self.scripts_track[finger] { DVec3::ZERO } else { state.velocity };
        let velocity = last.lerp(left.target.velocity, share);
        Drive { force: DVec3::ZERO, target: Target { velocity, ..Target::at(position) } }
    }
}

/// Targets as seen from the fingers.
fn what_is_left(followers: &Followers, states: &[FingerState]) -> Followers {
    let left = |(follower, state): (&Follower, &FingerState)| {
        let position = follower.target.position - state.position;
        Follower { target: Target { position, ..follower.target }, ..*follower }
    };
    followers.iter().zip(states).map(left).collect()
}
