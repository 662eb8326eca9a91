//! Closed meshes: centred, with their volume and inertia.

use glam::{DMat3, DVec3};
use parry3d_f64::transformation::try_convex_hull;

use super::error::MeshError;
use super::topology;
use super::triangles::{Triangles, bounds};

/// A closed triangle mesh with outward normals: scaled to metres, its centre of mass at the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Corners, m, from the centre of mass.
    pub vertices: Vec<DVec3>,
    /// Three vertices each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// What is inside, m³.
    pub volume_m3: f64,
    /// Inertia about the centre of mass of a body of this shape and uniform density, per kilogram: m².
    pub inertia_per_mass_m2: DMat3,
}

impl TriangleMesh {
    /// The body within closed `triangles`. Vertices at the same place become one, and triangles without an area are left
    /// out.
    ///
    /// # Errors
    /// When they are not closed, not numbers, too many, too small or too large; all but [`MeshError::Unreadable`] and
    /// [`MeshError::Format`].
    pub fn closed(triangles: &Triangles) -> Result<Self, MeshError> {
        triangles.check()?;
        let (vertices, kept) = topology::weld(triangles)?;
        topology::check_edges(&vertices, &kept)?;
        let triangles: Vec<[u32; 3]> = kept.into_iter().map(|(_, corners)| corners).collect();
        Self::centred(vertices, triangles)
    }

    /// The vertices, m, and triangles of closed `triangles` where they are, not moved to their centre.
    ///
    /// # Errors
    /// As [`TriangleMesh::closed`].
    pub(crate) fn closed_in_place(triangles: &Triangles) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), MeshError> {
        triangles.check()?;
        let (vertices, kept) = topology::weld(triangles)?;
        topology::check_edges(&vertices, &kept)?;
        let triangles: Vec<[u32; 3]> = kept.into_iter().map(|(_, corners)| corners).collect();
        Self::centred(vertices.clone(), triangles.clone())?;
        Ok((vertices, triangles))
    }

    /// The convex hull of the corners of `triangles`, which need not be closed.
    ///
    /// # Errors
    /// As [`TriangleMesh::closed`], except for what is said of edges.
    pub fn hull(triangles: &Triangles) -> Result<Self, MeshError> {
        triangles.check()?;
        let (vertices, _) = topology::weld(triangles)?;
        let (vertices, triangles) = try_convex_hull(&vertices).map_err(|_| MeshError::Flat)?;
        Self::centred(vertices, triangles)
    }

    /// The same mesh, `ratio` times as large.
    #[must_use]
    pub fn scaled(&self, ratio: f64) -> Self {
        Self {
            vertices: self.vertices.iter().map(|&vertex| vertex * ratio).collect(),
            triangles: self.triangles.clone(),
            volume_m3: self.volume_m3 * ratio.powi(3),
            inertia_per_mass_m2: self.inertia_per_mass_m2 * ratio.powi(2),
        }
    }

    /// The corners of triangle `index`, m.
    ///
    /// # Panics
    /// When there is no such triangle.
    #[must_use]
    pub fn corners(&self, index: usize) -> [DVec3; 3] {
        corners(&self.vertices, self.triangles[index])
    }

    /// Moves the centre of mass to the origin; volume and inertia are sums over the signed tetrahedra between the origin and
    /// each triangle.
    fn centred(mut vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let (low, high) = bounds(&vertices);
        // Near the origin tetrahedra cancel without loss.
        vertices.iter_mut().for_each(|vertex| *vertex -= (low + high) / 2.0);
        let (mut volume_m3, mut moment) = (0.0, DVec3::ZERO);
        for [a, b, c] in triangles.iter().map(|&triangle| corners(&vertices, triangle)) {
            let tetrahedron = a.dot(b.cross(c)) / 6.0;
            volume_m3 += tetrahedron;
            moment += (a + b + c) * (tetrahedron / 4.0);
        }
        if volume_m3.abs() <= 1e-9 * (high - low).max_element().powi(3) {
            return Err(MeshError::Flat);
        }
        if volume_m3 < 0.0 {
            return Err(MeshError::Inverted);
        }
        let centre = moment / volume_m3;
        vertices.iter_mut().for_each(|vertex| *vertex -= centre);
        let inertia_per_mass_m2 = inertia_per_mass_m2(&vertices, &triangles, volume_m3);
        Ok(Self { vertices, triangles, volume_m3, inertia_per_mass_m2 })
    }
}

/// Over a tetrahedron with corners 0, a, b, c and volume V, x·xᵀ integrates to V/20·(a·aᵀ + b·bᵀ + c·cᵀ + s·sᵀ), s = a + b + c.
fn inertia_per_mass_m2(vertices: &[DVec3], triangles: &[[u32; 3]], volume_m3: f64) -> DMat3 {
    let mut spread = DMat3::ZERO;
    for [a, b, c] in triangles.iter().map(|&triangle| corners(vertices, triangle)) {
        let weight = a.dot(b.cross(c)) / 120.0;
        for v in [a, b, c, a + b + c] {
            spread += DMat3::from_cols(v * v.x, v * v.y, v * v.z) * weight;
        }
    }
    let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
    (DMat3::from_diagonal(DVec3::splat(trace)) - spread) * volume_m3.recip()
}

fn corners(vertices: &[DVec3], triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|vertex| vertices[vertex as usize])
}
