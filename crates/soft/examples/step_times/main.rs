//! How long a period of a clamped beam of tetrahedra takes, how far it sags, and how much memory it needs: JSON for
//! `bench/soft_peers.py`, which runs other simulators on the same beams.
//!
//! Arguments: how many periods, then `CELLS_X,CELLS_Y,CELLS_Z` for every beam.

mod beam;

use std::time::Instant;

use beam::{SIZE_M, beam, body};
use cotouch_soft::{Corotational, SoftBody};
use glam::DVec3;

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
    let processor_time = processor_ms();
    for _ in 0..periods {
        let begin = now();
        body.step(&[]);
        times.push(begin.elapsed().as_secs_f64() * 1e3);
        lowest = lowest.max(sag(&body));
    }
    let processor_time = (processor_ms() - processor_time) / periods as f64;
    let (after, counts) = (sag(&body), body.solver_counts());
    let memory = body.memory_bytes();
    body.settle(&[]).expect("a clamped beam has an equilibrium");
    times.sort_by(f64::total_cmp);
    let count = mesh.tetrahedra.len();
    format!(
        "{{\"cells\": {cells:?}, \"tetrahedra\": {count}, \"nodes\": {}, \"p10_ms\": {:.4}, \"median_ms\": {:.4}, \"p90_ms\": {:.4}, \
         \"max_ms\": {:.4}, \"mean_ms\": {:.4}, \"processor_mean_ms\": {processor_time:.4}, \"lowest_m\": {lowest:.6}, \"sag_m\": {after:.6}, \
         \"static_sag_m\": {:.6}, \"bytes_per_tetrahedron\": {}, \"factorisations\": {}, \"solutions\": {}}}",
        mesh.nodes_m.len(),
        times[times.len() / 10],
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

/// Time that this process has spent on a processor so far, which other programs disturb less; NaN where it is not told.
fn processor_ms() -> f64 {
    let told = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    told.split_whitespace().next().and_then(|ns| ns.parse().ok()).map_or(f64::NAN, |ns: f64| ns * 1e-6)
}
