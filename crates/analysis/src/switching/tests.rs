//! The adversary against closed forms, against the maps whose eigenvalues are judged, and against known counter-examples.

mod stepping;
mod trial;

use cotouch_scene::Scene;
use cotouch_scene::scene::{SceneValues, SpringDamper};

use super::{ContactPoints, fed, find, search};
use crate::compile::{ContactMode, compile, compile_at};
use crate::modes::contact_points;
use crate::poles::analyze_loop;
use crate::verdict::{Switching, UnsettledMotion};

/// A box on a line between two hands that push at it: so many ticks a network period, n, m_h, m_o, b_h, and the springs and
/// dampers of Table 6.1's order.
struct Line {
    ticks: u32,
    delay_periods: u32,
    hand_kg: f64,
    object_kg: f64,
    hand_damping: f64,
    springs: [(f64, f64); 3],
}

/// Table 6.1 with b_h = 5 N·s/m.
const TABLE_6_1: Line = Line {
    ticks: 8,
    delay_periods: 1,
    hand_kg: 0.1,
    object_kg: 0.4,
    hand_damping: 5.0,
    springs: [(3000.0, 20.0), (400.0, 2.0), (300.0, 10.0)],
};

/// Every mode in which fingers touch all copies or none is stable, and throws keep it moving.
const COUNTER_EXAMPLE: Line = Line {
    ticks: 2,
    delay_periods: 0,
    hand_kg: 0.075,
    object_kg: 0.847,
    hand_damping: 3.567,
    springs: [(7618.422, 18.654), (6222.011, 2.755), (2523.913, 5.152)],
};

impl Line {
    fn scene(&self) -> Scene {
        let network = 1024 / self.ticks;
        let text = format!(
            r#"
            space = "line"
            [session]
            architecture = "distributed"
            users = 2
            [rates]
            control_hz = 1024
            network_hz = {network}
            [hand]
            finger_radius_m = 0.008
            [object]
            shape = "box"
            size_m = [0.1, 0.1, 0.1]
            [[user]]
            name = "anna"
            script = [{{ do = "force", force_n = [1, 0, 0], duration_s = 60 }}]
            [[user.finger]]
            position_m = [-0.07, 0, 0]
            [[user]]
            name = "ben"
            script = [{{ do = "force", force_n = [-1, 0, 0], duration_s = 60 }}]
            [[user.finger]]
            position_m = [0.07, 0, 0]
            "#
        );
        let scene = cotouch_scene::parse(&text, "a line", None, &[]).expect("a scene");
        let [own, remote, copies] = self.springs.map(|(stiffness_n_per_m, damping_n_s_per_m)| SpringDamper {
            stiffness_n_per_m,
            damping_n_s_per_m,
        });
        let edited = scene.edit(|scene| {
            scene.link.delay_periods = self.delay_periods;
            scene.hand.mass_kg = self.hand_kg;
            scene.hand.damping_n_s_per_m = self.hand_damping;
            scene.object.mass_kg = self.object_kg;
            scene.coupling.hand_object = own;
            scene.coupling.remote_hand_object = remote;
            scene.coupling.object_object = copies;
        });
        edited.expect("values like any")
    }
}

fn found(scene: &SceneValues, modes: &[ContactMode]) -> Option<UnsettledMotion> {
    let verdicts: Vec<_> = modes.iter().map(|mode| analyze_loop(&mode.spec).unwrap()).collect();
    find(scene, &contact_points(scene), &fed(modes, &verdicts), &|| true).expect("nobody gives up")
}

#[test]
fn the_counter_example_is_found_although_each_mode_is_stable() {
    let scene = COUNTER_EXAMPLE.scene();
    let switched = search(&scene, &compile, &contact_points(&scene), &|| true).unwrap();
    assert_eq!(switched.switching, Switching::Unproven);
    let distance = switched.distance.expect("each mode is stable");
    assert!((1.0..1.2).contains(&distance), "{distance}");
    let found = switched.found.expect("it keeps moving");
    assert!(found.rms_n.is_some_and(|rms_n| rms_n > 1.0) && found.hz > 20.0, "{found:?}");
    assert!(found.moving * 20 > found.tried, "{found:?}");
    assert_eq!(found.contacts, ["anna.finger1", "ben.finger1"]);
}

#[test]
fn table_6_1_with_surfaces_is_searched() {
    for delay_periods in [0, 1] {
        let scene = Line { delay_periods, ..TABLE_6_1 }.scene();
        let switched = search(&scene, &compile, &contact_points(&scene), &|| true).unwrap();
        assert_eq!(switched.found, None, "n = {delay_periods}");
        assert_eq!(switched.switching, Switching::Searched, "n = {delay_periods}");
    }
}

#[test]
fn what_is_found_does_not_depend_on_threads() {
    let scene = COUNTER_EXAMPLE.scene();
    let modes = compile(&scene);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| found(&scene, &modes))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_search_that_nobody_wants_ends() {
    let scene = COUNTER_EXAMPLE.scene();
    assert_eq!(find(&scene, &contact_points(&scene), &[], &|| false), None);
}

/// The distance is where the worst mode is on the line.
#[test]
fn a_mode_turns_unstable_at_the_distance() {
    let scene = COUNTER_EXAMPLE.scene();
    let distance = search(&scene, &compile, &contact_points(&scene), &|| true).unwrap().distance.unwrap();
    let is_stable = |factor: f64| {
        let scene = super::distance::stiffer(&scene, super::distance::Scaled::Springs, factor);
        compile(&scene).iter().all(|mode| analyze_loop(&mode.spec).unwrap().stable)
    };
    assert!(is_stable(distance) && !is_stable(distance * 1.0011), "{distance}");
}

/// Every set of contacts of single copies.
fn modes_of_copies(scene: &SceneValues) -> Vec<ContactMode> {
    let ContactPoints { always, switching } = contact_points(scene);
    let all = switching.fingers;
    let mode = |set: usize| {
        let mut point = always.clone();
        let closed = all.iter().enumerate().filter(|(contact, _)| set >> contact & 1 == 1);
        point.fingers = closed.map(|(_, at)| *at).collect();
        let contacts = point.fingers.iter().map(|at| format!("{} at {}", at.user, at.host)).collect();
        ContactMode { contacts, settled: false, spec: compile_at(scene, &point) }
    };
    (0..1 << all.len()).map(mode).collect()
}
