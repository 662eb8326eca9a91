//! Random scenes on both sides of the line at which a contact mode turns unstable.

use std::fmt::Write as _;

use cotouch_analysis::analyze_settled;
use cotouch_scene::scene::{Action, Scene, SceneValues, SpringDamper, User};
use cotouch_testkit::Random;
use glam::DVec3;

/// Gains are spread over such shares of those at which a mode turns unstable.
const SHARES: (f64, f64) = (0.2, 2.5);
/// Factors on all gains among which the line is looked for.
const FACTORS: (f64, f64) = (1.0 / 64.0, 64.0);
/// The line is found to a factor of 64² / 2^14, which is a hundredth of [`SHARES`].
const BISECTIONS: u32 = 9;
/// One of so many scenes has a soft body.
const ONE_SOFT_OF: usize = 12;

/// A finger's radius and how far it is from the surface at first, m.
const RADIUS_M: f64 = 0.008;
const GAP_M: f64 = 0.003;
/// Half the size of boxes, m.
const HALF_M: DVec3 = DVec3::new(0.05, 0.04, 0.03);
/// Radius of balls and capsules, and half the length of a capsule's axis, m.
const ROUND_M: f64 = 0.04;
const AXIS_M: f64 = 0.03;

/// How many people with how many fingers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crowd {
    /// Two with one finger each, which is quick to analyse.
    Small,
    /// Two to four with one or two; things may have weight, and there may be a second body.
    Any,
}

/// A random scene whose hands have yet to be told what to do.
pub(super) struct Drawn {
    pub(super) scene: Scene,
    /// For each user, for each finger, the unit vector into the surface.
    pub(super) inward: Vec<Vec<DVec3>>,
}

impl Drawn {
    /// The scene of a seed.
    pub(super) fn new(seed: u64, crowd: Crowd) -> Self {
        let mut random = Random::new(seed);
        // The first numbers of neighbouring seeds are alike.
        for _ in 0..8 {
            random.unit();
        }
        let drawn = if random.below(ONE_SOFT_OF) == 0 {
            Self::soft(&mut random)
        } else {
            // Of numbers of their own, so that a seed is the same scene but for them.
            Self::rigid(&mut random, crowd, &mut Random::new(!seed))
        };
        drawn.around_the_line(&mut random)
    }

    fn rigid(random: &mut Random, crowd: Crowd, of_surroundings: &mut Random) -> Self {
        let space = one_of(random, &["line", "plane", "plane", "space"]);
        let shape = match space {
            "line" => "box",
            _ => one_of(random, &["box", "box", "ball", "capsule", "mesh"]),
        };
        let (users, fingers) = match crowd {
            Crowd::Small => (2, 1),
            Crowd::Any if space == "line" => (one_of(random, &[2, 2, 3, 4]), 1),
            Crowd::Any => (one_of(random, &[2, 2, 2, 2, 3, 3, 4]), one_of(random, &[1, 1, 2])),
        };
        let surface = Surface { shape, space };
        let surroundings = match crowd {
            Crowd::Small => Surroundings::default(),
            Crowd::Any => Surroundings::new(of_surroundings, space),
        };
        let places = places(random, &surface, users, fingers);
        let mut text = format!("space = \"{space}\"\n{}", surroundings.gravity());
        text += &session(random, users);
        text += &object(random, &surface, surroundings);
        text += &couplings(random, space);
        text += &walls(random, &surface, surroundings);
        Self::parse(&(text + &people(random, &places)), &places)
    }

    /// A block, held at one end, under up to two users' fingers.
    fn soft(random: &mut Random) -> Self {
        let users = one_of(random, &[1, 2]);
        let size_m = DVec3::new(0.16, 0.06, 0.06);
        let above = |x: f64| (DVec3::new(x, 0.03, size_m.z + RADIUS_M + GAP_M), DVec3::NEG_Z);
        let places: Vec<Vec<_>> = [0.07, 0.15][..users].iter().map(|&x| vec![above(x)]).collect();
        let model = one_of(random, &["hold", "p", "pi", "compliance"]);
        let text = format!(
            "space = \"space\"\n{}simulation_hz = {}\n\
             [soft]\nmodel = \"corotational\"\nyoung_pa = {}\npoisson_ratio = 0.3\ndensity_kg_per_m3 = 1000\n\
             mesh = {{ generator = \"block\", size_m = [0.16, 0.06, 0.06], cells = [4, 2, 2] }}\n\
             [[soft.fixed]]\nfrom_m = [0, 0, 0]\nto_m = [0, 0.06, 0.06]\n\
             [local_model]\nkind = \"{model}\"\nfriction = 0.6\n{}",
            session(random, users),
            one_of(random, &[30, 60]),
            random.log_uniform(5e3, 5e5),
            people(random, &places)
        );
        Self::parse(&text, &places)
    }

