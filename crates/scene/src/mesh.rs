//! Triangle meshes: checked, centred, with their volume and inertia; from files ([`files`]), hulls and [`generators`].

use glam::{DMat3, DVec3};
use parry3d_f64::transformation::try_convex_hull;

pub mod files;
pub mod generators;
mod gltf;
mod topology;

pub use files::Triangles;

/// Most triangles of a mesh.
pub const MAX_TRIANGLES: usize = 1_000_000;
/// Smallest and largest extent of a mesh, m.
pub const EXTENT_M: (f64, f64) = (1e-4, 10.0);

/// A closed triangle mesh with outward normals: scaled to metres, its centre of mass at the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// m.
    pub vertices: Vec<DVec3>,
    /// Three vertices each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// m³.
    pub volume_m3: f64,
    /// Inertia about the centre of mass of a body of this shape and uniform density, per kilogram: m².
    pub inertia_per_mass_m2: DMat3,
}

/// What is wrong with a mesh. Triangles and vertices are counted from 1, as they come in the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be had.
    #[error("it cannot be read ({0})")]
    Unreadable(String),
    /// The file is not what its ending says.
    #[error("it is not a usable {format} file ({problem})")]
    Format {
        /// STL, OBJ or glTF.
        format: &'static str,
        /// What the reader found.
        problem: String,
    },
    /// No triangle is left.
    #[error("there is no triangle with an area")]
    Empty,
    /// More than [`MAX_TRIANGLES`].
    #[error("there are more than {MAX_TRIANGLES} triangles")]
    TooLarge,
    /// A vertex that is nowhere.
    #[error("vertex {vertex} has a coordinate that is not a number")]
    NotFinite {
        /// Which.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    OutOfRange {
        /// Which.
        triangle: usize,
        /// The vertex that it names.
        vertex: u64,
        /// How many there are.
        vertices: usize,
    },
    /// Smaller or larger than [`EXTENT_M`].
    #[error("all is within {extent_m} m")]
    Extent {
        /// Its largest extent along an axis, m.
        extent_m: f64,
    },
    /// An edge with one triangle only.
    #[error("the edge from {from} m to {to} m of triangle {triangle} has no second triangle")]
    Open {
        /// The triangle.
        triangle: usize,
        /// One end, m.
        from: DVec3,
        /// The other.
        to: DVec3,
    },
    /// An edge with two triangles of which one is turned inside out.
    #[error(
        "triangles {triangle} and {other} have different sides outside: they share the edge from {from} m to {to} m"
    )]
    Turned {
        /// One triangle.
        triangle: usize,
        /// The other.
        other: usize,
        /// One end of the edge, m.
        from: DVec3,
        /// The other.
        to: DVec3,
    },
    /// An edge with more than two triangles.
    #[error("the edge from {from} m to {to} m of triangle {triangle} is in {count} triangles")]
    NotManifold {
        /// One of the triangles.
        triangle: usize,
        /// One end, m.
        from: DVec3,
        /// The other.
        to: DVec3,
        /// How many triangles.
        count: usize,
    },
    /// All triangles are clockwise seen from outside.
    #[error("the triangles have their outer sides inside")]
    Inverted,
    /// Nothing is inside.
    #[error("there is no volume inside")]
    Flat,
}

impl MeshError {
    /// What a mesh must be instead; follows "it must be".
    #[must_use]
    pub fn allowed(&self) -> String {
        match self {
            Self::Unreadable(_) | Self::Format { .. } => {
                "a readable .stl, .obj, .gltf or .glb file of triangles".to_owned()
            }
            Self::Extent { .. } => {
                let (least, most) = EXTENT_M;
                format!(
                    "a mesh of {least} m to {most} m; mesh_scale is how many metres a unit of the file is"
                )
            }
            Self::TooLarge => format!("a mesh of at most {MAX_TRIANGLES} triangles"),
            Self::Empty | Self::NotFinite { .. } | Self::OutOfRange { .. } => {
                "a mesh of triangles between vertices that exist".to_owned()
            }
            Self::Open { .. }
            | Self::Turned { .. }
            | Self::NotManifold { .. }
            | Self::Inverted
            | Self::Flat => {
                "a closed mesh: every edge in two triangles that are counter-clockwise seen from outside"
                    .to_owned()
            }
        }
    }
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

/// The lowest and the highest corner of the box around `vertices`.
pub(crate) fn bounds(vertices: &[DVec3]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    vertices.iter().fold(start, |(low, high), &vertex| (low.min(vertex), high.max(vertex)))
}
