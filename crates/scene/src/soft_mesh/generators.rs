//! Soft objects that need no file.

use glam::DVec3;

use super::body::SoftMesh;

/// Side of the triangle of [`spring`], m.
const SPRING_SIDE_M: f64 = 0.02;

/// Nodes, m, and tetrahedra of a block with edges `size_m` and one corner at `origin_m`: `cells` cubes along x, y and z, each
/// cut into the six tetrahedra around its (0,0,0)–(1,1,1) diagonal (Kuhn). Node (i, j, k) has the number
/// `i + (cells_x + 1)·(j + (cells_y + 1)·k)`.
#[must_use]
pub(crate) fn block(size_m: DVec3, cells: [u32; 3], origin_m: DVec3) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let [nx, ny, nz] = cells;
    let number = |[i, j, k]: [u32; 3]| i + (nx + 1) * (j + (ny + 1) * k);
    let mut nodes = Vec::new();
    for at in grid([nx + 1, ny + 1, nz + 1]) {
        let part = DVec3::from(at.map(f64::from)) / DVec3::from(cells.map(f64::from));
        nodes.push(origin_m + size_m * part);
    }
    let tetrahedra = grid(cells).flat_map(|corner| kuhn(corner).map(|four| four.map(number))).collect();
    (nodes, tetrahedra)
}

/// All (i, j, k) below `counts`, i running fastest.
fn grid([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

/// The six tetrahedra of the cube at `corner`: from there along one axis, along a second and along the third.
fn kuhn(corner: [u32; 3]) -> [[[u32; 3]; 4]; 6] {
    let along = |mut at: [u32; 3], axis: usize| {
        at[axis] += 1;
        at
    };
    [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]].map(|[first, second, third]| {
        let a = along(corner, first);
        let b = along(a, second);
        let c = along(b, third);
        // x, y, z in turn make a positive volume; in the other three orders two nodes are swapped.
        if (first + 1) % 3 == second { [corner, a, b, c] } else { [corner, b, a, c] }
    })
}

/// The paper's object: an equilateral triangle of 20 mm sides across the x axis, its centroid at `origin_m`, its outer side
/// towards −x, every node tied to where it rests with a third of `stiffness_n_per_m`.
#[must_use]
pub(crate) fn spring(stiffness_n_per_m: f64, origin_m: DVec3) -> SoftMesh {
    let (half, from_centre) = (SPRING_SIDE_M / 2.0, SPRING_SIDE_M / 12f64.sqrt());
    let nodes_m = vec![
        origin_m + DVec3::new(0.0, 2.0 * from_centre, 0.0),
        origin_m + DVec3::new(0.0, -from_centre, half),
        origin_m + DVec3::new(0.0, -from_centre, -half),
    ];
    // Seen from −x the triangle must be counter-clockwise: (b − a) × (c − a) along −x.
    SoftMesh { nodes_m, tetrahedra: Vec::new(), triangles: vec![[0, 2, 1]], tied_n_per_m: stiffness_n_per_m }
}
