//! What a session is, as typed values: the result of reading and checking a scene file.
//!
//! A [`Scene`] that exists is valid: reading makes it ([`crate::load`]), and every number in it lies in its stated range.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::names::HostIndex;
use crate::time::{Rate, Schedule};

/// A checked session description. Units are in the field names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// The scene's name: the built-in's name, or the file's stem.
    pub name: String,
    /// One sentence about the scene.
    pub description: String,
    /// Who takes part and how hosts share the world.
    pub session: Session,
    /// The rates of the loops.
    pub rates: Rates,
    /// The network between hosts.
    pub link: Link,
    /// The directions in which bodies and hands may move.
    pub space: Space,
    /// Acceleration that acts on every body that is not fixed.
    pub gravity_m_per_s2: DVec3,
    /// Every user's hand together with the moving part of the device.
    pub hand: Hand,
    /// What every user holds.
    pub device: DeviceSpec,
    /// The shared object, and what all bodies have in common.
    pub object: Object,
    /// `[[body]]`; where there is none, the world has one body, the object: see [`Scene::world_bodies`].
    pub bodies: Vec<Body>,
    /// The ground under bodies that move in a plane.
    pub ground: Ground,
    /// How fingers touch bodies, and bodies walls and each other.
    pub contact: Contact,
    /// The virtual couplers.
    pub coupling: Coupling,
    /// The wall that the object meets.
    pub wall: Wall,
    /// Limits on every force that reaches a device.
    pub governor: GovernorLimits,
    /// The soft object, in a scene that has one; it then has no other body.
    pub soft: Soft,
    /// How hands feel the soft object at the haptic rate.
    pub local_model: LocalModel,
    /// What each user is called and does when simulated; exactly `session.users` entries.
    pub users: Vec<User>,
}

impl Scene {
    /// Which tick does which network step.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(self.rates.control_hz, self.rates.network_hz).expect("checked when the scene was read")
    }

    /// The rigid bodies of the world: `[[body]]`, or the one object; none where the object is soft.
    #[must_use]
    pub fn world_bodies(&self) -> Vec<Body> {
        if !self.bodies.is_empty() || self.soft.exists() {
            return self.bodies.clone();
        }
        let Object { mass_kg, shape, position_m, rotation_rad, .. } = &self.object;
        vec![Body {
            name: "object".to_owned(),
            shape: shape.clone(),
            mass_kg: *mass_kg,
            position_m: *position_m,
            rotation_rad: *rotation_rad,
            fixed: false,
        }]
    }

    /// The walls of the world: `[[wall.plane]]`, or the one across the x axis; none without stiffness and damping.
    #[must_use]
    pub fn walls(&self) -> Vec<WallPlane> {
        if !self.wall.exists() {
            return Vec::new();
        }
        if !self.wall.planes.is_empty() {
            return self.wall.planes.clone();
        }
        let point_m = DVec3::X * self.wall.position_m;
        vec![WallPlane { name: "wall".to_owned(), point_m, normal: DVec3::NEG_X }]
    }

    /// Which tick begins which period of the slow simulation.
    ///
    /// # Panics
    /// When there is no soft object, and the rates do not go together: only with one they are checked.
    #[must_use]
    pub fn slow_schedule(&self) -> Schedule {
        Schedule::new(self.rates.control_hz, self.rates.simulation_hz)
            .expect("checked when the scene was read")
    }

    /// The scene's hosts.
    pub fn hosts(&self) -> impl Iterator<Item = HostIndex> + Clone + use<> {
        HostIndex::all(self.session.users)
    }

    /// The impairment of the way from one host to another.
    #[must_use]
    pub fn impairment(&self, from: HostIndex, to: HostIndex) -> &Impairment {
        let of_way = self.link.ways.iter().rev().find(|way| way.from == from && way.to == to);
        of_way.map_or(&self.link.impairment, |way| &way.impairment)
    }

    /// Whole network periods that a packet from `from` is kept before use in the receiver, by `scheduled` play-out.
    ///
    /// Distributed: `link.delay_periods` each way. Centralized: the round trip is `link.delay_periods`, of which
    /// `link.return_delay_periods` lie on the force's way back and the rest on the position's way to the server.
    #[must_use]
    pub fn play_out_periods(&self, from: HostIndex) -> u32 {
        match self.session.architecture {
            Architecture::Distributed => self.link.delay_periods,
            Architecture::Centralized if from == HostIndex::FIRST => self.link.return_delay_periods,
            Architecture::Centralized => self.link.delay_periods - self.link.return_delay_periods,
        }
    }
}

