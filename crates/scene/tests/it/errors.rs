//! What a wrong scene is told: every message names the place, the key, what was found and what is allowed.

use std::fs;

use cotouch_scene::{Override, load, parse, parse_bytes};

/// The messages for a text and overrides, after the text itself.
fn told(text: &str, overrides: &[&str]) -> String {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    match parse(text, "lab.toml", None, &overrides) {
        Ok(_) => "fine".to_owned(),
        Err(errors) => errors.to_string(),
    }
}

#[test]
fn wrong_values() {
    insta::assert_snapshot!(told(
        r#"
name = "an\u0007gry"
[session]
architecture = "centralised"
users = 17
seed = -1
[rates]
control_hz = "fast"
network_hz = 0.5
[link]
delay_periods = 1.5
[hand]
mass_kg = -0.1
damping_n_s_per_m = nan
stiffness_n_per_m = inf
[object]
mass_kg = "heavy"
damping_n_s_per_m = 1979-05-27
[coupling]
hand_object = 3
remote_hand_object = { stiffness_n_per_m = true, damping_n_s_per_m = [1, 2] }
[wall]
sides = 2
position_m = 99999999999999999999999
[governor]
max_force_n = { most = 3 }
"#,
        &[]
    ));
}

#[test]
fn unknown_keys() {
    insta::assert_snapshot!(told(
        r#"
mass_kg = 1
colour = "red"
[hnad]
mass_kg = 0.1
[hand]
mass = 0.1
[hand.arm]
[session]
archtecture = "distributed"
weather = "fine"
[link.impairment]
los_rate = 0.1
[[link.way]]
from = 1
to = 2
latncy_s = 0.1
[[user]]
scirpt = []
[[user]]
script = [{ do = "force", force_n = 1, duration = 2 }]
[nothing]
"#,
        &["hand.mas_kg=1", "user.3.name=eve", "rates.control_hz.exact=1"]
    ));
}

#[test]
fn values_that_do_not_go_together() {
    insta::assert_snapshot!(told(
        r#"
[session]
architecture = "centralized"
users = 2
[rates]
control_hz = 100
network_hz = 128
[link]
delay_periods = 1
return_delay_periods = 2
[link.impairment]
loss_rate = 0.9
loss_burst_packets = 2
[[link.way]]
from = 1
to = 3
[[link.way]]
from = 2
to = 2
[[link.way]]
from = 2
to = 1
[[link.way]]
from = 2
to = 1
[[user]]
name = "anna"
script = [{ do = "reach", to_m = 0.1, duration_s = 1 }]
[[user]]
name = "anna"
script = [{ do = "push-and-let-go", force_n = [0, 1, 0], push_s = 2, duration_s = 1 }]
[[user]]
"#,
        &[]
    ));
}