    fn parse(text: &str, places: &[Vec<(DVec3, DVec3)>]) -> Self {
        let scene = cotouch_scene::parse(text, "a random scene", None, &[]);
        let scene = scene.unwrap_or_else(|errors| panic!("{errors}\n{text}"));
        let inward = places.iter().map(|user| user.iter().map(|&(_, inward)| inward).collect()).collect();
        Self { scene, inward }
    }

    /// The same with all gains at a random share of those at which a mode of its settled grasp turns unstable; with the gains
    /// that it has where there are none.
    fn around_the_line(self, random: &mut Random) -> Self {
        let share = random.log_uniform(SHARES.0, SHARES.1);
        let at_line = if self.scene.soft.exists() { None } else { self.line() };
        let scene = self.scaled(at_line.unwrap_or(1.0) * share);
        Self { scene, ..self }
    }

    /// The factor at which a mode turns unstable, to a hundredth.
    fn line(&self) -> Option<f64> {
        let pressed = Self { scene: self.pressed(), inward: self.inward.clone() };
        let is_stable = |factor: f64| {
            analyze_settled(&pressed.scaled(factor)).expect("a small loop").each_mode_is_stable()
        };
        let (mut stable, mut unstable) = FACTORS;
        if !is_stable(stable) || is_stable(unstable) {
            return None;
        }
        for _ in 0..BISECTIONS {
            let between = (stable * unstable).sqrt();
            *if is_stable(between) { &mut stable } else { &mut unstable } = between;
        }
        Some((stable * unstable).sqrt())
    }

    /// With hands that all press.
    pub(super) fn pressed(&self) -> Scene {
        let press = |(user, inward): (&mut User, &Vec<DVec3>)| {
            for (finger, &inward) in user.fingers.iter_mut().zip(inward) {
                finger.script = vec![Action::Force { force_n: inward, duration_s: 1.0 }];
            }
        };
        let edited = self.scene.edit(|scene| scene.users.iter_mut().zip(&self.inward).for_each(press));
        edited.expect("hands may press")
    }

    /// With all springs and dampers of couplings and walls times a factor; of a soft body, its contacts' stiffness.
    fn scaled(&self, factor: f64) -> Scene {
        let scale = |spring: &mut SpringDamper| {
            spring.stiffness_n_per_m *= factor;
            spring.damping_n_s_per_m *= factor;
        };
        let change = |scene: &mut SceneValues| {
            let coupling = &mut scene.coupling;
            for spring in [
                &mut coupling.hand_object,
                &mut coupling.remote_hand_object,
                &mut coupling.object_object,
                &mut coupling.hand_object_tangential,
                &mut coupling.remote_hand_object_tangential,
            ] {
                scale(spring);
            }
            coupling.object_object_rotational.stiffness_n_m_per_rad *= factor;
            coupling.object_object_rotational.damping_n_m_s_per_rad *= factor;
            scene.wall.stiffness_n_per_m *= factor;
            scene.wall.damping_n_s_per_m *= factor;
            if scene.soft.exists() {
                scene.local_model.stiffness_ratio *= factor;
            }
        };
        self.scene.edit(change).expect("gains in their ranges")
    }
}

/// What is around the body that hands touch.
#[derive(Clone, Copy, Debug, Default)]
struct Surroundings {
    /// Things have weight, and there is a floor.
    weighs: bool,
    /// Another body stands beside it, out of reach.
    beside: bool,
}

impl Surroundings {
    fn new(random: &mut Random, space: &str) -> Self {
        // The first numbers of neighbouring seeds are alike.
        for _ in 0..8 {
            random.unit();
        }
        let (weighs, beside) = (random.below(4) == 0, random.below(8) == 0);
        Self { weighs: weighs && space == "space", beside: beside && space != "line" }
    }

    fn gravity(self) -> &'static str {
        if self.weighs { "gravity_m_per_s2 = [0, 0, -9.81]\n" } else { "" }
    }
}

pub(super) fn one_of<T: Copy>(random: &mut Random, among: &[T]) -> T {
    among[random.below(among.len())]
}

