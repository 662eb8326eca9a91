//! The largest force that a session as scripted may ask a device for.
//!
//! An estimate from statics, for every finger, and no bound: what a force that swings builds up near a resonance, the blow of a
//! hand that a force has sped up, and hands that paths draw apart through one body are not in it.
//!
//! ```text
//! F = 2·(grip + weight + Σ pushes of all other fingers) + max(2·own push, 2·1 N, path) + rendered
//! ```
//!
//! Grip is what its script grasps with. Weight is that of the heaviest body that moves, of all its copies, shared by the
//! user's fingers: who lifts one lifts all. Pushes are open-loop forces, which reach any finger through what lies
//! between. Twice, because a force that begins at once moves an undamped spring to twice where it rests under it. A pointer on the page counts as
//! 1 N, as in the adversary's hands. Paths begin and end smoothly: hand and bodies are moved along them (all hands, and
//! the heaviest body with all its copies, by the largest acceleration), or they press, by the spring of tracking, as far as
//! they lead into a wall, a fixed body or a soft one. A weight is taken to be lowered no further than it was lifted.
//!
//! Rendered is what devices render besides the session's forces ([`HandImpedance::rendered`]) on the longest and the fastest of
//! all fingers' paths, for who holds a body goes where others carry it: its spring over all that such a script travels, and its damper.
//! What open-loop forces ask of that damper is in their own terms, for they are what moves against it.
//!
//! [`HandImpedance::rendered`]: cotouch_scene::scene::HandImpedance::rendered
//!
//! A force changes by no more than that within one tick: a contact that closes begins with its damper's whole force.

use cotouch_scene::mechanism::Placed;
use cotouch_scene::scene::{Action, Architecture, Body, Finger, Scene, SpringDamper, User};
use glam::DVec3;

use crate::operating_point::{has_surface, reach_m};

/// Of a force that begins at once: the largest deflection of an undamped spring over its static one.
const AT_ONCE: f64 = 2.0;
/// What a pointer on the page is taken to pull with.
const POINTER_N: f64 = 1.0;
/// The peak of a band-limited random force over its root mean square, but for one instant in 15 000 (Gaussian).
const PEAK_OF_RMS: f64 = 4.0;

/// The largest force that the session as scripted may ask for at any finger, N.
pub(super) fn demanded_n(scene: &Scene) -> f64 {
    let bodies = scene.world_bodies();
    let at = Place { scene, bodies: &bodies };
    let fingers: Vec<(&User, usize)> = scene
        .users
        .iter()
        .flat_map(|user| (0..user.fingers.len()).map(move |finger| (user, finger)))
        .collect();
    let pushes_n: Vec<f64> = fingers.iter().map(|&(user, finger)| largest_push_n(user, finger)).collect();
    let all_pushes_n: f64 = pushes_n.iter().sum();
    let rendered_n = at.rendered_n(&fingers);
    let of_finger = |(&(user, finger), own_n): (&(&User, usize), &f64)| {
        let steady_n = grip_n(user, finger) + at.weight_n(user) + (all_pushes_n - own_n);
        AT_ONCE * steady_n + (AT_ONCE * own_n.max(POINTER_N)).max(at.largest_path_n(user, finger))
    };
    fingers.iter().zip(&pushes_n).map(of_finger).fold(0.0, f64::max) + rendered_n
}

/// The force (N) that motors render everywhere in the workspace and in every direction; infinite where nothing limits them.
pub(super) fn motors_render_n(scene: &Scene) -> f64 {
    let limit_n_m = scene.device.max_joint_torque_n_m;
    let lever_m =
        Placed::of_finger(&scene.device, DVec3::ZERO).map(|placed| placed.mechanism.longest_lever_m());
    lever_m.filter(|_| limit_n_m > 0.0).map_or(f64::INFINITY, |lever_m| limit_n_m / lever_m)
}

/// What a finger's script grasps with, N.
fn grip_n(user: &User, finger: usize) -> f64 {
    let of_action = |action: &Action| match *action {
        Action::Grasp { force_n, .. } => force_n,
        _ => 0.0,
    };
    user.script_of(finger).iter().map(of_action).fold(0.0, f64::max)
}

/// The largest open-loop force of a finger's script, N.
fn largest_push_n(user: &User, finger: usize) -> f64 {
    let of_action = |action: &Action| match *action {
        Action::Force { force_n, .. } | Action::PushAndLetGo { force_n, .. } => force_n.length(),
        Action::SinusoidalForce { amplitude_n, .. } => amplitude_n.length(),
        Action::Tremor { rms_n, .. } => PEAK_OF_RMS * rms_n.length(),
        Action::Push { force_n, .. } => force_n.length() / user.fingers.len() as f64,
        _ => 0.0,
    };
    user.script_of(finger).iter().map(of_action).fold(0.0, f64::max)
}

/// Where paths lead.
struct Place<'a> {
    scene: &'a Scene,
    bodies: &'a [Body],
}

/// A way that a hand tracks.
struct Path {
    /// To where it leads farthest from its beginning, m.
    by: DVec3,
    /// Whether it leads there and as far to the other side.
    both_sides: bool,
    /// The largest speed, m/s.
    speed: f64,
    /// The largest acceleration, m/s².
    acceleration: f64,
    /// Where it ends, where that is known, m.
    to: Option<DVec3>,
    /// Whether walls may be in its way.
    meets_walls: bool,
}

