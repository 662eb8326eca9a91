//! The keys of a scene, except those of its lists.

use super::Fallback::{ByArchitecture, Derived, Is, Kept};
use super::shape;
use super::{Fallback, Key, Kind, at};
use crate::limits::MAX_USERS;
use crate::scene::{
    Architecture, Coordination, DeviceKind, Integrator, LocalModelKind, PlayOut, ReturnedForce, SceneValues,
    SoftMeshKind, SoftModel, Space, StiffnessFrom, SurfaceHold, VelocityEstimate, WallSides,
};
use crate::value::Value;

const fn number(min: f64, max: f64) -> Kind {
    Kind::Number { min, max }
}

/// Table 6.1 of Fotoohi Ghiam 2006 for the scene's architecture.
macro_rules! table_6_1 {
    ($distributed:literal, $centralized:literal) => {
        ByArchitecture {
            distributed: stringify!($distributed),
            centralized: stringify!($centralized),
            of: |scene: &SceneValues| {
                Value::Number(match scene.session.architecture {
                    Architecture::Distributed => $distributed as f64,
                    Architecture::Centralized => $centralized as f64,
                })
            },
        }
    };
}

/// The same as another field.
macro_rules! as_in {
    ($says:literal, $($field:ident).+) => {
        Derived { says: $says, of: |scene: &SceneValues| Value::Number(scene.$($field).+) }
    };
}

const SLEW: Fallback<SceneValues> = Derived {
    says: "governor.max_force_n times rates.control_hz",
    of: |scene| Value::Number(scene.governor.max_force_n * scene.rates.control_hz.hz()),
};
const USERS: Fallback<SceneValues> =
    Kept { says: "the number of [[user]] tables, at least 2, or 1 with a soft object" };
const NAME: Fallback<SceneValues> = Kept { says: "the file's name without its ending" };

/// Barbagli et al.'s model has the result of the first force at the end of the period; that of all forces comes one
/// later.
const RESULT_DELAY: Fallback<SceneValues> = Derived {
    says: "0 where local_model.returned_force is \"first\", else 1",
    of: |scene| Value::Count((scene.local_model.returned_force != ReturnedForce::First).into()),
};

/// What the analysis chooses for N = 50, the mean force and a result that comes one period later, an object whose K_o is
/// wrong by up to 30 % and contacts that move together up to three times less easily one way than another.
const STIFFNESS_RATIO: Fallback<SceneValues> = Derived {
    says: "0.3 where local_model.kind is \"pi\", else 0.35",
    of: |scene| Value::Number(if scene.local_model.kind == LocalModelKind::Pi { 0.3 } else { 0.35 }),
};

const STIFFNESS: Kind = number(0.0, 1e6);
const DAMPING: Kind = number(0.0, 1e4);
const MASS: Kind = number(1e-4, 1e3);
const FADE: Kind = number(0.0, 10.0);
const FRICTION: Kind = number(0.0, 10.0);
const WALL_STIFFNESS: Kind = number(0.0, 1e7);
const ROTATIONAL_DAMPING: Kind = number(-10.0, 1e3);

