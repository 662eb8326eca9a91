//! How long a period of a clamped beam of tetrahedra takes, how far it sags, and how much memory it needs: JSON for
//! `bench/soft_peers.py`, which runs other simulators on the same beams.
//!
//! Arguments: how many periods, then `CELLS_X,CELLS_Y,CELLS_Z` for every beam.

use std::time::Instant;

use cotouch_scene::Source;
use cotouch_scene::scene::{FixedRegion, Soft};
use cotouch_scene::soft_mesh::SoftMesh;
use cotouch_soft::{Corotational, SoftBody};
use glam::DVec3;

/// Edges of every beam, m.
const SIZE_M: DVec3 = DVec3::new(0.4, 0.1, 0.1);
const PERIOD_S: f64 = 1.0 / 60.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (periods, beams) = arguments.split_first().expect("how many periods, then cells as 10,4,4");
    let periods = periods.parse().expect("a number of periods");
    let rows: Vec<String> = beams.iter().map(|cells| measure(cells_of(cells), periods)).collect();
    println!("[{}]", rows.join(",\n "));
}

fn cells_of(text: &str) -> [usize; 3] {
    let numbers: Vec<usize> =
        text.split(',').map(|number| number.parse().expect("cells as 10,4,4")).collect();
    numbers.try_into().expect("three numbers of cells")
}

/// Lets a beam go and measures every period.
fn measure(cells: [usize; 3], periods: usize) -> String {
    let mesh = beam(cells);
    let mut body = body(&mesh);
    let tip = mesh.nodes_m.iter().position(|node| node.abs_diff_eq(DVec3::new(SIZE_M.x, 0.0, 0.0), 1e-9));
    let sag = |body: &Corotational| -body.state().positions_m[tip.expect("a corner at the tip")].z;
    let mut times: Vec<f64> = Vec::new();
    let mut lowest: f64 = 0.0;
    for _ in 0..periods {
        let begin = now();
        body.step(&[]);
        times.push(begin.elapsed().as_secs_f64() * 1e3);
        lowest = lowest.max(sag(&body));
    }
    let (after, counts) = (sag(&body), body.solver_counts());
    let memory = body.memory_bytes();
    body.settle(&[]).expect("a clamped beam has an equilibrium");
    times.sort_by(f64::total_cmp);
    let count = mesh.tetrahedra.len();
    format!(
        "{{\"cells\": {cells:?}, \"tetrahedra\": {count}, \"nodes\": {}, \"median_ms\": {:.4}, \"p90_ms\": {:.4}, \
         \"max_ms\": {:.4}, \"mean_ms\": {:.4}, \"lowest_m\": {lowest:.6}, \"sag_m\": {after:.6}, \
         \"static_sag_m\": {:.6}, \"bytes_per_tetrahedron\": {}, \"factorisations\": {}, \"solutions\": {}}}",
        mesh.nodes_m.len(),
        times[times.len() / 2],
        times[times.len() * 9 / 10],
        times[times.len() - 1],
        times.iter().sum::<f64>() / times.len() as f64,
        sag(&body),
        memory / count,
        counts.0,
        counts.1,
    )
}

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn now() -> Instant {
    Instant::now()
}

fn body(mesh: &SoftMesh) -> Corotational {
    let mut soft = any_soft_object();
    soft.young_pa = 2e5;
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
    Source::named("single-axis").load(&[]).expect("a built-in scene").soft
}

/// Cells, each cut into the six tetrahedra around its (0,0,0)–(1,1,1) diagonal.
fn beam([nx, ny, nz]: [usize; 3]) -> SoftMesh {
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
