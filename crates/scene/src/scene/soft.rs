//! The soft object, and what is between a hand and it.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::body::WallSides;
use crate::soft_mesh::{FixedRegion, SoftMesh};
use crate::value::choice;

/// `[soft]`: the soft object.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    pub nodes: Option<Arc<SoftMesh>>,
}

impl Soft {
    /// Whether the scene has a soft object.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.model != SoftModel::None
    }

    /// The mesh, read and checked when the scene was.
    ///
    /// # Panics
    /// When there is no soft object.
    #[must_use]
    pub fn mesh(&self) -> &Arc<SoftMesh> {
        self.nodes.as_ref().expect("a scene with a soft object has read its mesh")
    }
}

/// How a soft object is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SoftModel {
    /// There is no soft object.
    None,
    /// Springs along the edges of the mesh.
    MassSpring,
    /// Corotational linear tetrahedra.
    Corotational,
    /// A closed elastic surface around a fluid that keeps its volume.
    Balloon,
}

choice!(SoftModel {
    "none" => None,
    "mass-spring" => MassSpring,
    "corotational" => Corotational,
    "balloon" => Balloon
});

/// `soft.mesh`: a file's path, or a table that says which generator makes it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    /// It is in the file that `soft.mesh.file` names.
    File,
    /// Cubes, each cut into the six tetrahedra around its (0,0,0)–(1,1,1) diagonal.
    Beam,
    /// The same as a beam; the word for stocky ones.
    Block,
    /// A ball of tetrahedra.
    Ball,
    /// A sphere's surface, for a balloon.
    Balloon,
    /// A bean-shaped blob of tetrahedra.
    Organ,
    /// A small triangle across the x axis of which every node is tied to where it rests: K_o of the paper, `stiffness_n_per_m`.
    Spring,
}

choice!(SoftMeshKind {
    "file" => File,
    "beam" => Beam,
    "block" => Block,
    "ball" => Ball,
    "balloon" => Balloon,
    "organ" => Organ,
    "spring" => Spring
});

/// `[local_model]`: what is between a hand and the slowly simulated object, at the haptic rate (the paper, §2–4).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LocalModel {
    /// The law by which the surface answers.
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

choice!(LocalModelKind { "hold" => Hold, "p" => P, "pi" => Pi, "compliance" => Compliance });

/// Who says what K_o is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StiffnessFrom {
    /// The simulation of the body.
    Body,
    /// Estimated from forces and how the surface gives way, whatever the simulation is.
    Estimate,
}

choice!(StiffnessFrom { "body" => Body, "estimate" => Estimate });

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

choice!(ReturnedForce { "first" => First, "mean" => Mean, "last" => Last });

/// How the surface moves between two results of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceHold {
    /// It jumps when a result comes (2).
    Zero,
    /// It moves linearly, one period late (§3.4).
    First,
}

choice!(SurfaceHold { "zero" => Zero, "first" => First });
