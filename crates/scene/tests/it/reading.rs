//! What scenes become.

use std::fs;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Action, Architecture, DeviceKind, Impairment, SceneValues, ShapeKind, Space, SpringDamper,
};
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
        let left_out =
            SceneValues { users: written.users.clone(), name: name.into(), ..SceneValues::clone(&left_out) };
        assert_eq!(SceneValues { description: String::new(), ..SceneValues::clone(&written) }, left_out);
    }
}

#[test]
fn built_in_scenes_describe_themselves_and_take_as_many_users_as_have_room() {
    for name in builtin::names() {
        assert!(load(name, &[]).unwrap().description.ends_with('.'), "{name}");
        for users in 2..=16 {
            let set: Override = format!("session.users={users}").parse().unwrap();
            match load(name, &[set]) {
                Ok(scene) => assert_eq!(scene.users.len(), users),
                // Every other user of that scene has two fingers.
                Err(errors) => assert!(
                    name == "soft-block" && users > 10 && errors.to_string().contains("at most 16 fingers"),
                    "{name}: {errors}"
                ),
            }
        }
    }
}

#[test]
fn the_grasp_is_tables_8_1_and_8_2() {
    for name in ["grasp", "sinusoid", "push-wall", "grasp-centralized"] {
        let scene = load(name, &[]).unwrap();
        assert_eq!(scene.coupling.hand_object, gains(800.0, 3.0), "{name}");
        assert_eq!(scene.coupling.remote_hand_object, gains(800.0, 3.0), "{name}");
        assert_eq!(scene.coupling.hand_object_tangential, gains(1200.0, 10.0), "{name}");
        assert_eq!(scene.coupling.remote_hand_object_tangential, gains(1200.0, 10.0), "{name}");
        assert_eq!((scene.space, scene.device.kind), (Space::Plane, DeviceKind::Pantograph), "{name}");
        assert_eq!((scene.hand.mass_kg, scene.hand.damping_n_s_per_m, scene.object.mass_kg), (0.1, 5.0, 0.4));
        assert_eq!((scene.rates.control_hz.hz(), scene.rates.network_hz.hz()), (1024.0, 128.0));
        let ground = &scene.ground;
        let expected = if name == "sinusoid" { (0.0, 0.0) } else { (0.05, 0.15) };
        assert_eq!((ground.friction_coefficient, ground.rotational_friction_coefficient), expected, "{name}");
        assert_eq!((scene.contact.static_friction, scene.contact.dynamic_friction), (0.6, 0.6));
        let distributed = scene.session.architecture == Architecture::Distributed;
        assert_eq!(distributed, name != "grasp-centralized");
        if distributed {
            assert_eq!(scene.coupling.object_object, gains(400.0, 8.0), "{name}");
            let turning = scene.coupling.object_object_rotational;
            assert_eq!((turning.stiffness_n_m_per_rad, turning.damping_n_m_s_per_rad), (10.0, 0.1));
        }
    }
    let [grasp, central] = ["grasp", "grasp-centralized"].map(|name| load(name, &[]).unwrap());
    assert_eq!((grasp.users.len(), grasp.users[1].fingers.len(), grasp.walls().len()), (2, 2, 4));
    assert_eq!(central.users, grasp.users);
    let wall = load("push-wall", &[]).unwrap().wall.clone();
    assert_eq!((wall.stiffness_n_per_m, wall.damping_n_s_per_m), (4000.0, 30.0));
    assert_eq!((wall.tangential_stiffness_n_per_m, wall.tangential_damping_n_s_per_m), (7000.0, 50.0));
}

/// No finger, body or wall of a built-in scene starts inside another (bodies stand at right angles).
#[test]
fn built_in_scenes_start_apart() {
    for name in builtin::names() {
        let scene = load(name, &[]).unwrap();
        let bodies = scene.world_bodies();
        for body in bodies.iter().filter(|body| body.shape.kind == ShapeKind::Box) {
            let half = body.shape.size_m / 2.0;
            for finger in scene.users.iter().flat_map(|user| &user.fingers) {
                let outside = ((finger.position_m - body.position_m).abs() - half).max(DVec3::ZERO);
                assert!(outside.length() >= scene.hand.finger_radius_m - 1e-9, "{name}: {}", body.name);
            }
            for wall in scene.walls() {
                let normal = wall.normal.normalize();
                let reach = normal.abs().dot(half);
                assert!(
                    (body.position_m - wall.point_m).dot(normal) >= reach - 1e-9,
                    "{name}: {}",
                    body.name
                );
            }
            for other in bodies.iter().filter(|other| other.name != body.name) {
                let apart = (body.position_m - other.position_m).abs() - half - other.shape.size_m / 2.0;
                assert!(apart.max_element() >= -1e-9, "{name}: {}, {}", body.name, other.name);
            }
        }
    }
}

