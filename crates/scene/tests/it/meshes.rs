//! Mesh files, good and bad, and the mass of what is in them.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use cotouch_scene::mesh::MeshFormat;
use cotouch_scene::mesh::{MeshError, TriangleMesh, Triangles, generators};
use cotouch_scene::scene::{Shape, ShapeKind};
use cotouch_scene::{Override, Scene, load, parse, scene_hash, to_toml, with_override};
use glam::{DMat3, DVec3};
use proptest::prelude::*;

fn assert_near(actual: DMat3, expected: DMat3, tolerance: f64) {
    let (a, e) = (actual.to_cols_array(), expected.to_cols_array());
    let near = a.iter().zip(&e).all(|(a, e)| (a - e).abs() <= tolerance * expected.x_axis.length());
    assert!(near, "{actual} is not {expected}");
}

fn shape(kind: ShapeKind, size_m: DVec3, radius_m: f64, length_m: f64) -> Shape {
    let mesh = String::new();
    Shape { kind, size_m, radius_m, length_m, mesh, mesh_scale: 1.0, surface: None }
}

fn moved(triangles: &Triangles, by: DVec3) -> Triangles {
    let vertices = triangles.vertices.iter().map(|&vertex| vertex + by).collect();
    Triangles { vertices, triangles: triangles.triangles.clone() }
}