/// `[session]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Session {
    /// Who computes the world.
    pub architecture: Architecture,
    /// 2 to 16; 1 with a soft object.
    pub users: u8,
    /// How copies of the object are kept together (distributed).
    pub coordination: Coordination,
    /// How bodies are stepped.
    pub integrator: Integrator,
    /// Seed of everything random.
    pub seed: u64,
    /// A peer that is silent for so long has left; its coupling is released smoothly.
    pub peer_timeout_s: f64,
    /// Time in which the coupling to a peer fades in when it comes and out when it goes.
    pub peer_fade_s: f64,
}

/// Who computes the world (thesis §4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Host 1 is the server: it keeps the one object and sends forces back.
    Centralized,
    /// Every host keeps a copy of the object; copies are coupled.
    Distributed,
}

/// How copies of the object are kept together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordination {
    /// Every copy is coupled to every other with k_o, b_o.
    Pairwise,
    /// Every copy is coupled with k_o, b_o to the average of all copies (its own undelayed).
    Average,
}

/// How a body of mass m is advanced by T under a held force f.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// x += T·v + T²·f/(2m), v += T·f/m: exact for a force that is held over the period.
    ExactHold,
    /// v += T·f/m, x += T·v with the new v.
    SemiImplicitEuler,
}

/// `[rates]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rates {
    /// Haptic rate, 1/T_c.
    pub control_hz: Rate,
    /// Network rate, 1/T_t; not above the haptic rate.
    pub network_hz: Rate,
    /// Rate of the slow simulation of a soft object; not above the haptic rate.
    pub simulation_hz: Rate,
}

/// `[link]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Link {
    /// n: network periods between sampling and use; one way when distributed, round trip when centralized. 0 to 64.
    pub delay_periods: u32,
    /// The part of `delay_periods` that lies on the force's way back from the server (centralized). Default 0.
    pub return_delay_periods: u32,
    /// When a received sample is used.
    pub play_out: PlayOut,
    /// What a simulated link does to packets, in every direction that `ways` does not name.
    pub impairment: Impairment,
    /// Directions with an impairment of their own.
    pub ways: Vec<Way>,
}

/// When a received sample is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlayOut {
    /// At sample time + n·T_t; a late one at the next network step.
    Scheduled,
    /// At the first haptic tick at or after its arrival.
    OnArrival,
}

/// `[[link.way]]`: one direction with an impairment of its own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Way {
    /// Sender.
    pub from: HostIndex,
    /// Receiver.
    pub to: HostIndex,
    /// What happens on the way.
    pub impairment: Impairment,
}

/// What a simulated link does to packets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Impairment {
    /// Transit time of every packet, one way.
    pub latency_s: f64,
    /// Extra transit time: the mean of an exponential distribution. Without `reorder_rate`, order is kept.
    pub jitter_s: f64,
    /// Share of packets lost in the long run, 0 to 0.99.
    pub loss_rate: f64,
    /// Mean length of a run of lost packets, in packets, 1 or more (Gilbert–Elliott; 1/(1 − loss_rate) is independent loss).
    pub loss_burst_packets: f64,
    /// Share of packets that overtake: they skip the jitter and the queue's order.
    pub reorder_rate: f64,
    /// Share of packets that arrive twice.
    pub duplicate_rate: f64,
    /// Bytes a second that pass; 0 means no limit.
    pub rate_limit_bytes_per_s: f64,
}

impl Impairment {
    /// A perfect link.
    pub const NONE: Self = Self {
        latency_s: 0.0,
        jitter_s: 0.0,
        loss_rate: 0.0,
        loss_burst_packets: 1.0,
        reorder_rate: 0.0,
        duplicate_rate: 0.0,
        rate_limit_bytes_per_s: 0.0,
    };
}

/// The directions in which bodies and hands may move: a constraint on a three-dimensional world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// Along x; nothing turns.
    Line,
    /// In the x-y plane, turning about z.
    Plane,
    /// Everywhere.
    Space,
}

