//! `cotouch local-model compare`: every local model on one scene, open loop and closed.

mod open_loop;

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};

use cotouch_analysis::{analyze_settled, gain_ratios};
use cotouch_runtime::virtual_run;
use cotouch_scene::scene::{LocalModel, LocalModelKind, SoftMeshKind};
use cotouch_scene::{Override, Scene};
use cotouch_world::local::local_law;
use rayon::prelude::*;
use serde::Serialize;

use self::open_loop::{ForceErrors, Forces};
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// The models, by the words of `local_model.kind`.
const MODELS: &[&str] = LocalModelKind::WORDS;

/// How often gains are halved, at most.
const MAX_HALVINGS: u32 = 6;

/// Young's moduli: 500 Pa times 2⁰ to 2¹¹.
const SOFTEST_PA: f64 = 500.0;
const DOUBLINGS: i32 = 12;

#[derive(Serialize)]
struct Answer {
    scene: String,
    models: Vec<Model>,
}

#[derive(Serialize)]
struct Model {
    name: &'static str,
    #[serde(flatten)]
    errors: ForceErrors,
    moduli: Vec<Modulus>,
    /// Top of the unbroken run of stable moduli from the softest; none where not even that is stable.
    max_stable_young_pa: Option<f64>,
}

#[derive(Clone, Serialize)]
struct Modulus {
    young_pa: f64,
    stable: bool,
}

/// Compares the models. Whatever comes out, the work is done: exit status 0.
pub(super) fn compare(
    name: &str,
    duration_s: f64,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let progress = output.progress("comparing local models");
    let scenes = scenes(name, overrides)?;
    let moduli = if has_young(&scenes[0]) { DOUBLINGS as usize } else { 0 };
    let works = 1 + MODELS.len() * (1 + moduli);
    let done = AtomicUsize::new(0);
    let tell = || progress.show((1 + done.fetch_add(1, Ordering::Relaxed)) as f64 / works as f64);

    let reference = Forces::of(&open_loop::reference(&scenes[0])?)?;
    tell();
    let errors = scenes.par_iter().map(|scene| {
        let errors = Forces::of(scene).map(|forces| forces.errors(&reference));
        tell();
        errors
    });
    let errors: Vec<ForceErrors> = errors.collect::<anyhow::Result<_>>()?;
    let runs: Vec<(usize, i32)> = (0..MODELS.len())
        .flat_map(|model| (0..moduli as i32).map(move |doubling| (model, doubling)))
        .collect();
    let verdicts = runs.par_iter().map(|&(model, doubling)| {
        let young_pa = SOFTEST_PA * 2f64.powi(doubling);
        let stable = is_stable(&scenes[model], young_pa, duration_s);
        tell();
        Ok(Modulus { young_pa, stable: stable? })
    });
    let verdicts: Vec<Modulus> = verdicts.collect::<anyhow::Result<_>>()?;
    drop(progress);

    let model = |((name, errors), index): ((&'static str, ForceErrors), usize)| {
        let moduli = verdicts[index * moduli..(index + 1) * moduli].to_vec();
        let max_stable_young_pa = moduli.iter().take_while(|modulus| modulus.stable).last();
        Model {
            name,
            errors,
            max_stable_young_pa: max_stable_young_pa.map(|modulus| modulus.young_pa),
            moduli,
        }
    };
    let models = MODELS.iter().copied().zip(errors).zip(0..).map(model).collect();
    let answer = Answer { scene: scenes[0].name.clone(), models };
    output.answer_as(&answer, &text(&answer))?;
    Ok(Verdict::Good)
}

/// The scene with each of the models: its own with its gains, the others with those that the analysis chooses. Of a
/// compliance no gain is too stiff where the object has no inertia: it takes that of the reference.
fn scenes(name: &str, overrides: &[Override]) -> Result<Vec<Scene>, Failure> {
    let own = cotouch_scene::load(name, overrides)?;
    if !own.soft.exists() {
        return Err(Failure::usage(format!(
            "{name} has no soft object; compare needs a scene with [soft], such as soft-block"
        )));
    }
    let with_model = |model: &&str| -> Result<Scene, Failure> {
        let kind = format!("local_model.kind={model}").parse();
        let kind: Override = kind.map_err(Failure::usage)?;
        let mut scene = cotouch_scene::load(name, &[overrides, &[kind]].concat())?;
        if scene.local_model.kind != own.local_model.kind {
            let ratios = match local_law(scene.local_model.kind).needs().joint_compliance {
                true => [open_loop::REFERENCE_RATIO, 0.0],
                false => gain_ratios(&scene),
            };
            scene = soften(scene.edit(|scene| set_ratios(&mut scene.local_model, ratios))?)?;
        }
        Ok(scene)
    };
    MODELS.iter().map(with_model).collect()
}

/// Halves the gains until the analysis calls the scene stable: its choice is for objects without inertia. What no gain makes
/// stable keeps the softest.
fn soften(mut scene: Scene) -> anyhow::Result<Scene> {
    for _ in 0..MAX_HALVINGS {
        if analyze_settled(&scene)?.each_mode_is_stable() {
            break;
        }
        let LocalModel { stiffness_ratio, integral_ratio, .. } = scene.local_model;
        let halved = [stiffness_ratio, integral_ratio].map(|ratio| 0.5 * ratio);
        scene = scene.edit(|scene| set_ratios(&mut scene.local_model, halved))?;
    }
    Ok(scene)
}

/// Gains as shares of K_o.
fn set_ratios(model: &mut LocalModel, [stiffness_ratio, integral_ratio]: [f64; 2]) {
    (model.stiffness_n_per_m, model.integral_n_per_m) = (0.0, 0.0);
    (model.stiffness_ratio, model.integral_ratio) = (stiffness_ratio, integral_ratio);
}

/// Nodes that are tied to where they rest have a stiffness of their own.
fn has_young(scene: &Scene) -> bool {
    scene.soft.mesh.generator != SoftMeshKind::Spring
}

fn is_stable(scene: &Scene, young_pa: f64, duration_s: f64) -> anyhow::Result<bool> {
    let scene = scene.edit(|scene| scene.soft.young_pa = young_pa)?;
    Ok(virtual_run::run(&scene, duration_s, None, |_| true)?.stable)
}

fn text(answer: &Answer) -> String {
    let mut text = format!(
        "{}\n\n{:<12}{:>14}{:>14}{:>14}   {}\n",
        answer.scene, "model", "force error", "peak error", "largest jump", "stable up to"
    );
    for Model { name, errors, max_stable_young_pa, moduli } in &answer.models {
        let stable = match (max_stable_young_pa, moduli.is_empty()) {
            (_, true) => "the object has no Young's modulus".to_owned(),
            (None, _) => "nothing".to_owned(),
            (Some(pa), _) if moduli.iter().all(|modulus| modulus.stable) => {
                format!("{} kPa, the largest that was tried", pa / 1e3)
            }
            (Some(pa), _) => format!("{} kPa", pa / 1e3),
        };
        let _ = writeln!(
            text,
            "{name:<12}{:>12.1} %{:>12.1} %{:>12.3} N   {stable}",
            100.0 * errors.force_error,
            100.0 * errors.peak_error,
            errors.max_jump_n
        );
    }
    if !answer.models.iter().all(|model| model.moduli.is_empty()) {
        text.push('\n');
        for model in &answer.models {
            let marks: String =
                model.moduli.iter().map(|modulus| if modulus.stable { '+' } else { '-' }).collect();
            let _ =
                writeln!(text, "{:<12}{marks}   500 Pa … 1024 kPa, doubling: + stable, - not", model.name);
        }
    }
    text
}
