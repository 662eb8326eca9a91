//! `cotouch analyze damping`, `admittance` and `stiffness`: what users perceive of the object.

mod bode;

use std::fmt::Write as _;
use std::path::Path;

use cotouch_analysis::Grid;
use cotouch_analysis::transparency::{
    AddedDamping, Admittance, AdmittanceQuantity, EquivalentStiffness, TransparencyError, UserAdmittance,
    added_damping,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::{Override, Scene};

use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

use bode::Bode;

/// Frequencies that people are shown.
const MAX_ROWS: usize = 25;

/// Says what held data add to the damping that a user feels; `user` is a name, or a number from 1.
pub(super) fn damping(
    name: &str,
    user: &str,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let damping = added_damping(&scene, find_user(&scene, user)?)?;
    drop(progress);
    output.answer_as(&damping, &damping_text(&scene, &damping))?;
    Ok(Verdict::Good)
}

/// Says what users feel over frequency; a file that ends in `.svg` gets the figure.
pub(super) fn admittance(
    name: &str,
    frequencies: &Grid,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let admittance = cotouch_analysis::transparency::admittance(&scene, frequencies.values())?;
    drop(progress);
    let text = admittance_text(&scene, &admittance);
    if output.file.as_deref().is_some_and(is_svg) {
        let figure = Bode::of(&admittance).figure(&title(&scene))?;
        output.answer_and_file(&admittance, &text, &figure)?;
    } else {
        output.answer_as(&admittance, &text)?;
    }
    Ok(Verdict::Good)
}

/// Says what users feel at rest.
pub(super) fn stiffness(name: &str, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let progress = output.progress("analysing");
    let stiffness = cotouch_analysis::transparency::equivalent_stiffness(&scene)?;
    drop(progress);
    output.answer_as(&stiffness, &stiffness_text(&scene, &stiffness))?;
    Ok(Verdict::Good)
}

impl From<TransparencyError> for Failure {
    fn from(error: TransparencyError) -> Self {
        match error {
            TransparencyError::Analysis(_) => Self::Running(error.into()),
            TransparencyError::Frequency(_) | TransparencyError::User { .. } => Self::usage(error),
        }
    }
}

fn title(scene: &Scene) -> String {
    format!("{}: {}", scene.name, prediction::who_and_how(scene))
}

fn is_svg(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("svg"))
}

/// A name goes before a number, should a user be called "2".
fn find_user(scene: &Scene, wanted: &str) -> Result<HostIndex, Failure> {
    let by_name = scene.hosts().find(|host| scene.users[host.index()].name == wanted);
    let by_number = || {
        let number: u8 = wanted.parse().ok()?;
        scene.hosts().find(|host| host.0 + 1 == number)
    };
    by_name.or_else(by_number).ok_or_else(|| {
        let known: Vec<_> = scene
            .hosts()
            .map(|host| format!("{} ({})", host.0 + 1, scene.users[host.index()].name))
            .collect();
        Failure::usage(format!(
            "there is no user {wanted:?} in {}; there are {}",
            scene.name,
            known.join(", ")
        ))
    })
}