/// `[hand]`: mass of hand and device together, and the arm's damping and stiffness to where the hand rests; the same for
/// every finger.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hand {
    /// m_h.
    pub mass_kg: f64,
    /// b_h.
    pub damping_n_s_per_m: f64,
    /// k_h, towards the rest position: where the finger is at the start.
    pub stiffness_n_per_m: f64,
    /// A finger is a sphere of this radius, where bodies have shapes.
    pub finger_radius_m: f64,
}

/// `[device]`: what every finger of every user is on. Its inertia at the finger is part of `hand.mass_kg` unless
/// [`DeviceSpec::inertia`] adds the links' own.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviceSpec {
    /// Its mechanism.
    pub kind: DeviceKind,
    /// Counts of an encoder a turn of its joint; 0 is a perfect sensor. Without effect for `point`.
    pub encoder_counts_per_turn: u32,
    /// How velocity is told.
    pub velocity: VelocityEstimate,
    /// Corner of the low pass of [`VelocityEstimate::Filtered`].
    pub velocity_cutoff_hz: f64,
    /// Largest torque of a joint; 0 is no limit. Without effect for `point`.
    pub max_joint_torque_n_m: f64,
    /// Whether the inertia of the links is added to the hand's mass. Without effect for `point`.
    pub inertia: bool,
}

/// The mechanism of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceKind {
    /// A point mass without a mechanism.
    Point,
    /// The planar five-bar pantograph of the thesis, in the x-y plane.
    Pantograph,
    /// A three-joint arm like the PHANToM 1.0's.
    Phantom,
}

/// How a device tells velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocityEstimate {
    /// The true velocity.
    Exact,
    /// (x_k − x_{k−1})/T_c.
    Difference,
    /// The same through a first-order low pass: `v_k = v_{k−1} + (1 − e^{−ω·T_c})·((x_k − x_{k−1})/T_c − v_{k−1})`.
    Filtered,
}

/// `[object]`: the one body of a scene without `[[body]]`, and what all bodies have in common (damping).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Object {
    /// m_o of every copy.
    pub mass_kg: f64,
    /// Damping to the ground; negative values compensate the drag of the network (thesis §6.1).
    pub damping_n_s_per_m: f64,
    /// The same for each world axis, on top of that.
    pub axis_damping_n_s_per_m: DVec3,
    /// The same for turning.
    pub rotational_damping_n_m_s_per_rad: f64,
    /// Its shape.
    pub shape: Shape,
    /// Where its centre of mass is at the start.
    pub position_m: DVec3,
    /// How it is turned at the start: a rotation vector.
    pub rotation_rad: DVec3,
}

/// `[[body]]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Body {
    /// Unique within the scene.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Of every copy.
    pub mass_kg: f64,
    /// Where its centre of mass is at the start.
    pub position_m: DVec3,
    /// How it is turned at the start: a rotation vector.
    pub rotation_rad: DVec3,
    /// A fixed body never moves: a wall of any shape.
    pub fixed: bool,
}

/// What a body looks like; its frame's origin is its centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shape {
    /// Which of the numbers below count.
    pub kind: ShapeKind,
    /// Edges of a box.
    pub size_m: DVec3,
    /// Of a ball or a capsule.
    pub radius_m: f64,
    /// Between the centres of a capsule's ends, along its y axis.
    pub length_m: f64,
    /// File of a hull or mesh: STL, OBJ, glTF; absolute once it was read.
    pub mesh: String,
    /// Metres per unit of the file.
    pub mesh_scale: f64,
    /// What is in the file (a hull's own hull), read when the scene was: scaled, with the origin at the centre of mass.
    #[serde(skip)]
    pub surface: Option<std::sync::Arc<crate::mesh::TriangleMesh>>,
}

/// The kind of a body's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// No surface: hands are coupled to the body's centre, as in the thesis's analysis.
    Point,
    /// A ball.
    Ball,
    /// A box.
    Box,
    /// A capsule.
    Capsule,
    /// The convex hull of a mesh.
    Hull,
    /// A closed triangle mesh.
    Mesh,
}

