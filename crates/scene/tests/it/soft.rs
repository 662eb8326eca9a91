//! Soft objects: what scenes say of them, and the meshes that come of it.

use std::sync::Arc;

use cotouch_scene::scene::{Action, LocalModelKind, ReturnedForce, Scene, SoftMeshKind, SoftModel};
use cotouch_scene::soft_mesh::{SoftMesh, solids};
use cotouch_scene::{Override, builtin, load, parse, scene_hash, to_toml, with_override};
use glam::DVec3;
use parry3d_f64::query::PointQuery as _;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

const BLOCK: &str = r#"
space = "space"
[soft]
model = "corotational"
mesh = { generator = "block", size_m = [0.35, 0.1, 0.075], cells = [14, 4, 3] }
[[soft.fixed]]
from_m = [0, -1, -1]
to_m = [0, 1, 1]
"#;

fn read_with(text: &str, overrides: &[&str]) -> Result<Scene, String> {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    parse(text, "lab.toml", None, &overrides).map_err(|errors| errors.to_string())
}

fn read(text: &str) -> Scene {
    read_with(text, &[]).unwrap_or_else(|errors| panic!("{errors}"))
}

fn told(text: &str, overrides: &[&str]) -> String {
    read_with(text, overrides).expect_err("this must not be read")
}

fn soft(mesh: &str, model: &str, rest: &str) -> String {
    format!("space = \"space\"\n[soft]\nmodel = \"{model}\"\nmesh = {mesh}\n{rest}")
}

/// Everything in a large box below the origin's plane is fixed.
const LOWER_HALF: &str = "[[soft.fixed]]\nfrom_m = [-9, -9, -9]\nto_m = [9, 9, 0]\n";

/// Six times the volume of the tetrahedra, and of what is within the surface, m³.
fn volumes(mesh: &SoftMesh) -> (f64, f64) {
    let at = |node: u32| mesh.nodes_m[node as usize];
    let of_tetrahedron = |&[a, b, c, d]: &[u32; 4]| (at(b) - at(a)).dot((at(c) - at(a)).cross(at(d) - at(a)));
    let of_triangle = |&[a, b, c]: &[u32; 3]| at(a).dot(at(b).cross(at(c)));
    (mesh.tetrahedra.iter().map(of_tetrahedron).sum(), mesh.triangles.iter().map(of_triangle).sum())
}

/// Nodes − edges + triangles of the surface: 2 for one without holes.
fn euler(mesh: &SoftMesh) -> i64 {
    let mut nodes: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes.len() as i64 - mesh.triangles.len() as i64 / 2
}

#[test]
fn more_fingers_than_contacts_are_solved_together_are_refused() {
    let fingers = "[[user]]\nfinger = [{}, {}, {}, {}]\n".repeat(4);
    assert!(read_with(&format!("{BLOCK}\n{fingers}"), &[]).is_ok());
    let message = told(&format!("{BLOCK}\n{fingers}[[user]]\n"), &[]);
    assert!(
        message.contains("user.5.finger") && message.contains("at most 16 fingers together"),
        "{message}"
    );
}

#[test]
fn a_block_is_cut_as_the_contract_says() {
    let scene = read(BLOCK);
    let mesh = scene.soft.mesh();
    assert_eq!((mesh.nodes_m.len(), mesh.tetrahedra.len()), (15 * 5 * 4, 14 * 4 * 3 * 6));
    assert_eq!(mesh.triangles.len(), 2 * 2 * (14 * 4 + 4 * 3 + 14 * 3));
    let (whole, within) = volumes(mesh);
    let expected = 6.0 * 0.35 * 0.1 * 0.075;
    assert!((whole / expected - 1.0).abs() < 1e-12 && (within / expected - 1.0).abs() < 1e-12);
    assert_eq!(euler(mesh), 2);
    // Every tetrahedron of a cell has both ends of its diagonal.
    let (cell, start) = (DVec3::splat(0.025), 1e-9);
    for four in &mesh.tetrahedra {
        let nodes = four.map(|node| mesh.nodes_m[node as usize]);
        let low = nodes.iter().copied().reduce(DVec3::min).unwrap();
        let ends = [low, low + cell];
        assert!(ends.iter().all(|&end| nodes.iter().any(|node| node.distance(end) < start)));
    }
    let held = mesh.fixed_nodes(&scene.soft.fixed).iter().filter(|&&fixed| fixed).count();
    assert_eq!(held, 5 * 4);
}

