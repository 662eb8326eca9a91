use cotouch_scene::scene::{Architecture, Scene};
use cotouch_testkit::scenes::{BoxOnALine, edited};

use super::contacts::{BodyContacts, Set};
use super::hands::{Hand, ways};
use super::loops::judge_candidate;
use super::symmetry::{representative, symmetries};
use super::{Study, cover};
use crate::operating_point::Reach;
use crate::stability::analyze_settled;

fn load(name: &str, set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    cotouch_scene::load(name, &set).unwrap()
}

fn parse(text: &str) -> Scene {
    cotouch_scene::parse(text, "test", None, &[]).unwrap()
}

#[test]
fn a_finger_at_one_copy_alone_is_a_mode() {
    let mut scene = BoxOnALine::COUNTER_EXAMPLE.scene();
    scene = edited(&scene, |scene| scene.users.iter_mut().for_each(|user| user.script.clear()));
    let covered = cover(&scene).unwrap();
    let partial = |mode: &&crate::ModeStability| mode.contacts.iter().any(|name| name.contains("copy"));
    let largest =
        |modes: Vec<&crate::ModeStability>| modes.iter().map(|mode| mode.spectral_radius).fold(0.0, f64::max);
    let (partly, wholly): (Vec<_>, Vec<_>) = covered.modes.iter().partition(partial);
    assert!((largest(wholly) - 0.998_352_6).abs() < 1e-6);
    assert!(partly.iter().any(|mode| mode.contacts == ["anna.finger1 (ben's copy)"]), "{partly:?}");
    // What drifts because it feels nothing is no pole of these.
    assert!((0.9974..1.0 - 1e-6).contains(&largest(partly)));
    assert!(covered.left_out.is_empty(), "{:?}", covered.left_out);
}

/// Fingers without a script touch, as a hand that is taken on the page can.
const FOUR_FINGERS: &str = r#"
space = "plane"
[session]
architecture = "distributed"
users = 2
[link]
delay_periods = 1
[object]
mass_kg = 0.3
shape = "box"
size_m = [0.2, 0.12, 0.05]
[coupling.hand_object]
stiffness_n_per_m = 200000
damping_n_s_per_m = 3
[coupling.hand_object_tangential]
stiffness_n_per_m = 1200
damping_n_s_per_m = 10
[coupling.remote_hand_object]
stiffness_n_per_m = 800
damping_n_s_per_m = 3
[coupling.object_object]
stiffness_n_per_m = 400
damping_n_s_per_m = 8
[[user]]
name = "me"
[[user.finger]]
position_m = [-0.03, -0.09, 0]
[[user.finger]]
position_m = [-0.03, 0.09, 0]
[[user]]
name = "you"
[[user.finger]]
position_m = [0.03, -0.09, 0]
[[user.finger]]
position_m = [0.03, 0.09, 0]
"#;

#[test]
fn fingers_without_a_script_count() {
    let scene = parse(FOUR_FINGERS);
    assert!(analyze_settled(&scene).unwrap().each_mode_is_stable(), "scripts touch nothing");
    let covered = cover(&scene).unwrap();
    let alone = |mode: &&crate::ModeStability| mode.contacts == ["me.finger1"];
    let alone = covered.modes.iter().find(alone).unwrap();
    assert!(!alone.stable && covered.spectral_radius > 1.0, "{alone:?}");
    assert!(covered.worst.place.is_some() && covered.worst.gain.is_some(), "{:?}", covered.worst);
}

/// Every set has the eigenvalues of the one that stands for it.
#[test]
fn sets_that_are_alike_are_equally_stable() {
    for (name, architecture, least) in [
        ("grasp", Architecture::Distributed, 4),
        ("grasp", Architecture::Centralized, 2),
        ("hand-over", Architecture::Distributed, 1),
    ] {
        let scene = load(name, &[]);
        let scene = scene.edit(|scene| scene.session.architecture = architecture).unwrap();
        let reach = Reach::of(&scene);
        let contacts = BodyContacts::of(&scene, &reach, 0);
        let symmetries = symmetries(&scene, &reach, &contacts);
        assert!(symmetries.len() >= least, "{name}: {}", symmetries.len());
        let study = Study { scene: &scene, reach: &reach };
        let all = contacts.all.len();
        for number in 1..60_usize {
            let code = number.wrapping_mul(40_503) % (1 << all);
            let set: Set = (0..all).filter(|&contact| code >> contact & 1 == 1).collect();
            let alike = representative(&set, &symmetries);
            if set == alike || !contacts.can_be(&scene, &reach, &set) {
                continue;
            }
            let [one, other] = [&set, &alike].map(|set| {
                let candidate = study.told(&contacts, set);
                judge_candidate(&scene, &reach, &candidate, false).unwrap().spectral_radius
            });
            assert!((one - other).abs() < 1e-7, "{name} {set:?} {alike:?}: {one} {other}");
        }
    }
}

/// Sets in which every contact is with all copies are the modes of the settled grasp.
#[test]
fn contacts_with_all_copies_are_the_modes_of_the_settled_grasp() {
    let scene = load("sinusoid", &[]);
    let covered = cover(&scene).unwrap();
    for mode in analyze_settled(&scene).unwrap().modes {
        let same = covered.modes.iter().find(|other| other.contacts == mode.contacts).unwrap();
        assert!((same.spectral_radius - mode.spectral_radius).abs() < 1e-7, "{mode:?} {same:?}");
    }
}

