//! What scenes become.

use std::fs;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, Architecture, Impairment, SpringDamper};
use cotouch_scene::{Override, Scene, builtin, link_file, load, parse, scene_hash, to_toml, with_override};
use glam::DVec3;

fn read(text: &str) -> Scene {
    parse(text, "lab.toml", None, &[]).unwrap_or_else(|errors| panic!("{errors}"))
}

fn read_with(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    parse(text, "lab.toml", None, &overrides).unwrap_or_else(|errors| panic!("{errors}"))
}

fn gains(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
}

#[test]
fn built_in_scenes_are_table_6_1() {
    let scene = load("single-axis", &[]).unwrap();
    assert_eq!(scene.name, "single-axis");
    assert_eq!(scene.session.architecture, Architecture::Distributed);
    assert_eq!((scene.rates.control_hz.hz(), scene.rates.network_hz.hz()), (1024.0, 128.0));
    assert_eq!((scene.hand.mass_kg, scene.object.mass_kg, scene.link.delay_periods), (0.1, 0.4, 1));
    assert_eq!(scene.coupling.hand_object, gains(3000.0, 20.0));
    assert_eq!(scene.coupling.remote_hand_object, gains(400.0, 2.0));
    assert_eq!(scene.coupling.object_object, gains(300.0, 10.0));
    assert!(!scene.wall.exists());
    assert_eq!(scene.governor.max_slew_n_per_s, 20.0 * 1024.0);

    let scene = load("single-axis-centralized", &[]).unwrap();
    assert_eq!(scene.session.architecture, Architecture::Centralized);
    assert_eq!(scene.coupling.hand_object, gains(1000.0, 15.0));
    assert_eq!(scene.coupling.remote_hand_object, gains(85.0, 3.0));
}

/// What a built-in scene writes for reading is what it would have had anyway.
#[test]
fn built_in_scenes_write_the_defaults() {
    for (name, text) in
        [("single-axis", ""), ("single-axis-centralized", "session.architecture = \"centralized\"")]
    {
        let (written, left_out) = (load(name, &[]).unwrap(), read(text));
        let left_out = Scene { users: written.users.clone(), name: name.into(), ..left_out };
        assert_eq!(Scene { description: String::new(), ..written }, left_out);
    }
}

#[test]
fn built_in_scenes_describe_themselves_and_take_any_number_of_users() {
    for name in builtin::names() {
        assert!(builtin::description(name).is_some_and(|text| text.ends_with('.')), "{name}");
        for users in 2..=16 {
            let set: Override = format!("session.users={users}").parse().unwrap();
            assert_eq!(load(name, &[set]).unwrap_or_else(|errors| panic!("{errors}")).users.len(), users);
        }
    }
}

#[test]
fn defaults_follow_the_architecture_and_written_values_stay() {
    let scene = read("session.architecture = \"centralized\"");
    assert_eq!(scene.coupling.hand_object, gains(1000.0, 15.0));
    assert_eq!(read("").coupling.hand_object, gains(3000.0, 20.0));
    let set: Override = "session.architecture=centralized".parse().unwrap();
    assert_eq!(load("single-axis", &[set]).unwrap().coupling.hand_object, gains(3000.0, 20.0));
}

#[test]
fn rates_are_taken_exactly_from_their_text() {
    let scene = read("[rates]\ncontrol_hz = 1_000.1\nnetwork_hz = \"1024/10\"");
    assert_eq!(scene.rates.control_hz.to_string(), "10001/10");
    assert_eq!(scene.rates.network_hz.to_string(), "512/5");
    let scene = read_with("", &["rates.control_hz=+1e3", "rates.network_hz=1024/10"]);
    assert_eq!((scene.rates.control_hz.hz(), scene.rates.network_hz.hz()), (1000.0, 102.4));
    let scene = read_with("", &["rates.control_hz=0x400", "rates.network_hz=.5e2"]);
    assert_eq!((scene.rates.control_hz.hz(), scene.rates.network_hz.hz()), (1024.0, 50.0));
}

