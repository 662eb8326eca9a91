//! Cells as they are in a file, within a budget.

use glam::DVec3;

use crate::mesh::Triangles;

/// Most points or cells that are read.
pub(super) const MAX_ITEMS: u64 = 4_000_000;

/// What is in a file, in metres: tetrahedra, and triangles on and between them. Cells of other kinds are an error where they
/// have a volume, else left out; of curved ones the corners count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// Where the nodes are, m.
    pub nodes_m: Vec<DVec3>,
    /// Four places in `nodes_m` each.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Three places in `nodes_m` each.
    pub triangles: Vec<[u32; 3]>,
}

impl Cells {
    /// The triangles alone, as a surface.
    pub(crate) fn into_surface(self) -> Triangles {
        Triangles { vertices: self.nodes_m, triangles: self.triangles }
    }

    /// Adds cell `number` (from 1) of the VTK kind `kind` between `nodes`.
    pub(super) fn add_vtk(&mut self, number: usize, kind: u64, nodes: &[u64]) -> Result<(), String> {
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

    pub(super) fn add_tetrahedron(&mut self, number: usize, nodes: &[u64]) -> Result<(), String> {
        self.tetrahedra.push(self.corners(number, nodes)?);
        Ok(())
    }

    pub(super) fn add_triangle(&mut self, number: usize, nodes: &[u64]) -> Result<(), String> {
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