#[test]
fn wrong_scripts() {
    insta::assert_snapshot!(told(
        r#"
[[user]]
script = [
  { do = "dance", duration_s = 1 },
  { force_n = 1, duration_s = 1 },
  { do = "force", duration_s = 0 },
  { do = "reach", to_m = [1, 2], duration_s = 1 },
  { do = "tremor", rms_n = [0, 2000, 0], duration_s = 1 },
  { do = "sinusoidal-force", amplitude_n = 1, frequency_hz = 0, phase_rad = "pi", duration_s = 1 },
  7,
]
[[link.way]]
from = 0
latency_s = 11
"#,
        &[]
    ));
    insta::assert_snapshot!(told("user = 3\n[link]\nway = [1]", &[]), @r#"
    lab.toml:1: user is 3; it must be a list of tables
    lab.toml:3: link.way.1 is 1; it must be a table
    "#);
}

#[test]
fn wrong_bodies_fingers_and_walls() {
    insta::assert_snapshot!(told(
        r#"
space = "volume"
gravity_m_per_s2 = [0, 0]
[device]
kind = "mouse"
encoder_counts_per_turn = -1
[object]
shape = "egg"
[contact]
moment_cancellation = 1
[[body]]
shape = "ball"
radius_m = -1
mas_kg = 1
[[wall.plane]]
normal = [0, 0, 1]
[[wall.plane]]
point_m = 0
normal = "up"
[[user]]
finger = [{ position_m = [0, 0, 99] }, { positon_m = 0 }, 3]
script = [
  { do = "grasp", force_n = 0, duration_s = 1 },
  { do = "wait-until" },
  { do = "turn", angle = 1, duration_s = 1 },
]
"#,
        &["body.2.mass_kg=1", "user.1.finger.2.script=7", "body.1.fixed=no"]
    ));
}

#[test]
fn bodies_that_do_not_go_together() {
    insta::assert_snapshot!(told(
        r#"
[device]
kind = "pantograph"
[contact]
static_friction = 0.3
dynamic_friction = 0.4
[wall]
dynamic_friction = 0.7
[[wall.plane]]
name = "ball"
point_m = 0
normal = 0
[[body]]
name = "ball"
shape = "ball"
[[body]]
shape = "capsule"
radius_m = 0.1
[[body]]
shape = "box"
size_m = [1, 0, 1]
fixed = true
[[body]]
name = "body2"
[[body]]
shape = "hull"
[[user]]
script = [
  { do = "grasp", body = "body3", force_n = 1, duration_s = 1 },
  { do = "grasp", body = "body2", force_n = 1, duration_s = 1 },
]
[[user]]
tracking.stiffness_n_per_m = 1
finger = [{}, { script = [{ do = "grasp", body = "object", force_n = 1, duration_s = 1 }] }, {}, {}, {}]
"#,
        &[]
    ));
    let bodies = |count: usize, rest: &str| {
        told(&format!("{}{rest}", "[[body]]\nshape = \"ball\"\nradius_m = 0.1\n".repeat(count)), &[])
    };
    assert_eq!(bodies(8, ""), "fine");
    assert_eq!(bodies(9, ""), "lab.toml:1: body is a list of 9; it must be a list of at most 8 tables");
    assert_eq!(bodies(8, "[[user]]\nfinger = [{}, {}]"), "fine");
    assert_eq!(
        bodies(8, "[[user]]\nfinger = [{}, {}, {}]"),
        "lab.toml:26: user.1.finger is a list of 3; it must be a list of at most 2 tables: fingers and bodies that are not \
         fixed (8) are at most 10"
    );
    assert_eq!(
        told(
            "[[body]]\nfixed = true\n[[user]]\ntracking.stiffness_n_per_m = 1\nscript = [{ do = \"grasp\", body = \"body1\", force_n = 1, duration_s = 1 }]",
            &[]
        ),
        "lab.toml:5: user.1.script.1.body is \"body1\"; it must be left out, because no body can be moved"
    );
    assert_eq!(
        told("[[wall.plane]]\nname = \"object\"\npoint_m = 0\nnormal = 1", &[]),
        "lab.toml:2: wall.plane.1.name is \"object\"; it must be another name than that of object"
    );
}

#[test]
fn overrides_are_named_as_written() {
    insta::assert_snapshot!(told(
        "[rates]\nnetwork_hz = 128\n",
        &[
            "rates.control_hz=1024/10",
            "hand.mass_kg=abc",
            "session.architecture=star",
            "hand=3",
            "wall.position_m=inf"
        ]
    ));
}

#[test]
fn what_is_no_override() {
    for text in ["hand.mass_kg", "=3", "hand..mass_kg=3", "hand.mass_kg=", ".=1", "hand mass=3"] {
        let error = text.parse::<Override>().unwrap_err().to_string();
        assert_eq!(
            error,
            format!("\"{text}\" is not an override; it must be KEY=VALUE, such as hand.mass_kg=0.2")
        );
    }
}

#[test]
fn a_conflict_is_blamed_on_the_override() {
    assert_eq!(
        told("[rates]\nnetwork_hz = 128\n", &["rates.control_hz=100"]),
        "--set rates.control_hz=100: rates.network_hz is 128 Hz; it must be at most rates.control_hz (100 Hz), and in a \
         ratio to it that repeats within a million ticks"
    );
}

#[test]
fn a_wrong_key_has_no_conflicts_besides() {
    assert_eq!(told("[rates]\ncontrol_hz = 0\nnetwork_hz = 5000\n", &[]).lines().count(), 1);
}

#[test]
fn what_is_no_toml() {
    insta::assert_snapshot!(told("[hand]\nmass_kg = 0.1\nmass_kg = 0.2\n\n[object\nmass_kg 3\n", &[]));
    assert!(told(&format!("{}1", "a.".repeat(100_000)), &[]).contains("not TOML"));
    assert!(told(&"[".repeat(100_000), &[]).contains("not TOML"));
}

#[test]
fn what_is_no_text() {
    let errors = parse_bytes(b"[hand]\nmass_kg = \xff", "lab.toml", None, &[]).unwrap_err();
    assert_eq!(errors.to_string(), "lab.toml:2: byte 17 is 0xff; the text must be UTF-8");
    let long = " ".repeat((1 << 20) + 1);
    assert_eq!(told(&long, &[]), "lab.toml: this is longer than 1048576 bytes, the most that is allowed");
    assert_eq!(told(&long[1..], &[]), "fine");
}

#[test]
fn what_is_no_scene() {
    let message = load("singel-axis", &[]).unwrap_err().to_string();
    assert!(message.starts_with("singel-axis: there is no such file"), "{message}");
    assert!(message.ends_with("did you mean single-axis?"), "{message}");
    let message = load("no/such/lab.toml", &[]).unwrap_err().to_string();
    assert!(message.starts_with("no/such/lab.toml: this cannot be read"), "{message}");
    // As any pipe or device, which could be read without end.
    let message = load("/", &[]).unwrap_err().to_string();
    assert!(message.starts_with("/: this cannot be read (it is not a regular file)"), "{message}");
}

#[test]
fn a_link_file_is_checked_too() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("lab.toml", "[link]\ninclude = \"lab.link.toml\"\n");
    write("lab.link.toml", "[measured]\nsent = 3\n[impairment]\nlatency_s = -1\nlatncy_s = 2\n");
    let errors = load(folder.path().join("lab.toml").to_str().unwrap(), &[]).unwrap_err();
    let message = errors.to_string().replace(folder.path().to_str().unwrap(), "");
    assert_eq!(
        message,
        "/lab.link.toml:5: impairment.latncy_s is not a scene key; did you mean impairment.latency_s?"
    );
    write("lab.link.toml", "[impairment]\nlatency_s = -1\n");
    let errors = load(folder.path().join("lab.toml").to_str().unwrap(), &[]).unwrap_err();
    let message = errors.to_string().replace(folder.path().to_str().unwrap(), "");
    assert_eq!(
        message,
        "/lab.link.toml:2: link.impairment.latency_s is -1; it must be a number from 0 to 10 (s)"
    );
    assert_eq!(
        told("[link]\ninclude = \"/etc/hostname\"\n", &[]),
        "lab.toml:2: link.include is \"/etc/hostname\"; it must be left out, because this scene is not in a file"
    );
}
