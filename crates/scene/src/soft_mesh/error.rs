//! What can be wrong with a soft object's mesh.

use glam::DVec3;

use crate::mesh::{EXTENT_M, MeshError};

/// Most tetrahedra, or triangles of a balloon.
pub const MAX_ELEMENTS: usize = 200_000;
/// The least shape of a tetrahedron: 6·√2 times its volume over the cube of its longest edge; 1 is a regular one.
pub const LEAST_SHAPE: f64 = 1e-3;

/// What is wrong with a soft object's mesh. Tetrahedra, triangles and nodes are counted from 1, as they come in the file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftMeshError {
    /// The surface that is to be filled, or is a balloon's skin.
    #[error(transparent)]
    Surface(#[from] MeshError),
    /// The file is not what its ending says, or holds what is not read.
    #[error("it is not a usable {format} file ({problem})")]
    Format {
        /// Gmsh MSH, VTK or VTU.
        format: &'static str,
        /// What the reader found.
        problem: String,
    },
    /// The ending of the file is none that is read.
    #[error("its name does not end in .msh, .vtk, .vtu, .stl, .obj, .gltf or .glb")]
    Ending,
    /// There is no tetrahedron.
    #[error("there is no tetrahedron in it")]
    Empty,
    /// There are more than [`MAX_ELEMENTS`].
    #[error("it has {found} tetrahedra or triangles")]
    TooLarge {
        /// How many there are, about.
        found: usize,
    },
    /// Two tetrahedra in the same place.
    #[error("tetrahedra {tetrahedron} and {other} are on the same side of a face that they share")]
    Overlap {
        /// One of the tetrahedra.
        tetrahedron: usize,
        /// The other tetrahedron.
        other: usize,
    },
    /// A node that is nowhere.
    #[error("node {node} has a coordinate that is not a number")]
    NotFinite {
        /// Which node, counted from 1.
        node: usize,
    },
    /// A tetrahedron names a node that does not exist, or one twice.
    #[error("tetrahedron {tetrahedron} names node {node} of {nodes}")]
    OutOfRange {
        /// Which tetrahedron, counted from 1.
        tetrahedron: usize,
        /// The node that it names.
        node: u64,
        /// How many there are.
        nodes: usize,
    },
    /// A tetrahedron that is turned inside out, while others are not.
    #[error("tetrahedron {tetrahedron} is inverted: its volume is {volume_m3:.1e} m³")]
    Inverted {
        /// Which tetrahedron, counted from 1.
        tetrahedron: usize,
        /// Its signed volume, where that of most is positive.
        volume_m3: f64,
    },
    /// A tetrahedron of hardly any volume.
    #[error(
        "tetrahedron {tetrahedron} is flat: its volume is {shape:.1e} of that of a regular one with its longest edge"
    )]
    Flat {
        /// Which tetrahedron, counted from 1.
        tetrahedron: usize,
        /// Its shape, see [`LEAST_SHAPE`].
        shape: f64,
    },
    /// A face in more than two tetrahedra.
    #[error("a face of tetrahedron {tetrahedron} is in {count} tetrahedra")]
    NotManifold {
        /// One of the tetrahedra that have the face.
        tetrahedron: usize,
        /// How many tetrahedra have the face.
        count: usize,
    },
    /// Tetrahedra that hang together by an edge only.
    #[error(
        "the surface meets itself in the edge between nodes {from} and {to} of tetrahedron {tetrahedron}"
    )]
    Hinge {
        /// One of the tetrahedra at the edge.
        tetrahedron: usize,
        /// One end of the edge, a node.
        from: usize,
        /// The other end of the edge.
        to: usize,
    },
    /// Smaller or larger than [`EXTENT_M`].
    #[error("all of it is within {extent_m} m")]
    Extent {
        /// Its largest extent along an axis, m.
        extent_m: f64,
    },
    /// A surface that could not be filled.
    #[error("it cannot be filled with tetrahedra of about {edge_m} m ({problem})")]
    NotFilled {
        /// The edge that was asked for, m.
        edge_m: f64,
        /// What the filling lacks.
        problem: String,
    },
    /// Nothing that is fixed keeps a piece of the mesh from moving or turning.
    #[error("the piece of the mesh around ({}, {}, {}) m has {fixed} nodes in them", .near_m.x, .near_m.y, .near_m.z)]
    NotHeld {
        /// A node of the piece, m.
        near_m: DVec3,
        /// How many of its nodes are fixed: fewer than 3, or all on a line.
        fixed: usize,
    },
    /// Every node is fixed: nothing can move.
    #[error("all {nodes} nodes are in them")]
    AllFixed {
        /// How many there are.
        nodes: usize,
    },
}

impl SoftMeshError {
    /// Whether the regions that are fixed are at fault, and not the mesh.
    #[must_use]
    pub fn is_of_fixed(&self) -> bool {
        matches!(self, Self::NotHeld { .. } | Self::AllFixed { .. })
    }

    /// What a mesh must be instead; follows "it must be".
    #[must_use]
    pub fn allowed(&self) -> String {
        match self {
            Self::Surface(MeshError::Extent { .. }) | Self::Extent { .. } => {
                let (least, most) = EXTENT_M;
                format!("a mesh of {least} m to {most} m; soft.mesh.scale is how many metres a unit of the file is")
            }
            Self::Surface(MeshError::Unreadable(_) | MeshError::Format { .. })
            | Self::Format { .. }
            | Self::Ending => {
                "a readable .msh, .vtk or .vtu file of tetrahedra, or a closed surface as .stl, .obj, .gltf or .glb".to_owned()
            }
            Self::Surface(error) => error.allowed(),
            Self::Empty | Self::NotFinite { .. } | Self::OutOfRange { .. } => {
                "a mesh of tetrahedra between nodes that exist".to_owned()
            }
            Self::TooLarge { .. } => format!("a mesh of at most {MAX_ELEMENTS} of them"),
            Self::Inverted { .. } => "a mesh of tetrahedra that are all turned alike".to_owned(),
            Self::Flat { .. } => format!("a mesh of tetrahedra of at least {LEAST_SHAPE} of that volume"),
            Self::Overlap { .. } => "a mesh of tetrahedra that do not overlap".to_owned(),
            Self::NotManifold { .. } | Self::Hinge { .. } => {
                "a mesh in which every face is in one or two tetrahedra, and every edge of the surface in two triangles"
                    .to_owned()
            }
            Self::NotFilled { .. } => "a closed surface without parts thinner than that; soft.mesh.edge_m is the edge".to_owned(),
            Self::NotHeld { .. } => {
                "regions that hold at least three nodes, not on a line, of every piece of the mesh".to_owned()
            }
            Self::AllFixed { .. } => "regions that leave a node free".to_owned(),
        }
    }
}
