//! What the adversary of the analysis finds, a running session does.

use std::fs::write;

use crate::program::{cotouch, folder, json};

/// Two hands and a box on a line whose contact modes are all stable; ben pushes harder for a moment than anna.
const SCENE: &str = r#"
space = "line"
[session]
architecture = "distributed"
users = 2
[rates]
control_hz = 1024
network_hz = 512
[link]
delay_periods = 0
[hand]
mass_kg = 0.075
damping_n_s_per_m = 3.567
finger_radius_m = 0.008
[object]
mass_kg = 0.847
shape = "box"
size_m = [0.1, 0.1, 0.1]
[coupling.hand_object]
stiffness_n_per_m = 7618.422
damping_n_s_per_m = 18.654
[coupling.remote_hand_object]
stiffness_n_per_m = 6222.011
damping_n_s_per_m = 2.755
[coupling.object_object]
stiffness_n_per_m = 2523.913
damping_n_s_per_m = 5.152
[[user]]
name = "anna"
script = [{ do = "force", force_n = [1, 0, 0], duration_s = 60 }]
[[user.finger]]
position_m = [-0.1, 0, 0]
[[user]]
name = "ben"
script = [
  { do = "force", force_n = [-4, 0, 0], duration_s = 0.2 },
  { do = "force", force_n = [-1, 0, 0], duration_s = 60 },
]
[[user.finger]]
position_m = [0.06, 0, 0]
"#;

#[test]
fn what_switching_keeps_moving_shakes_in_the_running_session_too() {
    let folder = folder();
    write(folder.path().join("box.toml"), SCENE).unwrap();
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
