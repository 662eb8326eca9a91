//! What `analyze` and `local-model` answer: shapes that scripts rely on, values that are known, and errors that help.

use crate::program::{cotouch, folder, has_keys, json, stderr, stdout};
use serde_json::Value;

const K11: &str = "coupling.hand_object.stiffness_n_per_m";
const K12: &str = "coupling.remote_hand_object.stiffness_n_per_m";

fn answer(words: &[&str]) -> Value {
    let output = cotouch(folder().path(), &[words, &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{words:?}: {}", stderr(&output));
    json(&output)
}

fn close(value: &Value, expected: f64, relative: f64) {
    let found = value.as_f64().unwrap_or_else(|| panic!("{value} is not {expected}"));
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} is not {expected}");
}

#[test]
fn a_map_has_rows_of_y_and_a_boundary_between_its_verdicts() {
    let x = format!("{K11}=100..9000:9");
    let y = format!("{K12}=10..4000:7");
    let words = ["analyze", "stability", "single-axis", "--sweep", &x, "--sweep", &y];
    let map = answer(&words);
    has_keys(&map, &["x.key", "x.values[]", "y.key", "y.values[]", "stable", "boundary"]);
    assert_eq!((map["x"]["key"].as_str(), map["y"]["key"].as_str()), (Some(K11), Some(K12)));
    let rows = map["stable"].as_array().unwrap();
    assert_eq!((rows.len(), rows[0].as_array().unwrap().len()), (7, 9));
    let verdicts = rows.iter().flat_map(|row| row.as_array().unwrap()).map(|cell| cell.as_bool().unwrap());
    assert!(verdicts.clone().any(|stable| stable) && verdicts.clone().any(|stable| !stable));
    assert!(map["boundary"][0][0][1].is_f64() && map.get("spectral_radius").is_none());

    let full = answer(&[&words[..], &["--radius"]].concat());
    assert_eq!(full["stable"], map["stable"]);
    for (row, column) in [(0, 0), (3, 5), (6, 8)] {
        let set = |key: &str, value: &Value| format!("{key}={value}");
        let (x, y) = (set(K11, &map["x"]["values"][column]), set(K12, &map["y"]["values"][row]));
        let point = answer(&["analyze", "stability", "single-axis", "--set", &x, "--set", &y]);
        assert_eq!(point["stable"], full["stable"][row][column]);
        close(&full["spectral_radius"][row][column], point["spectral_radius"].as_f64().unwrap(), 1e-10);
    }
}

/// A line, grasps of many modes, a soft body, an unstable scene, and rates without a common multiple: whatever routes apply
/// agree with the verdict, and what is checked is what the verdict rests on.
#[test]
fn routes_that_share_only_the_description_agree_with_the_verdict() {
    for (words, nested) in [
        (&["single-axis"][..], true),
        (&["grasp-centralized"], true),
        (&["sinusoid"], true),
        (&["spring"], true),
        (&["single-axis", "--set", "rates.network_hz=100"], false),
    ] {
        let found = answer(&[&["analyze", "stability"], words, &["--check"]].concat());
        let check = found["check"].as_array().unwrap();
        close(&check[0]["spectral_radius"], found["spectral_radius"].as_f64().unwrap(), 1e-9);
        // The search may have found another place for contacts that are checked where scripts come from as well. What has no
        // part in the contacts may be larger still.
        let of_worst = found["worst"]["spectral_radius"].as_f64().unwrap();
        let mut alike = check.iter().filter(|mode| mode["contacts"] == found["worst"]["contacts"]);
        let checked = alike.any(|mode| mode["spectral_radius"].as_f64().unwrap() > of_worst - 1e-9);
        assert!(checked, "{words:?}: the worst is not checked");
        for mode in check {
            let names =
                mode["routes"].as_array().unwrap().iter().map(|route| route["name"].as_str().unwrap());
            assert!(names.eq(["instants", "state-space", "resampling"]));
            for route in mode["routes"].as_array().unwrap() {
                if route["name"] == "resampling" && !nested {
                    assert!(route["note"].as_str().unwrap().contains("does not apply"), "{route}");
                    assert!(route["spectral_radius"].is_null() && route["difference"].is_null());
                } else {
                    close(&route["spectral_radius"], mode["spectral_radius"].as_f64().unwrap(), 1e-9);
                    assert!(route["difference"].as_f64().unwrap() < 1e-9, "{words:?} {route}");
                }
            }
        }
    }
    assert!(answer(&["analyze", "stability", "single-axis"]).get("check").is_none());
}

#[test]
fn one_sweep_is_a_single_row_and_its_crossings() {
    let map = answer(&["analyze", "stability", "single-axis", "--sweep", &format!("{K12}=10..4000:40:log")]);
    assert_eq!(map["stable"].as_array().unwrap().len(), 1);
    let at = map["boundary"][0][0][0].as_f64().unwrap();
    for (factor, stable) in [(0.999, true), (1.001, false)] {
        let set = format!("{K12}={}", factor * at);
        assert_eq!(answer(&["analyze", "stability", "single-axis", "--set", &set])["stable"], stable);
    }
}

#[test]
fn an_empty_region_says_why() {
    let b = |key: &str| format!("coupling.{key}.damping_n_s_per_m=10");
    let (b1, b2) = (b("hand_object"), b("remote_hand_object"));
    let map = answer(&[
        "analyze",
        "stability",
        "single-axis-centralized",
        "--set",
        &b1,
        "--set",
        &b2,
        "--set",
        "link.delay_periods=2",
        "--sweep",
        &format!("{K11}=1..3000:12"),
        "--sweep",
        &format!("{K12}=1..1000:12"),
    ]);
    assert!(map["empty"].as_str().unwrap().contains("damp"), "{}", map["empty"]);
    assert_eq!(map["boundary"].as_array().unwrap().len(), 0);
}

#[test]
fn maps_become_pictures_and_tables() {
    let folder = folder();
    let sweep = format!("{K11}=100..9000:12");
    let other = format!("{K12}=10..4000:12");
    for (name, begins) in [("map.svg", "<svg"), ("map.csv", "")] {
        let words =
            ["analyze", "stability", "single-axis", "--sweep", &sweep, "--sweep", &other, "--out", name];
        let output = cotouch(folder.path(), &words);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stdout(&output).contains(K11), "{}", stdout(&output));
        let written = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(written.starts_with(begins) && written.contains(K11), "{name}");
    }
}

