//! The lesson's controls: which settings of a scene can be moved, how far, and what they are in plain words.

use cotouch_scene::builtin;
use cotouch_scene::scene::{
    Architecture, LocalModelKind, ReturnedForce, ShapeKind, SoftMeshKind, SurfaceHold,
};
use cotouch_scene::{Scene, Value};

use crate::control::Control;
use crate::setting::{Setting, Settings, shortened};
use crate::settings::{ARCHITECTURE, Chosen, SCENE, architecture, family_of};

/// Key, label, unit, help.
type Words = (&'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
mod words {
    use super::{ARCHITECTURE, SCENE, Words};

    pub(super) const OF_SCENE: Words = (SCENE, "Scene", "", "What is held, and by whom.");
    pub(super) const OF_ARCHITECTURE: Words = (ARCHITECTURE, "Architecture", "", "Distributed: every computer keeps a copy of the objects; centralized: the first one computes for all. Each has couplings of its own, which are taken too.");
    pub(super) const USERS: Words = ("session.users", "Users", "", "How many people move the object, each on a host of their own.");
    pub(super) const DELAY: Words = ("link.delay_periods", "Delay", "network periods", "How long what is sent is kept before it is used, so that late packets still count; one way when distributed, there and back when centralized.");
    pub(super) const LATENCY: Words = ("link.impairment.latency_s", "Latency", "s", "How long every packet travels, one way.");
    pub(super) const JITTER: Words = ("link.impairment.jitter_s", "Jitter", "s", "How much longer packets travel by chance, in the mean.");
    pub(super) const LOSS: Words = ("link.impairment.loss_rate", "Loss", "", "The share of packets that never arrives.");
    pub(super) const NETWORK: Words = ("rates.network_hz", "Packet rate", "Hz", "How often every computer says where its hand and its objects are.");
    pub(super) const COMPENSATION: Words = ("object.damping_n_s_per_m", "Object damping", "N·s/m", "Damping of the object; a negative value compensates the drag that the network adds.");

    pub(super) const MODEL: Words = ("local_model.kind", "Local model", "", "What a hand meets between two results of the simulation. Hold: a force that stays until the next result. P: a spring. Pi: a spring and an integral, which feels as stiff as the object. Compliance: a spring to a surface that gives way as the object would.");
    /// In N/m, and in units of K_o.
    pub(super) const STIFFNESS: [Words; 2] = [
        ("local_model.stiffness_n_per_m", "Local model: stiffness K_h", "N/m", "The spring that a hand feels at once, at the haptic rate."),
        ("local_model.stiffness_ratio", "Local model: stiffness K_h", "K_o", "The spring that a hand feels at once, at the haptic rate, in units of the object's own stiffness where it is touched."),
    ];
    pub(super) const INTEGRAL: [Words; 2] = [
        ("local_model.integral_n_per_m", "Local model: integral INT", "N/m", "Of pi: how fast the force grows while the hand is inside, in one period of the simulation."),
        ("local_model.integral_ratio", "Local model: integral INT", "K_o", "Of pi: how fast the force grows while the hand is inside, in one period of the simulation, in units of the object's own stiffness."),
    ];
    pub(super) const RETURNED: Words = ("local_model.returned_force", "Force to the simulation", "", "Which force of a period the simulation is told: that of its first tick, the mean of all, or that of its last.");
    pub(super) const HOLD: Words = ("local_model.hold", "Surface between results", "", "Zero: the surface jumps to each result; first: it moves there evenly, and is one period late.");
    pub(super) const SIMULATION: Words = ("rates.simulation_hz", "Simulation rate", "Hz", "How often the soft object is simulated.");
    pub(super) const YOUNG: Words = ("soft.young_pa", "Young's modulus", "Pa", "How firm the material is; of a balloon, its skin.");
    pub(super) const SPRING: Words = ("soft.mesh.stiffness_n_per_m", "Spring stiffness K_o", "N/m", "The stiffness of the simulated spring.");

    pub(super) const BETWEEN_COPIES: [Words; 2] = [
        ("coupling.object_object.stiffness_n_per_m", "Copy to copy: stiffness", "N/m", "How firmly the copies of an object are held together."),
        ("coupling.object_object.damping_n_s_per_m", "Copy to copy: damping", "N·s/m", "How strongly the copies of an object brake each other."),
    ];
    pub(super) const HANDS: [Words; 4] = [
        ("coupling.hand_object.stiffness_n_per_m", "Hand to object: stiffness", "N/m", "How firmly a hand holds the object on its own computer; centralized: the server's hand."),
        ("coupling.hand_object.damping_n_s_per_m", "Hand to object: damping", "N·s/m", "The damping of that grip."),
        ("coupling.remote_hand_object.stiffness_n_per_m", "Distant hand to object: stiffness", "N/m", "How firmly a hand holds an object on another computer, over the network."),
        ("coupling.remote_hand_object.damping_n_s_per_m", "Distant hand to object: damping", "N·s/m", "The damping of that grip."),
    ];
    pub(super) const WALLS: [Words; 2] = [
        ("wall.stiffness_n_per_m", "Wall: stiffness", "N/m", "How hard the walls are."),
        ("wall.damping_n_s_per_m", "Wall: damping", "N·s/m", "How strongly the walls brake what pushes into them."),
    ];
}

/// How far a slider goes from the scene's own value, either way.
const SPAN: f64 = 20.0;
/// The end of a slider about 0: N/m and N·s/m.
const FROM_ZERO: (f64, f64) = (2000.0, 50.0);
/// Network rates that are offered are the haptic rate by these.
const DIVISORS: [u32; 6] = [2, 4, 8, 16, 32, 64];
/// Rates of the slow simulation that are offered are the haptic rate by these.
const SLOW_DIVISORS: [u32; 10] = [4, 8, 10, 16, 20, 25, 32, 40, 50, 64];
/// The end of the sliders of K_h and INT in units of K_o: well past what can be stable.
const MAX_RATIO: f64 = 2.5;
/// How many users a lesson has at most.
const MAX_USERS_OF_LESSON: u32 = 8;

/// The controls of the scene that is chosen, `scene`. Sliders are laid about the values of its own text, and reach the present
/// ones.
pub(crate) fn controls(chosen: &Chosen, scene: &Scene) -> Vec<Control> {
    let plain = chosen.plain();
    let own = plain.open().unwrap_or_else(|_| scene.clone());
    let mut controls = vec![choice(words::OF_SCENE, scenes(chosen.first()))];
    let architectures = architectures(&plain);
    if architectures.len() > 1 {
        controls.push(choice(words::OF_ARCHITECTURE, architectures));
    }
    if users_are_alike(scene) {
        controls.push(whole(words::USERS, 2, MAX_USERS_OF_LESSON));
    }
    if scene.soft.exists() {
        controls.extend(soft_controls(&own, scene));
    }
    if scene.session.users > 1 {
        controls.extend(network_controls(scene));
    }
    if !scene.soft.exists() {
        controls.extend(rigid_controls(&own, scene));
    }
    controls.into_iter().map(|control| reaching(control, scene)).collect()
}

fn network_controls(scene: &Scene) -> Vec<Control> {
    vec![
        whole(words::DELAY, 0, 8),
        number(words::LATENCY, 0.0, 0.2),
        number(words::JITTER, 0.0, 0.05),
        number(words::LOSS, 0.0, 0.5),
        choice(words::NETWORK, rates(scene, &DIVISORS)),
    ]
}

/// Of bodies that are held by couplings.
fn rigid_controls(own: &Scene, scene: &Scene) -> Vec<Control> {
    let mut controls = Vec::new();
    if scene.session.architecture == Architecture::Distributed {
        controls.extend(words::BETWEEN_COPIES.map(|words| about(words, own)));
    }
    controls.extend(words::HANDS.map(|words| about(words, own)));
    controls.push(number(words::COMPENSATION, -20.0, 20.0));
    if scene.wall.exists() {
        controls.extend(words::WALLS.map(|words| about(words, own)));
    }
    controls
}

/// Of a soft object and its local model. Gains are N/m where the scene gives them so, else shares of K_o.
fn soft_controls(own: &Scene, scene: &Scene) -> Vec<Control> {
    let gain = |[absolute, ratio]: [Words; 2]| match own.number(absolute.0) {
        Some(value) if value > 0.0 => about(absolute, own),
        _ => number(ratio, 0.0, MAX_RATIO),
    };
    let words_of = |words: Words, choices: &[&str]| {
        choice(words, choices.iter().map(|word| (*word).to_owned()).collect())
    };
    let firmness = if own.soft.mesh.generator == SoftMeshKind::Spring { words::SPRING } else { words::YOUNG };
    vec![
        Control { restarts: false, ..words_of(words::MODEL, LocalModelKind::WORDS) },
        gain(words::STIFFNESS),
        gain(words::INTEGRAL),
        words_of(words::RETURNED, ReturnedForce::WORDS),
        words_of(words::HOLD, SurfaceHold::WORDS),
        choice(words::SIMULATION, rates(scene, &SLOW_DIVISORS)),
        Control { restarts: true, ..about(firmness, own) },
    ]
}

/// What the controls are set to in `scene`.
pub(crate) fn values(controls: &[Control], chosen: &Chosen, scene: &Scene) -> Settings {
    let value = |control: &Control| -> Option<(String, Setting)> {
        let setting = match (control.key, scene.get(control.key)) {
            (SCENE, _) => Setting::Choice(chosen.family().to_owned()),
            (ARCHITECTURE, _) => Setting::Choice(architecture(scene).to_owned()),
            (_, Some(Value::Text(word))) => Setting::Choice(word),
            (_, Some(Value::Rate(rate))) => Setting::Choice(rate.to_string()),
            (_, Some(value)) => Setting::Number(value.number()?),
            (_, None) => return None,
        };
        Some((control.key.to_owned(), setting))
    };
    controls.iter().filter_map(value).collect()
}

/// Refuses, in words, what no control of the lesson could have said.
pub(crate) fn check(controls: &[Control], settings: &Settings) -> Result<(), String> {
    settings.iter().try_for_each(|(key, setting)| {
        let Some(control) = controls.iter().find(|control| control.key == key) else {
            return Err(format!("there is no control \"{}\" in this scene", shortened(key, 60)));
        };
        match setting {
            Setting::Choice(word) if control.choices.contains(word) => Ok(()),
            Setting::Choice(word) if !control.choices.is_empty() => Err(format!(
                "{key} is \"{}\"; it must be one of {}",
                shortened(word, 60),
                control.choices.join(", ")
            )),
            Setting::Number(number) if control.choices.is_empty() && control.reaches(*number) => Ok(()),
            Setting::Number(number) if !control.choices.is_empty() => {
                Err(format!("{key} is {number}; it must be one of {}", control.choices.join(", ")))
            }
            Setting::Number(number) => Err(format!(
                "{key} is {number}; it must be a number from {} to {}",
                control.low, control.high
            )),
            Setting::Choice(word) => Err(format!(
                "{key} is \"{}\"; it must be a number from {} to {}",
                shortened(word, 60),
                control.low,
                control.high
            )),
        }
    })
}

fn scenes(family: &str) -> Vec<String> {
    let mut names: Vec<String> =
        builtin::names().filter(|name| family_of(name) == *name).map(str::to_owned).collect();
    if !names.iter().any(|name| name == family) {
        names.insert(0, family.to_owned());
    }
    names
}

/// The architectures in which the scene can be had.
fn architectures(plain: &Chosen) -> Vec<String> {
    let can_be_had = |word: &&str| {
        let setting = Setting::Choice((*word).to_owned());
        plain.with(&Settings::from([(ARCHITECTURE.to_owned(), setting)])).open().is_ok()
    };
    ["distributed", "centralized"]
        .iter()
        .filter(|word| can_be_had(word))
        .map(|word| (*word).to_owned())
        .collect()
}

/// Hands that all hold one point can be any number.
fn users_are_alike(scene: &Scene) -> bool {
    !scene.soft.exists() && scene.world_bodies().iter().all(|body| body.shape.kind == ShapeKind::Point)
}

/// Whole parts of the haptic rate.
fn rates(scene: &Scene, divisors: &[u32]) -> Vec<String> {
    let control = scene.rates.control_hz;
    let by = |divisor: &u32| {
        let hz = control.hz() / f64::from(*divisor);
        (hz >= 8.0 && hz.fract() == 0.0).then(|| hz.to_string())
    };
    divisors.iter().filter_map(by).collect()
}

fn choice(words: Words, choices: Vec<String>) -> Control {
    Control { kind: "choice", choices, restarts: true, ..number(words, 0.0, 0.0) }
}

fn whole(words: Words, low: u32, high: u32) -> Control {
    Control { kind: "whole", restarts: true, ..number(words, f64::from(low), f64::from(high)) }
}

fn number((key, label, unit, help): Words, low: f64, high: f64) -> Control {
    Control {
        key,
        label,
        unit,
        help,
        kind: "number",
        low,
        high,
        log: false,
        choices: Vec::new(),
        restarts: false,
    }
}

/// A slider about the value in the scene `own`: over the logarithm where that is above 0.
fn about(words: Words, own: &Scene) -> Control {
    let value = own.number(words.0).unwrap_or(0.0);
    if value <= 0.0 {
        let high = if words.2 == "N/m" { FROM_ZERO.0 } else { FROM_ZERO.1 };
        return number(words, 0.0, high);
    }
    Control { log: true, ..number(words, round_figure(value / SPAN), round_figure(value * SPAN)) }
}

/// `number` with two leading digits.
fn round_figure(number: f64) -> f64 {
    let step = 10_f64.powf(number.log10().floor() - 1.0);
    // Whole tens of a decimal power below 1 are read back from text, so that no digit is left over.
    format!("{:.6}", (number / step).round() * step).parse().unwrap_or(number)
}

/// `control` with the present value within its reach.
fn reaching(control: Control, scene: &Scene) -> Control {
    match scene.get(control.key) {
        Some(Value::Rate(rate)) if !control.choices.contains(&rate.to_string()) => {
            let mut choices = control.choices;
            choices.push(rate.to_string());
            Control { choices, ..control }
        }
        Some(Value::Number(number)) => {
            // A logarithm has no zero.
            let log = control.log && number > 0.0;
            Control { low: control.low.min(number), high: control.high.max(number), log, ..control }
        }
        Some(Value::Count(count)) => Control { high: control.high.max(count as f64), ..control },
        _ => control,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::settings::Base;

    fn chosen(scene: &str, settings: Settings) -> (Chosen, Scene, Vec<Control>) {
        let chosen = Chosen::new(Base { scene: scene.to_owned(), overrides: Vec::new() }, settings);
        let scene = chosen.open().unwrap();
        let controls = controls(&chosen, &scene);
        (chosen, scene, controls)
    }

    fn keys(controls: &[Control]) -> Vec<&'static str> {
        controls.iter().map(|control| control.key).collect()
    }

    #[test]
    fn every_built_in_scene_has_controls_whose_values_it_accepts() {
        for name in builtin::names() {
            let (chosen, scene, controls) = chosen(name, Settings::new());
            let values = values(&controls, &chosen, &scene);
            assert_eq!(values.len(), controls.len(), "{name}: {values:?}");
            assert_eq!(check(&controls, &values), Ok(()), "{name}");
            assert_eq!(chosen.with(&values).open().unwrap(), scene, "{name}");
        }
    }

    #[test]
    fn ends_of_sliders_are_scenes_too() {
        for name in ["single-axis", "single-axis-centralized", "grasp", "push-wall", "spring", "balloon"] {
            let (chosen, _, controls) = chosen(name, Settings::new());
            for control in controls.iter().filter(|control| control.choices.is_empty()) {
                for end in [control.low, control.high] {
                    let setting = Settings::from([(control.key.to_owned(), Setting::Number(end))]);
                    let opened = chosen.with(&setting).open();
                    assert!(opened.is_ok(), "{name}, {} = {end}: {opened:?}", control.key);
                }
            }
        }
    }

    #[test]
    fn controls_are_those_that_mean_something() {
        let (_, _, line) = chosen("single-axis", Settings::new());
        assert!(keys(&line).contains(&"session.users"));
        assert!(keys(&line).contains(&ARCHITECTURE));
        assert!(!keys(&line).contains(&"wall.stiffness_n_per_m"));
        let (_, _, central) = chosen("single-axis-centralized", Settings::new());
        assert!(!keys(&central).iter().any(|key| key.starts_with("coupling.object_object")));
        let (_, _, wall) = chosen("push-wall", Settings::new());
        assert!(keys(&wall).contains(&"wall.stiffness_n_per_m"));
        assert!(!keys(&wall).contains(&"session.users"));
    }

    #[test]
    fn controls_of_a_soft_object_are_those_of_its_local_model() {
        let (chosen, scene, block) = chosen("soft-block", Settings::new());
        let keys = keys(&block);
        for key in ["local_model.kind", "local_model.stiffness_ratio", "soft.young_pa", "rates.simulation_hz"]
        {
            assert!(keys.contains(&key), "{key} is missing in {keys:?}");
        }
        let rigid = ["coupling.", "object.", "wall.", "session.users"];
        assert!(!keys.iter().any(|key| rigid.iter().any(|other| key.starts_with(other))), "{keys:?}");
        let set = values(&block, &chosen, &scene);
        assert_eq!(set["local_model.kind"], Setting::Choice("p".to_owned()));
        assert_eq!(set["rates.simulation_hz"], Setting::Choice("60".to_owned()));
    }

    #[test]
    fn the_spring_of_one_user_has_gains_in_newtons_per_metre_and_no_network() {
        let (chosen, _, spring) = chosen("spring", Settings::new());
        let keys = keys(&spring);
        assert!(
            keys.contains(&"local_model.stiffness_n_per_m") && keys.contains(&"soft.mesh.stiffness_n_per_m")
        );
        assert!(!keys.iter().any(|key| key.starts_with("link.") || *key == "rates.network_hz"), "{keys:?}");
        for control in spring.iter().filter(|control| control.key.starts_with("local_model.")) {
            for word in &control.choices {
                let setting = Settings::from([(control.key.to_owned(), Setting::Choice(word.clone()))]);
                let opened = chosen.with(&setting).open();
                assert!(opened.is_ok(), "{} = {word}: {opened:?}", control.key);
            }
        }
    }

    #[test]
    fn sliders_stay_where_they_are_while_they_are_moved() {
        let key = "coupling.object_object.stiffness_n_per_m";
        let (_, _, before) = chosen("single-axis", Settings::new());
        let (_, _, after) =
            chosen("single-axis", Settings::from([(key.to_owned(), Setting::Number(1500.0))]));
        assert_eq!(before, after);
        let slider = before.iter().find(|control| control.key == key).unwrap();
        assert!(slider.log && (slider.low, slider.high) == (15.0, 6000.0), "{slider:?}");
    }

    proptest! {
        #[test]
        fn any_number_at_any_control_is_a_scene_or_words(which in 0_usize..40, number in any::<f64>()) {
            let (chosen, _, controls) = chosen("single-axis", Settings::new());
            let key = controls[which % controls.len()].key.to_owned();
            let settings = Settings::from([(key, Setting::Number(number))]);
            if check(&controls, &settings).is_ok() {
                let opened = chosen.with(&settings).open();
                prop_assert!(opened.is_ok() || number.fract() != 0.0, "{settings:?}: {opened:?}");
            }
        }
    }

    #[test]
    fn what_no_control_says_is_refused_in_words() {
        let (_, _, controls) = chosen("single-axis", Settings::new());
        let refused = |key: &str, setting| {
            check(&controls, &Settings::from([(key.to_owned(), setting)])).expect_err("this is not allowed")
        };
        assert!(refused("object.mesh", Setting::Choice("/etc/passwd".to_owned())).contains("no control"));
        assert!(refused(SCENE, Setting::Choice("/etc/passwd".to_owned())).contains("single-axis"));
        assert!(refused("session.users", Setting::Number(1e9)).contains("from 2 to 8"));
        assert!(
            refused("link.delay_periods", Setting::Choice("1".to_owned())).contains("number from 0 to 8")
        );
        assert!(refused("rates.network_hz", Setting::Number(128.0)).contains("one of"));
    }
}
