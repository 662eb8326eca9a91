//! What can be wrong with a triangle mesh.

use glam::DVec3;

/// Most triangles of a mesh.
pub const MAX_TRIANGLES: usize = 1_000_000;
/// Smallest and largest extent of a mesh, m.
pub const EXTENT_M: (f64, f64) = (1e-4, 10.0);

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
    /// There are more than [`MAX_TRIANGLES`].
    #[error("there are more than {MAX_TRIANGLES} triangles")]
    TooLarge,
    /// A vertex that is nowhere.
    #[error("vertex {vertex} has a coordinate that is not a number")]
    NotFinite {
        /// Which vertex, counted from 1.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    OutOfRange {
        /// Which triangle, counted from 1.
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
        /// The triangle that has the edge.
        triangle: usize,
        /// One end of the edge, m.
        from: DVec3,
        /// The other end of the edge, m.
        to: DVec3,
    },
    /// An edge with two triangles of which one is turned inside out.
    #[error(
        "triangles {triangle} and {other} have different sides outside: they share the edge from {from} m to {to} m"
    )]
    Turned {
        /// One of the triangles that have the edge.
        triangle: usize,
        /// The other triangle that has the edge.
        other: usize,
        /// One end of the edge, m.
        from: DVec3,
        /// The other end of the edge, m.
        to: DVec3,
    },
    /// An edge with more than two triangles.
    #[error("the edge from {from} m to {to} m of triangle {triangle} is in {count} triangles")]
    NotManifold {
        /// One of the triangles.
        triangle: usize,
        /// One end of the edge, m.
        from: DVec3,
        /// The other end of the edge, m.
        to: DVec3,
        /// How many triangles have the edge.
        count: usize,
    },
    /// All triangles are clockwise seen from outside.
    #[error("the triangles have their outer sides inside")]
    Inverted,
    /// The triangles have no volume inside.
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
