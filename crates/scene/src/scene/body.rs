//! Rigid bodies, their shapes, and the walls and the ground that they meet.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::mesh::TriangleMesh;
use crate::value::choice;

/// The directions in which bodies and hands may move: a constraint on a three-dimensional world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Space {
    /// Along x; nothing turns.
    Line,
    /// In the x-y plane, turning about z.
    Plane,
    /// Everywhere, turning about every axis.
    Space,
}

choice!(Space { "line" => Line, "plane" => Plane, "space" => Space });

/// `[object]`: the one body of a scene without `[[body]]`, and what all bodies have in common (damping).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Object {
    /// m_o of every copy.
    pub mass_kg: f64,
    /// Damping to the ground; negative values compensate the drag of the network (Fotoohi Ghiam 2006, §6.1).
    pub damping_n_s_per_m: f64,
    /// The same for each world axis, on top of that.
    pub axis_damping_n_s_per_m: DVec3,
    /// The same for turning.
    pub rotational_damping_n_m_s_per_rad: f64,
    /// What it looks like, and where fingers touch it.
    pub shape: Shape,
    /// Where its centre of mass is at the start.
    pub position_m: DVec3,
    /// How it is turned at the start: a rotation vector.
    pub rotation_rad: DVec3,
}

/// What a body that moves is to the ground, whatever touches it, along the axes of the world: the one place where keys of `[object]`
/// become springs and dampers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyImpedance {
    /// Towards where the body's centre of mass starts, N/m.
    pub stiffness_n_per_m: DVec3,
    /// N·s/m.
    pub damping_n_s_per_m: DVec3,
    /// Of turning about any axis, N·m·s/rad.
    pub rotational_damping_n_m_s_per_rad: f64,
}

impl Object {
    /// What every body that moves is to the ground.
    #[must_use]
    pub fn to_ground(&self) -> BodyImpedance {
        BodyImpedance {
            stiffness_n_per_m: DVec3::ZERO,
            damping_n_s_per_m: DVec3::splat(self.damping_n_s_per_m) + self.axis_damping_n_s_per_m,
            rotational_damping_n_m_s_per_rad: self.rotational_damping_n_m_s_per_rad,
        }
    }
}

/// `[[body]]`: a rigid body of the world.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Body {
    /// Unique within the scene.
    pub name: String,
    /// What it looks like, and where fingers touch it.
    pub shape: Shape,
    /// Mass of every copy, kg.
    pub mass_kg: f64,
    /// Where its centre of mass is at the start.
    pub position_m: DVec3,
    /// How it is turned at the start: a rotation vector.
    pub rotation_rad: DVec3,
    /// A fixed body never moves: a wall of any shape.
    pub fixed: bool,
}

/// What a body looks like; its frame's origin is its centre of mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    pub surface: Option<Arc<TriangleMesh>>,
}

/// The kind of a body's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeKind {
    /// No surface: hands are coupled to the body's centre, as in Fotoohi Ghiam's analysis.
    Point,
    /// A ball of `radius_m`.
    Ball,
    /// A box with edges of `size_m`.
    Box,
    /// A capsule: all within `radius_m` of a line of `length_m`.
    Capsule,
    /// The convex hull of a mesh.
    Hull,
    /// A closed triangle mesh.
    Mesh,
}

choice!(ShapeKind {
    "point" => Point,
    "ball" => Ball,
    "box" => Box,
    "capsule" => Capsule,
    "hull" => Hull,
    "mesh" => Mesh
});

/// `[ground]`: Coulomb friction under bodies that move in a plane; the normal force is m·g with g = 9.81 m/s².
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Ground {
    /// Friction coefficient of sliding.
    pub friction_coefficient: f64,
    /// Of turning: the torque is this times m·g times the body's radius of gyration about the plane's normal.
    pub rotational_friction_coefficient: f64,
}

/// `[wall]`: what all walls are made of, and a plane across the x axis. Stiffness and damping 0 mean that there is none.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Wall {
    /// k_w: across the wall.
    pub stiffness_n_per_m: f64,
    /// b_w: across the wall.
    pub damping_n_s_per_m: f64,
    /// Where on the axis.
    pub position_m: f64,
    /// Whether it also pulls; walls never pull at bodies with a shape.
    pub sides: WallSides,
    /// k_Tw: along the wall, for bodies with a shape.
    pub tangential_stiffness_n_per_m: f64,
    /// b_Tw: along the wall, for bodies with a shape.
    pub tangential_damping_n_s_per_m: f64,
    /// μ_s between bodies and walls, and between bodies.
    pub static_friction: f64,
    /// μ_k between bodies and walls, and between bodies; at most μ_s.
    pub dynamic_friction: f64,
    /// `[[wall.plane]]`; where there is none, the one wall is across the x axis at `position_m`.
    pub planes: Vec<WallPlane>,
}

/// `[[wall.plane]]`: a wall that bodies do not pass.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
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
    /// The object is always coupled to the wall, as in Fotoohi Ghiam's analysis: linear.
    Two,
    /// The wall pushes towards −x where the object is beyond it, and never pulls.
    One,
}

choice!(WallSides { "two" => Two, "one" => One });
