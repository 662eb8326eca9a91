//! What scripts are found to ask for, held to runs and to closed forms.

use std::cell::Cell;

use cotouch_runtime::{scripted_demand, virtual_run};
use cotouch_scene::{DemandExtent, Scene, ScriptedDemand, load, parse};

fn found(scene: &Scene) -> ScriptedDemand {
    scripted_demand(scene, &|| true)
}

fn built_in(name: &str, set: &[&str]) -> Scene {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    load(name, &set).unwrap()
}

fn near(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} and {expected}");
}

#[test]
fn the_largest_force_is_that_of_the_run() {
    for name in ["hand-over", "grasp", "push-wall", "balloon", "spring"] {
        let scene = built_in(name, &[]);
        let demand = found(&scene);
        assert_eq!(demand.extent, DemandExtent::Whole, "{name}");
        let run = virtual_run::run(&scene, demand.force.at_s + 0.5, None, |_| true).unwrap();
        let peak_n = run.users_detail.iter().filter_map(|user| user.peak_force_n).fold(0.0, f64::max);
        near(demand.force.newtons, peak_n, 1e-9);
        let of_user = run.users_detail.iter().find(|user| user.name == demand.force.user).unwrap();
        assert_eq!(of_user.peak_force_n, Some(peak_n), "{name}");
    }
}

#[test]
fn limits_are_lifted() {
    let free = found(&built_in("hand-over", &[]));
    let set = ["governor.max_force_n=1", "governor.max_slew_n_per_s=20", "governor.passivity_control=true"];
    assert_eq!(found(&built_in("hand-over", &set)), free);
}

/// A finger of 8 mm that is drawn 28 mm deep into a ball that is fixed, and what the device renders besides.
fn pressing(duration_s: f64) -> Scene {
    let text = format!(
        r#"
space = "space"
[session]
users = 2
[[body]]
shape = "ball"
radius_m = 0.05
fixed = true
[[user]]
name = "anna"
tracking = {{ stiffness_n_per_m = 1000, damping_n_s_per_m = 10 }}
script = [{{ do = "reach", to_m = [0.03, 0, 0], duration_s = {duration_s} }}, {{ do = "hold", duration_s = 5 }}]
[[user.finger]]
position_m = [0.07, 0, 0]
[[user]]
[[user.finger]]
position_m = [-0.2, 0, 0]
"#
    );
    parse(&text, "test", None, &[]).unwrap()
}

#[test]
fn a_slow_press_asks_for_what_two_springs_in_series_take() {
    let scene = pressing(20.0);
    let contact = scene.coupling.hand_object.stiffness_n_per_m;
    let demand = found(&scene);
    near(demand.force.newtons, 0.028 / (1000.0_f64.recip() + contact.recip()), 1e-3);
    assert_eq!((demand.force.user.as_str(), demand.force.finger), ("anna", 0));
    assert!(demand.force.at_s > 19.0, "{demand:?}");
}

#[test]
fn what_devices_render_besides_is_asked_for_too() {
    let alone = |action: &str| {
        let text = format!(
            r#"
[session]
users = 2
[governor]
damping_n_s_per_m = 3
[coupling]
hand_object = {{ stiffness_n_per_m = 0, damping_n_s_per_m = 0 }}
remote_hand_object = {{ stiffness_n_per_m = 0, damping_n_s_per_m = 0 }}
[[user]]
tracking = {{ stiffness_n_per_m = 1e4, damping_n_s_per_m = 300 }}
script = [{{ {action} }}]
"#
        );
        found(&parse(&text, "test", None, &[]).unwrap()).force.newtons
    };
    // Minimum jerk (Flash & Hogan 1985): the largest speed is 15/8 of the mean one.
    near(alone("do = \"reach\", to_m = 0.05, duration_s = 1"), 3.0 * 1.875 * 0.05, 0.01);
    // What swings for ten minutes is cut, and the same.
    let swing = |duration_s: u32| {
        alone(&format!(
            "do = \"sinusoid\", amplitude_m = 0.05, frequency_hz = 1, phase_rad = 0, duration_s = {duration_s}"
        ))
    };
    near(swing(600), swing(5), 1e-9);
}

#[test]
fn what_comes_after_a_long_rest_is_seen() {
    let script = |rest_s: f64| {
        let text = format!(
            r#"
[session]
users = 2
[[user]]
name = "anna"
script = [{{ do = "relax", duration_s = {rest_s} }}, {{ do = "force", force_n = 7, duration_s = 1 }}]
"#
        );
        found(&parse(&text, "test", None, &[]).unwrap())
    };
    let (soon, late) = (script(30.0), script(600.0));
    near(late.force.newtons, soon.force.newtons, 1e-6);
    assert!(
        soon.force.at_s > 30.0 && late.force.at_s > 40.0 && late.extent == DemandExtent::Whole,
        "{late:?}"
    );
}

#[test]
fn what_is_not_seen_to_its_end_is_said() {
    // A body that is pushed slowly for ten minutes, to a wall that is far away.
    let text = r#"
wall = { sides = "one", position_m = 10, stiffness_n_per_m = 1000, damping_n_s_per_m = 10 }
[session]
users = 2
[[user]]
script = [{ do = "force", force_n = 0.0005, duration_s = 600 }]
"#;
    let demand = found(&parse(text, "test", None, &[]).unwrap());
    assert!(matches!(demand.extent, DemandExtent::Until { .. }), "{demand:?}");
    let demand = found(&pressing(400.0));
    assert!(matches!(demand.extent, DemandExtent::Until { at_s } if at_s > 299.0), "{demand:?}");
}

#[test]
fn it_is_given_up_when_nobody_wants_it_any_more() {
    let asked = Cell::new(0);
    let wanted = || asked.replace(asked.get() + 1) < 4;
    let demand = scripted_demand(&built_in("grasp", &[]), &wanted);
    assert_eq!(demand.extent, DemandExtent::Until { at_s: 1.0 });
}