#[test]
fn overrides_win_over_the_text() {
    let scene = read_with(
        "[hand]\nmass_kg = 0.2\n[[user]]\nname = \"anna\"\n",
        &[
            "hand.mass_kg=0.3",
            "link.delay_periods=2",
            "coupling.hand_object.stiffness_n_per_m=5e3",
            "session.architecture=centralized",
            "user.1.name=eve",
            "description=as it comes",
            "wall.position_m=.5",
            "user.1.script=[{do=\"relax\", duration_s=1}]",
        ],
    );
    assert_eq!((scene.hand.mass_kg, scene.link.delay_periods), (0.3, 2));
    assert_eq!(scene.coupling.hand_object, gains(5000.0, 15.0));
    assert_eq!((scene.users[0].name.as_str(), scene.description.as_str()), ("eve", "as it comes"));
    assert_eq!(scene.wall.position_m, 0.5);
    assert_eq!(scene.users[0].script, [Action::Relax { duration_s: 1.0 }]);
    assert_eq!(read_with("", &["hand.mass_kg=1", "hand.mass_kg=2"]).hand.mass_kg, 2.0);
}

#[test]
fn users_beyond_the_tables_repeat_their_scripts_in_turn() {
    let text =
        "[[user]]\nname = \"anna\"\nscript = [{ do = \"force\", force_n = 1, duration_s = 1 }]\n[[user]]\n";
    let scene = read_with(text, &["session.users=4"]);
    let names: Vec<&str> = scene.users.iter().map(|user| user.name.as_str()).collect();
    assert_eq!(names, ["anna", "user2", "user3", "user4"]);
    assert_eq!(scene.users[2].script, scene.users[0].script);
    assert_eq!(scene.users[3].script, []);
    assert_eq!(read(text).session.users, 2);
    assert_eq!(read(&"[[user]]\n".repeat(5)).session.users, 5);
    assert_eq!(read_with(&"[[user]]\n".repeat(5), &["session.users=3"]).users.len(), 3);
}

#[test]
fn vectors_are_three_numbers_or_one_along_x() {
    let scene = read(
        "[[user]]\nscript = [{ do = \"force\", force_n = -2, duration_s = 1 }, \
         { do = \"tremor\", rms_n = [0, 1, 0.5], duration_s = 1 }]",
    );
    let [Action::Force { force_n, .. }, Action::Tremor { rms_n, .. }] = scene.users[0].script[..] else {
        panic!()
    };
    assert_eq!((force_n, rms_n), (DVec3::new(-2.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.5)));
}

#[test]
fn a_way_has_an_impairment_of_its_own() {
    let scene = read(
        "[link.impairment]\nlatency_s = 0.01\nloss_rate = 0.5\n[[link.way]]\nfrom = 2\nto = 1\njitter_s = 0.001\n",
    );
    assert_eq!(scene.link.impairment.loss_burst_packets, 2.0);
    let way = scene.impairment(HostIndex(1), HostIndex(0));
    assert_eq!(*way, Impairment { jitter_s: 0.001, ..Impairment::NONE });
    assert_eq!(scene.impairment(HostIndex(0), HostIndex(1)).latency_s, 0.01);
}

#[test]
fn a_link_file_fills_what_the_scene_leaves_out() {
    let folder = tempfile::tempdir().unwrap();
    let scene_file = folder.path().join("lab.toml");
    let link_file = folder.path().join("lab.link.toml");
    fs::write(&scene_file, "[link]\ninclude = \"lab.link.toml\"\nimpairment.jitter_s = 0.5\n").unwrap();
    fs::write(
        &link_file,
        "[measured]\nany = [1]\n[impairment]\nlatency_s = 0.01\njitter_s = 0.1\nloss_rate = 0.1\n",
    )
    .unwrap();
    let overrides = ["link.impairment.loss_rate=0.2".parse().unwrap()];
    let scene = load(scene_file.to_str().unwrap(), &overrides).unwrap();
    assert_eq!(scene.name, "lab");
    let impairment = &scene.link.impairment;
    assert_eq!((impairment.latency_s, impairment.jitter_s, impairment.loss_rate), (0.01, 0.5, 0.2));
    let set: Override = format!("link.include={}", link_file.display()).parse().unwrap();
    assert_eq!(load("single-axis", &[set]).unwrap().link.impairment.jitter_s, 0.1);
}