fn damping_text(scene: &Scene, damping: &AddedDamping) -> String {
    let what =
        if scene.soft.exists() { "presses the soft object" } else { "moves the object in free motion" };
    let mut text = format!("{}\n{} {what}, the others are absent\n\n", title(scene), damping.user);
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22} {value}");
    };
    let viscous =
        |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |value| format!("{value:.6} N·s/m"));
    row(
        "added damping",
        format!(
            "{} (force over velocity at network instants){}",
            viscous(damping.damping_n_s_per_m),
            unstable_alone(damping.stable)
        ),
    );
    row("by the mean velocity", viscous(damping.mean_damping_n_s_per_m));
    if damping.dampers_of_scene_n_s_per_m != 0.0 {
        let value = damping.dampers_of_scene_n_s_per_m;
        row("  in it", format!("{value:.6} N·s/m of dampers that the scene has (hand, governor, object)"));
    }
    row(
        "simplified model",
        format!(
            "{} (no hands, the force acts on every copy){}",
            viscous(damping.simplified_damping_n_s_per_m),
            unstable_alone(damping.simplified_stable != Some(false))
        ),
    );
    row("drag pole", pole(damping.drag_pole));
    if damping.session_stable == Some(false) {
        row("session", "unstable in free motion with all hands on the object".to_owned());
    }
    if let Some(compensation) = damping.compensation_n_s_per_m.filter(|&value| value != 0.0) {
        row("compensated by", format!("object.damping_n_s_per_m={compensation:.6}"));
        row("  added damping", viscous(damping.damping_if_compensated_n_s_per_m));
        row("  drag pole", pole(damping.drag_pole_if_compensated));
        let word = |stable| if stable { "stable" } else { "unstable" };
        row("  session", damping.stable_if_compensated.map_or("unknown", word).to_owned());
    }
    for about in &damping.turning {
        let [x, y, z] = about.axis;
        let turning = |value: Option<f64>| {
            value.map_or_else(|| "none".to_owned(), |value| format!("{value:.6} N·m·s/rad"))
        };
        row(
            &format!("turn ({x:.0}, {y:.0}, {z:.0})"),
            format!(
                "{} for {:.6} kg·m² (simplified model); drag pole {}",
                turning(about.simplified_damping_n_m_s_per_rad),
                about.inertia_kg_m2,
                pole(about.drag_pole)
            ),
        );
        if let Some(compensation) = about.compensation_n_m_s_per_rad.filter(|&value| value != 0.0) {
            row("  compensated by", format!("object.rotational_damping_n_m_s_per_rad={compensation:.6}"));
            row("  drag pole", pole(about.drag_pole_if_compensated));
        }
    }
    notes(&mut text, &damping.notes);
    text
}

fn pole(pole: Option<f64>) -> String {
    let words = |pole| if pole > 1.0 { " (the drift of the whole grows)" } else { "" };
    pole.map_or_else(|| "none".to_owned(), |pole| format!("{}{}", prediction::radius(pole), words(pole)))
}

/// What follows the answer of a user whose loop never comes to it.
fn unstable_alone(stable: bool) -> &'static str {
    if stable { "" } else { " (unstable alone: never settles into this)" }
}

fn stiffness_text(scene: &Scene, stiffness: &EquivalentStiffness) -> String {
    let mut text = format!("{}\nforce over displacement at rest, the others absent\n\n", title(scene));
    for user in &stiffness.users {
        let value = match user.stiffness_n_per_m {
            0.0 => "0 N/m (nothing resists)".to_owned(),
            value => format!("{value:.3} N/m"),
        };
        let _ = writeln!(text, "{:<22} {value}{}", user.name, unstable_alone(user.stable));
    }
    let mut ideal = |name: &str, value: f64, alone: &str| {
        let _ = writeln!(text, "{name:<22} {value:.3} N/m ({alone} alone)");
    };
    if scene.soft.exists() {
        for user in &stiffness.users {
            ideal(&format!("ideal, {}", user.name), user.ideal_n_per_m, "object and hand");
        }
    } else {
        ideal("ideal", stiffness.ideal_n_per_m, "wall and hand");
    }
    notes(&mut text, &stiffness.notes);
    text
}

fn admittance_text(scene: &Scene, admittance: &Admittance) -> String {
    let (what, unit) = match admittance.quantity {
        AdmittanceQuantity::Velocity => ("velocity over force in free motion", "m/s/N"),
        AdmittanceQuantity::Position if scene.soft.exists() => {
            ("position over force on the soft object", "m/N")
        }
        AdmittanceQuantity::Position => ("position over force against the wall", "m/N"),
    };
    let mut text = format!("{}\n{what}, each user with the others absent\n", title(scene));
    for user in &admittance.users {
        user_text(&mut text, user, admittance, unit);
    }
    let limit = admittance.slow_rate_limit_rad_s;
    if admittance.frequency_rad_s.iter().any(|&frequency| frequency > limit) {
        let _ = writeln!(
            text,
            "note: beyond {limit:.1} rad/s (half the network rate) the slow-rate response repeats itself; the fundamental \
             does not."
        );
    }
    notes(&mut text, &admittance.notes);
    text
}

