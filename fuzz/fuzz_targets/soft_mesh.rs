//! No bytes make the readers of tetrahedra panic, and what is called a soft mesh has a volume.
#![no_main]

use cotouch_scene::soft_mesh::{Cells, SoftMesh, TetrahedraFormat};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for format in [TetrahedraFormat::Msh, TetrahedraFormat::Vtk, TetrahedraFormat::Vtu] {
        let Ok(cells) = Cells::parse(format, bytes) else { continue };
        if let Ok(mesh) = SoftMesh::from_tetrahedra(cells.nodes_m, cells.tetrahedra) {
            assert!(mesh.volume_m3() > 0.0 && !mesh.triangles.is_empty());
        }
    }
});