#[test]
fn bodies_fingers_and_walls_are_read() {
    let scene = read(
        r#"
space = "space"
gravity_m_per_s2 = [0, 0, -9.81]
[wall]
stiffness_n_per_m = 100
[[wall.plane]]
point_m = [0, 0, -1]
normal = [0, 0, 2]
[[body]]
shape = "ball"
radius_m = 0.1
[[body]]
name = "post"
fixed = true
shape = "capsule"
radius_m = 0.1
length_m = 1
position_m = [0, 1, 0]
rotation_rad = [1.5, 0, 0]
[[user]]
tracking.stiffness_n_per_m = 10
script = [{ do = "grasp", body = "body1", force_n = 2, duration_s = 3 }, { do = "let-go", duration_s = 1 }]
[[user.finger]]
position_m = [0, 0.2, 0]
[[user.finger]]
script = [{ do = "wait-until", until_s = 5 }]
"#,
    );
    assert_eq!((scene.space, scene.gravity_m_per_s2), (Space::Space, DVec3::new(0.0, 0.0, -9.81)));
    let names: Vec<String> = scene.world_bodies().into_iter().map(|body| body.name).collect();
    assert_eq!(names, ["body1", "post"]);
    assert!(scene.bodies[1].fixed && !scene.bodies[0].fixed);
    let walls = scene.walls();
    assert_eq!((walls.len(), walls[0].name.as_str(), walls[0].normal), (1, "wall1", DVec3::Z * 2.0));
    assert_eq!(scene.wall.tangential_stiffness_n_per_m, 100.0);
    let [one, two] = &scene.users[0].fingers[..] else { panic!() };
    assert_eq!((one.position_m, one.script.len()), (DVec3::Y * 0.2, 0));
    assert_eq!((two.position_m, &two.script[..]), (DVec3::ZERO, &[Action::WaitUntil { until_s: 5.0 }][..]));
    let [Action::Grasp { speed_m_per_s, .. }, Action::LetGo { distance_m, .. }] = scene.users[0].script[..]
    else {
        panic!()
    };
    assert_eq!((speed_m_per_s, distance_m), (0.05, 0.02));
    // A user without tables takes the first one's, fingers and all.
    assert_eq!(scene.users[1].fingers, scene.users[0].fingers);
}

#[test]
fn what_is_left_out_follows_what_is_written() {
    let scene = read(
        "[coupling]\nhand_object.stiffness_n_per_m = 7\n[contact]\nstatic_friction = 0.3\nbody_body.damping_n_s_per_m = 1",
    );
    assert_eq!(scene.coupling.hand_object_tangential, gains(7.0, 20.0));
    assert_eq!(scene.contact.dynamic_friction, 0.3);
    assert_eq!(scene.contact.body_body_tangential, gains(5000.0, 1.0));
    assert!(scene.contact.moment_cancellation);
    let changed = with_override(&scene, "coupling.hand_object.stiffness_n_per_m", 8.0).unwrap();
    assert_eq!(changed.coupling.hand_object_tangential.stiffness_n_per_m, 8.0);
    let changed = with_override(&changed, "coupling.hand_object_tangential.stiffness_n_per_m", 9.0).unwrap();
    let changed = with_override(&changed, "coupling.hand_object.stiffness_n_per_m", 1.0).unwrap();
    assert_eq!(changed.coupling.hand_object_tangential.stiffness_n_per_m, 9.0);
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
        "hand.mass_kg=NaN: hand.mass_kg is NaN; it must be a number from 0.0001 to 1000 (kg)"
    );
    assert!(error("hand.mas_kg", 1.0).ends_with("did you mean hand.mass_kg?"));
    assert!(error("rates.network_hz", 2048.0).contains("at most rates.control_hz (1024 Hz)"));
    assert!(error("link.delay_periods", 1.5).contains("a whole number from 0 to 64"));
    assert!(error("session.architecture", 1.0).contains("\"centralized\" or \"distributed\""));
}

#[test]
fn an_edit_is_checked_as_a_whole() {
    let scene = load("single-axis", &[]).unwrap();
    let told = |change: fn(&mut SceneValues)| scene.edit(change).unwrap_err().to_string();
    insta::assert_snapshot!(
        [
            told(|scene| (scene.hand.mass_kg, scene.rates.network_hz) = (-0.1, "0.5".parse().unwrap())),
            told(|scene| scene.rates.network_hz = "2000".parse().unwrap()),
            told(|scene| scene.users.truncate(1)),
            told(|scene| scene.users[1].fingers.clear()),
            told(|scene| scene.users[1].name = scene.users[0].name.clone()),
            told(|scene| scene.users[0].script = vec![Action::Hold { duration_s: f64::NAN }]),
            told(|scene| scene.link.impairment.loss_burst_packets = 0.0),
        ]
        .join("\n")
    );
    let edited = scene.edit(|scene| scene.object.position_m = DVec3::new(-0.0, 1.0, 0.0)).unwrap();
    assert!(edited.object.position_m.x.is_sign_positive());
    assert_eq!(parse(&to_toml(&edited), "single-axis", None, &[]).unwrap(), edited);
}

#[test]
fn the_hash_is_of_what_hosts_must_agree_on() {
    let scene = load("single-axis", &[]).unwrap();
    let rename = |scene: &mut SceneValues| (scene.name, scene.description) = ("other".into(), "same".into());
    let renamed = scene.edit(rename).unwrap();
    assert_eq!(scene_hash(&scene), scene_hash(&renamed));
    let mut seen = vec![scene_hash(&scene)];
    for (key, number) in [("hand.mass_kg", 0.11), ("session.seed", 2.0), ("link.impairment.latency_s", 0.1)] {
        let hash = scene_hash(&with_override(&scene, key, number).unwrap());
        assert!(!seen.contains(&hash), "{key}");
        seen.push(hash);
    }
    // By this, hosts with different versions of this program know each other: it changes with every new key.
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
