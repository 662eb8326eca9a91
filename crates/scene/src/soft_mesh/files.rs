//! Tetrahedra from files: Gmsh MSH (2.2 and 4.1, text and binary), VTK (legacy, text and binary) and VTU.
//!
//! The readers are our own because no kept crate reads all of it (November 2026): mshio reads MSH 4.1 only, and the
//! vtkio that reads today's VTU is a release candidate.

mod cells;
mod msh;
mod scanner;
mod vtk;
mod vtu;

use std::path::Path;

use glam::DVec3;

use super::error::SoftMeshError;
use crate::mesh::read_bytes;

pub use cells::Cells;

/// What a file of tetrahedra is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TetrahedraFormat {
    /// Gmsh's own format, 2.2 and 4.1.
    Msh,
    /// The legacy format of VTK.
    Vtk,
    /// An unstructured grid in the XML format of VTK.
    Vtu,
}

impl TetrahedraFormat {
    /// By the ending of a file's name.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "msh" => Some(Self::Msh),
            "vtk" => Some(Self::Vtk),
            "vtu" => Some(Self::Vtu),
            _ => None,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Msh => "Gmsh MSH",
            Self::Vtk => "VTK",
            Self::Vtu => "VTU",
        }
    }
}

impl Cells {
    /// Reads a file of which a unit is `scale` metres and the origin is at `origin_m`.
    ///
    /// # Errors
    /// When it cannot be read, is not what its ending says, or has cells with a volume that are no tetrahedra.
    pub fn read(path: &Path, scale: f64, origin_m: DVec3) -> Result<Self, SoftMeshError> {
        let format = TetrahedraFormat::from_path(path).ok_or(SoftMeshError::Ending)?;
        let mut cells = Self::parse(format, &read_bytes(path)?)?;
        cells.nodes_m.iter_mut().for_each(|node| *node = *node * scale + origin_m);
        Ok(cells)
    }

    /// Reads the bytes of a file of which a unit is a metre.
    ///
    /// # Errors
    /// When it is not what `format` says, or has cells with a volume that are no tetrahedra.
    pub fn parse(format: TetrahedraFormat, bytes: &[u8]) -> Result<Self, SoftMeshError> {
        let read = match format {
            TetrahedraFormat::Msh => msh::read(bytes),
            TetrahedraFormat::Vtk => vtk::read(bytes),
            TetrahedraFormat::Vtu => vtu::read(bytes),
        };
        read.map_err(|problem| SoftMeshError::Format { format: format.name(), problem })
    }
}