#[test]
fn a_spring_is_a_triangle_that_faces_the_hand() {
    let scene = read(&soft(
        "{ generator = \"spring\", stiffness_n_per_m = 200, origin_m = [0.1, 0, 0] }",
        "mass-spring",
        "quasi_static = true\n[session]\nusers = 1",
    ));
    assert_eq!((scene.session.users, scene.users.len()), (1, 1));
    let mesh = scene.soft.mesh();
    assert_eq!((mesh.nodes_m.len(), mesh.tied_n_per_m), (3, 200.0));
    let [a, b, c] = mesh.triangles[0].map(|node| mesh.nodes_m[node as usize]);
    assert!((a + b + c).distance(DVec3::X * 0.3) < 1e-15);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        assert!((from.distance(to) - 0.02).abs() < 1e-15);
    }
    let normal = (b - a).cross(c - a).normalize();
    assert!(normal.distance(DVec3::NEG_X) < 1e-15);
}

#[test]
fn a_balloon_is_a_closed_skin() {
    let scene = read(&soft(
        "{ generator = \"balloon\", radius_m = 0.05, origin_m = [0, 0, 0.02] }",
        "balloon",
        LOWER_HALF,
    ));
    let mesh = scene.soft.mesh();
    assert_eq!((mesh.tetrahedra.len(), mesh.triangles.len(), euler(mesh)), (0, 320, 2));
    let centre = DVec3::Z * 0.02;
    assert!(mesh.nodes_m.iter().all(|node| (node.distance(centre) - 0.05).abs() < 1e-15));
    assert!(volumes(mesh).1 > 0.0);
}

#[test]
fn a_soft_scene_survives_being_written() {
    let extra =
        "[local_model]\nkind = \"pi\"\nreturned_force = \"last\"\nfriction = 0.2\n[session]\nusers = 3";
    let scene = read(&format!("{BLOCK}{extra}"));
    assert_eq!(scene.local_model.kind, LocalModelKind::Pi);
    let again = parse(&to_toml(&scene), "lab.toml", None, &[]).unwrap();
    assert_eq!(again, scene);
    assert_eq!(scene_hash(&again), scene_hash(&scene));
    let softer = with_override(&scene, "soft.young_pa", 5e3).unwrap();
    assert_ne!(scene_hash(&softer), scene_hash(&scene));
}

#[test]
fn numbers_that_change_do_not_make_the_mesh_again_unless_they_are_of_it() {
    let scene = read(BLOCK);
    let softer = with_override(&scene, "soft.young_pa", 5e3).unwrap();
    assert!(Arc::ptr_eq(scene.soft.mesh(), softer.soft.mesh()));
    let spring = read(&soft("{ generator = \"spring\", stiffness_n_per_m = 200 }", "mass-spring", ""));
    let harder = with_override(&spring, "soft.mesh.stiffness_n_per_m", 300.0).unwrap();
    assert_eq!(harder.soft.mesh().tied_n_per_m, 300.0);
    let errors = with_override(&spring, "soft.mesh.stiffness_n_per_m", 0.0).unwrap_err().to_string();
    assert!(errors.contains("it must be more than 0 (N/m)"), "{errors}");
}

#[test]
fn an_edit_of_the_mesh_makes_it_again() {
    let scene = read(BLOCK);
    let softer = scene.edit(|scene| scene.soft.young_pa = 5e3).unwrap();
    assert!(Arc::ptr_eq(scene.soft.mesh(), softer.soft.mesh()));
    let finer = scene.edit(|scene| scene.soft.mesh.cells = [7, 2, 2]).unwrap();
    assert_eq!(finer.soft.mesh().tetrahedra.len(), 7 * 2 * 2 * 6);
    let floating = scene.edit(|scene| scene.soft.fixed.clear()).unwrap_err().to_string();
    assert!(floating.contains("soft.fixed is 0 regions"), "{floating}");
    let alone = scene.edit(|scene| scene.soft.model = SoftModel::None).unwrap_err().to_string();
    assert!(alone.contains("session.users is 1; it must be from 2 to 16"), "{alone}");
}

#[test]
fn a_skin_is_stretched_but_less_than_twice() {
    let balloon = load("balloon", &[]).unwrap();
    for stretch in [0.9, 2.0, 2.5, f64::NAN] {
        let error = balloon.edit(|scene| scene.soft.skin_stretch = stretch).unwrap_err().to_string();
        assert!(error.contains(&format!("soft.skin_stretch is {stretch}; it must be")), "{error}");
    }
    for stretch in [1.001, 1.99] {
        assert!(balloon.edit(|scene| scene.soft.skin_stretch = stretch).is_ok(), "{stretch}");
    }
}