impl Place<'_> {
    fn copies(&self) -> f64 {
        match self.scene.session.architecture {
            Architecture::Distributed => f64::from(self.scene.session.users),
            Architecture::Centralized => 1.0,
        }
    }

    /// All copies of the heaviest body that moves, kg.
    fn heaviest_kg(&self) -> f64 {
        let moving = self.bodies.iter().filter(|body| !body.fixed).map(|body| body.mass_kg);
        self.copies() * moving.fold(0.0, f64::max)
    }

    /// A finger's share of a weight that its user holds alone, N.
    fn weight_n(&self, user: &User) -> f64 {
        self.heaviest_kg() * self.scene.gravity_m_per_s2.length() / user.fingers.len() as f64
    }

    /// What moves along a path, kg.
    fn moved_kg(&self) -> f64 {
        let fingers: usize = self.scene.users.iter().map(|user| user.fingers.len()).sum();
        fingers as f64 * self.scene.hand_impedance().mass_kg + self.heaviest_kg()
    }

    /// The largest force that a finger's paths ask for, N.
    fn largest_path_n(&self, user: &User, number: usize) -> f64 {
        let asked_n = |path: Path| {
            let moving_n = self.moved_kg() * path.acceleration;
            let pressing_n = user.tracking.stiffness_n_per_m * self.pressed_m(&path);
            moving_n.max(pressing_n)
        };
        self.paths(user, number).map(asked_n).fold(0.0, f64::max)
    }

    /// What a device renders, whatever its finger touches, where any script leads its hand farthest and fastest, N.
    fn rendered_n(&self, fingers: &[(&User, usize)]) -> f64 {
        let rendered = self.scene.hand_impedance().rendered;
        if rendered == SpringDamper::default() {
            return 0.0;
        }
        let paths = |&(user, finger): &(&User, usize)| self.paths(user, finger).collect::<Vec<Path>>();
        let all: Vec<Vec<Path>> = fingers.iter().map(paths).collect();
        let fastest = all.iter().flatten().map(|path| path.speed).fold(0.0, f64::max);
        let travelled_m = |paths: &Vec<Path>| paths.iter().map(|path| path.by.length()).sum();
        let farthest_m = all.iter().map(travelled_m).fold(0.0, f64::max);
        rendered.stiffness_n_per_m * farthest_m + rendered.damping_n_s_per_m * fastest
    }

    /// All ways that a finger tracks, one after the other.
    fn paths(&self, user: &User, number: usize) -> impl Iterator<Item = Path> {
        let finger = &user.fingers[number];
        let mut at = finger.position_m;
        user.script_of(number).iter().filter_map(move |action| {
            let path = self.path(action, at, finger)?;
            at = path.to.unwrap_or(at);
            Some(path)
        })
    }

    /// The way of an action that tracks one, from where the finger was.
    fn path(&self, action: &Action, at: DVec3, finger: &Finger) -> Option<Path> {
        let smooth = |by: DVec3, duration_s: f64, meets_walls: bool| Path {
            by,
            both_sides: false,
            speed: minimum_jerk_speed(by.length(), duration_s),
            acceleration: minimum_jerk_acceleration(by.length(), duration_s),
            to: None,
            meets_walls,
        };
        match *action {
            Action::Reach { to_m, duration_s } => {
                Some(Path { to: Some(to_m), ..smooth(to_m - at, duration_s, true) })
            }
            Action::Sinusoid { amplitude_m, frequency_hz, .. } => {
                let rate = std::f64::consts::TAU * frequency_hz;
                let speed = amplitude_m.length() * rate;
                let acceleration = speed * rate;
                Some(Path {
                    by: amplitude_m,
                    both_sides: true,
                    speed,
                    acceleration,
                    to: None,
                    meets_walls: true,
                })
            }
            Action::Carry { by_m, duration_s } => Some(smooth(by_m, duration_s, true)),
            Action::CarryTo { to_m, duration_s } => Some(smooth(to_m - at, duration_s, true)),
            Action::Lift { height_m, duration_s } => Some(smooth(DVec3::Z * height_m, duration_s, false)),
            Action::LetGo { distance_m, duration_s } => {
                Some(smooth(DVec3::X * distance_m, duration_s, false))
            }
            Action::Turn { angle_rad, duration_s } => {
                let arm_m = |body: &Body| body.position_m.distance(finger.position_m);
                let farthest_m = self.bodies.iter().map(arm_m).fold(0.0, f64::max);
                Some(smooth(DVec3::X * (farthest_m * angle_rad), duration_s, false))
            }
            _ => None,
        }
    }

    /// How far a path leads into what does not give way, m.
    fn pressed_m(&self, path: &Path) -> f64 {
        let length_m = path.by.length();
        if self.scene.soft.exists() {
            return length_m;
        }
        let across = |normal: DVec3| {
            let into_m = -path.by.dot(normal.normalize());
            if path.both_sides { into_m.abs() } else { into_m }
        };
        let walls = self.scene.walls();
        let walls = walls.iter().filter(|_| path.meets_walls).map(|wall| across(wall.normal));
        let fixed = self.bodies.iter().filter(|body| body.fixed && has_surface(&body.shape));
        let into = |body: &Body| {
            let to = path.to.unwrap_or(DVec3::INFINITY);
            reach_m(&body.shape) + self.scene.hand.finger_radius_m - to.distance(body.position_m)
        };
        walls.chain(fixed.map(into)).fold(0.0, f64::max).min(length_m)
    }
}

/// The largest speed on a minimum-jerk path, 15/8·d/T (Flash & Hogan 1985), m/s.
fn minimum_jerk_speed(distance_m: f64, duration_s: f64) -> f64 {
    1.875 * distance_m / duration_s
}

/// The largest acceleration on a minimum-jerk path, 10/√3·d/T² (Flash & Hogan 1985), m/s².
fn minimum_jerk_acceleration(distance_m: f64, duration_s: f64) -> f64 {
    10.0 / 3.0_f64.sqrt() * distance_m / (duration_s * duration_s)
}
