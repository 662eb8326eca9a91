use cotouch_scene::Scene;
use cotouch_scene::scene::{SceneValues, SpringDamper};

use super::find;
use super::random::Random;
use crate::compile::{ContactMode, compile_at};
use crate::operating_point::{OperatingPoint, Settled};
use crate::poles::judge;

const TEMPLATE: &str = r#"
space = "line"
[session]
architecture = "distributed"
users = 2
[rates]
control_hz = 1024
network_hz = "1024/N"
[link]
delay_periods = 0
[hand]
mass_kg = 0.1
damping_n_s_per_m = 5
stiffness_n_per_m = 0
finger_radius_m = 0.008
[object]
mass_kg = 0.4
shape = "box"
size_m = [0.1, 0.1, 0.1]
[wall]
stiffness_n_per_m = 0
[[user]]
name = "anna"
script = [ { do = "force", force_n = [1,0,0], duration_s = 60 } ]
[[user.finger]]
position_m = [-0.07, 0, 0]
[[user]]
name = "ben"
script = [ { do = "force", force_n = [-1,0,0], duration_s = 60 } ]
[[user.finger]]
position_m = [0.07, 0, 0]
"#;

fn scene(ratio: u32) -> Scene {
    let text = TEMPLATE.replace("1024/N", &format!("1024/{ratio}"));
    cotouch_scene::parse(&text, "a line", None, &[]).expect("a scene")
}

fn candidates(scene: &SceneValues) -> (OperatingPoint, OperatingPoint) {
    let settled = Settled::of(scene);
    let all: Vec<usize> = (0..settled.grips.len()).collect();
    let leans: Vec<usize> = (0..settled.leans.len()).collect();
    (settled.point(scene, &[], &settled.always()), settled.point(scene, &all, &leans))
}

/// Every set of contacts of single copies.
fn modes_of_copies(scene: &SceneValues) -> Vec<ContactMode> {
    let (point, candidates) = candidates(scene);
    let contacts = candidates.fingers.len();
    (0..1usize << contacts).map(|set| {
        let mut point = point.clone();
        let here = (0..contacts).filter(|contact| set >> contact & 1 == 1);
        point.fingers = here.map(|contact| candidates.fingers[contact]).collect();
        ContactMode { contacts: vec![format!("{set:04b}")], settled: false, spec: compile_at(scene, &point) }
    }).collect()
}

fn is_consistent(mode: &ContactMode) -> bool {
    ["0000", "0101", "1010", "1111"].contains(&mode.contacts[0].as_str())
}

type Scale = fn(&mut SceneValues, f64);

fn springs(scene: &mut SceneValues, factor: f64) {
    contact_springs(scene, factor);
    scene.coupling.object_object.stiffness_n_per_m *= factor;
}

fn contact_springs(scene: &mut SceneValues, factor: f64) {
    scene.coupling.hand_object.stiffness_n_per_m *= factor;
    scene.coupling.remote_hand_object.stiffness_n_per_m *= factor;
}

fn contact_gains(scene: &mut SceneValues, factor: f64) {
    contact_springs(scene, factor);
    scene.coupling.hand_object.damping_n_s_per_m *= factor;
    scene.coupling.remote_hand_object.damping_n_s_per_m *= factor;
}

fn gains(scene: &mut SceneValues, factor: f64) {
    contact_gains(scene, factor);
    scene.coupling.object_object.stiffness_n_per_m *= factor;
    scene.coupling.object_object.damping_n_s_per_m *= factor;
}

/// The first factor, from a small one on, at which a mode is unstable.
fn limit(scene: &SceneValues, scale: Scale, all: bool, from: f64) -> f64 {
    let stable = |factor: f64| {
        let mut scaled = scene.clone();
        scale(&mut scaled, factor);
        modes_of_copies(&scaled).iter().filter(|mode| all || is_consistent(mode)).all(|mode| judge(&mode.spec, false).unwrap().stable)
    };
    let mut low = from;
    if !stable(low) { return 0.0; }
    let mut high = low;
    while stable(high) {
        low = high;
        high *= 1.15;
        if high > 20.0 { return 20.0; }
    }
    while high / low > 1.001 {
        let middle = (low * high).sqrt();
        if stable(middle) { low = middle } else { high = middle }
    }
    low
}

fn random_set(random: &mut Random) -> SceneValues {
    let ratio = [1, 2, 4, 8][random.below(4)];
    let mut log = |low: f64, high: f64| low * (high / low).powf(random.share());
    let mut values = SceneValues::clone(&scene(ratio));
    values.hand.mass_kg = log(0.03, 0.3);
    values.object.mass_kg = log(0.1, 1.0);
    values.hand.damping_n_s_per_m = log(0.5, 10.0);
    let mut spring = |k: [f64; 2], b: [f64; 2]| SpringDamper { stiffness_n_per_m: log(k[0], k[1]), damping_n_s_per_m: log(b[0], b[1]) };
    values.coupling.hand_object = spring([500.0, 10_000.0], [1.0, 40.0]);
    values.coupling.remote_hand_object = spring([100.0, 8000.0], [0.5, 20.0]);
    values.coupling.object_object = spring([100.0, 4000.0], [1.0, 20.0]);
    values.link.delay_periods = random.below(2) as u32;
    values
}

#[test]
#[ignore = "half an hour: the table"]
fn trial() {
    let sets: u64 = std::env::var("SETS").unwrap().parse().unwrap();
    for seed in 0..sets {
        let mut random = Random::new(0x1234 + seed);
        let set = random_set(&mut random);
        let top = limit(&set, springs, false, 0.01);
        if top <= 0.0 || top >= 20.0 { continue; }
        for share in [0.5, 0.7, 0.9] {
            let mut values = set.clone();
            springs(&mut values, share * top);
            let modes = modes_of_copies(&values);
            let radius = |consistent: bool| modes.iter().filter(|m| is_consistent(m) == consistent).map(|m| judge(&m.spec, false).unwrap().spectral_radius).fold(0.0, f64::max);
            let (a, b) = (radius(true), radius(false));
            let mut worst: Vec<_> = modes.iter().collect();
            worst.sort_by(|x, y| judge(&y.spec, false).unwrap().spectral_radius.total_cmp(&judge(&x.spec, false).unwrap().spectral_radius));
            worst.truncate(4);
            let (point, candidates) = candidates(&values);
            let start = std::time::Instant::now();
            let found = find(&values, (&point, &candidates), &worst, &|| true).unwrap();
            let time = start.elapsed().as_secs_f64();
            let d: Vec<f64> = [springs as Scale, contact_springs, contact_gains, gains].iter().map(|&scale| limit(&values, scale, true, 1.0)).collect();
            println!("T {seed} {share} {a:.5} {b:.5} d {d:.3?} {time:.2} {:?}", found.map(|f| (f.policy, f.rms_n, f.hz, f.moving, f.tried)));
        }
    }
}

#[test]
fn probe() {
    let path = std::env::var("SCENE").unwrap();
    let scene = cotouch_scene::load(&path, &[]).unwrap();
    let (point, candidates) = candidates(&scene);
    let modes = crate::compile::compile(&scene);
    let worst: Vec<_> = modes.iter().collect();
    let start = std::time::Instant::now();
    let found = find(&scene, (&point, &candidates), &worst, &|| true);
    println!("{found:?} {:?}", start.elapsed());
}