#[test]
fn what_is_left_out_of_a_local_model_follows() {
    let scene = read(BLOCK);
    let local = &scene.local_model;
    assert_eq!((local.kind, local.returned_force), (LocalModelKind::P, ReturnedForce::Mean));
    assert_eq!((local.result_delay_periods, local.friction), (1, scene.contact.static_friction));
    let first =
        read_with(BLOCK, &["local_model.returned_force=first", "contact.static_friction=0.1"]).unwrap();
    assert_eq!((first.local_model.result_delay_periods, first.local_model.friction), (0, 0.1));
    let finer = read_with(BLOCK, &["soft.mesh.cells=[7,2,2]", "soft.mesh.generator=beam"]).unwrap();
    assert_eq!(
        (finer.soft.mesh.generator, finer.soft.mesh().tetrahedra.len()),
        (SoftMeshKind::Beam, 7 * 2 * 2 * 6)
    );
    let gone = read_with(BLOCK, &["soft.model=none"]).unwrap();
    assert!(gone.soft.model == SoftModel::None && gone.soft.nodes.is_none());
}

#[test]
fn what_does_not_go_with_a_soft_object_is_told() {
    let messages = [
        told("[session]\nusers = 1", &[]),
        told(&format!("{BLOCK}[[body]]\nshape = \"ball\"\nradius_m = 0.1"), &[]),
        told(BLOCK, &["wall.stiffness_n_per_m=5", "object.shape=ball", "object.radius_m=1"]),
        told(BLOCK, &["rates.simulation_hz=2000"]),
        told(BLOCK, &["soft.mesh.cells=[100,100,100]"]),
        told(BLOCK, &["soft.mesh.cells=[1,2]"]),
        told(BLOCK, &["soft.mesh.cells=[1,0,2]"]),
        told(BLOCK, &["soft.mesh.size_m=0.1"]),
        told(BLOCK, &["soft.mesh.generator=balloon"]),
        told(BLOCK, &["soft.mesh.generator=spring"]),
        told(BLOCK, &["soft.mesh=7"]),
        told(BLOCK, &["soft.model=mass-spring", "soft.poisson_ratio=0.45"]),
        told(BLOCK, &["soft.model=balloon", "soft.mesh.generator=balloon"]),
        told(BLOCK, &["soft.fixed.1.to_m=[-1, 0, 0]"]),
        told(BLOCK, &["soft.fixed.1.to_m=[0, -0.5, 1]"]),
        told(BLOCK, &["soft.fixed.1.to_m=[0, 0, 1]"]),
        told(BLOCK, &["soft.fixed.1.to_m=[1, 1, 1]"]),
        told(BLOCK, &["soft.fixed=[]"]),
        told(BLOCK, &["local_model.kind=reduced", "local_model.stiffness_rato=1", "soft.yong_pa=3"]),
        told(&soft("\"liver.msh\"", "corotational", LOWER_HALF), &[]),
        told(&soft("\"liver.msh\"", "corotational", LOWER_HALF), &["soft.mesh=/nowhere/liver.msh"]),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

/// The least and the mean shape of tetrahedra: 1 is a regular one.
fn shapes(mesh: &SoftMesh) -> (f64, f64) {
    let shape = |four: &[u32; 4]| {
        let [a, b, c, d] = four.map(|node| mesh.nodes_m[node as usize]);
        let longest =
            [b - a, c - a, d - a, c - b, d - b, d - c].map(DVec3::length).into_iter().fold(0.0, f64::max);
        2f64.sqrt() * (b - a).dot((c - a).cross(d - a)) / longest.powi(3)
    };
    let all: Vec<f64> = mesh.tetrahedra.iter().map(shape).collect();
    (all.iter().copied().fold(1.0, f64::min), all.iter().sum::<f64>() / all.len() as f64)
}

/// The mean length of the edges of tetrahedra, m.
fn mean_edge(mesh: &SoftMesh) -> f64 {
    let at = |node: u32| mesh.nodes_m[node as usize];
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let lengths =
        mesh.tetrahedra.iter().flat_map(|four| pairs.map(|(i, j)| at(four[i]).distance(at(four[j]))));
    lengths.clone().sum::<f64>() / lengths.count() as f64
}

#[test]
fn balls_and_organs_are_filled_with_good_tetrahedra() {
    let mesh = solids::ball(0.05, 0.0125, DVec3::Y).unwrap();
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * 0.05f64.powi(3);
    // The surface is of chords: a little is missing.
    assert!((0.97..1.0).contains(&(mesh.volume_m3() / sphere)));
    let on_surface = |&node: &u32| (mesh.nodes_m[node as usize].distance(DVec3::Y) - 0.05).abs() < 1e-9;
    assert!(mesh.triangles.iter().flatten().all(on_surface));

    let half_axes = DVec3::new(0.12, 0.06, 0.05);
    for (name, mesh, edge_m) in [
        ("ball", mesh, 0.0125),
        ("coarse ball", solids::ball(1.0, 0.9, DVec3::ZERO).unwrap(), 0.9),
        ("organ", solids::organ(half_axes, 0.03, DVec3::ZERO).unwrap(), 0.03),
        ("fine organ", solids::organ(half_axes, 0.01, DVec3::NEG_ONE).unwrap(), 0.01),
    ] {
        let (whole, within) = volumes(&mesh);
        assert!((whole / within - 1.0).abs() < 1e-9, "{name}");
        assert_eq!(euler(&mesh), 2, "{name}");
        assert!((mean_edge(&mesh) / edge_m - 1.0).abs() < 0.15, "{name}: {}", mean_edge(&mesh));
        let (least, mean) = shapes(&mesh);
        assert!(least > 0.05 && mean > 0.5, "{name}: {least}, {mean}");
    }
}

#[test]
fn an_organ_fills_its_half_axes() {
    let (half_axes, centre) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.0, 2.0, 3.0));
    let mesh = solids::organ(half_axes, 0.03, centre).unwrap();
    let part = |node: &DVec3| (*node - centre) / half_axes;
    let high = mesh.nodes_m.iter().map(part).reduce(DVec3::max).unwrap();
    let low = mesh.nodes_m.iter().map(part).reduce(DVec3::min).unwrap();
    let expected = DVec3::new(1.0, 0.94, 1.0);
    assert!((high - expected).abs().max_element() < 0.05, "{high}");
    assert!((low + expected).abs().max_element() < 0.05, "{low}");
}

