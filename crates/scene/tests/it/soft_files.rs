//! Soft meshes from files, as several programs write them, and what is told of bad ones.

use std::fs;
use std::path::{Path, PathBuf};

use cotouch_scene::mesh::generators::{cuboid, icosphere, torus};
use cotouch_scene::scene::Scene;
use cotouch_scene::soft_mesh::{Cells, SoftMesh, SoftMeshError, TetrahedraFormat, solids};
use cotouch_scene::{load, scene_hash, to_toml, with_override};
use glam::DVec3;
use proptest::prelude::*;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/soft_meshes")
}

fn examples() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let mut all: Vec<PathBuf> = entries.filter(|path| TetrahedraFormat::from_path(path).is_some()).collect();
    all.sort();
    all
}

/// A scene with that mesh file, read from a folder of its own.
fn scene(mesh: &str, model: &str, more: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lab.toml");
    let text = format!(
        "space = \"space\"\n[soft]\nmodel = \"{model}\"\nmesh = {mesh}\n{more}\n[[soft.fixed]]\nfrom_m = [-9, -9, -9]\nto_m = [9, 9, 0]\n"
    );
    fs::write(&path, text).unwrap();
    load(path.to_str().unwrap(), &[]).map_err(|errors| errors.to_string())
}

#[test]
fn all_programs_write_the_same_box() {
    assert!(examples().len() >= 21);
    for path in examples() {
        let name = path.file_name().unwrap().to_str().unwrap();
        let cells = Cells::read(&path, 0.1, DVec3::Z).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((cells.tetrahedra.len(), cells.triangles.len()), (24, 24), "{name}");
        let mesh = SoftMesh::from_tetrahedra(cells.nodes_m, cells.tetrahedra).unwrap();
        assert_eq!((mesh.nodes_m.len(), mesh.triangles.len()), (14, 24), "{name}");
        assert!((mesh.volume_m3() / 2e-3 - 1.0).abs() < 1e-6, "{name}: {}", mesh.volume_m3());
        let low = mesh.nodes_m.iter().copied().reduce(DVec3::min).unwrap();
        assert!(low.distance(DVec3::Z) < 1e-6, "{name}: {low}");
    }
}

#[test]
fn a_scene_names_a_file() {
    let path = folder().join("gmsh-4.1-text.msh");
    let path = path.to_str().unwrap();
    let short = scene(&format!("\"{path}\""), "corotational", "").unwrap();
    assert_eq!((short.soft.mesh.file.as_str(), short.soft.mesh().tetrahedra.len()), (path, 24));
    let again = cotouch_scene::parse(&to_toml(&short), "lab.toml", None, &[]).unwrap();
    assert_eq!((&again, scene_hash(&again)), (&short, scene_hash(&short)));
    let half = with_override(&short, "soft.mesh.scale", 0.5).unwrap();
    assert_eq!(half.soft.mesh().volume_m3(), short.soft.mesh().volume_m3() / 8.0);
    assert_ne!(scene_hash(&half), scene_hash(&short));
    // Of a balloon the surface counts.
    let skin = scene(&format!("\"{path}\""), "balloon", "").unwrap();
    let mesh = skin.soft.mesh();
    assert_eq!((mesh.tetrahedra.len(), mesh.triangles.len(), mesh.nodes_m.len()), (0, 24, 14));
    let missing = scene("\"liver.msh\"", "corotational", "").unwrap_err();
    assert!(missing.contains("it cannot be read"), "{missing}");
    let ending = scene("\"liver.stp\"", "corotational", "").unwrap_err();
    assert!(ending.contains("its name does not end in .msh"), "{ending}");
}

#[test]
fn closed_surfaces_are_filled() {
    for (name, surface, edge_m, euler) in [
        ("box", cuboid(DVec3::new(0.3, 0.2, 0.1)), 0.02, 2),
        ("ball", icosphere(0.1, 4), 0.02, 2),
        ("ring", torus(0.1, 0.04, 48, 24), 0.015, 0),
    ] {
        let mesh = solids::filled(&surface, edge_m).unwrap_or_else(|error| panic!("{name}: {error}"));
        let part = mesh.volume_m3() / SoftMesh::from_skin(&surface).unwrap().volume_m3();
        assert!((0.9..1.0001).contains(&part), "{name}: {part}");
        let mut nodes: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        assert_eq!(nodes.len() as i64 - mesh.triangles.len() as i64 / 2, euler, "{name}");
    }
    let thin = solids::filled(&cuboid(DVec3::new(0.3, 0.2, 0.01)), 0.05);
    assert!(matches!(thin, Err(SoftMeshError::NotFilled { .. })), "{thin:?}");
    let fine = solids::filled(&cuboid(DVec3::ONE), 0.005);
    assert!(matches!(fine, Err(SoftMeshError::TooLarge { .. })), "{fine:?}");
    let mut open = cuboid(DVec3::ONE);
    open.triangles.pop();
    assert!(matches!(solids::filled(&open, 0.2), Err(SoftMeshError::Surface(_))));
}

