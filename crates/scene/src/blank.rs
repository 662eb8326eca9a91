//! Where reading starts: values of which every one is set from the key tables before anyone sees them.

use glam::DVec3;

use crate::names::HostIndex;
use crate::scene::{
    Architecture, Body, Contact, Coordination, Coupling, DeviceKind, DeviceSpec, Finger, FixedRegion,
    GovernorLimits, Ground, Hand, Impairment, Integrator, Link, LocalModel, LocalModelKind, Object, PlayOut,
    Rates, ReturnedForce, RotationalSpringDamper, Scene, Session, Shape, ShapeKind, Soft, SoftMeshKind,
    SoftMeshSource, SoftModel, Space, SpringDamper, StiffnessFrom, SurfaceHold, User, VelocityEstimate, Wall,
    WallPlane, WallSides, Way,
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
        rates: Rates { control_hz: one_hz, network_hz: one_hz, simulation_hz: one_hz },
        link: Link {
            delay_periods: 0,
            return_delay_periods: 0,
            play_out: PlayOut::Scheduled,
            impairment: Impairment::NONE,
            ways: Vec::new(),
        },
        space: Space::Line,
        gravity_m_per_s2: DVec3::ZERO,
        hand: Hand { mass_kg: 0.0, damping_n_s_per_m: 0.0, stiffness_n_per_m: 0.0, finger_radius_m: 0.0 },
        device: DeviceSpec {
            kind: DeviceKind::Point,
            encoder_counts_per_turn: 0,
            velocity: VelocityEstimate::Exact,
            velocity_cutoff_hz: 0.0,
            max_joint_torque_n_m: 0.0,
            inertia: false,
        },
        object: Object {
            mass_kg: 0.0,
            damping_n_s_per_m: 0.0,
            axis_damping_n_s_per_m: DVec3::ZERO,
            rotational_damping_n_m_s_per_rad: 0.0,
            shape: shape(),
            position_m: DVec3::ZERO,
            rotation_rad: DVec3::ZERO,
        },
        bodies: Vec::new(),
        ground: Ground { friction_coefficient: 0.0, rotational_friction_coefficient: 0.0 },
        contact: Contact {
            static_friction: 0.0,
            dynamic_friction: 0.0,
            stick_speed_m_per_s: 0.0,
            moment_cancellation: false,
            body_body: SLACK,
            body_body_tangential: SLACK,
        },
        coupling: Coupling {
            hand_object: SLACK,
            remote_hand_object: SLACK,
            object_object: SLACK,
            hand_object_tangential: SLACK,
            remote_hand_object_tangential: SLACK,
            object_object_rotational: RotationalSpringDamper {
                stiffness_n_m_per_rad: 0.0,
                damping_n_m_s_per_rad: 0.0,
            },
        },
        wall: Wall {
            stiffness_n_per_m: 0.0,
            damping_n_s_per_m: 0.0,
            position_m: 0.0,
            sides: WallSides::Two,
            tangential_stiffness_n_per_m: 0.0,
            tangential_damping_n_s_per_m: 0.0,
            static_friction: 0.0,
            dynamic_friction: 0.0,
            planes: Vec::new(),
        },
        governor: GovernorLimits {
            max_force_n: 0.0,
            max_slew_n_per_s: 0.0,
            watchdog_s: 0.0,
            soft_start_s: 0.0,
            release_s: 0.0,
            damping_n_s_per_m: 0.0,
            passivity_control: false,
        },
        soft: soft(),
        local_model: LocalModel {
            kind: LocalModelKind::P,
            stiffness_n_per_m: 0.0,
            stiffness_ratio: 0.0,
            integral_n_per_m: 0.0,
            integral_ratio: 0.0,
            stiffness_from: StiffnessFrom::Body,
            returned_force: ReturnedForce::Mean,
            hold: SurfaceHold::Zero,
            result_delay_periods: 0,
            exit_threshold_m: 0.0,
            entry_threshold_m: 0.0,
            threshold_force_n: 0.0,
            drain_periods: 0.0,
            sides: WallSides::One,
            friction: 0.0,
        },
        users: Vec::new(),
    }
}

fn soft() -> Soft {
    Soft {
        model: SoftModel::None,
        mesh: SoftMeshSource {
            generator: SoftMeshKind::File,
            file: String::new(),
            scale: 1.0,
            size_m: DVec3::ZERO,
            cells: [1; 3],
            radius_m: 0.0,
            edge_m: 0.0,
            stiffness_n_per_m: 0.0,
            origin_m: DVec3::ZERO,
        },
        young_pa: 0.0,
        poisson_ratio: 0.0,
        density_kg_per_m3: 0.0,
        mass_damping_per_s: 0.0,
        stiffness_damping_s: 0.0,
        newton_steps: 1,
        quasi_static: false,
        skin_thickness_m: 0.0,
        skin_stretch: 1.0,
        fixed: Vec::new(),
        nodes: None,
    }
}

pub(crate) fn fixed_region() -> FixedRegion {
    FixedRegion { from_m: DVec3::ZERO, to_m: DVec3::ZERO }
}

pub(crate) fn way() -> Way {
    Way { from: HostIndex::FIRST, to: HostIndex::FIRST, impairment: Impairment::NONE }
}

/// User `number`, counted from 1.
pub(crate) fn user(number: usize) -> User {
    User {
        name: format!("user{number}"),
        fingers: vec![finger()],
        tracking: SLACK,
        script: Vec::new(),
        repeat: false,
    }
}

pub(crate) fn shape() -> Shape {
    Shape {
        kind: ShapeKind::Point,
        size_m: DVec3::ZERO,
        radius_m: 0.0,
        length_m: 0.0,
        mesh: String::new(),
        mesh_scale: 1.0,
        surface: None,
    }
}

/// Body `number`, counted from 1.
pub(crate) fn body(number: usize) -> Body {
    Body {
        name: format!("body{number}"),
        shape: shape(),
        mass_kg: 0.0,
        position_m: DVec3::ZERO,
        rotation_rad: DVec3::ZERO,
        fixed: false,
    }
}

/// Wall `number`, counted from 1.
pub(crate) fn wall_plane(number: usize) -> WallPlane {
    WallPlane { name: format!("wall{number}"), point_m: DVec3::ZERO, normal: DVec3::NEG_X }
}

pub(crate) fn finger() -> Finger {
    Finger { position_m: DVec3::ZERO, script: Vec::new() }
}
