//! The program from outside: exit statuses, what is said where, and the JSON that scripts rely on.

use crate::program::{cotouch, folder, has_keys, json, stderr, stdout};
use serde_json::Value;

#[test]
fn every_command_explains_itself() {
    let folder = folder();
    let commands: [&[&str]; 17] = [
        &[],
        &["run"],
        &["serve"],
        &["join"],
        &["probe"],
        &["probe", "serve"],
        &["replay"],
        &["analyze", "stability"],
        &["analyze", "margin"],
        &["analyze", "damping"],
        &["analyze", "admittance"],
        &["analyze", "stiffness"],
        &["local-model", "check"],
        &["local-model", "step"],
        &["local-model", "choose"],
        &["reproduce"],
        &["scene"],
    ];
    for command in commands {
        let output = cotouch(folder.path(), &[command, &["--help"]].concat());
        assert_eq!(output.status.code(), Some(0), "{command:?}");
        let text = stdout(&output);
        assert!(text.contains("--json") && text.contains("--set"), "{command:?}: {text}");
    }
    let run = stdout(&cotouch(folder.path(), &["run", "--help"]));
    for default in ["[default: 20]", "recordings/", "127.0.0.1:7700", "grasp"] {
        assert!(run.contains(default), "{default} is not in {run}");
    }
}

#[test]
fn bad_usage_is_exit_status_2_and_a_sentence_on_stderr() {
    let folder = folder();
    let cases: [(&[&str], &str); 7] = [
        (&["run", "--duration", "-1"], "duration"),
        (&["run", "nowhere.toml"], "nowhere.toml"),
        (&["run", "--set", "hand.mass_kg=-1"], "hand.mass_kg"),
        (&["analyze", "stability", "--set", "hand.mas_kg=1"], "hand.mas_kg"),
        (&["run", "--virtual", "--impair", "loss_rate=2"], "loss_rate"),
        (&["replay", "nothing.mcap"], "nothing.mcap"),
        (&["join", "nowhere"], "HOST:PORT"),
    ];
    for (words, named) in cases {
        let output = cotouch(folder.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(named), "{words:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{words:?}: {}", stdout(&output));
    }
}