/// In the order in which a scene is written.
#[rustfmt::skip]
pub(crate) static SCENE: &[Key<SceneValues>] = &[
    Key::new("name", Kind::Text { min: 1, max: 64 }, NAME, "", "The scene's name; two hosts may call one scene differently.", at!(name)),
    Key::new("description", Kind::Text { min: 0, max: 500 }, Is(""), "", "One sentence about the scene.", at!(description)),
    Key::new("space", Kind::Choice(Space::WORDS), Is("line"), "", "Where bodies and hands may move: along x, nothing turning; in the x-y plane, turning about z; or everywhere.", at!(space)),
    Key::new("gravity_m_per_s2", Kind::Vector { max: 100.0 }, Is("0"), "m/s²", "Acceleration of every body that is not fixed; hands do not feel it.", at!(gravity_m_per_s2)),

    Key::new("session.architecture", Kind::Choice(Architecture::WORDS), Is("distributed"), "", "Who computes the world: host 1 for all (centralized), or every host its own copy (distributed).", at!(session.architecture)),
    Key::new("session.users", Kind::Count { min: 1, max: MAX_USERS as u64 }, USERS, "", "How many people take part, each on a host of their own; 1 only where there is a soft object.", at!(session.users)),
    Key::new("session.coordination", Kind::Choice(Coordination::WORDS), Is("pairwise"), "", "What a copy of the object is coupled to: every other copy, or the average of all; without effect when centralized.", at!(session.coordination)),
    Key::new("session.integrator", Kind::Choice(Integrator::WORDS), Is("exact-hold"), "", "How objects are stepped; hands are always exact.", at!(session.integrator)),
    Key::new("session.seed", Kind::Count { min: 0, max: i64::MAX as u64 }, Is("1"), "", "Seed of everything random: the same scene and seed give the same bytes.", at!(session.seed)),
    Key::new("session.peer_timeout_s", number(0.01, 60.0), Is("0.25"), "s", "A peer of which no sample came for so long has left; older samples are not used.", at!(session.peer_timeout_s)),
    Key::new("session.peer_fade_s", FADE, Is("0.25"), "s", "Time in which the coupling to a peer fades in when it comes and out when it goes; 0 is at once.", at!(session.peer_fade_s)),
    Key::new("session.rejoin_after_s", number(0.01, 60.0), Is("0.05"), "s", "After longer gaps between samples of a peer, in whole network steps, what came apart is brought together within session.rejoin_s.", at!(session.rejoin_after_s)),
    Key::new("session.rejoin_s", FADE, Is("1.5"), "s", "Time in which what came apart while a peer was away, or a device failed, is brought together; 0 leaves it to the couplings at once.", at!(session.rejoin_s)),

    Key::new("rates.control_hz", Kind::Rate { min: 1, max: 20_000 }, Is("1024"), "Hz", "Haptic rate, 1/T_c: forces are computed so often.", at!(rates.control_hz)),
    Key::new("rates.network_hz", Kind::Rate { min: 1, max: 20_000 }, Is("128"), "Hz", "Network rate, 1/T_t: states are sent so often; at most the haptic rate.", at!(rates.network_hz)),
    Key::new("rates.simulation_hz", Kind::Rate { min: 1, max: 20_000 }, Is("60"), "Hz", "Rate of the slow simulation of a soft object; at most the haptic rate.", at!(rates.simulation_hz)),

    Key::new("link.delay_periods", Kind::Count { min: 0, max: 64 }, Is("1"), "network periods", "n: from sampling to use; one way when distributed, the round trip when centralized.", at!(link.delay_periods)),
    Key::new("link.return_delay_periods", Kind::Count { min: 0, max: 64 }, Is("0"), "network periods", "The part of link.delay_periods on the force's way back from the server; without effect when distributed.", at!(link.return_delay_periods)),
    Key::new("link.play_out", Kind::Choice(PlayOut::WORDS), Is("scheduled"), "", "When a received sample is used: link.delay_periods after it was taken, or on arrival.", at!(link.play_out)),

    Key::new("hand.mass_kg", MASS, Is("0.1"), "kg", "m_h: hand and moving part of the device together, of every finger.", at!(hand.mass_kg)),
    Key::new("hand.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "b_h: damping of the arm.", at!(hand.damping_n_s_per_m)),
    Key::new("hand.stiffness_n_per_m", STIFFNESS, Is("0"), "N/m", "k_h: stiffness of the arm, towards where the finger rests.", at!(hand.stiffness_n_per_m)),
    Key::new("hand.finger_radius_m", number(1e-4, 1.0), Is("0.008"), "m", "A finger is a ball of this radius where bodies have shapes.", at!(hand.finger_radius_m)),

    Key::new("device.kind", Kind::Choice(DeviceKind::WORDS), Is("point"), "", "The mechanism that every finger is on: none, the planar pantograph (space \"plane\" only), or a three-joint arm.", at!(device.kind)),
    Key::new("device.encoder_counts_per_turn", Kind::Count { min: 0, max: 100_000_000 }, Is("0"), "", "Counts of a joint's encoder in a turn; 0 is a perfect sensor. Without effect for point.", at!(device.encoder_counts_per_turn)),
    Key::new("device.velocity", Kind::Choice(VelocityEstimate::WORDS), Is("exact"), "", "How velocity is told: as it is, from the last two positions, or that through a low pass.", at!(device.velocity)),
    Key::new("device.velocity_cutoff_hz", number(0.1, 1e4), Is("50"), "Hz", "Corner of the low pass of filtered velocity; without effect on the others.", at!(device.velocity_cutoff_hz)),
    Key::new("device.max_joint_torque_n_m", number(0.0, 1e3), Is("0"), "N·m", "Largest torque of a joint; 0 is no limit. Without effect for point.", at!(device.max_joint_torque_n_m)),
    Key::new("device.inertia", Kind::Flag, Is("false"), "", "Whether the inertia of the links comes on top of hand.mass_kg. Without effect for point.", at!(device.inertia)),

    Key::new("object.mass_kg", MASS, Is("0.4"), "kg", "m_o: mass of every copy of the object.", at!(object.mass_kg)),
    Key::new("object.damping_n_s_per_m", number(-1e3, 1e4), Is("0"), "N·s/m", "Damping to the ground; a negative value compensates the drag of the network.", at!(object.damping_n_s_per_m)),
    Key::new("object.axis_damping_n_s_per_m", Kind::Vector { max: 1e4 }, Is("0"), "N·s/m", "The same along each axis of the world, on top of that.", at!(object.axis_damping_n_s_per_m)),
    Key::new("object.rotational_damping_n_m_s_per_rad", ROTATIONAL_DAMPING, Is("0"), "N·m·s/rad", "The same for turning.", at!(object.rotational_damping_n_m_s_per_rad)),
    shape::kind!("object.shape", object.shape.kind),
    shape::size!("object.size_m", object.shape.size_m),
    shape::radius!("object.radius_m", object.shape.radius_m),
    shape::length!("object.length_m", object.shape.length_m),
    shape::mesh!("object.mesh", object.shape.mesh),
    shape::mesh_scale!("object.mesh_scale", object.shape.mesh_scale),
    shape::position!("object.position_m", object.position_m),
    shape::rotation!("object.rotation_rad", object.rotation_rad),

    Key::new("ground.friction_coefficient", FRICTION, Is("0"), "", "Coulomb friction between bodies and the ground, where space is \"plane\": times m·g, g = 9.81 m/s².", at!(ground.friction_coefficient)),
    Key::new("ground.rotational_friction_coefficient", FRICTION, Is("0"), "", "The same for turning: times m·g and the body's radius of gyration about z.", at!(ground.rotational_friction_coefficient)),

    Key::new("contact.static_friction", FRICTION, Is("0.6"), "", "mu_s between fingers and bodies: up to this times the normal force a finger sticks.", at!(contact.static_friction)),
    Key::new("contact.dynamic_friction", FRICTION, as_in!("contact.static_friction", contact.static_friction), "", "mu_k between fingers and bodies, while sliding; at most mu_s.", at!(contact.dynamic_friction)),
    Key::new("contact.stick_speed_m_per_s", number(0.0, 1.0), Is("0.005"), "m/s", "v_tr: a contact that slides more slowly than this sticks.", at!(contact.stick_speed_m_per_s)),
    Key::new("contact.moment_cancellation", Kind::Flag, Is("true"), "", "Whether a finger is pushed to a stop on first contact, by as many ticks of the largest force as its momentum takes.", at!(contact.moment_cancellation)),
    Key::new("contact.body_body.stiffness_n_per_m", WALL_STIFFNESS, Is("5000"), "N/m", "Across the surface where two bodies touch.", at!(contact.body_body.stiffness_n_per_m)),
    Key::new("contact.body_body.damping_n_s_per_m", DAMPING, Is("20"), "N·s/m", "The damping of that.", at!(contact.body_body.damping_n_s_per_m)),
    Key::without_margin(Key::new("contact.body_body_tangential.stiffness_n_per_m", WALL_STIFFNESS, as_in!("contact.body_body.stiffness_n_per_m", contact.body_body.stiffness_n_per_m), "N/m", "Along the surface where two bodies touch.", at!(contact.body_body_tangential.stiffness_n_per_m))),
    Key::without_margin(Key::new("contact.body_body_tangential.damping_n_s_per_m", DAMPING, as_in!("contact.body_body.damping_n_s_per_m", contact.body_body.damping_n_s_per_m), "N·s/m", "The damping of that.", at!(contact.body_body_tangential.damping_n_s_per_m))),

    Key::new("coupling.hand_object.stiffness_n_per_m", STIFFNESS, table_6_1!(3000, 1000), "N/m", "k_11 = k_22: a hand and the copy on its own host; centralized k_1: the server's hand and the object.", at!(coupling.hand_object.stiffness_n_per_m)),
    Key::new("coupling.hand_object.damping_n_s_per_m", DAMPING, table_6_1!(20, 15), "N·s/m", "b_11 = b_22; centralized b_1.", at!(coupling.hand_object.damping_n_s_per_m)),
    Key::new("coupling.remote_hand_object.stiffness_n_per_m", STIFFNESS, table_6_1!(400, 85), "N/m", "k_12 = k_21: a hand and a copy on another host; centralized k_2: a client's hand and the object.", at!(coupling.remote_hand_object.stiffness_n_per_m)),
    Key::new("coupling.remote_hand_object.damping_n_s_per_m", DAMPING, table_6_1!(2, 3), "N·s/m", "b_12 = b_21; centralized b_2.", at!(coupling.remote_hand_object.damping_n_s_per_m)),
    Key::new("coupling.object_object.stiffness_n_per_m", STIFFNESS, Is("300"), "N/m", "k_o: copies of the object; without effect when centralized.", at!(coupling.object_object.stiffness_n_per_m)),
    Key::new("coupling.object_object.damping_n_s_per_m", DAMPING, Is("10"), "N·s/m", "b_o: copies of the object; without effect when centralized.", at!(coupling.object_object.damping_n_s_per_m)),
    Key::new("coupling.hand_object_tangential.stiffness_n_per_m", STIFFNESS, as_in!("coupling.hand_object.stiffness_n_per_m", coupling.hand_object.stiffness_n_per_m), "N/m", "k_T11 = k_T22, centralized k_T1: along the surface, where bodies have shapes; hand_object is then across it.", at!(coupling.hand_object_tangential.stiffness_n_per_m)),
    Key::new("coupling.hand_object_tangential.damping_n_s_per_m", DAMPING, as_in!("coupling.hand_object.damping_n_s_per_m", coupling.hand_object.damping_n_s_per_m), "N·s/m", "b_T11 = b_T22; centralized b_T1.", at!(coupling.hand_object_tangential.damping_n_s_per_m)),
    Key::new("coupling.remote_hand_object_tangential.stiffness_n_per_m", STIFFNESS, as_in!("coupling.remote_hand_object.stiffness_n_per_m", coupling.remote_hand_object.stiffness_n_per_m), "N/m", "k_T12 = k_T21, centralized k_T2: the same for a hand on another host.", at!(coupling.remote_hand_object_tangential.stiffness_n_per_m)),
    Key::new("coupling.remote_hand_object_tangential.damping_n_s_per_m", DAMPING, as_in!("coupling.remote_hand_object.damping_n_s_per_m", coupling.remote_hand_object.damping_n_s_per_m), "N·s/m", "b_T12 = b_T21; centralized b_T2.", at!(coupling.remote_hand_object_tangential.damping_n_s_per_m)),
    Key::new("coupling.object_object_rotational.stiffness_n_m_per_rad", number(0.0, 1e5), Is("10"), "N·m/rad", "k_oR: turning of copies; without effect when centralized or on a line.", at!(coupling.object_object_rotational.stiffness_n_m_per_rad)),
    Key::new("coupling.object_object_rotational.damping_n_m_s_per_rad", number(0.0, 1e3), Is("0.1"), "N·m·s/rad", "b_oR: turning of copies; without effect when centralized or on a line.", at!(coupling.object_object_rotational.damping_n_m_s_per_rad)),

    Key::new("wall.stiffness_n_per_m", WALL_STIFFNESS, Is("0"), "N/m", "k_w, across the wall: what bodies meet; with damping 0 too there is none.", at!(wall.stiffness_n_per_m)),
    Key::new("wall.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "b_w.", at!(wall.damping_n_s_per_m)),
    Key::new("wall.position_m", number(-10.0, 10.0), Is("0"), "m", "Where on the x axis the wall is, when there is no [[wall.plane]].", at!(wall.position_m)),
    Key::new("wall.sides", Kind::Choice(WallSides::WORDS), Is("two"), "", "Two: the object is always coupled to the wall; one: the wall pushes towards -x and never pulls. Walls never pull at bodies with a shape.", at!(wall.sides)),
    Key::new("wall.tangential_stiffness_n_per_m", WALL_STIFFNESS, as_in!("wall.stiffness_n_per_m", wall.stiffness_n_per_m), "N/m", "k_Tw: along the wall, for bodies with a shape.", at!(wall.tangential_stiffness_n_per_m)),
    Key::new("wall.tangential_damping_n_s_per_m", DAMPING, as_in!("wall.damping_n_s_per_m", wall.damping_n_s_per_m), "N·s/m", "b_Tw: along the wall, for bodies with a shape.", at!(wall.tangential_damping_n_s_per_m)),
    Key::new("wall.static_friction", FRICTION, Is("0.6"), "", "mu_s between bodies and walls, and between bodies.", at!(wall.static_friction)),
    Key::new("wall.dynamic_friction", FRICTION, as_in!("wall.static_friction", wall.static_friction), "", "mu_k between bodies and walls, and between bodies; at most mu_s.", at!(wall.dynamic_friction)),

    Key::new("governor.max_force_n", number(0.1, 1e3), Is("20"), "N", "Largest force that reaches a device.", at!(governor.max_force_n)),
    Key::new("governor.max_slew_n_per_s", number(0.01, 1e9), SLEW, "N/s", "Largest change of that force; the default admits a jump from 0 to the largest force in one tick.", at!(governor.max_slew_n_per_s)),
    Key::new("governor.watchdog_s", number(0.001, 10.0), Is("0.02"), "s", "After so long without a tick, or without a reading of the device, its force fades out and comes back softly.", at!(governor.watchdog_s)),
    Key::new("governor.soft_start_s", FADE, Is("0.25"), "s", "Time in which forces fade in at the start; 0 is at once.", at!(governor.soft_start_s)),
    Key::new("governor.release_s", FADE, Is("0.1"), "s", "Time in which forces fade out on a stop, a lost link or a fault; 0 is at once.", at!(governor.release_s)),
    Key::new("governor.damping_n_s_per_m", DAMPING, Is("0"), "N·s/m", "Damping that the governor adds at the device.", at!(governor.damping_n_s_per_m)),
    Key::new("governor.passivity_control", Kind::Flag, Is("false"), "", "Whether the governor brakes a finger that got more energy from the session than it put in, by at most 10 N·s/m: what comes out faster than that still comes out.", at!(governor.passivity_control)),

    Key::new("soft.model", Kind::Choice(SoftModel::WORDS), Is("none"), "", "The soft object: none, springs along the edges of tetrahedra, corotational linear tetrahedra, or a closed elastic skin around a fluid. It is the only body: no [[body]], no object.shape and no wall beside it.", at!(soft.model)),
    Key::new("soft.young_pa", number(1.0, 1e9), Is("20000"), "Pa", "Young's modulus; of a balloon: of its skin.", at!(soft.young_pa)),
    Key::new("soft.poisson_ratio", number(0.0, 0.49), Is("0.3"), "", "Poisson's ratio; a mass-spring network has 1/4 whatever is written, and takes 0.2 to 0.3.", at!(soft.poisson_ratio)),
    Key::new("soft.density_kg_per_m3", number(1.0, 1e5), Is("1000"), "kg/m³", "Density; of a balloon: of the fluid inside.", at!(soft.density_kg_per_m3)),
    Key::new("soft.mass_damping_per_s", number(0.0, 1e4), Is("0"), "1/s", "Rayleigh damping: this times the mass.", at!(soft.mass_damping_per_s)),
    Key::new("soft.stiffness_damping_s", number(0.0, 10.0), Is("0.01"), "s", "Rayleigh damping: this times the stiffness.", at!(soft.stiffness_damping_s)),
    Key::new("soft.newton_steps", Kind::Count { min: 1, max: 20 }, Is("1"), "", "Newton steps of a period of the simulation.", at!(soft.newton_steps)),
    Key::new("soft.quasi_static", Kind::Flag, Is("false"), "", "Whether every period ends in the equilibrium of its forces, without inertia and damping.", at!(soft.quasi_static)),
    Key::new("soft.skin_thickness_m", number(1e-6, 0.1), Is("0.001"), "m", "Thickness of a balloon's skin.", at!(soft.skin_thickness_m)),
    Key::new("soft.skin_stretch", number(1.001, 3.0), Is("1.1"), "", "How much longer, in every direction, a balloon's skin is than it was cut: its tension.", at!(soft.skin_stretch)),

    Key::new("soft.mesh.generator", Kind::Choice(SoftMeshKind::WORDS), Is("file"), "", "Where the mesh comes from: a file; cubes cut into six tetrahedra each (beam or block); a ball; a sphere's skin (balloon); a bean-shaped blob (organ); or a triangle across x that is tied to where it rests (spring).", at!(soft.mesh.generator)),
    Key::new("soft.mesh.file", Kind::Text { min: 0, max: 4096 }, Is(""), "", "Gmsh .msh, VTK .vtk or .vtu with tetrahedra; or a closed surface .stl, .obj, .gltf or .glb, which is filled with tetrahedra (not for a balloon, of which it is the skin). From the scene's folder.", at!(soft.mesh.file)),
    Key::new("soft.mesh.scale", number(1e-6, 1e6), Is("1"), "", "Metres in one unit of the file.", at!(soft.mesh.scale)),
    Key::new("soft.mesh.size_m", Kind::Vector { max: 10.0 }, Is("0"), "m", "Edges of a beam or block along x, y and z; half axes of an organ.", at!(soft.mesh.size_m)),
    Key::new("soft.mesh.cells", Kind::Counts { min: 1, max: 1000 }, Is("1"), "", "Cubes of a beam or block along x, y and z.", at!(soft.mesh.cells)),
    Key::new("soft.mesh.radius_m", number(0.0, 5.0), Is("0"), "m", "Of a ball or a balloon.", at!(soft.mesh.radius_m)),
    Key::new("soft.mesh.edge_m", number(0.0, 5.0), Is("0"), "m", "About how long edges are, of a ball, a balloon, an organ and a surface that is filled; 0: an eighth of the largest extent.", at!(soft.mesh.edge_m)),
    Key::without_margin(Key::new("soft.mesh.stiffness_n_per_m", STIFFNESS, Is("0"), "N/m", "K_o of the generator spring.", at!(soft.mesh.stiffness_n_per_m))),
    Key::new("soft.mesh.origin_m", Kind::Vector { max: 10.0 }, Is("0"), "m", "Where the least corner of a beam or block is, the middle of anything else that is generated, or the origin of a file.", at!(soft.mesh.origin_m)),

    Key::new("local_model.kind", Kind::Choice(LocalModelKind::WORDS), Is("p"), "", "Between a hand and the soft object: a force that is computed once a period of the simulation and held; a spring (p); a spring and an integral (pi); or a spring to a surface that gives way by the joint compliance of all contacts.", at!(local_model.kind)),
    Key::new("local_model.stiffness_n_per_m", STIFFNESS, Is("0"), "N/m", "K_h; 0: local_model.stiffness_ratio times K_o, the contact's stiffness in its softest direction, less where other contacts move it too.", at!(local_model.stiffness_n_per_m)),
    Key::with_margin(Key::new("local_model.stiffness_ratio", number(0.0, 10.0), STIFFNESS_RATIO, "", "K_h in units of K_o.", at!(local_model.stiffness_ratio))),
    Key::new("local_model.integral_n_per_m", STIFFNESS, Is("0"), "N/m", "INT of pi, what the integral gains in a period of the simulation; 0: local_model.integral_ratio times K_o.", at!(local_model.integral_n_per_m)),
    Key::with_margin(Key::new("local_model.integral_ratio", number(0.0, 10.0), Is("0.5"), "", "INT in units of K_o.", at!(local_model.integral_ratio))),
    Key::new("local_model.stiffness_from", Kind::Choice(StiffnessFrom::WORDS), Is("body"), "", "Who says what K_o is: the simulation, or an estimate from forces and how the surface gives way.", at!(local_model.stiffness_from)),
    Key::new("local_model.returned_force", Kind::Choice(ReturnedForce::WORDS), Is("mean"), "", "Which force of a period goes to the simulation: that of its first tick, the mean of all, or that of its last.", at!(local_model.returned_force)),
    Key::new("local_model.hold", Kind::Choice(SurfaceHold::WORDS), Is("zero"), "", "How the surface moves between two results of the simulation: it jumps, or it moves linearly and comes one period late.", at!(local_model.hold)),
    Key::new("local_model.result_delay_periods", Kind::Count { min: 0, max: 8 }, RESULT_DELAY, "periods of the simulation", "From the end of the period whose forces are simulated to the use of the result; in real time a late result is used when it is there.", at!(local_model.result_delay_periods)),
    Key::new("local_model.exit_threshold_m", number(0.0, 0.1), Is("0.0005"), "m", "Theta_1 of (11): the penetration that the integral of pi tolerates while the hand comes out.", at!(local_model.exit_threshold_m)),
    Key::new("local_model.entry_threshold_m", number(0.0, 0.1), Is("0.0002"), "m", "Theta_2 of (11): the same while the hand goes in.", at!(local_model.entry_threshold_m)),
    Key::new("local_model.threshold_force_n", number(0.0, 1e3), Is("0"), "N", "I_tot of (11): the integral's force at which theta_2 is fully there, growing linearly before; 0: always.", at!(local_model.threshold_force_n)),
    Key::new("local_model.drain_periods", number(0.01, 1e3), Is("2"), "periods of the simulation", "In how many the integral's force goes linearly to 0 when the hand leaves.", at!(local_model.drain_periods)),
    Key::new("local_model.sides", Kind::Choice(WallSides::WORDS), Is("one"), "", "One: the surface pushes and never pulls; two: every finger holds the nearest point of the surface for good, which is linear.", at!(local_model.sides)),
    Key::new("local_model.friction", FRICTION, as_in!("contact.static_friction", contact.static_friction), "", "The force along the surface is at most this times the force across it; a finger that pulls harder slides.", at!(local_model.friction)),
];

/// What the tables of a scene are about.
pub(crate) static TABLES: &[(&str, &str)] = &[
    ("session", "Who takes part, and how hosts share the world."),
    (
        "rates",
        "The rates of the loops: a number, taken exactly as written, or a fraction such as \"1024/10\".",
    ),
    ("link", "The network between hosts."),
    ("link.impairment", "What a simulated link does to packets, in every direction without a [[link.way]]."),
    ("hand", "Every user's hand together with the moving part of the device."),
    ("device", "What every finger of every user is on."),
    ("object", "The shared object, where there is no [[body]]; its damping is that of all bodies."),
    ("ground", "The ground under bodies that move in a plane."),
    ("contact", "How fingers touch bodies, and bodies each other; the springs of fingers are in [coupling]."),
    ("contact.body_body", "Between bodies, across the surface."),
    ("contact.body_body_tangential", "Between bodies, along the surface."),
    ("coupling", "The virtual couplers: springs with dampers."),
    ("coupling.hand_object", "Between a hand and the object on the same host."),
    ("coupling.remote_hand_object", "Between a hand and the object on another host."),
    ("coupling.object_object", "Between copies of the object (distributed)."),
    (
        "coupling.hand_object_tangential",
        "Between a finger and the object on the same host, along the surface.",
    ),
    (
        "coupling.remote_hand_object_tangential",
        "Between a finger and the object on another host, along the surface.",
    ),
    ("coupling.object_object_rotational", "Between copies of the object, for turning (distributed)."),
    (
        "wall",
        "What all walls are made of: planes that bodies meet; without stiffness and damping there is none.",
    ),
    ("governor", "Limits on every force that reaches a device."),
    ("soft", "The soft object, in a scene that has one; it then has no other body."),
    ("soft.mesh", "The mesh of the soft object: which generator makes it, or which file it is in."),
    ("local_model", "What is between a hand and the slowly simulated soft object, at the haptic rate."),
];

/// The list of bodies: [`super::parts::BODY`].
pub(crate) const BODY_LIST: (&str, &str) = (
    "body",
    "A body, in place of [object], of which only the damping then counts; up to 8, and a user's fingers and the bodies that are not fixed are at most 10 together.",
);
/// The list of walls: [`super::parts::PLANE`].
pub(crate) const PLANE_LIST: (&str, &str) = (
    "wall.plane",
    "A wall that bodies do not pass, made as [wall] says; where there is none, there is one wall across the x axis at wall.position_m.",
);
/// The list of regions in which a soft object is fixed: [`super::parts::FIXED`].
pub(crate) const FIXED_LIST: (&str, &str) = (
    "soft.fixed",
    "A box; nodes of the soft object that rest in it do not move. Of every piece of it three nodes must be held, not on a line, and some node must be free.",
);
/// The table of a soft object's mesh, which may also be the path of a file.
pub(crate) const SOFT_MESH: (&str, &str) = (
    "soft.mesh",
    "A text in place of this table is the path of a file: short for { generator = \"file\", file = \"PATH\" }.",
);
/// The list of users: [`super::parts::USER`].
pub(crate) const USER_LIST: (&str, &str) = (
    "user",
    "A user's name and what the simulated hand does; users beyond the last table are called userN and repeat the tables' scripts in turn.",
);
/// The list of ways: [`super::parts::WAY`] and [`super::parts::IMPAIRMENT`].
pub(crate) const WAY_LIST: (&str, &str) = (
    "link.way",
    "One direction with an impairment of its own; what is left out is as on a perfect link, not as in [link.impairment].",
);
/// The link file.
pub(crate) const INCLUDE: (&str, &str) = (
    "link.include",
    "A link file as `cotouch probe` writes it, relative to the scene file; keys of [link.impairment] win over it.",
);
/// Where the scene's own impairment is.
pub(crate) const LINK_IMPAIRMENT: &str = "link.impairment.";
