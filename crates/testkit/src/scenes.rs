//! Scenes that several tests start from.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Action, Architecture, Coordination, Coupling, Finger, Impairment, Integrator, LocalModelKind, PlayOut,
    RotationalSpringDamper, Scene, SceneValues, ShapeKind, Space, SpringDamper, User, WallSides, Way,
};
use cotouch_scene::{Override, load, parse};
use glam::DVec3;
use proptest::prelude::*;

/// A built-in scene with overrides (`key=value`).
///
/// # Panics
/// When there is no such scene, or an override is wrong.
pub fn built_in(name: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().expect("an override")).collect();
    load(name, &overrides).unwrap_or_else(|errors| panic!("{errors}"))
}

/// A spring (N/m) beside a damper (N·s/m).
pub fn spring(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
}

/// The scene with `change` made to its values, which must be allowed.
pub fn edited(scene: &Scene, change: impl FnOnce(&mut SceneValues)) -> Scene {
    scene.edit(change).unwrap()
}

/// Table 6.1 of Fotoohi Ghiam 2006, n = 0.
pub fn table_6_1(architecture: Architecture) -> Scene {
    let name = match architecture {
        Architecture::Centralized => "single-axis-centralized",
        Architecture::Distributed => "single-axis",
    };
    edited(&load(name, &[]).unwrap(), |scene| {
        scene.link.delay_periods = 0;
        scene.wall.sides = WallSides::Two;
        scene.users = users(2);
    })
}

/// So many users with one free finger each, who do nothing.
pub fn users(count: u8) -> Vec<User> {
    let user = |index: u8| User {
        name: format!("user{index}"),
        fingers: vec![finger(DVec3::ZERO)],
        tracking: spring(0.0, 0.0),
        script: vec![],
        repeat: false,
    };
    (0..count).map(user).collect()
}

/// A finger that starts at a place (m) and does nothing.
pub fn finger(position_m: DVec3) -> Finger {
    Finger { position_m, script: vec![] }
}

/// The scene with so many users who do nothing.
pub fn with_users(scene: Scene, count: u8) -> Scene {
    edited(&scene, |scene| (scene.session.users, scene.users) = (count, users(count)))
}

/// Tick and network rate with N ticks a network step.
pub fn with_ratio(scene: Scene, ratio: u32) -> Scene {
    edited(&scene, |scene| scene.rates.network_hz = format!("1024/{ratio}").parse().unwrap())
}

/// A link that delays (s) and spares everything else.
pub fn latency(latency_s: f64) -> Impairment {
    Impairment { latency_s, ..Impairment::NONE }
}

/// One direction between two users, with a latency (s).
pub fn way(from: u8, to: u8, latency_s: f64) -> Way {
    Way { from: HostIndex(from), to: HostIndex(to), impairment: latency(latency_s) }
}

/// Chapter 5: b = 10 N·s/m in every coupler.
pub fn chapter_5(architecture: Architecture, k: [f64; 3], n: u32) -> Scene {
    edited(&table_6_1(architecture), |scene| {
        scene.coupling.hand_object = spring(k[0], 10.0);
        scene.coupling.remote_hand_object = spring(k[1], 10.0);
        scene.coupling.object_object = spring(k[2], 10.0);
        scene.link.delay_periods = n;
    })
}

/// Two users with two fingers each hold a box in the plane: Tables 8.1 and 8.2 of Fotoohi Ghiam 2006, hands of 5 N·s/m
/// that track with 200 N/m, n = 1.
pub fn grasp(architecture: Architecture) -> Scene {
    edited(&table_6_1(architecture), |scene| {
        scene.link.delay_periods = 1;
        scene.space = Space::Plane;
        scene.hand.damping_n_s_per_m = 5.0;
        scene.hand.finger_radius_m = 0.008;
        scene.object.mass_kg = 0.4;
        scene.object.shape.kind = ShapeKind::Box;
        scene.object.shape.size_m = DVec3::new(0.15, 0.1, 0.05);
        scene.contact.static_friction = 0.6;
        scene.contact.dynamic_friction = 0.6;
        scene.coupling = Coupling {
            hand_object: spring(800.0, 3.0),
            remote_hand_object: spring(800.0, 3.0),
            object_object: spring(400.0, 8.0),
            hand_object_tangential: spring(1200.0, 10.0),
            remote_hand_object_tangential: spring(1200.0, 10.0),
            object_object_rotational: RotationalSpringDamper {
                stiffness_n_m_per_rad: 10.0,
                damping_n_m_s_per_rad: 0.1,
            },
        };
        for (user, x) in scene.users.iter_mut().zip([-0.03, 0.03]) {
            user.fingers = vec![finger(DVec3::new(x, -0.073, 0.0)), finger(DVec3::new(x, 0.073, 0.0))];
            user.tracking = spring(200.0, 2.0);
            user.script = vec![grasp_action(2.0)];
        }
    })
}