#[test]
fn margins_are_where_the_verdict_turns() {
    let margins = answer(&["analyze", "margin", "single-axis"]);
    has_keys(&margins, &["delay_periods", "loss_rate", "gains[].key", "gains[].factor"]);
    let delay = margins["delay_periods"].as_f64().unwrap().floor();
    for (periods, stable) in [(delay, true), (delay + 1.0, false)] {
        let set = format!("link.delay_periods={periods}");
        assert_eq!(answer(&["analyze", "stability", "single-axis", "--set", &set])["stable"], stable);
    }
    let loss = margins["loss_rate"].as_f64().unwrap();
    assert_eq!(loss, 1.0);
    let centralized = answer(&["analyze", "margin", "single-axis-centralized"]);
    let loss = centralized["loss_rate"].as_f64().unwrap();
    assert!(loss > 0.1 && loss < 0.9, "{loss}");
    let gains = margins["gains"].as_array().unwrap();
    let of = |key: &str| gains.iter().find(|gain| gain["key"] == key).unwrap_or_else(|| panic!("{key}"));
    let factor = of(K12)["factor"].as_f64().unwrap();
    let scene = answer(&["scene", "show", "single-axis"]);
    let now = scene["coupling"]["remote_hand_object"]["stiffness_n_per_m"].as_f64().unwrap();
    for (by, stable) in [(0.9999 * factor, true), (1.0001 * factor, false)] {
        let set = format!("{K12}={}", by * now);
        assert_eq!(answer(&["analyze", "stability", "single-axis", "--set", &set])["stable"], stable);
    }
}

#[test]
fn damping_is_that_of_6_3() {
    let words = [
        "analyze",
        "damping",
        "single-axis",
        "--set",
        "rates.network_hz=512",
        "--set",
        "link.delay_periods=0",
    ];
    let damping = answer(&words);
    has_keys(&damping, &["damping_n_s_per_m", "simplified_damping_n_s_per_m"]);
    close(&damping["simplified_damping_n_s_per_m"], 0.148_321_46, 1e-7);
    // The same user by name, and both users alike.
    for user in ["1", "2", "anna", "ben"] {
        let again = answer(&[&words[..], &["--user", user]].concat());
        close(&again["damping_n_s_per_m"], damping["damping_n_s_per_m"].as_f64().unwrap(), 1e-9);
    }
}

#[test]
fn admittance_is_over_the_frequencies_that_were_asked_for() {
    let words = ["analyze", "admittance", "single-axis", "--frequencies", "0.001..100:6:log"];
    let admittance = answer(&words);
    has_keys(
        &admittance,
        &["frequency_rad_s[]", "users[].name", "users[].magnitude[]", "users[].phase_rad[]"],
    );
    assert_eq!(admittance["users"][0]["magnitude"].as_array().unwrap().len(), 6);
    // Towards frequency 0 only the damping is left.
    let damping = answer(&["analyze", "damping", "single-axis"]);
    let expected = 1.0 / damping["damping_n_s_per_m"].as_f64().unwrap();
    close(&admittance["users"][0]["magnitude"][0], expected, 1e-4);
}