#[test]
fn scenes_are_listed_shown_and_checked() {
    let folder = folder();
    let list = json(&cotouch(folder.path(), &["scene", "list", "--json"]));
    let names: Vec<&str> =
        list.as_array().unwrap().iter().map(|scene| scene["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"single-axis") && names.contains(&"single-axis-centralized"), "{names:?}");

    let words = ["scene", "show", "single-axis", "--set", "hand.mass_kg=0.25", "--out", "mine.toml"];
    assert_eq!(cotouch(folder.path(), &words).status.code(), Some(0));
    let check = cotouch(folder.path(), &["scene", "check", "mine.toml"]);
    assert_eq!(check.status.code(), Some(0), "{}", stderr(&check));
    let shown = json(&cotouch(folder.path(), &["scene", "show", "mine.toml", "--json"]));
    assert_eq!(shown["hand"]["mass_kg"], 0.25);
    assert!(json(&cotouch(folder.path(), &["scene", "schema"]))["properties"].is_object());
}

#[test]
fn a_wrong_scene_is_told_line_by_line() {
    let folder = folder();
    std::fs::write(folder.path().join("wrong.toml"), "[hand]\nmass_kg = -1\ncolour = \"red\"\n").unwrap();
    let check = cotouch(folder.path(), &["scene", "check", "wrong.toml"]);
    assert_eq!(check.status.code(), Some(2));
    let said = stderr(&check);
    assert!(
        said.contains("wrong.toml:2: hand.mass_kg") && said.contains("wrong.toml:3: hand.colour"),
        "{said}"
    );
    let check = cotouch(folder.path(), &["scene", "check", "wrong.toml", "--json"]);
    let document = json(&check);
    assert_eq!((check.status.code(), &document["valid"]), (Some(2), &Value::Bool(false)));
    assert_eq!(document["errors"].as_array().unwrap().len(), 2);
}

#[test]
fn stability_answers_0_whatever_the_verdict() {
    let folder = folder();
    let unstable = "coupling.remote_hand_object.stiffness_n_per_m=4000";
    let cases: [(&[&str], bool); 2] = [(&[], true), (&["--set", unstable], false)];
    for (set, stable) in cases {
        let output =
            cotouch(folder.path(), &[&["analyze", "stability", "single-axis", "--json"], set].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let document = json(&output);
        assert_eq!(document["stable"], stable);
        let keys = [
            "spectral_radius",
            "stable",
            "rigid_body_poles",
            "drag_pole",
            "states",
            "period_s",
            "modes[].contacts",
            "modes[].spectral_radius",
            "modes[].stable",
        ];
        has_keys(&document, &keys);
    }
}

#[test]
fn a_virtual_run_has_the_promised_shape_a_recording_and_a_picture() {
    let folder = folder();
    let words =
        ["run", "--virtual", "--duration", "2", "--record", "out/run.mcap", "--json", "--out", "run.json"];
    let output = cotouch(folder.path(), &words);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let document = json(&output);
    has_keys(&document, &RUN_KEYS);
    assert_eq!(
        (&document["haptic"]["due"], &document["haptic"]["missed"]),
        (&Value::from(2 * 2048), &Value::from(0))
    );
    assert_eq!(document["predicted"]["stable"], document["stable"]);
    assert_eq!(std::fs::read(folder.path().join("run.json")).unwrap(), output.stdout);
    let picture = std::fs::read_to_string(folder.path().join("out/run.svg")).unwrap();
    assert!(picture.contains("quiet, as predicted"));

    let replay = cotouch(folder.path(), &["replay", "out/run.mcap", "--csv", "tables", "--json"]);
    assert_eq!(replay.status.code(), Some(0), "{}", stderr(&replay));
    let document = json(&replay);
    // Forces fade out after the run's end, which takes ticks too.
    let ticks = document["ticks"].as_u64().unwrap();
    assert!(ticks > 2 * 2048 && document["identical"] == true, "{document}");
    let table = std::fs::read_to_string(folder.path().join("tables/host2.csv")).unwrap();
    assert_eq!(table.lines().count() as u64, 1 + ticks / 2);
}

#[test]
fn the_same_virtual_run_gives_the_same_bytes() {
    let folder = folder();
    for name in ["a.mcap", "b.mcap"] {
        let words = ["run", "--virtual", "--duration", "1", "--impair", "loss_rate=0.1", "--record", name];
        let output = cotouch(folder.path(), &words);
        assert!(output.status.code().is_some_and(|code| code < 2), "{}", stderr(&output));
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.mcap") == read("b.mcap"));
}

#[test]
fn an_unstable_run_was_predicted_and_is_exit_status_1() {
    let folder = folder();
    let set = "coupling.remote_hand_object.stiffness_n_per_m=4000";
    let output =
        cotouch(folder.path(), &["run", "single-axis", "--virtual", "--no-record", "--json", "--set", set]);
    let document = json(&output);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert_eq!(
        (&document["predicted"]["stable"], &document["stable"]),
        (&Value::Bool(false), &Value::Bool(false))
    );
    assert!(!folder.path().join("recordings").exists());
}

#[test]
fn a_real_run_on_loopback_has_the_same_shape() {
    let folder = folder();
    let output = cotouch(folder.path(), &["run", "--headless", "--duration", "1", "--json"]);
    let document = json(&output);
    has_keys(&document, &RUN_KEYS);
    let haptic = &document["haptic"];
    let count = |key: &str| haptic[key].as_u64().unwrap();
    assert_eq!(count("ticks") + count("missed"), count("due"));
    let recordings: Vec<_> = std::fs::read_dir(folder.path().join("recordings")).unwrap().collect();
    assert_eq!(recordings.len(), 2, "a recording and a picture: {recordings:?}");
}

const RUN_KEYS: [&str; 35] = [
    "scene",
    "architecture",
    "users",
    "duration_s",
    "stable",
    "verdict",
    "shaking",
    "predicted.stable",
    "predicted.spectral_radius",
    "haptic.hosts",
    "haptic.due",
    "haptic.ticks",
    "haptic.missed",
    "haptic.compute_us.p50",
    "haptic.compute_us.p99",
    "haptic.compute_us.p999",
    "haptic.compute_us.max",
    "haptic.lateness_us.p50",
    "haptic.lateness_us.p99",
    "haptic.lateness_us.p999",
    "haptic.lateness_us.max",
    "network.sent",
    "network.received",
    "network.lost",
    "network.round_trip_ms.mean",
    "network.round_trip_ms.rms_jitter",
    "objects[].name",
    "objects[].position_m.2",
    "objects[].orientation_wxyz.3",
    "users_detail[].name",
    "users_detail[].peak_force_n",
    "users_detail[].energy_j",
    "users_detail.1.name",
    "recording",
    "picture",
];

/// Starts the program with these words and interrupts it as soon as it listens to that.
#[cfg(target_os = "linux")]
fn interrupted(words: &[&str]) -> std::process::Output {
    use std::process::{Command, Stdio};

    let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
    let process = command.args(words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let id = process.id().to_string();
    // The second bit of the mask of signals that have a handler is SIGINT's.
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap().trim();
        u64::from_str_radix(mask, 16).unwrap() & 2 != 0
    };
    while !listens() {
        std::thread::yield_now();
    }
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    process.wait_with_output().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_is_heard_before_a_session_has_begun() {
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    for (words, before) in [
        (&["join", &free, "--headless", "--no-record"][..], "answered"),
        (&["run", "grasp", "--headless", "--no-record"], "the prediction was there"),
        (
            &["serve", "grasp", "--listen", "127.0.0.1:0", "--headless", "--no-record"],
            "the prediction was there",
        ),
        (&["run", "grasp", "--virtual", "--no-record"], "the prediction was there"),
    ] {
        let output = interrupted(words);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{words:?}: {said}");
        assert!(said.contains("interrupted before") && said.contains(before), "{words:?}: {said}");
    }
}