/// `[ground]`: Coulomb friction under bodies that move in a plane; the normal force is m·g with g = 9.81 m/s².
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ground {
    /// Of sliding.
    pub friction_coefficient: f64,
    /// Of turning: the torque is this times m·g times the body's radius of gyration about the plane's normal.
    pub rotational_friction_coefficient: f64,
}

/// `[contact]`: how fingers touch bodies. Stiffness and damping are in `[coupling]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contact {
    /// μ_s.
    pub static_friction: f64,
    /// μ_k, at most μ_s.
    pub dynamic_friction: f64,
    /// v_tr: a contact that slides more slowly than this sticks.
    pub stick_speed_m_per_s: f64,
    /// Whether the device is pushed to a stop on first contact, thesis (7.1)–(7.2).
    pub moment_cancellation: bool,
    /// Between bodies, normal.
    pub body_body: SpringDamper,
    /// Between bodies, tangential.
    pub body_body_tangential: SpringDamper,
}

/// `[coupling]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coupling {
    /// k_11 = k_22, b_11 = b_22; centralized: k_1, b_1.
    pub hand_object: SpringDamper,
    /// k_12 = k_21, b_12 = b_21; centralized: k_2, b_2.
    pub remote_hand_object: SpringDamper,
    /// k_o, b_o (distributed).
    pub object_object: SpringDamper,
    /// k_T11 = k_T22, b_T11 = b_T22; centralized k_T1: along the surface, where bodies have shapes; then
    /// `hand_object` is across it.
    pub hand_object_tangential: SpringDamper,
    /// k_T12 = k_T21, b_T12 = b_T21; centralized k_T2.
    pub remote_hand_object_tangential: SpringDamper,
    /// k_oR, b_oR (distributed).
    pub object_object_rotational: RotationalSpringDamper,
}

/// A virtual coupler's spring and damper for turning.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RotationalSpringDamper {
    /// N·m/rad.
    pub stiffness_n_m_per_rad: f64,
    /// N·m·s/rad.
    pub damping_n_m_s_per_rad: f64,
}

/// A virtual coupler's spring and damper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringDamper {
    /// N/m.
    pub stiffness_n_per_m: f64,
    /// N·s/m.
    pub damping_n_s_per_m: f64,
}

/// `[wall]`: what all walls are made of, and a plane across the x axis. Stiffness and damping 0 mean that there is none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Wall {
    /// k_w.
    pub stiffness_n_per_m: f64,
    /// b_w.
    pub damping_n_s_per_m: f64,
    /// Where on the axis.
    pub position_m: f64,
    /// Whether it also pulls; walls never pull at bodies with a shape.
    pub sides: WallSides,
    /// k_Tw: along the wall, for bodies with a shape.
    pub tangential_stiffness_n_per_m: f64,
    /// b_Tw.
    pub tangential_damping_n_s_per_m: f64,
    /// μ_s between bodies and walls, and between bodies.
    pub static_friction: f64,
    /// μ_k between bodies and walls, and between bodies; at most μ_s.
    pub dynamic_friction: f64,
    /// `[[wall.plane]]`; where there is none, the one wall is across the x axis at `position_m`.
    pub planes: Vec<WallPlane>,
}

/// `[[wall.plane]]`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WallPlane {
    /// Unique within the scene.
    pub name: String,
    /// A point of it.
    pub point_m: DVec3,
    /// Where it pushes to, of any length but zero.
    pub normal: DVec3,
}

impl Wall {
    /// Whether there is a wall at all.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.stiffness_n_per_m > 0.0 || self.damping_n_s_per_m > 0.0
    }
}

/// Whether a wall also pulls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallSides {
    /// The object is always coupled to the wall, as in the thesis's analysis: linear.
    Two,
    /// The wall pushes towards −x where the object is beyond it, and never pulls.
    One,
}

/// `[governor]`: limits on every force that reaches a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GovernorLimits {
    /// Largest force.
    pub max_force_n: f64,
    /// Largest change of force; the default `max_force_n · control_hz` admits 0 → F_max in one tick.
    pub max_slew_n_per_s: f64,
    /// After so long without a tick, or without a reading of the device, forces fade out and come back softly.
    pub watchdog_s: f64,
    /// Time in which forces fade in at the start.
    pub soft_start_s: f64,
    /// Time in which forces fade out on a stop, a lost link or a fault.
    pub release_s: f64,
    /// Damping that the governor adds at the device.
    pub damping_n_s_per_m: f64,
    /// Whether the governor brakes a finger that the session gave more energy than it took (time-domain passivity control,
    /// Hannaford & Ryu 2002).
    pub passivity_control: bool,
}

