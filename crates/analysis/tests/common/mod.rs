//! Scenes that several tests start from.
#![allow(dead_code)]

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Architecture, Coordination, Coupling, GovernorLimits, Hand, Impairment, Integrator, Link, Object,
    PlayOut, Rates, Scene, Session, SpringDamper, User, Wall, WallSides, Way,
};

pub(crate) fn spring(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
}

/// Table 6.1 of the thesis, n = 0.
pub(crate) fn table_6_1(architecture: Architecture) -> Scene {
    let centralized = architecture == Architecture::Centralized;
    Scene {
        name: "test".into(),
        description: String::new(),
        session: Session {
            architecture,
            users: 2,
            coordination: Coordination::Pairwise,
            integrator: Integrator::ExactHold,
            seed: 1,
            peer_timeout_s: 1.0,
            peer_fade_s: 0.1,
        },
        rates: Rates { control_hz: "1024".parse().unwrap(), network_hz: "128".parse().unwrap() },
        link: Link {
            delay_periods: 0,
            return_delay_periods: 0,
            play_out: PlayOut::Scheduled,
            impairment: Impairment::NONE,
            ways: vec![],
        },
        hand: Hand { mass_kg: 0.1, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0 },
        object: Object { mass_kg: 0.4, damping_n_s_per_m: 0.0 },
        coupling: Coupling {
            hand_object: if centralized { spring(1000.0, 15.0) } else { spring(3000.0, 20.0) },
            remote_hand_object: if centralized { spring(85.0, 3.0) } else { spring(400.0, 2.0) },
            object_object: spring(300.0, 10.0),
        },
        wall: Wall { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0, position_m: 0.0, sides: WallSides::Two },
        governor: GovernorLimits {
            max_force_n: 10.0,
            max_slew_n_per_s: 1e4,
            watchdog_s: 0.05,
            soft_start_s: 0.5,
            release_s: 0.2,
            damping_n_s_per_m: 0.0,
        },
        users: users(2),
    }
}

pub(crate) fn users(count: u8) -> Vec<User> {
    let user = |index: u8| User {
        name: format!("user{index}"),
        tracking: spring(0.0, 0.0),
        script: vec![],
        repeat: false,
    };
    (0..count).map(user).collect()
}

pub(crate) fn with_users(mut scene: Scene, count: u8) -> Scene {
    scene.session.users = count;
    scene.users = users(count);
    scene
}

/// Tick and network rate with N ticks a network step.
pub(crate) fn with_ratio(mut scene: Scene, ratio: u32) -> Scene {
    scene.rates.network_hz = format!("1024/{ratio}").parse().unwrap();
    scene
}

pub(crate) fn latency(latency_s: f64) -> Impairment {
    Impairment { latency_s, ..Impairment::NONE }
}

pub(crate) fn way(from: u8, to: u8, latency_s: f64) -> Way {
    Way { from: HostIndex(from), to: HostIndex(to), impairment: latency(latency_s) }
}

/// Chapter 5: b = 10 N·s/m in every coupler.
pub(crate) fn chapter_5(architecture: Architecture, k: [f64; 3], n: u32) -> Scene {
    let mut scene = table_6_1(architecture);
    scene.coupling = Coupling {
        hand_object: spring(k[0], 10.0),
        remote_hand_object: spring(k[1], 10.0),
        object_object: spring(k[2], 10.0),
    };
    scene.link.delay_periods = n;
    scene
}