/// A capsule's surface: a ball's, whose upper half is moved up. The ball must have edges along its equator.
fn capsule(radius_m: f64, length_m: f64) -> Triangles {
    let (around, rings) = (200u32, 50u32);
    let mut vertices = vec![DVec3::Y * -(radius_m + length_m / 2.0)];
    for ring in 1..2 * rings + 1 {
        // The equator comes twice, once for each end.
        let (step, half) = if ring <= rings { (ring, -0.5) } else { (ring - 1, 0.5) };
        let angle = PI * f64::from(step) / f64::from(2 * rings);
        for spoke in 0..around {
            let about = 2.0 * PI * f64::from(spoke) / f64::from(around);
            let flat = DVec3::new(about.cos(), 0.0, -about.sin()) * angle.sin();
            vertices.push((flat - DVec3::Y * angle.cos()) * radius_m + DVec3::Y * length_m * half);
        }
    }
    vertices.push(DVec3::Y * (radius_m + length_m / 2.0));
    let (last, at) = (vertices.len() as u32 - 1, |ring: u32, spoke: u32| 1 + ring * around + spoke % around);
    let mut triangles = Vec::new();
    for spoke in 0..around {
        triangles.push([0, at(0, spoke + 1), at(0, spoke)]);
        triangles.push([last, at(2 * rings - 1, spoke), at(2 * rings - 1, spoke + 1)]);
        for ring in 0..2 * rings - 1 {
            let [a, b] = [at(ring, spoke), at(ring, spoke + 1)];
            let [c, d] = [at(ring + 1, spoke + 1), at(ring + 1, spoke)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Triangles { vertices, triangles }
}

#[test]
fn shapes_in_closed_form_weigh_what_their_meshes_do() {
    let size_m = DVec3::new(0.12, 0.08, 0.05);
    let solid = TriangleMesh::closed(&generators::cuboid(size_m)).unwrap();
    let weighed = shape(ShapeKind::Box, size_m, 0.0, 0.0).mass_properties(0.4);
    assert_eq!(weighed.mass_kg, 0.4);
    assert_near(solid.inertia_per_mass_m2 * 0.4, weighed.inertia_kg_m2, 1e-12);
    assert!((solid.volume_m3 - size_m.element_product()).abs() < 1e-15);

    let ball = TriangleMesh::closed(&generators::icosphere(0.05, 6)).unwrap();
    assert_near(
        ball.inertia_per_mass_m2,
        shape(ShapeKind::Ball, DVec3::ZERO, 0.05, 0.0).mass_properties(1.0).inertia_kg_m2,
        1e-3,
    );
    assert!((ball.volume_m3 / (4.0 / 3.0 * PI * 0.05f64.powi(3)) - 1.0).abs() < 1e-3);

    let pill = TriangleMesh::closed(&capsule(0.02, 0.1)).unwrap();
    assert_near(
        pill.inertia_per_mass_m2,
        shape(ShapeKind::Capsule, DVec3::ZERO, 0.02, 0.1).mass_properties(1.0).inertia_kg_m2,
        2e-3,
    );

    let point = shape(ShapeKind::Point, size_m, 1.0, 1.0).mass_properties(2.0);
    assert_eq!((point.mass_kg, point.inertia_kg_m2), (2.0, DMat3::ZERO));
}

#[test]
fn a_mesh_is_centred_wherever_it_was() {
    let size_m = DVec3::new(0.3, 0.2, 0.1);
    let far = moved(&generators::cuboid(size_m), DVec3::new(5.0, -4.0, 3.0));
    let solid = TriangleMesh::closed(&far).unwrap();
    assert_near(
        solid.inertia_per_mass_m2,
        shape(ShapeKind::Box, size_m, 0.0, 0.0).mass_properties(1.0).inertia_kg_m2,
        1e-12,
    );
    let middle: DVec3 = solid.vertices.iter().sum();
    assert!(middle.length() < 1e-13, "{middle}");
    let double = solid.scaled(2.0);
    let again = TriangleMesh::closed(&generators::cuboid(size_m * 2.0)).unwrap();
    assert!((double.volume_m3 / again.volume_m3 - 1.0).abs() < 1e-12);
    assert_near(double.inertia_per_mass_m2, again.inertia_per_mass_m2, 1e-12);
}

/// A torus is not convex: volume 2·π²·R·r², about its axis R² + 3/4·r².
#[test]
fn a_ring_and_its_hull_differ() {
    let (ring, tube) = (0.1, 0.03);
    let triangles = generators::torus(ring, tube, 160, 80);
    let solid = TriangleMesh::closed(&triangles).unwrap();
    assert!((solid.volume_m3 / (2.0 * PI * PI * ring * tube * tube) - 1.0).abs() < 5e-3);
    assert!((solid.inertia_per_mass_m2.z_axis.z / (ring * ring + 0.75 * tube * tube) - 1.0).abs() < 5e-3);
    let hull = TriangleMesh::hull(&triangles).unwrap();
    // A disc with a rounded rim: 2·r·π·R² and half a tube around it.
    let filled = 2.0 * tube * PI * ring * ring + PI * PI * ring * tube * tube + 4.0 / 3.0 * PI * tube.powi(3);
    assert!((hull.volume_m3 / filled - 1.0).abs() < 5e-3, "{} is not {filled}", hull.volume_m3);
}

#[test]
fn a_hull_needs_no_closed_mesh() {
    let size_m = DVec3::new(0.3, 0.2, 0.1);
    let mut open = generators::cuboid(size_m);
    open.triangles.remove(0);
    assert!(matches!(TriangleMesh::closed(&open), Err(MeshError::Open { .. })));
    let hull = TriangleMesh::hull(&open).unwrap();
    assert!((hull.volume_m3 - size_m.element_product()).abs() < 1e-15);
    assert_near(
        hull.inertia_per_mass_m2,
        shape(ShapeKind::Box, size_m, 0.0, 0.0).mass_properties(1.0).inertia_kg_m2,
        1e-12,
    );
    assert_eq!(hull.vertices.len(), 8);
    let flat = Triangles { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
    assert_eq!(TriangleMesh::hull(&flat), Err(MeshError::Flat));
}

#[test]
fn what_is_no_mesh() {
    let ball = || generators::icosphere(0.1, 1);
    let told = |change: fn(&mut Triangles)| {
        let mut triangles = ball();
        change(&mut triangles);
        let error = TriangleMesh::closed(&triangles).unwrap_err();
        format!("{error}; it must be {}", error.allowed())
    };
    let all = [
        told(|ball| ball.triangles.clear()),
        told(|ball| ball.vertices[3].y = f64::NAN),
        told(|ball| ball.triangles[4][1] = 99),
        told(|ball| ball.triangles.truncate(79)),
        told(|ball| ball.triangles[7].swap(0, 1)),
        told(|ball| ball.triangles.push(ball.triangles[0])),
        told(|ball| ball.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1))),
        told(|ball| ball.vertices.iter_mut().for_each(|vertex| *vertex *= 1000.0)),
        told(|ball| ball.vertices.iter_mut().for_each(|vertex| vertex.z = 0.0)),
        told(|ball| ball.triangles = vec![[0, 1, 2]; 1_000_001]),
        told(|ball| ball.triangles = vec![[0, 1, 2], [0, 2, 1]]),
        told(|ball| ball.triangles = vec![[0, 1, 1], [5, 5, 5]]),
    ];
    insta::assert_snapshot!(all.join("\n"));
}

#[test]
fn vertices_at_one_place_are_one_and_slivers_are_dropped() {
    let ball = generators::icosphere(0.1, 2);
    let mut loose = Triangles::default();
    for triangle in &ball.triangles {
        let first = loose.vertices.len() as u32;
        loose.vertices.extend(triangle.map(|vertex| ball.vertices[vertex as usize]));
        loose.triangles.push([first, first + 1, first + 2]);
    }
    loose.triangles.insert(1, [0, 0, 1]);
    let (whole, welded) = (TriangleMesh::closed(&ball).unwrap(), TriangleMesh::closed(&loose).unwrap());
    assert_eq!(
        (welded.vertices.len(), welded.triangles.len()),
        (whole.vertices.len(), whole.triangles.len())
    );
    assert!((welded.volume_m3 / whole.volume_m3 - 1.0).abs() < 1e-12);
    assert!(whole.corners(0).iter().all(|corner| (corner.length() - 0.1).abs() < 1e-3));
}

// --- files ---

fn binary_stl(triangles: &Triangles, header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend((triangles.triangles.len() as u32).to_le_bytes());
    for triangle in &triangles.triangles {
        bytes.extend([0; 12]);
        for vertex in triangle.map(|vertex| triangles.vertices[vertex as usize]) {
            bytes.extend(vertex.as_vec3().to_array().iter().flat_map(|number| number.to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn text_stl(triangles: &Triangles) -> Vec<u8> {
    let mut text = "solid body\n".to_owned();
    for triangle in &triangles.triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for v in triangle.map(|vertex| triangles.vertices[vertex as usize].as_vec3()) {
            text += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid body\n").into_bytes()
}

fn obj(triangles: &Triangles) -> Vec<u8> {
    let vertices = triangles.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = triangles.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    format!("mtllib no.mtl\n{}{}", vertices.collect::<String>(), faces.collect::<String>()).into_bytes()
}

fn gltf_parts(triangles: &Triangles, uri: &str) -> (String, Vec<u8>) {
    let indices: Vec<u8> =
        triangles.triangles.iter().flatten().flat_map(|index| index.to_le_bytes()).collect();
    let positions = triangles.vertices.iter().flat_map(|vertex| vertex.as_vec3().to_array());
    let positions: Vec<u8> = positions.flat_map(f32::to_le_bytes).collect();
    let (low, high) = (f32::MIN, f32::MAX);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[1,2,3]}},{{"mesh":0,"scale":[-2,2,2]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":1}},"indices":0}}]}}],
        "buffers":[{{{uri}"byteLength":{total}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{split}}},{{"buffer":0,"byteOffset":{split},"byteLength":{rest}}}],
        "accessors":[{{"bufferView":0,"componentType":5125,"count":{corners},"type":"SCALAR"}},
        {{"bufferView":1,"componentType":5126,"count":{vertices},"type":"VEC3","min":[{low},{low},{low}],"max":[{high},{high},{high}]}}]}}"#,
        total = indices.len() + positions.len(),
        split = indices.len(),
        rest = positions.len(),
        corners = triangles.triangles.len() * 3,
        vertices = triangles.vertices.len(),
    );
    (json, [indices, positions].concat())
}

fn gltf(triangles: &Triangles) -> Vec<u8> {
    let (_, data) = gltf_parts(triangles, "");
    let uri = format!("\"uri\":\"data:application/octet-stream;base64,{}\",", STANDARD.encode(data));
    gltf_parts(triangles, &uri).0.into_bytes()
}

fn glb(triangles: &Triangles) -> Vec<u8> {
    let (mut json, mut data) = gltf_parts(triangles, "");
    json += &" ".repeat(json.len().next_multiple_of(4) - json.len());
    data.resize(data.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json.into_bytes()), (b"BIN\0", data)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// Each format's bytes for the same ball of radius 0.1 about (1, 2, 3), and how large they make it.
fn files() -> Vec<(MeshFormat, &'static str, Vec<u8>, f64)> {
    let ball = generators::icosphere(0.1, 1);
    vec![
        (MeshFormat::Stl, "a.stl", binary_stl(&ball, b"binary"), 1.0),
        (MeshFormat::Stl, "b.STL", binary_stl(&ball, b"solid but binary"), 1.0),
        (MeshFormat::Stl, "c.stl", text_stl(&ball), 1.0),
        (MeshFormat::Obj, "d.obj", obj(&ball), 1.0),
        (MeshFormat::Gltf, "e.gltf", gltf(&ball), 2.0),
        (MeshFormat::Gltf, "f.glb", glb(&ball), 2.0),
    ]
}

#[test]
fn every_format_gives_the_same_ball() {
    let ball = TriangleMesh::closed(&generators::icosphere(0.1, 1)).unwrap();
    for (format, name, bytes, size) in files() {
        let triangles =
            Triangles::parse(format, &bytes, 0.5 / size, None).unwrap_or_else(|e| panic!("{name}: {e}"));
        let read = TriangleMesh::closed(&triangles).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((read.vertices.len(), read.triangles.len()), (42, 80), "{name}");
        assert!((read.volume_m3 / ball.volume_m3 * 8.0 - 1.0).abs() < 1e-5, "{name}: {}", read.volume_m3);
        if format == MeshFormat::Gltf {
            let middle = triangles.vertices.iter().sum::<DVec3>() / triangles.vertices.len() as f64;
            assert!(middle.distance(DVec3::new(0.25, 0.5, 0.75)) < 1e-6, "{name}: {middle}");
        }
    }
}

/// What the library's own checks stumble over.
#[test]
fn a_gltf_file_that_names_what_is_not_there_is_refused() {
    let text = String::from_utf8(gltf(&generators::icosphere(0.1, 0))).unwrap();
    for (from, to) in [
        ("\"POSITION\":1", "\"POSITION\":9"),
        ("\"indices\":0", "\"indices\":9"),
        ("\"mesh\":0", "\"mesh\":9"),
        ("\"children\":[1]", "\"children\":[0]"),
        ("\"bufferView\":1", "\"bufferView\":9"),
        ("\"byteOffset\":240", "\"byteOffset\":9999"),
        ("\"count\":12", "\"count\":13"),
        ("\"count\":12", "\"count\":0"),
        ("\"VEC3\"", "\"VEC2\""),
    ] {
        assert!(text.contains(from), "{from}");
        let read = Triangles::parse(MeshFormat::Gltf, text.replace(from, to).as_bytes(), 1.0, None);
        assert!(matches!(read, Err(MeshError::Format { .. })), "{to}: {read:?}");
    }
    let cut_short = b"glTF\x02\0\0\0\x04\0\0\0";
    assert!(Triangles::parse(MeshFormat::Gltf, cut_short, 1.0, None).is_err());
}

#[test]
fn polygons_of_an_obj_are_cut() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf -7 -6 -2 -3\n";
    let cube = TriangleMesh::closed(&Triangles::parse(MeshFormat::Obj, text.as_bytes(), 0.1, None).unwrap())
        .unwrap();
    assert!((cube.volume_m3 - 1e-3).abs() < 1e-15);
}

#[test]
fn a_buffer_beside_a_gltf_file_is_read_and_no_other() {
    let ball = generators::icosphere(0.1, 1);
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("in")).unwrap();
    let told = |uri: &str| {
        let (json, data) = gltf_parts(&ball, &format!("\"uri\":\"{uri}\","));
        fs::write(folder.path().join("in/the ball.bin"), &data).unwrap();
        fs::write(folder.path().join("out.bin"), &data).unwrap();
        fs::write(folder.path().join("in/ball.gltf"), json).unwrap();
        Triangles::read(&folder.path().join("in/ball.gltf"), 1.0)
    };
    assert_eq!(told("the%20ball.bin").unwrap().triangles.len(), 80);
    assert!(matches!(told("no.bin"), Err(MeshError::Unreadable(_))));
    for uri in ["../out.bin", "/etc/hostname", "https://example.org/ball.bin"] {
        assert!(told(uri).is_err(), "{uri}");
    }
}

// --- scenes ---

const SCENE: &str = "space = \"space\"\n[object]\nshape = \"mesh\"\nmesh = \"ball.obj\"\nmesh_scale = 0.5\n";

fn folder_with_ball() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.obj"), obj(&generators::icosphere(0.1, 1))).unwrap();
    fs::write(folder.path().join("lab.toml"), SCENE).unwrap();
    folder
}

fn read(folder: &Path, overrides: &[&str]) -> Result<Scene, String> {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    let name = folder.join("lab.toml").display().to_string();
    load(&name, &overrides).map_err(|errors| errors.to_string().replace(&folder.display().to_string(), "LAB"))
}

#[test]
fn a_scene_with_a_mesh_is_read_written_and_hashed() {
    let folder = folder_with_ball();
    let scene = read(folder.path(), &[]).unwrap();
    let surface = scene.object.shape.surface.clone().unwrap();
    assert_eq!(surface.triangles.len(), 80);
    assert!((surface.corners(0)[0].length() - 0.05).abs() < 1e-12);
    let weighed = scene.object.shape.mass_properties(3.0).inertia_kg_m2;
    assert_near(weighed, surface.inertia_per_mass_m2 * 3.0, 1e-15);

    let copy = parse(&to_toml(&scene), "lab.toml", None, &[]).unwrap();
    assert_eq!(copy, scene);
    let grown = with_override(&scene, "object.mesh_scale", 1.0).unwrap();
    assert!((grown.object.shape.surface.as_ref().unwrap().volume_m3 / surface.volume_m3 - 8.0).abs() < 1e-12);
    assert_ne!(scene_hash(&grown), scene_hash(&scene));

    // What is in the file counts, not where it is.
    let elsewhere = folder_with_ball();
    assert_eq!(scene_hash(&read(elsewhere.path(), &[]).unwrap()), scene_hash(&scene));
    fs::write(elsewhere.path().join("ball.obj"), obj(&generators::icosphere(0.1, 2))).unwrap();
    assert_ne!(scene_hash(&read(elsewhere.path(), &[]).unwrap()), scene_hash(&scene));

    let from_here = format!("object.mesh={}", folder.path().join("ball.obj").display());
    assert_eq!(read(elsewhere.path(), &[&from_here]).unwrap(), scene);
    let hull = read(folder.path(), &["object.shape=hull"]).unwrap().object.shape.surface.clone().unwrap();
    assert!((hull.volume_m3 / surface.volume_m3 - 1.0).abs() < 1e-12);
}

#[test]
fn a_wrong_mesh_is_told_with_its_key() {
    let folder = folder_with_ball();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n");
    write("bad.stl", "solid\nfacet\n");
    write("bad.gltf", "{}");
    let told = |set: &[&str]| read(folder.path(), set).unwrap_err();
    let in_lab = |name: &str| format!("object.mesh={}", folder.path().join(name).display());
    let all = [
        told(&[&in_lab("open.obj")]),
        told(&[&in_lab("bad.stl")]),
        told(&[&in_lab("bad.gltf")]),
        told(&[&in_lab("no.stl")]),
        told(&[&in_lab("lab.toml")]),
        told(&["object.mesh_scale=1000"]),
        parse(SCENE, "text", None, &[]).unwrap_err().to_string(),
    ];
    insta::assert_snapshot!(all.join("\n").replace(&folder.path().display().to_string(), "LAB"));
}

proptest! {
    #[test]
    fn no_bytes_make_a_mesh_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for format in [MeshFormat::Stl, MeshFormat::Obj, MeshFormat::Gltf] {
            let with_magic = [b"glTF".as_slice(), &bytes].concat();
            for bytes in [&bytes, &with_magic] {
                let _ = Triangles::parse(format, bytes, 1.0, None).and_then(|t| TriangleMesh::closed(&t));
            }
        }
    }

    #[test]
    fn no_slip_in_a_mesh_file_makes_its_reader_panic(
        which in any::<prop::sample::Index>(),
        slips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let files = files();
        let (format, _, mut bytes, _) = files[which.index(files.len())].clone();
        for (at, byte) in slips {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let triangles = Triangles::parse(format, &bytes, 1.0, None);
        if let Ok(triangles) = triangles {
            for mesh in [TriangleMesh::closed(&triangles), TriangleMesh::hull(&triangles)].into_iter().flatten() {
                prop_assert!(mesh.volume_m3 > 0.0 && mesh.inertia_per_mass_m2.is_finite());
            }
        }
    }

    #[test]
    fn a_hull_holds_all_its_points(points in prop::collection::vec([-1.0..1.0f64, -1.0..1.0, -1.0..1.0], 4..40)) {
        let vertices: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let triangles = (2..vertices.len() as u32).map(|last| [0, last - 1, last]).collect();
        let all = Triangles { vertices, triangles };
        if let Ok(hull) = TriangleMesh::hull(&all) {
            prop_assert!(hull.volume_m3 <= 8.0);
            for index in 0..hull.triangles.len() {
                let [a, b, c] = hull.corners(index);
                let out = (b - a).cross(c - a).normalize_or_zero();
                prop_assert!(hull.vertices.iter().all(|&vertex| out.dot(vertex - a) < 1e-6), "{:?}", index);
            }
        }
    }
}
