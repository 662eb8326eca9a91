//! The adversary against closed forms, against the maps whose eigenvalues are judged, and against known counter-examples.

mod stepping;
mod trial;

use cotouch_scene::scene::SceneValues;
use cotouch_testkit::scenes::BoxOnALine;

use super::{ContactPoints, fed, find, search};
use crate::compile::{ContactMode, compile, compile_at};
use crate::modes::contact_points;
use crate::poles::analyze_loop;
use crate::verdict::{Switching, UnsettledMotion};

fn found(scene: &SceneValues, modes: &[ContactMode]) -> Option<UnsettledMotion> {
    let verdicts: Vec<_> = modes.iter().map(|mode| analyze_loop(&mode.spec).unwrap()).collect();
    find(scene, &contact_points(scene), &fed(modes, &verdicts), &|| true).expect("nobody gives up")
}

#[test]
fn the_counter_example_is_found_although_each_mode_is_stable() {
    let scene = BoxOnALine::COUNTER_EXAMPLE.scene();
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
        let scene = BoxOnALine { delay_periods, ..BoxOnALine::TABLE_6_1 }.scene();
        let switched = search(&scene, &compile, &contact_points(&scene), &|| true).unwrap();
        assert_eq!(switched.found, None, "n = {delay_periods}");
        assert_eq!(switched.switching, Switching::Searched, "n = {delay_periods}");
    }
}

#[test]
fn what_is_found_does_not_depend_on_threads() {
    let scene = BoxOnALine::COUNTER_EXAMPLE.scene();
    let modes = compile(&scene);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| found(&scene, &modes))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_search_that_nobody_wants_ends() {
    let scene = BoxOnALine::COUNTER_EXAMPLE.scene();
    assert_eq!(find(&scene, &contact_points(&scene), &[], &|| false), None);
}

/// The distance is where the worst mode is on the line.
#[test]
fn a_mode_turns_unstable_at_the_distance() {
    let scene = BoxOnALine::COUNTER_EXAMPLE.scene();
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