/// Node 1 to 4 are those of a tetrahedron.
fn nodes() -> Vec<DVec3> {
    vec![
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        DVec3::ONE,
        DVec3::new(0.2, 0.2, 0.0),
        DVec3::NEG_ONE,
        DVec3::NEG_Y,
        DVec3::NEG_Z,
    ]
}

/// What is told of tetrahedra between the nodes above.
fn told(tetrahedra: &[[u32; 4]]) -> String {
    match SoftMesh::from_tetrahedra(nodes(), tetrahedra.to_vec()) {
        Ok(_) => "fine".to_owned(),
        Err(error) => format!("{error}; it must be {}", error.allowed()),
    }
}

#[test]
fn a_bad_mesh_names_its_element() {
    let whole = [0, 1, 2, 3];
    let messages = [
        told(&[whole]),
        told(&[[0, 2, 1, 3]]),
        told(&[whole, [1, 2, 3, 4], [1, 3, 4, 2]]),
        told(&[whole, [1, 2, 4, 3]]),
        told(&[whole, [0, 1, 2, 5]]),
        told(&[whole, [1, 1, 2, 3]]),
        told(&[whole, [1, 2, 3, 9]]),
        told(&[]),
        told(&[whole, [1, 2, 3, 4], [2, 1, 3, 6]]),
        told(&[whole, [0, 1, 7, 8]]),
        told(&vec![whole; 200_001]),
    ];
    let mut nowhere = nodes();
    nowhere[6].y = f64::NAN;
    let not_a_number = SoftMesh::from_tetrahedra(nowhere, vec![whole]).unwrap_err();
    let large = nodes().iter().map(|&node| node * 20.0).collect();
    let too_large = SoftMesh::from_tetrahedra(large, vec![whole]).unwrap_err();
    insta::assert_snapshot!(format!("{}\n{not_a_number}\n{too_large}", messages.join("\n")));
}

#[test]
fn a_bad_file_says_what_is_wrong() {
    let told = |format, text: &str| match Cells::parse(format, text.as_bytes()) {
        Ok(cells) => format!("{} tetrahedra", cells.tetrahedra.len()),
        Err(error) => error.to_string(),
    };
    let msh =
        |rest: &str| told(TetrahedraFormat::Msh, &format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{rest}"));
    let vtk =
        |rest: &str| told(TetrahedraFormat::Vtk, &format!("# vtk DataFile Version 3.0\n\nASCII\n{rest}"));
    let points = "DATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n";
    let vtu = |inside: &str| {
        told(
            TetrahedraFormat::Vtu,
            &format!(
                "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{inside}</UnstructuredGrid></VTKFile>"
            ),
        )
    };
    let array = |name: &str, kind: &str, text: &str| {
        format!("<DataArray Name=\"{name}\" type=\"{kind}\" format=\"ascii\">{text}</DataArray>")
    };
    let piece = |types: &str, connectivity: &str| {
        let cells = [
            array("types", "UInt8", types),
            array("offsets", "Int32", "4"),
            array("connectivity", "Int32", connectivity),
        ];
        let points = array("", "Float32", "0 0 0 1 0 0 0 1 0 0 0 1");
        format!("<Piece><Points>{points}</Points><Cells>{}</Cells></Piece>", cells.concat())
    };
    let messages = [
        told(TetrahedraFormat::Msh, "solid"),
        told(TetrahedraFormat::Msh, "$MeshFormat\n4 0 8\n$EndMeshFormat"),
        told(TetrahedraFormat::Msh, "$MeshFormat\n4.1 0 4\n$EndMeshFormat"),
        told(TetrahedraFormat::Msh, "$MeshFormat\n2.2 0 8\n"),
        msh("$Nodes\n99999999\n"),
        msh("$Nodes\n2\n1 0 0 0\n"),
        msh("$Nodes\n2\n1 0 0 0\n1 0 0 0\n$EndNodes\n"),
        msh("$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 4 0 1 1 1 2\n$EndElements\n"),
        msh("$Nodes\n1\n1 0 0 0\n$EndNodes\n$Elements\n1\n1 5 0 1 1 1 1 1 1 1 1\n$EndElements\n"),
        msh("$Nodes\n1\n1 0 zero 0\n$EndNodes\n"),
        msh("$Elements\n1\n1 99 0 1\n$EndElements\n"),
        msh("nodes"),
        told(TetrahedraFormat::Vtk, "# vtk DataFile\n\nASCII\n"),
        told(TetrahedraFormat::Vtk, "# vtk DataFile Version 3.0\n\nTEXT\n"),
        vtk("DATASET STRUCTURED_POINTS\n"),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n")),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n")),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 -3\nCELL_TYPES 1\n10\n")),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n")),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n1000\n")),
        vtk(&format!("{points}CELLS 1 5\n4 0 1 2 3\n")),
        vtk("POINTS 1 quaternion\n"),
        vtu(&piece("10", "0 1 2 3")),
        vtu(&piece("10", "0 1 2 4")),
        vtu(&piece("10", "0 1 2")),
        vtu(&piece("10", "0 1 2 x")),
        vtu(&piece("12", "0 1 2 3")),
        vtu(&piece("10 10", "0 1 2 3")),
        told(TetrahedraFormat::Vtu, "<VTKFile type=\"PolyData\"/>"),
        told(TetrahedraFormat::Vtu, "<VTKFile type=\"UnstructuredGrid\">"),
        told(
            TetrahedraFormat::Vtu,
            "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\"/>",
        ),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

