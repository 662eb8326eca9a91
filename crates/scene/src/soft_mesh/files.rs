//! Tetrahedra from files: Gmsh MSH (2.2 and 4.1, text and binary), VTK (legacy, text and binary) and VTU.

use std::path::Path;

use glam::DVec3;

use super::SoftMeshError;
use crate::mesh::Triangles;
use crate::mesh::files::read_bytes;

mod msh;
mod scanner;
mod vtk;
mod vtu;

/// Most points or cells that are read.
const MAX_ITEMS: u64 = 4_000_000;

/// What is in a file, in metres: tetrahedra, and triangles on and between them. Cells of other kinds are an error where they
/// have a volume, else left out; of curved ones the corners count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// m.
    pub nodes_m: Vec<DVec3>,
    /// Four nodes each.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Three nodes each.
    pub triangles: Vec<[u32; 3]>,
}

/// What a file of tetrahedra is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Gmsh.
    Msh,
    /// VTK, legacy.
    Vtk,
    /// VTK, XML, unstructured grid.
    Vtu,
}

impl Format {
    /// By the ending of a file's name.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
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
        let format = Format::of(path).ok_or(SoftMeshError::Ending)?;
        let mut cells = Self::parse(format, &read_bytes(path)?)?;
        cells.nodes_m.iter_mut().for_each(|node| *node = *node * scale + origin_m);
        Ok(cells)
    }

    /// Reads the bytes of a file of which a unit is a metre.
    ///
    /// # Errors
    /// When it is not what `format` says, or has cells with a volume that are no tetrahedra.
    pub fn parse(format: Format, bytes: &[u8]) -> Result<Self, SoftMeshError> {
        let read = match format {
            Format::Msh => msh::read(bytes),
            Format::Vtk => vtk::read(bytes),
            Format::Vtu => vtu::read(bytes),
        };
        read.map_err(|problem| SoftMeshError::Format { format: format.name(), problem })
    }

    /// The triangles alone.
    pub(super) fn into_surface(self) -> Triangles {
        Triangles { vertices: self.nodes_m, triangles: self.triangles }
    }

    /// Adds cell `number` (from 1) of the VTK kind `kind` between `nodes`.
    fn add_vtk(&mut self, number: usize, kind: u64, nodes: &[u64]) -> Result<(), String> {
        match kind {
            // Linear, quadratic and of any order.
            10 | 24 | 71 => self.add_tetrahedron(number, nodes),
            5 | 22 | 34 | 69 => self.add_triangle(number, nodes),
            11..=16 | 25..=27 | 29 | 32 | 33 | 37 | 41 | 42 | 67 | 72..=74 | 79..=81 => {
                Err(format!("cell {number} of type {kind} is not a tetrahedron"))
            }
            0..=81 => Ok(()),
            _ => Err(format!("cell {number} has type {kind}, which is unknown")),
        }
    }

    fn add_tetrahedron(&mut self, number: usize, nodes: &[u64]) -> Result<(), String> {
        self.tetrahedra.push(self.corners(number, nodes)?);
        Ok(())
    }

    fn add_triangle(&mut self, number: usize, nodes: &[u64]) -> Result<(), String> {
        self.triangles.push(self.corners(number, nodes)?);
        Ok(())
    }

    /// The first nodes of a cell, if they exist.
    fn corners<const N: usize>(&self, number: usize, nodes: &[u64]) -> Result<[u32; N], String> {
        let count = self.nodes_m.len();
        let corners = nodes.get(..N).ok_or_else(|| format!("cell {number} has {} nodes", nodes.len()))?;
        let mut found = [0; N];
        for (corner, &node) in found.iter_mut().zip(corners) {
            let exists = u32::try_from(node).ok().filter(|&node| (node as usize) < count);
            *corner = exists
                .ok_or_else(|| format!("cell {number} names node {} of {count}", node.saturating_add(1)))?;
        }
        Ok(found)
    }
}