#[test]
fn generators_are_known_by_their_names() {
    for (mesh, model, tetrahedra) in [
        ("{ generator = \"ball\", radius_m = 0.05 }", "corotational", true),
        ("{ generator = \"ball\", radius_m = 0.05 }", "balloon", false),
        ("{ generator = \"organ\", size_m = [0.12, 0.06, 0.05] }", "mass-spring", true),
    ] {
        let scene = read(&soft(mesh, model, LOWER_HALF));
        let mesh = scene.soft.mesh();
        assert_eq!((!mesh.tetrahedra.is_empty(), euler(mesh)), (tetrahedra, 2));
        // The surface's nodes are all that a skin has.
        assert_eq!(tetrahedra, mesh.nodes_m.len() > mesh.triangles.len() / 2 + 2);
    }
    let ball = soft("{ generator = \"ball\", radius_m = 1 }", "corotational", LOWER_HALF);
    let told = told(&ball, &["soft.mesh.edge_m=0.01"]);
    assert!(told.contains("it must be a mesh of at most 200000"), "{told}");
}

/// How far a point is outside of a closed surface, m; below 0 inside.
fn outside_by(mesh: &SoftMesh, point: DVec3) -> f64 {
    let surface =
        TriMesh::with_flags(mesh.nodes_m.clone(), mesh.triangles.clone(), TriMeshFlags::ORIENTED).unwrap();
    let nearest = surface.project_local_point(point, false);
    let distance = nearest.point.distance(point);
    if nearest.is_inside { -distance } else { distance }
}

/// Fingers of built-in scenes with a soft object start off it, and whoever reaches anywhere reaches into it.
#[test]
fn built_in_scripts_touch_the_soft_object() {
    let scenes: Vec<Scene> = builtin::names().map(|name| load(name, &[]).unwrap()).collect();
    for scene in scenes.iter().filter(|scene| scene.soft.exists() && scene.soft.mesh().tied_n_per_m == 0.0) {
        let depth = |point: DVec3| scene.hand.finger_radius_m - outside_by(scene.soft.mesh(), point);
        for user in &scene.users {
            let starts = user.fingers.iter().map(|finger| depth(finger.position_m));
            assert!(starts.fold(f64::NEG_INFINITY, f64::max) < 0.0, "{}: {}", scene.name, user.name);
            let reach = |action: &Action| match action {
                Action::Reach { to_m, .. } => Some(depth(*to_m)),
                _ => None,
            };
            let scripts = user.fingers.iter().flat_map(|finger| &finger.script).chain(&user.script);
            let deepest = scripts.filter_map(reach).reduce(f64::max);
            assert!(deepest.is_none_or(|depth| depth > 1e-3), "{}: {} {deepest:?}", scene.name, user.name);
        }
    }
}