/// `[soft]`: the soft object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Soft {
    /// How it is simulated; [`SoftModel::None`] where there is no soft object.
    pub model: SoftModel,
    /// Where its mesh comes from.
    pub mesh: SoftMeshSource,
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio, 0 to 0.49.
    pub poisson_ratio: f64,
    /// kg/m³; of a balloon: of the fluid inside.
    pub density_kg_per_m3: f64,
    /// Rayleigh damping: this times the mass, 1/s.
    pub mass_damping_per_s: f64,
    /// Rayleigh damping: this times the stiffness, s.
    pub stiffness_damping_s: f64,
    /// Newton steps of a period of the simulation, 1 to 20.
    pub newton_steps: u32,
    /// Without inertia and damping: every period ends in the equilibrium of its forces.
    pub quasi_static: bool,
    /// Thickness of a balloon's skin, m.
    pub skin_thickness_m: f64,
    /// How much larger (in every direction) a balloon's skin is than it was cut, more than 1: its tension.
    pub skin_stretch: f64,
    /// Nodes within any of these do not move.
    pub fixed: Vec<FixedRegion>,
    /// The mesh, read and checked when the scene was.
    #[serde(skip)]
    pub nodes: Option<std::sync::Arc<crate::soft_mesh::SoftMesh>>,
}

impl Soft {
    /// Whether the scene has a soft object.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.model != SoftModel::None
    }

    /// The mesh.
    ///
    /// # Panics
    /// When there is no soft object.
    #[must_use]
    pub fn mesh(&self) -> &std::sync::Arc<crate::soft_mesh::SoftMesh> {
        self.nodes.as_ref().expect("a scene with a soft object has read its mesh")
    }
}

/// How a soft object is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SoftModel {
    /// There is none.
    None,
    /// Springs along the edges of the mesh.
    MassSpring,
    /// Corotational linear tetrahedra.
    Corotational,
    /// A closed elastic surface around a fluid that keeps its volume.
    Balloon,
}

/// `soft.mesh`: a file's path, or a table that says which generator makes it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SoftMeshSource {
    /// Which of the fields below count.
    pub generator: SoftMeshKind,
    /// A file: Gmsh MSH, VTK or VTU; or a closed surface (OBJ, STL) that is filled with tetrahedra. Absolute once read.
    pub file: String,
    /// Metres in one unit of the file.
    pub scale: f64,
    /// Edges of a beam or block along x, y, z (one corner at `origin_m`); half axes of an organ.
    pub size_m: DVec3,
    /// Cells of a beam or block along x, y, z.
    pub cells: [u32; 3],
    /// Of a ball or a balloon.
    pub radius_m: f64,
    /// About how long edges are: of a ball, an organ, and of a surface that is filled.
    pub edge_m: f64,
    /// Stiffness of the generator `spring`, N/m.
    pub stiffness_n_per_m: f64,
    /// Where the corner of a beam or block, the middle of anything else that is generated, or the file's origin is.
    pub origin_m: DVec3,
}

/// Where a soft mesh comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SoftMeshKind {
    /// `soft.mesh.file`.
    File,
    /// Cubes, each cut into the six tetrahedra around its (0,0,0)–(1,1,1) diagonal.
    Beam,
    /// The same as a beam; the word for stocky ones.
    Block,
    /// A ball of tetrahedra.
    Ball,
    /// A sphere's surface.
    Balloon,
    /// A bean-shaped blob of tetrahedra.
    Organ,
    /// A small triangle across the x axis of which every node is tied to where it rests: K_o of the paper, `stiffness_n_per_m`.
    Spring,
}

/// `[[soft.fixed]]`: a box; nodes in it do not move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FixedRegion {
    /// Its least corner, m.
    pub from_m: DVec3,
    /// Its largest corner, m.
    pub to_m: DVec3,
}

impl FixedRegion {
    /// Whether a point is in it, but for rounding (1 nm).
    #[must_use]
    pub fn contains(&self, point: DVec3) -> bool {
        let slack = DVec3::splat(1e-9);
        point.cmpge(self.from_m - slack).all() && point.cmple(self.to_m + slack).all()
    }
}

