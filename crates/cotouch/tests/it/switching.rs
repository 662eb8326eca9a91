//! What the adversary of the analysis finds, a running session does.

use std::fs::write;

use cotouch_scene::scene::{Action, Scene};
use cotouch_scene::to_toml;
use cotouch_testkit::scenes::{BoxOnALine, edited};
use glam::DVec3;

use crate::program::{cotouch, folder, json};

/// The counter-example, in which ben pushes harder for a moment than anna, who comes later.
fn scene() -> Scene {
    edited(&BoxOnALine::COUNTER_EXAMPLE.scene(), |scene| {
        let [anna, ben] = &mut scene.users[..] else { panic!("two users") };
        anna.fingers[0].position_m.x = -0.1;
        ben.fingers[0].position_m.x = 0.06;
        ben.script.insert(0, Action::Force { force_n: DVec3::X * -4.0, duration_s: 0.2 });
    })
}

#[test]
fn what_switching_keeps_moving_shakes_in_the_running_session_too() {
    let folder = folder();
    write(folder.path().join("box.toml"), to_toml(&scene())).unwrap();
    let analysis = json(&cotouch(folder.path(), &["analyze", "stability", "box.toml", "--json"]));
    assert!(analysis["stable"].is_null(), "{analysis}");
    assert_eq!(analysis["switching"], "unproven");
    let found = &analysis["switching_found"];
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("a number in {value}"));

    let words = ["run", "box.toml", "--virtual", "--headless", "--duration", "12", "--json"];
    let run = json(&cotouch(folder.path(), &words));
    assert_eq!(run["verdict"], "shaking", "{run}");
    let stretches = run["shaking"].as_array().unwrap();
    let to_the_end = stretches.iter().find(|stretch| number(&stretch["to_s"]) > 11.5);
    let to_the_end = to_the_end.unwrap_or_else(|| panic!("it keeps shaking: {run}"));
    for key in ["rms_n", "hz"] {
        let (predicted, seen) = (number(&found[key]), number(&to_the_end[key]));
        assert!((seen / predicted - 1.0).abs() < 0.2, "{key}: {seen}, found {predicted}");
    }
}