#[test]
fn a_written_link_file_can_be_included() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lab.link.toml");
    let impairment =
        Impairment { latency_s: 0.1 / 3.0, loss_rate: 0.01, loss_burst_packets: 3.5, ..Impairment::NONE };
    fs::write(&path, link_file(&impairment, &[("sent", 1e4), ("round_trip_mean_ms", f64::NAN)])).unwrap();
    let set: Override = format!("link.include={}", path.display()).parse().unwrap();
    assert_eq!(load("single-axis", &[set]).unwrap().link.impairment, impairment);
}

#[test]
fn numbers_can_be_read_and_changed_one_by_one() {
    let scene = load("single-axis", &[]).unwrap();
    assert_eq!(scene.number("rates.control_hz"), Some(1024.0));
    assert_eq!(scene.number("session.architecture"), None);
    assert_eq!(scene.number("no.such"), None);

    let changed = with_override(&scene, "coupling.object_object.stiffness_n_per_m", 77.5).unwrap();
    assert_eq!(changed.coupling.object_object.stiffness_n_per_m, 77.5);
    let changed = with_override(&scene, "governor.max_force_n", 5.0).unwrap();
    assert_eq!(changed.governor.max_slew_n_per_s, 5.0 * 1024.0);
    let changed = with_override(&scene, "link.impairment.loss_rate", 0.75).unwrap();
    assert_eq!(changed.link.impairment.loss_burst_packets, 4.0);
    let changed = with_override(&scene, "rates.network_hz", 102.4).unwrap();
    assert_eq!(changed.rates.network_hz.to_string(), "512/5");
    let changed = with_override(&scene, "session.users", 5.0).unwrap();
    let set: Override = "session.users=5".parse().unwrap();
    assert_eq!(changed, load("single-axis", &[set]).unwrap());

    let error = |key, number| with_override(&scene, key, number).unwrap_err().to_string();
    assert_eq!(
        error("hand.mass_kg", f64::NAN),
        "--set hand.mass_kg=NaN: hand.mass_kg is NaN; it must be a number from 0.0001 to 1000 (kg)"
    );
    assert!(error("hand.mas_kg", 1.0).ends_with("did you mean hand.mass_kg?"));
    assert!(error("rates.network_hz", 2048.0).contains("at most rates.control_hz (1024 Hz)"));
    assert!(error("link.delay_periods", 1.5).contains("a whole number from 0 to 64"));
    assert!(error("session.architecture", 1.0).contains("\"centralized\" or \"distributed\""));
}

#[test]
fn the_hash_is_of_what_hosts_must_agree_on() {
    let scene = load("single-axis", &[]).unwrap();
    let renamed = Scene { name: "other".into(), description: "same".into(), ..scene.clone() };
    assert_eq!(scene_hash(&scene), scene_hash(&renamed));
    let mut seen = vec![scene_hash(&scene)];
    for (key, number) in [("hand.mass_kg", 0.11), ("session.seed", 2.0), ("link.impairment.latency_s", 0.1)] {
        let hash = scene_hash(&with_override(&scene, key, number).unwrap());
        assert!(!seen.contains(&hash), "{key}");
        seen.push(hash);
    }
    // Hosts with different versions of this program compare hashes: a change here needs a new protocol version.
    insta::assert_snapshot!(format!("{:016x}", seen[0]));
}

#[test]
fn a_scene_is_written_for_reading() {
    insta::assert_snapshot!(to_toml(&load("single-axis", &[]).unwrap()));
}

#[test]
fn schema_and_reference() {
    insta::assert_json_snapshot!(cotouch_scene::json_schema());
    insta::assert_snapshot!(cotouch_scene::reference::markdown());
}