/// A box on a line between two hands that push at it with 1 N; every host has a copy of its own.
pub struct BoxOnALine {
    /// In a network period.
    pub ticks: u32,
    /// n.
    pub delay_periods: u32,
    /// m_h.
    pub hand_kg: f64,
    /// m_o.
    pub object_kg: f64,
    /// b_h, N·s/m.
    pub hand_damping: f64,
    /// Springs (N/m) and dampers (N·s/m) from a copy to its own finger, to others' fingers and to other copies.
    pub springs: [(f64, f64); 3],
}

impl BoxOnALine {
    /// Table 6.1 of Fotoohi Ghiam 2006 with b_h = 5 N·s/m.
    pub const TABLE_6_1: Self = Self {
        ticks: 8,
        delay_periods: 1,
        hand_kg: 0.1,
        object_kg: 0.4,
        hand_damping: 5.0,
        springs: [(3000.0, 20.0), (400.0, 2.0), (300.0, 10.0)],
    };

    /// Every mode in which fingers touch all copies or none is stable, and throws keep it moving.
    pub const COUNTER_EXAMPLE: Self = Self {
        ticks: 2,
        delay_periods: 0,
        hand_kg: 0.075,
        object_kg: 0.847,
        hand_damping: 3.567,
        springs: [(7618.422, 18.654), (6222.011, 2.755), (2523.913, 5.152)],
    };

    /// The scene: anna on the left, ben on the right.
    ///
    /// # Panics
    /// When a value is out of its range.
    #[must_use]
    pub fn scene(&self) -> Scene {
        let network = 1024 / self.ticks;
        let text = format!(
            r#"
            space = "line"
            [session]
            architecture = "distributed"
            users = 2
            [rates]
            control_hz = 1024
            network_hz = {network}
            [hand]
            finger_radius_m = 0.008
            [object]
            shape = "box"
            size_m = [0.1, 0.1, 0.1]
            [[user]]
            name = "anna"
            script = [{{ do = "force", force_n = [1, 0, 0], duration_s = 60 }}]
            [[user.finger]]
            position_m = [-0.07, 0, 0]
            [[user]]
            name = "ben"
            script = [{{ do = "force", force_n = [-1, 0, 0], duration_s = 60 }}]
            [[user.finger]]
            position_m = [0.07, 0, 0]
            "#
        );
        let scene = parse(&text, "a box on a line", None, &[]).unwrap_or_else(|errors| panic!("{errors}"));
        let [own, remote, copies] = self.springs.map(|(stiffness, damping)| spring(stiffness, damping));
        edited(&scene, |scene| {
            scene.link.delay_periods = self.delay_periods;
            scene.hand.mass_kg = self.hand_kg;
            scene.hand.damping_n_s_per_m = self.hand_damping;
            scene.object.mass_kg = self.object_kg;
            scene.coupling.hand_object = own;
            scene.coupling.remote_hand_object = remote;
            scene.coupling.object_object = copies;
        })
    }
}

/// Closing on the object with a force (N).
pub fn grasp_action(force_n: f64) -> Action {
    Action::Grasp { body: "object".into(), force_n, speed_m_per_s: 0.05, duration_s: 2.0 }
}

/// Scenes on a line, of either architecture.
pub fn any_scene() -> impl Strategy<Value = Scene> {
    let shape = (any::<bool>(), 2u8..4, 0u32..4, 1u32..9, any::<[bool; 4]>());
    let gains = (10.0..2000.0, 0.0..20.0, 10.0..300.0, 0.0..10.0, 0.05..0.5, -1.0..5.0);
    (shape, gains, prop::array::uniform4(0.0..0.006)).prop_map(|(shape, gains, latencies)| {
        let (distributed, users, n, ratio, [grounded, average, euler, on_arrival]) = shape;
        let (k1, b1, k2, b2, mass_kg, damping_n_s_per_m) = gains;
        let architecture = if distributed { Architecture::Distributed } else { Architecture::Centralized };
        edited(&with_ratio(with_users(table_6_1(architecture), users), ratio), |scene| {
            scene.coupling.hand_object = spring(k1, b1);
            scene.coupling.remote_hand_object = spring(k2, b2);
            scene.coupling.object_object = spring(k2, b1);
            scene.hand.mass_kg = mass_kg;
            scene.object.damping_n_s_per_m = damping_n_s_per_m;
            scene.link.delay_periods = n;
            if grounded {
                scene.hand.stiffness_n_per_m = 100.0;
            }
            if average {
                scene.session.coordination = Coordination::Average;
            }
            if euler {
                scene.session.integrator = Integrator::SemiImplicitEuler;
            }
            if on_arrival {
                scene.link.play_out = PlayOut::OnArrival;
            }
            let [a, b, c, d] = latencies;
            scene.link.ways = vec![way(0, 1, a), way(1, 0, b)];
            scene.link.impairment.latency_s = c.min(d);
        })
    })
}

/// Every coordination scheme that a scene can name.
pub fn coordinations() -> impl Iterator<Item = Coordination> {
    let named = |word: &&str| {
        built_in("single-axis", &[&format!("session.coordination={word}")]).session.coordination
    };
    Coordination::WORDS.iter().map(named)
}

/// The words of all local models that a scene can have.
pub fn local_model_kinds() -> Vec<String> {
    LocalModelKind::WORDS.iter().map(|&word| word.to_owned()).collect()
}
