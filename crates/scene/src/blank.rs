//! Where reading starts: values of which every one is set from the key tables before anyone sees them.

use crate::names::HostIndex;
use crate::scene::{
    Architecture, Coordination, Coupling, GovernorLimits, Hand, Impairment, Integrator, Link, Object,
    PlayOut, Rates, Scene, Session, SpringDamper, User, Wall, WallSides, Way,
};
use crate::time::Rate;

const SLACK: SpringDamper = SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0 };

pub(crate) fn scene(name: String) -> Scene {
    let one_hz = Rate::new(1, 1).expect("1 is a rate");
    Scene {
        name,
        description: String::new(),
        session: Session {
            architecture: Architecture::Distributed,
            users: 2,
            coordination: Coordination::Pairwise,
            integrator: Integrator::ExactHold,
            seed: 0,
            peer_timeout_s: 0.0,
            peer_fade_s: 0.0,
        },
        rates: Rates { control_hz: one_hz, network_hz: one_hz },
        link: Link {
            delay_periods: 0,
            return_delay_periods: 0,
            play_out: PlayOut::Scheduled,
            impairment: Impairment::NONE,
            ways: Vec::new(),
        },
        hand: Hand { mass_kg: 0.0, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0 },
        object: Object { mass_kg: 0.0, damping_n_s_per_m: 0.0 },
        coupling: Coupling { hand_object: SLACK, remote_hand_object: SLACK, object_object: SLACK },
        wall: Wall { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0, position_m: 0.0, sides: WallSides::Two },
        governor: GovernorLimits {
            max_force_n: 0.0,
            max_slew_n_per_s: 0.0,
            watchdog_s: 0.0,
            soft_start_s: 0.0,
            release_s: 0.0,
            damping_n_s_per_m: 0.0,
        },
        users: Vec::new(),
    }
}

pub(crate) fn way() -> Way {
    Way { from: HostIndex::FIRST, to: HostIndex::FIRST, impairment: Impairment::NONE }
}

/// User `number`, counted from 1.
pub(crate) fn user(number: usize) -> User {
    User { name: format!("user{number}"), tracking: SLACK, script: Vec::new(), repeat: false }
}