fn spring(stiffness: f64, damping: f64) -> String {
    format!("{{ stiffness_n_per_m = {stiffness}, damping_n_s_per_m = {damping} }}")
}

fn random_spring(random: &mut Random, stiffness: (f64, f64), damping: (f64, f64)) -> String {
    spring(random.log_uniform(stiffness.0, stiffness.1), random.log_uniform(damping.0, damping.1))
}

/// Ends in the table of rates.
fn session(random: &mut Random, users: usize) -> String {
    format!(
        "[session]\narchitecture = \"{}\"\nusers = {users}\ncoordination = \"{}\"\nintegrator = \"{}\"\n\
         [link]\ndelay_periods = {}\n\
         [hand]\nmass_kg = {}\ndamping_n_s_per_m = {}\nfinger_radius_m = {RADIUS_M}\n\
         [rates]\n{}\n",
        one_of(random, &["distributed", "distributed", "centralized"]),
        one_of(random, &["pairwise", "average"]),
        one_of(random, &["exact-hold", "exact-hold", "semi-implicit-euler"]),
        random.below(3),
        random.log_uniform(0.05, 0.3),
        random.log_uniform(0.5, 10.0),
        one_of(
            random,
            &[
                "control_hz = 1024\nnetwork_hz = 128",
                "control_hz = 1024\nnetwork_hz = 128",
                "control_hz = 1000\nnetwork_hz = 100",
                "control_hz = 1024\nnetwork_hz = 512",
                "control_hz = 500\nnetwork_hz = 250",
                "control_hz = 1000\nnetwork_hz = 1000",
            ]
        ),
    )
}

fn object(random: &mut Random, surface: &Surface, surroundings: Surroundings) -> String {
    let shape = surface.shape;
    let of_box = format!("size_m = {}", vector(2.0 * HALF_M));
    let form = match shape {
        "box" => of_box.clone(),
        "ball" => format!("radius_m = {ROUND_M}"),
        "capsule" => format!("radius_m = {ROUND_M}\nlength_m = {}", 2.0 * AXIS_M),
        _ => format!("mesh = \"{}/tests/meshes/wedge.obj\"", env!("CARGO_MANIFEST_DIR")),
    };
    let friction = 0.2 + 0.8 * random.unit();
    let mass = random.log_uniform(0.1, 1.0);
    let body = format!("mass_kg = {mass}\nshape = \"{shape}\"\n{form}\n");
    let bodies = match surroundings.beside {
        true => {
            let at = vector(DVec3::new(0.0, 0.4, HALF_M.z - surface.lowest_m()));
            let other = format!("mass_kg = {mass}\nshape = \"box\"\n{of_box}\nposition_m = {at}\n");
            format!("[[body]]\nname = \"object\"\n{body}[[body]]\nname = \"other\"\n{other}")
        }
        false => format!("[object]\n{body}"),
    };
    // Weights are no reason for a limit to act.
    let governor = match surroundings.weighs {
        true => "[governor]\nmax_force_n = 200\nmax_slew_n_per_s = 1e6\n",
        false => "",
    };
    format!(
        "{bodies}{governor}[contact]\nstatic_friction = {friction}\ndynamic_friction = {}\n",
        0.9 * friction
    )
}

fn couplings(random: &mut Random, space: &str) -> String {
    let mut text = String::from("[coupling]\n");
    let mut add = |name: &str, spring: String| writeln!(text, "{name} = {spring}").expect("a string");
    let own = (random.log_uniform(300.0, 8000.0), random.log_uniform(1.0, 30.0));
    let remote = (random.log_uniform(50.0, 3000.0), random.log_uniform(0.3, 10.0));
    add("hand_object", spring(own.0, own.1));
    add("remote_hand_object", spring(remote.0, remote.1));
    add("object_object", random_spring(random, (50.0, 2000.0), (1.0, 20.0)));
    if space != "line" {
        let along = random.log_uniform(0.3, 2.0);
        add("hand_object_tangential", spring(along * own.0, along * own.1));
        add("remote_hand_object_tangential", spring(along * remote.0, along * remote.1));
        let (k, b) = (random.log_uniform(0.1, 10.0), random.log_uniform(0.002, 0.1));
        add(
            "object_object_rotational",
            format!("{{ stiffness_n_m_per_rad = {k}, damping_n_m_s_per_rad = {b} }}"),
        );
    }
    text
}