/// Neither deep nor long nonsense takes a stack or memory of its size.
#[test]
fn nonsense_is_refused_soon() {
    let deep = "<VTKFile type=\"UnstructuredGrid\">".repeat(50_000);
    assert!(Cells::parse(TetrahedraFormat::Vtu, deep.as_bytes()).is_err());
    let many = format!("# vtk DataFile Version 5.1\n\nBINARY\nPOINTS {} double\n", u64::MAX);
    assert!(Cells::parse(TetrahedraFormat::Vtk, many.as_bytes()).is_err());
    let many = format!("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n{0} {0} {0} {0}\n", u64::MAX);
    assert!(Cells::parse(TetrahedraFormat::Msh, many.as_bytes()).is_err());
}

proptest! {
    /// No damage makes a reader panic; what is still read is only what exists.
    #[test]
    fn damaged_files_are_read_or_refused(
        file in 0..100usize,
        cut in 0.0..1.0f64,
        damage in prop::collection::vec((0.0..1.0f64, any::<u8>()), 0..8),
    ) {
        let all = examples();
        let path = &all[file % all.len()];
        let mut bytes = fs::read(path).unwrap();
        for (at, byte) in damage {
            let at = (at * bytes.len() as f64) as usize;
            bytes[at] = byte;
        }
        if cut > 0.3 {
            bytes.truncate((cut * bytes.len() as f64) as usize);
        }
        if let Ok(cells) = Cells::parse(TetrahedraFormat::from_path(path).unwrap(), &bytes) {
            let nodes = cells.nodes_m.len();
            let named = cells.tetrahedra.iter().flatten().chain(cells.triangles.iter().flatten());
            prop_assert!(named.into_iter().all(|&node| (node as usize) < nodes));
            // Whatever it is, it is a mesh or an error.
            if let Ok(mesh) = SoftMesh::from_tetrahedra(cells.nodes_m, cells.tetrahedra) {
                prop_assert!(mesh.volume_m3() > 0.0 && mesh.nodes_m.iter().all(|node| node.is_finite()));
            }
        }
    }
}

#[test]
fn tetrahedra_in_the_same_place_are_named() {
    let nodes = |fifth| vec![DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1, DVec3::Z * 0.1, fifth];
    let two = vec![[0, 1, 2, 3], [0, 1, 2, 4]];
    let overlap = SoftMesh::from_tetrahedra(nodes(DVec3::new(0.02, 0.02, 0.15)), two.clone());
    assert_eq!(overlap, Err(SoftMeshError::Overlap { tetrahedron: 1, other: 2 }));
    let twice = SoftMesh::from_tetrahedra(nodes(DVec3::ZERO), vec![[0, 1, 2, 3], [0, 1, 2, 3]]);
    assert_eq!(twice, Err(SoftMeshError::Overlap { tetrahedron: 1, other: 2 }));
    // On the other side it is fine, its nodes the other way round.
    let mesh =
        SoftMesh::from_tetrahedra(nodes(DVec3::new(0.02, 0.02, -0.1)), vec![[0, 1, 2, 3], [0, 2, 1, 4]]);
    assert_eq!(mesh.unwrap().triangles.len(), 6);
}