#[test]
fn hands_are_held_in_every_way_that_differs() {
    let tracked = load("grasp", &[]);
    assert_eq!(ways(&tracked.users[0]), [Hand::Told, Hand::OnDevice]);
    let pushed = load("single-axis", &[]);
    assert_eq!(ways(&pushed.users[0]), [Hand::Told, Hand::Taken]);
}

/// No set of contacts of these scenes is unstable, whatever copies fingers and walls are at.
#[test]
fn built_in_scenes_are_covered() {
    for name in ["grasp", "sinusoid", "push-wall"] {
        let covered = cover(&load(name, &[])).unwrap();
        let unstable: Vec<_> = covered.modes.iter().filter(|mode| !mode.stable).collect();
        assert!(unstable.is_empty(), "{name} {unstable:?}");
    }
}

/// A finger that touches a copy of which it feels nothing is free. Nothing that drifts so is unstable by what rounding makes of
/// a double pole at 1.
#[test]
fn a_hand_that_feels_nothing_makes_no_mode_unstable() {
    let ball = ["object.shape=ball", "object.radius_m=0.05"];
    let more: &[&[&str]] = &[
        &[],
        &["hand.damping_n_s_per_m=0.001"],
        &["space=plane"],
        &["session.users=3"],
        &["session.architecture=centralized"],
        &["link.delay_periods=3", "hand.mass_kg=0.3"],
        &["device.velocity=filtered"],
        &["rates.network_hz=512", "coupling.remote_hand_object.damping_n_s_per_m=0"],
    ];
    for set in more {
        let found = cover(&load("single-axis", &[&ball, *set].concat())).unwrap();
        for mode in &found.modes {
            let by_rounding = (1.0 + 1e-12..1.0 + 1e-6).contains(&mode.spectral_radius);
            assert!(!by_rounding, "{set:?}: {mode:?}");
        }
    }
    let found = cover(&load("single-axis", &ball)).unwrap();
    assert!(
        found.modes.iter().all(|mode| mode.stable && mode.spectral_radius < 1.0 - 1e-6),
        "{:?}",
        found.modes
    );
}

#[test]
fn copies_on_a_line_are_touched_from_the_ends_of_their_row() {
    let mut scene = BoxOnALine::COUNTER_EXAMPLE.scene();
    scene = edited(&scene, |scene| {
        scene.session.users = 3;
        let carl = cotouch_scene::scene::User { name: "carl".into(), ..scene.users[0].clone() };
        scene.users.push(carl);
    });
    let reach = Reach::of(&scene);
    let contacts = BodyContacts::of(&scene, &reach, 0);
    // anna's finger and carl's on the left, ben's on the right; each touches some of three copies, the first three contacts are
    // anna's.
    let set = |touched: [&[usize]; 3]| -> Set {
        (0..3).flat_map(|user| touched[user].iter().map(move |copy| 3 * user + copy)).collect()
    };
    let can_be = |touched| contacts.can_be(&scene, &reach, &set(touched));
    assert!(can_be([&[0], &[], &[0, 1]]), "carl's finger is deeper than anna's");
    assert!(!can_be([&[0], &[], &[1]]), "what anna's touches first, carl's does too");
    assert!(can_be([&[0], &[1, 2], &[]]) && can_be([&[0], &[2], &[]]) && can_be([&[0, 1, 2], &[1], &[]]));
    assert!(!can_be([&[0, 1], &[1, 2], &[0, 2]]), "anna's says that the last copy is farthest to the right");
    assert!(can_be([&[0, 1], &[2], &[0]]) && !can_be([&[0, 1], &[0], &[0]]));
}

/// A block in a plane whose right side is slanted, beside a wall to its right.
fn wedge_beside_a_wall() -> Scene {
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/../cotouch/tests/meshes/wedge.obj");
    parse(&format!(
        r#"
space = "plane"
[session]
architecture = "distributed"
users = 2
[object]
mass_kg = 0.3
shape = "mesh"
mesh = "{mesh}"
[wall]
stiffness_n_per_m = 500
damping_n_s_per_m = 5
[[wall.plane]]
name = "right"
point_m = [0.08, 0, 0]
normal = [-1, 0, 0]
[[user]]
name = "me"
[[user.finger]]
position_m = [-0.07, 0, 0]
[[user]]
name = "you"
[[user.finger]]
position_m = [0, -0.06, 0]
"#
    ))
}

#[test]
fn a_mesh_lies_against_a_wall_on_a_corner_or_on_any_of_its_sides() {
    let scene = wedge_beside_a_wall();
    let reach = Reach::of(&scene);
    let corners = |turned| reach.leans_turned(&scene, 0, turned)[0].corners.len();
    assert_eq!(corners(glam::DQuat::IDENTITY), 1, "the lower end of the slanted side");
    let turns = reach.turns_onto_faces(&scene, 0, 0);
    assert_eq!(turns.iter().map(|&turned| corners(turned)).collect::<Vec<_>>(), [2; 4]);
}

#[test]
fn contacts_of_a_mesh_with_a_wall_are_analysed() {
    let covered = cover(&wedge_beside_a_wall()).unwrap();
    let at_wall = |mode: &&crate::ModeStability| mode.contacts.iter().any(|name| name.starts_with("right"));
    assert!(covered.modes.iter().any(|mode| at_wall(&mode)));
    assert!(covered.left_out.iter().all(|gap| !gap.what.contains("wall")), "{:?}", covered.left_out);
}