/// `[local_model]`: what is between a hand and the slowly simulated object, at the haptic rate (the paper, §2–4).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LocalModel {
    /// Which.
    pub kind: LocalModelKind,
    /// K_h, N/m; 0: `stiffness_ratio` times the K_o of the contacts.
    pub stiffness_n_per_m: f64,
    /// K_h in units of K_o, where `stiffness_n_per_m` is 0. K_o is a contact's stiffness in its softest direction, divided by
    /// the largest eigenvalue of the joint compliance of all contacts in units of their own.
    pub stiffness_ratio: f64,
    /// INT = N·T·I of `pi`, N/m; 0: `integral_ratio` times K_o.
    pub integral_n_per_m: f64,
    /// INT in units of K_o, where `integral_n_per_m` is 0.
    pub integral_ratio: f64,
    /// Who says what K_o is.
    pub stiffness_from: StiffnessFrom,
    /// Which force of a slow period goes to the simulation (Step 3).
    pub returned_force: ReturnedForce,
    /// How the surface moves between two results of the simulation.
    pub hold: SurfaceHold,
    /// Slow periods between the end of the period whose forces are simulated and the use of the result.
    pub result_delay_periods: u32,
    /// θ̄₁ of (11), m: the penetration that `pi` tolerates while the hand comes out.
    pub exit_threshold_m: f64,
    /// θ̄₂ of (11), m: the same while it goes in; reached linearly as the integral grows to `threshold_force_n`.
    pub entry_threshold_m: f64,
    /// Ī_tot of (11), N: the integral's force at which the threshold is fully there; 0: always.
    pub threshold_force_n: f64,
    /// In how many slow periods the integral's force is drained, linearly, when the hand leaves (§3.5).
    pub drain_periods: f64,
    /// Whether the contact also pulls: `two`, every finger holds the nearest point of the surface for good; linear.
    pub sides: WallSides,
    /// μ along the surface: what the tangential force is at most, times the normal one.
    pub friction: f64,
}

/// What is between a hand and a soft object at the haptic rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LocalModelKind {
    /// None: the force is computed once a slow period, and held.
    Hold,
    /// A spring to the surface (§2.1).
    P,
    /// A spring and an integral (§3.4).
    Pi,
    /// A spring to a surface that gives way by the compliance W = J·K⁻¹·Jᵀ of all contacts together.
    Compliance,
}

/// Who says what K_o is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StiffnessFrom {
    /// The simulation.
    Body,
    /// Estimated from forces and how the surface gives way, whatever the simulation is.
    Estimate,
}

/// Which force of a slow period goes to the simulation (the paper, §4, Step 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReturnedForce {
    /// Of its first tick: the paper's equations.
    First,
    /// The mean of all ticks: the paper's algorithm, Step 3.
    Mean,
    /// Of its last tick.
    Last,
}

/// How the surface moves between two results of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceHold {
    /// It jumps (2).
    Zero,
    /// It moves linearly, one period late (§3.4).
    First,
}

/// `[[user]]`: a user's name and what the simulated hand of that user does.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct User {
    /// Unique within the session.
    pub name: String,
    /// 1 to [`crate::limits::MAX_FINGERS`]; one at the origin where none is written.
    pub fingers: Vec<Finger>,
    /// How firmly the hand follows `reach`, `sinusoid` and `hold`; part of the loop, so the analysis compiles it.
    pub tracking: SpringDamper,
    /// What the hand does, in order.
    pub script: Vec<Action>,
    /// Whether the script starts again at its end (otherwise the hand relaxes).
    pub repeat: bool,
}

/// `[[user.finger]]`: one haptic interface point of a user.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finger {
    /// Where it rests and is at the start.
    pub position_m: DVec3,
    /// What this finger does instead of the user's script; empty: the user's script.
    pub script: Vec<Action>,
}