fn user_text(text: &mut String, user: &UserAdmittance, admittance: &Admittance, unit: &str) {
    let stable = unstable_alone(user.stable);
    let _ = writeln!(text, "\n{}{stable}", user.name);
    let columns =
        ["rad/s", &format!("slow-rate, {unit}"), "phase", &format!("fundamental, {unit}"), "phase", "ideal"];
    let [frequency, slow_rate, slow_phase, fundamental, phase, ideal] = columns;
    let _ = writeln!(
        text,
        "{frequency:>12} {slow_rate:>18} {slow_phase:>8} {fundamental:>20} {phase:>8} {ideal:>12}"
    );
    let count = admittance.frequency_rad_s.len();
    let every = count.div_ceil(MAX_ROWS).max(1);
    for index in (0..count).step_by(every) {
        let _ = writeln!(
            text,
            "{:>12.5} {:>18.6e} {:>7.1}° {:>20.6e} {:>7.1}° {:>12.4e}",
            admittance.frequency_rad_s[index],
            user.magnitude[index],
            user.phase_rad[index].to_degrees(),
            user.fundamental_magnitude[index],
            user.fundamental_phase_rad[index].to_degrees(),
            user.ideal.magnitude[index],
        );
    }
    if every > 1 {
        let _ = writeln!(text, "{:>12} every {every}th of {count} frequencies; --json has all of them", "");
    }
}

fn notes(text: &mut String, notes: &[String]) {
    for note in notes {
        let _ = writeln!(text, "note: {note}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn users_have_names_and_numbers() {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        assert_eq!(find_user(&scene, "2").unwrap(), HostIndex(1));
        assert_eq!(find_user(&scene, "ben").unwrap(), HostIndex(1));
        for wanted in ["0", "3", "-1", "Ben", "", "256"] {
            let Err(Failure::Usage(error)) = find_user(&scene, wanted) else { panic!("{wanted} is nobody") };
            assert!(error.contains("1 (anna), 2 (ben)"), "{error}");
        }
    }

    #[test]
    fn people_are_shown_what_was_computed() {
        let settings = ["link.delay_periods=0"].map(|setting| setting.parse().unwrap());
        let scene = cotouch_scene::load("single-axis", &settings).unwrap();
        let text = damping_text(&scene, &added_damping(&scene, HostIndex(0)).unwrap());
        assert!(
            text.contains("2.038923 N·s/m") && text.contains("object.damping_n_s_per_m=-1.067496"),
            "{text}"
        );
        let frequencies: Vec<f64> = (1..=100).map(|step| f64::from(step) * 10.0).collect();
        let admittance = cotouch_analysis::transparency::admittance(&scene, &frequencies).unwrap();
        let text = admittance_text(&scene, &admittance);
        assert!(text.contains("every 4th of 100") && text.contains("402.1 rad/s"), "{text}");
        let stiffness = cotouch_analysis::transparency::equivalent_stiffness(&scene).unwrap();
        assert!(stiffness_text(&scene, &stiffness).contains("nothing resists"));
        assert!(Bode::of(&admittance).figure("title").unwrap().contains("anna, fundamental"));
    }

    #[test]
    fn a_damping_to_which_no_loop_comes_is_called_so() {
        let text = |settings: &[&str]| {
            let settings: Vec<Override> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
            let scene = cotouch_scene::load("single-axis", &settings).unwrap();
            damping_text(&scene, &added_damping(&scene, HostIndex(0)).unwrap())
        };
        assert!(!text(&[]).contains("unstable"));
        let stiff = text(&["coupling.hand_object.stiffness_n_per_m=200000"]);
        let line = |name: &str| stiff.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(line("added damping").ends_with("(unstable alone: never settles into this)"), "{stiff}");
        assert!(!line("simplified model").contains("unstable"), "{stiff}");
        assert!(line("session ").contains("unstable in free motion"), "{stiff}");
    }
}