#[test]
fn stiffness_is_that_of_6_4_corrected() {
    let stiffness = answer(&["analyze", "stiffness", "single-axis", "--set", "wall.stiffness_n_per_m=300"]);
    let (k11, k21, ko, kw) = (3000.0, 400.0, 300.0, 300.0);
    let k = k11 * (kw * kw + kw * (2.0 * ko + k21))
        / (k11 * k21 + k11 * ko + k11 * kw + k21 * ko + k21 * kw + 2.0 * ko * kw + kw * kw);
    close(&stiffness["users"][0]["stiffness_n_per_m"], k, 1e-9);
    assert_eq!(stiffness["users"][1]["name"], "ben");
}

#[test]
fn local_models_are_checked_stepped_and_chosen() {
    let check = |kh: &str, int: &str, returned: &str| {
        let words =
            ["local-model", "check", "--kh", kh, "--int", int, "--ko", "1", "--ratio", "50", "--json"];
        let output = cotouch(folder().path(), &[&words[..], &["--returned-force", returned]].concat());
        (output.status.code(), json(&output))
    };
    let (status, document) = check("0.5", "0", "first");
    assert_eq!((status, &document["stable"]), (Some(0), &Value::Bool(true)));
    close(&document["spectral_radius"], 0.5, 1e-12);
    let (status, document) = check("1.01", "0", "last");
    assert_eq!((status, &document["stable"]), (Some(1), &Value::Bool(false)));
    // Inside the printed region, unstable with the force that Barbagli et al.'s algorithm returns.
    assert_eq!(check("1.5", "1.2", "first").0, Some(0));
    assert_eq!(check("1.5", "1.2", "mean").0, Some(1));

    let step = answer(&["local-model", "step", "--kh", "190", "--ko", "200", "--input", "0.025"]);
    has_keys(&step, &["time_s[]", "surface_m[]", "force_n[]", "settling_s.5%", "settling_s.2%", "overshoot"]);
    close(&step["settling_s"]["5%"], 2.95, 1e-9);
    close(&step["settling_s"]["2%"], 3.85, 1e-9);
    close(&step["overshoot"], 0.95, 1e-9);

    let choice = answer(&[
        "local-model",
        "choose",
        "--ko",
        "800",
        "--ko-error",
        "0.3",
        "--contacts",
        "4",
        "--correlation",
        "0.5",
    ]);
    has_keys(&choice, &["kh_n_per_m", "int_n_per_m", "spectral_radius", "worst_spectral_radius"]);
    let worst = choice["worst_spectral_radius"].as_f64().unwrap();
    assert!(worst < 1.0 && choice["int_n_per_m"].as_f64().unwrap() > 0.0, "{choice}");
}

#[test]
fn what_cannot_be_analysed_is_exit_status_2_and_says_what_can() {
    let folder = folder();
    let cases: [(&[&str], &str); 13] = [
        (&["analyze", "stability", "--sweep", "hand.mass_kg=-1..1:5"], "hand.mass_kg"),
        (&["analyze", "stability", "--sweep", "hand.mas_kg=0.1..1:5"], "hand.mas_kg"),
        (&["analyze", "stability", "--sweep", "hand.mass_kg=0.1..1:0"], "1 to"),
        (&["analyze", "stability", "--sweep", "hand.mass_kg=1..1:5"], "hand.mass_kg=1..1:5"),
        (&["analyze", "stability", "--out", "x.svg"], "x.svg"),
        (&["analyze", "margin", "--out", "x.csv"], "x.csv"),
        (&["analyze", "stability", "--sweep", "session.architecture=0..1:2"], "session.architecture"),
        (&["analyze", "damping", "single-axis", "--user", "3"], "2 (ben)"),
        (&["analyze", "damping", "single-axis", "--user", "zoe"], "anna"),
        (&["analyze", "admittance", "single-axis", "--frequencies", "0..10:5"], "positive"),
        (&["analyze", "margin", "nowhere"], "nowhere"),
        (&["local-model", "step", "--kh", "1", "--ko", "1", "--input", "1", "--fast-hz", "990"], "multiple"),
        (&["local-model", "check", "--kh", "1", "--int", "0", "--ko", "0"], "--ko"),
    ];
    for (words, named) in cases {
        let output = cotouch(folder.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{words:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{words:?}: {}", stdout(&output));
    }
}
