//! Mass, and inertia about the centre of mass, of a shape of uniform density.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::scene::{Shape, ShapeKind};

/// How hard a body is to move and to turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// kg.
    pub mass_kg: f64,
    /// About the centre of mass, along the axes of the body's frame, kg·m². Zero for a point, which does not turn.
    pub inertia_kg_m2: DMat3,
}

impl Shape {
    /// The mass properties of a body of this shape and of uniform density. In closed form for a ball, a box and a capsule;
    /// a hull's or mesh's from its tetrahedra ([`crate::mesh::TriangleMesh::inertia_per_mass_m2`]).
    #[must_use]
    pub fn mass_properties(&self, mass_kg: f64) -> MassProperties {
        let per_mass_m2 = match self.kind {
            ShapeKind::Point => DMat3::ZERO,
            ShapeKind::Ball => DMat3::from_diagonal(DVec3::splat(0.4 * self.radius_m.powi(2))),
            ShapeKind::Box => {
                let square = self.size_m * self.size_m;
                DMat3::from_diagonal((DVec3::splat(square.element_sum()) - square) / 12.0)
            }
            ShapeKind::Capsule => capsule_m2(self.radius_m, self.length_m),
            ShapeKind::Hull | ShapeKind::Mesh => {
                self.surface.as_ref().map_or(DMat3::ZERO, |surface| surface.inertia_per_mass_m2)
            }
        };
        MassProperties { mass_kg, inertia_kg_m2: per_mass_m2 * mass_kg }
    }
}

/// A cylinder and two half balls along y. A half ball's centre of mass is 3/8·r from its flat side, whence 3/8·l·r.
fn capsule_m2(radius_m: f64, length_m: f64) -> DMat3 {
    let (r, l) = (radius_m, length_m);
    let (cylinder, ball) = (PI * r * r * l, PI * r.powi(3) * 4.0 / 3.0);
    let along = cylinder * r * r / 2.0 + ball * 0.4 * r * r;
    let across =
        cylinder * (l * l / 12.0 + r * r / 4.0) + ball * (0.4 * r * r + l * l / 4.0 + l * r * 3.0 / 8.0);
    DMat3::from_diagonal(DVec3::new(across, along, across) / (cylinder + ball))
}