/// One thing that a simulated hand does, for `duration_s`. Vectors are in the world frame; a scene on a line uses x.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// No force.
    Relax {
        /// s.
        duration_s: f64,
    },
    /// Stay, by tracking, where the hand was when the action began.
    Hold {
        /// s.
        duration_s: f64,
    },
    /// Go by tracking to `to_m` along a minimum-jerk path (Flash & Hogan 1985).
    Reach {
        /// m.
        to_m: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Follow `centre + amplitude·sin(2π·f·t + phase)` by tracking, centre being where the hand was.
    Sinusoid {
        /// m.
        amplitude_m: DVec3,
        /// Hz.
        frequency_hz: f64,
        /// rad.
        phase_rad: f64,
        /// s.
        duration_s: f64,
    },
    /// Push with a constant force.
    Force {
        /// N.
        force_n: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Push with `amplitude·sin(2π·f·t + phase)`.
    SinusoidalForce {
        /// N.
        amplitude_n: DVec3,
        /// Hz.
        frequency_hz: f64,
        /// rad.
        phase_rad: f64,
        /// s.
        duration_s: f64,
    },
    /// Physiological tremor: seeded band-limited force, 8 to 12 Hz.
    Tremor {
        /// Root mean square, N.
        rms_n: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Close the fingers on a body until each presses with `force_n`: each goes straight to the side of the body that it is
    /// at. Ends when all press, or after `duration_s`; from then on the fingers hold what they hold.
    Grasp {
        /// The body's name.
        body: String,
        /// N, of each finger.
        force_n: f64,
        /// At what speed fingers close, m/s.
        speed_m_per_s: f64,
        /// At most, s.
        duration_s: f64,
    },
    /// Move what is held by `by_m` along a minimum-jerk path; all fingers move alike.
    Carry {
        /// m.
        by_m: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Move what is held until its centre is at `to_m`, as seen when the action begins.
    CarryTo {
        /// m.
        to_m: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Lift what is held by `height_m`, against gravity.
    Lift {
        /// m.
        height_m: f64,
        /// s.
        duration_s: f64,
    },
    /// Turn what is held about its centre, about the z axis.
    Turn {
        /// rad.
        angle_rad: f64,
        /// s.
        duration_s: f64,
    },
    /// Push what is held with a constant force on top of the grip, shared by the fingers; it fades in and out.
    Push {
        /// N, of all fingers together.
        force_n: DVec3,
        /// s.
        duration_s: f64,
    },
    /// Hold what is held until another hand takes its weight: until the load that the fingers feel has fallen to half of
    /// what it was when the action began, or `duration_s` is over.
    HandOver {
        /// At most, s.
        duration_s: f64,
    },
    /// Open the fingers: back along the surface's normal by `distance_m`.
    LetGo {
        /// m.
        distance_m: f64,
        /// s.
        duration_s: f64,
    },
    /// Hold until the session's clock shows `until_s`: people who work together agree on times. Takes no time when it
    /// is later already.
    WaitUntil {
        /// s of session time.
        until_s: f64,
    },
    /// Push with a constant force for `push_s`, then let go for the rest of `duration_s`.
    PushAndLetGo {
        /// N.
        force_n: DVec3,
        /// s.
        push_s: f64,
        /// s.
        duration_s: f64,
    },
}

impl Action {
    /// How long it takes at most, s (from the session's start for [`Action::WaitUntil`]).
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match *self {
            Self::Relax { duration_s }
            | Self::Hold { duration_s }
            | Self::Reach { duration_s, .. }
            | Self::Sinusoid { duration_s, .. }
            | Self::Force { duration_s, .. }
            | Self::SinusoidalForce { duration_s, .. }
            | Self::Tremor { duration_s, .. }
            | Self::Grasp { duration_s, .. }
            | Self::Carry { duration_s, .. }
            | Self::CarryTo { duration_s, .. }
            | Self::Lift { duration_s, .. }
            | Self::Turn { duration_s, .. }
            | Self::Push { duration_s, .. }
            | Self::HandOver { duration_s }
            | Self::LetGo { duration_s, .. }
            | Self::PushAndLetGo { duration_s, .. } => duration_s,
            Self::WaitUntil { until_s } => until_s,
        }
    }

    /// Whether the hand tracks a path during it.
    #[must_use]
    pub fn tracks(&self) -> bool {
        !matches!(
            self,
            Self::Relax { .. }
                | Self::Force { .. }
                | Self::SinusoidalForce { .. }
                | Self::Tremor { .. }
                | Self::PushAndLetGo { .. }
        )
    }
}
