//! No bytes make the readers of tetrahedra panic, and what is called a soft mesh has a volume.
#![no_main]

use cotouch_scene::soft_mesh::SoftMesh;
use cotouch_scene::soft_mesh::files::{Cells, Format};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for format in [Format::Msh, Format::Vtk, Format::Vtu] {
        let Ok(cells) = Cells::parse(format, bytes) else { continue };
        if let Ok(mesh) = SoftMesh::of_tetrahedra(cells.nodes_m, cells.tetrahedra) {
            assert!(mesh.volume_m3() > 0.0 && !mesh.triangles.is_empty());
        }
    }
});
