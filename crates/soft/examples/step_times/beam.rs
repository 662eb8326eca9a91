//! The beams that are measured.

use cotouch_scene::Source;
use cotouch_scene::scene::{FixedRegion, Soft};
use cotouch_scene::soft_mesh::SoftMesh;
use cotouch_soft::Corotational;
use glam::DVec3;

/// Edges of every beam, m.
pub(crate) const SIZE_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);

/// Of the simulation, s.
const PERIOD_S: f64 = 1.0 / 60.0;

/// The beam, clamped at x = 0, under its own weight.
pub(crate) fn body(mesh: &SoftMesh) -> Corotational {
    let mut soft = any_soft_object();
    soft.young_pa = 1e6;
    soft.poisson_ratio = 0.3;
    soft.density_kg_per_m3 = 1000.0;
    soft.mass_damping_per_s = 1.0;
    soft.stiffness_damping_s = 0.005;
    soft.newton_steps = 1;
    soft.fixed = vec![FixedRegion { from_m: DVec3::ZERO, to_m: DVec3::new(0.0, SIZE_M.y, SIZE_M.z) }];
    Corotational::new(mesh, &soft, DVec3::new(0.0, 0.0, -9.81), PERIOD_S).expect("a good mesh")
}

/// A description to change: that of a built-in scene, whatever it says.
fn any_soft_object() -> Soft {
    Source::named("single-axis").load(&[]).expect("a built-in scene").soft.clone()
}

/// Cells, each cut into the six tetrahedra around its (0,0,0)–(1,1,1) diagonal.
pub(crate) fn beam([nx, ny, nz]: [usize; 3]) -> SoftMesh {
    let index = |x: usize, y: usize, z: usize| ((x * (ny + 1) + y) * (nz + 1) + z) as u32;
    let grid = |x: usize, y: usize, z: usize| {
        DVec3::new(x as f64, y as f64, z as f64) * SIZE_M / DVec3::new(nx as f64, ny as f64, nz as f64)
    };
    let all = |nx: usize, ny: usize, nz: usize| {
        (0..nx).flat_map(move |x| (0..ny).flat_map(move |y| (0..nz).map(move |z| [x, y, z])))
    };
    let nodes_m = all(nx + 1, ny + 1, nz + 1).map(|[x, y, z]| grid(x, y, z)).collect();
    let mut tetrahedra = Vec::new();
    for [x, y, z] in all(nx, ny, nz) {
        for (first, second, even) in
            [(0, 1, true), (1, 2, true), (2, 0, true), (1, 0, false), (2, 1, false), (0, 2, false)]
        {
            let mut corner = [x, y, z];
            let mut path = vec![index(x, y, z)];
            for axis in [first, second, 3 - first - second] {
                corner[axis] += 1;
                path.push(index(corner[0], corner[1], corner[2]));
            }
            let [a, b, c, d] = [path[0], path[1], path[2], path[3]];
            tetrahedra.push(if even { [a, b, c, d] } else { [a, c, b, d] });
        }
    }
    SoftMesh { nodes_m, tetrahedra, triangles: Vec::new(), tied_n_per_m: 0.0 }
}