fn walls(random: &mut Random, surface: &Surface, surroundings: Surroundings) -> String {
    let mut text = match surface.space {
        "plane" => format!("[ground]\nfriction_coefficient = {}\n", one_of(random, &[0.0, 0.05])),
        _ => String::new(),
    };
    let (k, b) = (random.log_uniform(500.0, 5000.0), random.log_uniform(3.0, 40.0));
    let right = (random.below(10) < 3).then(|| ("right", DVec3::X * 0.08, DVec3::NEG_X));
    let floor = surroundings.weighs.then(|| ("floor", DVec3::NEG_Z * surface.lowest_m(), DVec3::Z));
    let planes: Vec<_> = right.into_iter().chain(floor).collect();
    if !planes.is_empty() {
        text += &format!("[wall]\nstiffness_n_per_m = {k}\ndamping_n_s_per_m = {b}\n");
    }
    for (name, point, normal) in planes {
        let (point, normal) = (vector(point), vector(normal));
        writeln!(text, "[[wall.plane]]\nname = \"{name}\"\npoint_m = {point}\nnormal = {normal}")
            .expect("a string");
    }
    text
}

fn people(random: &mut Random, places: &[Vec<(DVec3, DVec3)>]) -> String {
    let tracking = random_spring(random, (50.0, 800.0), (1.0, 10.0));
    let mut text = String::new();
    for (user, fingers) in places.iter().enumerate() {
        writeln!(text, "[[user]]\nname = \"user{}\"\ntracking = {tracking}", user + 1).expect("a string");
        for (place, _) in fingers {
            writeln!(text, "[[user.finger]]\nposition_m = {}", vector(*place)).expect("a string");
        }
    }
    text
}

fn vector(DVec3 { x, y, z }: DVec3) -> String {
    format!("[{x}, {y}, {z}]")
}

/// What fingers touch.
struct Surface {
    shape: &'static str,
    space: &'static str,
}

/// For each user, for each finger, where it is at first and the unit vector into the surface: near the middle of sides, but
/// not at it, for what is symmetric stays so. Two fingers of a user are on opposite sides, and so are two users: what nobody
/// holds against slips away.
fn places(random: &mut Random, surface: &Surface, users: usize, fingers: usize) -> Vec<Vec<(DVec3, DVec3)>> {
    let axes = match surface.space {
        "line" => 1,
        "plane" => 2,
        _ => 3,
    };
    let (first, flip) = (random.below(axes), random.below(2));
    let of_user = |user: usize| {
        let axis = DVec3::AXES[(first + user / 2) % axes];
        let (side, aside) =
            (if (user + flip).is_multiple_of(2) { axis } else { -axis }, surface.aside(random));
        let one = surface.place(side, aside);
        let noise = 0.2 * surface.aside(random);
        let other = surface.place(-side, aside + noise);
        [one, other][..fingers].to_vec()
    };
    (0..users).map(of_user).collect()
}

impl Surface {
    /// How far its lowest point is below its centre, m.
    fn lowest_m(&self) -> f64 {
        if matches!(self.shape, "ball" | "capsule") { ROUND_M } else { HALF_M.z }
    }

    /// Up to 1 cm to any side.
    fn aside(&self, random: &mut Random) -> DVec3 {
        let free = match self.space {
            "line" => DVec3::ZERO,
            "plane" => DVec3::new(1.0, 1.0, 0.0),
            _ => DVec3::ONE,
        };
        let mut up_to = || 0.02 * random.unit() - 0.01;
        free * DVec3::new(up_to(), up_to(), up_to())
    }

    fn place(&self, side: DVec3, aside: DVec3) -> (DVec3, DVec3) {
        let far = RADIUS_M + GAP_M;
        let round = |from: DVec3| {
            let outward = (HALF_M.x * side + aside - from).normalize();
            (from + (ROUND_M + far) * outward, -outward)
        };
        match self.shape {
            "ball" => round(DVec3::ZERO),
            "capsule" => round(DVec3::Y * if side.y == 0.0 { aside.y } else { AXIS_M * side.y }),
            "mesh" if side == DVec3::X => {
                // The slanted face through (0.04, 0).
                let (outward, along) = (DVec3::new(4.0, 1.0, 0.0).normalize(), DVec3::new(-1.0, 4.0, 0.0));
                let at = DVec3::X * 0.04 + along.normalize() * aside.y + DVec3::Z * aside.z;
                (at + far * outward, -outward)
            }
            _ => {
                let outward = side * (HALF_M.dot(side.abs()) + far);
                (outward + aside - side * aside.dot(side), -side)
            }
        }
    }
}
