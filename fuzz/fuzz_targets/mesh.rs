//! No bytes make the mesh readers panic, and what is called a closed mesh has a volume and an inertia.
#![no_main]

use cotouch_scene::mesh::{MeshFormat, TriangleMesh, Triangles};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for format in [MeshFormat::Stl, MeshFormat::Obj, MeshFormat::Gltf] {
        let Ok(triangles) = Triangles::parse(format, bytes, 1.0, None) else { continue };
        for mesh in [TriangleMesh::closed(&triangles), TriangleMesh::hull(&triangles)].into_iter().flatten() {
            assert!(mesh.volume_m3 > 0.0 && mesh.inertia_per_mass_m2.is_finite());
        }
    }
});
