//! What the page's lesson is told: the analysis of the scene as it would run, part by part.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use cotouch_analysis::{
    AnalysisError, Evaluator, ModeStability, Stability, StabilityMap, Sweep, SweepError, analyze_settled,
    margins, stability_map,
};
use cotouch_runtime::{LOOK_PERIOD, clock};
use cotouch_scene::Scene;
use cotouch_scene::scene::ShapeKind;
use cotouch_viewer::{Answer, MapAxes, MapAxis, Predictor, Question};
use serde_json::{Value, json};

use crate::whole_verdict::whole_verdict;

/// A map of which one point takes longer than this is drawn coarsely first, and never completed point by point, s.
const SLOW_POINT_S: f64 = 1e-3;
/// Most values along an axis of a map on the page.
const MAX_VALUES: usize = 200;
/// Contact modes that the page lists, the worst ones.
const MAX_MODES: usize = 64;

/// Whole verdicts that are remembered: scripts that begin anew and settings that come back ask again for what took seconds.
const MAX_KNOWN: usize = 8;

/// Answers by analysing, on one core: the others belong to the session that runs.
pub(crate) struct Analyst {
    pool: Arc<rayon::ThreadPool>,
    /// Whole verdicts, the newest first.
    known: Mutex<VecDeque<(Scene, Stability)>>,
}

impl Analyst {
    pub(crate) fn new() -> anyhow::Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        Ok(Self { pool: Arc::new(pool), known: Mutex::default() })
    }

    /// What is known of a scene, and whether that is all: where not all is asked for, it may be the contacts that scripts make.
    /// `None` when nobody wants it any more.
    fn look(
        &self,
        scene: &Scene,
        all: bool,
        wanted: &dyn Fn() -> bool,
    ) -> Option<Result<(Stability, bool), AnalysisError>> {
        let lock = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = lock().iter().find(|(known, _)| known == scene) {
            return Some(Ok((known.clone(), true)));
        }
        if !all {
            return Some(self.pool.install(|| first_look(scene)).map(|stability| (stability, false)));
        }
        let found = self.whole(scene, wanted)?;
        if let Ok(stability) = &found {
            let mut known = lock();
            known.truncate(MAX_KNOWN - 1);
            known.push_front((scene.clone(), stability.clone()));
        }
        Some(found.map(|stability| (stability, true)))
    }

    /// The whole verdict, which takes seconds. When nobody wants it any more, as at the end of a session, it is left at work, and nobody
    /// waits for it or hears of it.
    fn whole(&self, scene: &Scene, wanted: &dyn Fn() -> bool) -> Option<Result<Stability, AnalysisError>> {
        let (said, answer) = mpsc::channel();
        let is_left = Arc::new(AtomicBool::new(false));
        let (scene, pool, left) = (scene.clone(), Arc::clone(&self.pool), Arc::clone(&is_left));
        thread::spawn(move || {
            let goes_on = || !left.load(Ordering::Relaxed);
            // Others that were left may have kept the core busy until now.
            let find = || goes_on().then(|| whole_verdict(&scene, &goes_on));
            pool.install(find).map(|found| drop(said.send(found)))
        });
        while wanted() {
            match answer.recv_timeout(LOOK_PERIOD) {
                Ok(found) => return Some(found),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => panic!("the analysis failed"),
            }
        }
        is_left.store(true, Ordering::Relaxed);
        None
    }
}

impl Predictor for Analyst {
    fn predict(&self, question: &Question, wanted: &(dyn Fn() -> bool + Sync), tell: &mut dyn FnMut(Answer)) {
        let Question { scene, whole, margin, map } = question;
        let Some(found) = self.look(scene, *whole || !is_slow(scene), wanted) else { return };
        tell(match found {
            // What is unstable in one contact mode stays so, however many more are looked at.
            Ok((stability, is_whole)) => {
                Answer::Verdict(verdict(&stability, is_whole || stability.stable.is_some()))
            }
            Err(error) => Answer::Failed("verdict", error.to_string()),
        });
        if let (Some(axes), true) = (map, wanted()) {
            match self.map(scene, axes, wanted, tell) {
                Ok(()) | Err(SweepError::GivenUp) => {}
                Err(error) => tell(Answer::Failed("map", error.to_string())),
            }
        }
        if *margin && wanted() {
            match self.pool.install(|| margins(scene, &[], &|_| wanted())) {
                Ok(margins) => tell(Answer::Margin(json!(margins))),
                Err(SweepError::GivenUp) => {}
                Err(error) => tell(Answer::Failed("margin", error.to_string())),
            }
        }
    }
}

impl Analyst {
    /// The whole map at once where points are quick; else coarse first, and finer as long as it is wanted.
    fn map(
        &self,
        scene: &Scene,
        axes: &MapAxes,
        wanted: &dyn Fn() -> bool,
        tell: &mut dyn FnMut(Answer),
    ) -> Result<(), SweepError> {
        let (x, y) = (sweep(&axes.x)?, sweep(&axes.y)?);
        let evaluator = Evaluator::new(scene, &[&x.key, &y.key])?;
        let began = clock::now();
        evaluator.at(&[x.values.values()[0], y.values.values()[0]])?;
        if clock::now().since(began) as f64 * 1e-9 < SLOW_POINT_S {
            let map = self.pool.install(|| stability_map(scene, &x, Some(&y), false, &|_| ()))?;
            tell(Answer::Map(whole(&map)));
            return Ok(());
        }
        refine(&evaluator, &x, &y, wanted, |stable, complete| {
            tell(Answer::Map(coarse(&x, &y, &stable, complete)));
        })
    }
}

/// Whether there is much that users can touch, or a soft body to be run: then the whole verdict is asked for when settings rest.
fn is_slow(scene: &Scene) -> bool {
    scene.soft.exists() || scene.world_bodies().iter().any(|body| body.shape.kind != ShapeKind::Point)
}

/// The contacts that scripts make alone, which is quick: it may find a scene unstable, but never proves it stable.
fn first_look(scene: &Scene) -> Result<Stability, AnalysisError> {
    let mut stability = analyze_settled(scene)?;
    stability.stable = stability.stable.filter(|stable| !stable);
    Ok(stability)
}

fn sweep(axis: &MapAxis) -> Result<Sweep, SweepError> {
    let MapAxis { key, from, to, count, log } = axis;
    let count = (*count).clamp(2, MAX_VALUES);
    let logarithm = if *log { ":log" } else { "" };
    format!("{key}={from}..{to}:{count}{logarithm}").parse()
}

/// Verdicts at every eighth value along both axes, then at every fourth, second and each; `show` is handed the map after
/// each pass, with the nearest known verdict where there is none yet.
fn refine(
    evaluator: &Evaluator,
    x: &Sweep,
    y: &Sweep,
    wanted: &dyn Fn() -> bool,
    mut show: impl FnMut(Vec<Vec<bool>>, bool),
) -> Result<(), SweepError> {
    let (xs, ys) = (x.values.values(), y.values.values());
    let mut known: Vec<Vec<Option<bool>>> = vec![vec![None; xs.len()]; ys.len()];
    for stride in [8, 4, 2, 1] {
        for row in (0..ys.len()).step_by(stride) {
            for column in (0..xs.len()).step_by(stride).filter(|_| wanted()) {
                if known[row][column].is_none() {
                    known[row][column] = Some(evaluator.at(&[xs[column], ys[row]])?.stable);
                }
            }
        }
        if !wanted() {
            return Err(SweepError::GivenUp);
        }
        let at =
            |row: usize, column: usize| known[row - row % stride][column - column % stride] == Some(true);
        let rows = (0..ys.len()).map(|row| (0..xs.len()).map(|column| at(row, column)).collect());
        show(rows.collect(), stride == 1);
    }
    Ok(())
}

fn whole(map: &StabilityMap) -> Value {
    json!({ "x": map.x, "y": map.y, "stable": map.stable, "boundary": map.boundary, "complete": true })
}

fn coarse(x: &Sweep, y: &Sweep, stable: &[Vec<bool>], complete: bool) -> Value {
    json!({ "x": x, "y": y, "stable": stable, "boundary": [], "complete": complete })
}

fn verdict(stability: &Stability, whole: bool) -> Value {
    let mut modes: Vec<&ModeStability> = stability.modes.iter().collect();
    modes.sort_by(|a, b| b.spectral_radius.total_cmp(&a.spectral_radius));
    modes.truncate(MAX_MODES);
    json!({
        "stable": stability.stable,
        "whole": whole,
        "spectral_radius": stability.spectral_radius,
        "period_s": stability.period_s,
        "modes": modes,
        "switching": stability.switching,
        "left_out": stability.left_out,
        "warnings": stability.warnings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(
        scene: &str,
        margin: bool,
        map: Option<MapAxes>,
        wanted: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Answer> {
        let scene = cotouch_scene::load(scene, &[]).unwrap();
        let mut answers = Vec::new();
        let question = Question { scene, whole: margin, margin, map };
        Analyst::new().unwrap().predict(&question, wanted, &mut |answer| answers.push(answer));
        answers
    }

    fn axes(count: usize) -> Option<MapAxes> {
        let axis = |key: &str, to: f64| MapAxis { key: key.to_owned(), from: 10.0, to, count, log: true };
        Some(MapAxes {
            x: axis("coupling.object_object.stiffness_n_per_m", 1e4),
            y: axis("coupling.hand_object.stiffness_n_per_m", 2e4),
        })
    }

    #[test]
    fn a_quick_scene_is_answered_as_the_commands_do() {
        let found = answers("single-axis", true, axes(20), &|| true);
        let [Answer::Verdict(verdict), Answer::Map(map), Answer::Margin(margin)] = &found[..] else {
            panic!("{found:?}")
        };
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        assert_eq!(
            verdict["spectral_radius"],
            json!(whole_verdict(&scene, &|| true).unwrap().spectral_radius)
        );
        assert_eq!(*margin, json!(margins(&scene, &[], &|_| true).unwrap()));
        let [x, y] = ["x", "y"].map(|axis| map[axis]["values"].as_array().unwrap().clone());
        assert_eq!((x.len(), y.len()), (20, 20));
        assert!(!map["boundary"].as_array().unwrap().is_empty());
    }

    #[test]
    fn what_was_judged_whole_is_known_from_then_on() {
        let analyst = Analyst::new().unwrap();
        let verdict = |more: usize, whole: bool| {
            let damping = 10 + more;
            let set = format!("coupling.object_object.damping_n_s_per_m={damping}").parse().unwrap();
            let scene = cotouch_scene::load("push-wall", &[set]).unwrap();
            let mut found = Vec::new();
            let question = Question { scene, whole, margin: false, map: None };
            analyst.predict(&question, &|| true, &mut |answer| found.push(answer));
            let [Answer::Verdict(verdict)] = &found[..] else { panic!("{found:?}") };
            verdict.clone()
        };
        let first = verdict(0, false);
        let whole = verdict(0, true);
        assert_ne!(first, whole);
        assert_eq!(verdict(0, false), whole);
        // Of other settings nothing is known, and not for ever.
        assert_eq!(verdict(1, false)["whole"], json!(false));
        (1..=MAX_KNOWN).for_each(|more| drop(verdict(more, true)));
        assert_eq!(verdict(0, false), first);
    }

    #[test]
    fn what_takes_long_is_looked_at_quickly_first_and_then_as_the_commands_do() {
        let verdict = |whole: bool| {
            let scene = cotouch_scene::load("grasp", &[]).unwrap();
            let question = Question { scene, whole, margin: false, map: None };
            let mut answers = Vec::new();
            Analyst::new().unwrap().predict(&question, &|| true, &mut |answer| answers.push(answer));
            let [Answer::Verdict(verdict)] = &answers[..] else { panic!("{answers:?}") };
            (verdict["stable"].clone(), verdict["whole"].clone())
        };
        assert_eq!(verdict(false), (json!(null), json!(false)));
        let of_the_commands =
            whole_verdict(&cotouch_scene::load("grasp", &[]).unwrap(), &|| true).unwrap().stable;
        assert_eq!(verdict(true), (json!(of_the_commands), json!(true)));
    }

    #[test]
    fn a_verdict_that_nobody_wants_any_more_is_not_waited_for() {
        let analyst = Analyst::new().unwrap();
        let scene = cotouch_scene::load("grasp", &[]).unwrap();
        let question = Question { scene: scene.clone(), whole: true, margin: true, map: axes(4) };
        let asked = std::sync::atomic::AtomicU32::new(0);
        let once = || asked.fetch_add(1, Ordering::Relaxed) < 1;
        analyst.predict(&question, &once, &mut |answer| panic!("{answer:?}"));
        // Nothing that was left half done is remembered.
        assert!(analyst.known.lock().unwrap().is_empty());
        let (found, is_whole) = analyst.look(&scene, true, &|| true).unwrap().unwrap();
        assert_eq!((found.stable, is_whole), (Some(true), true));
    }

    #[test]
    fn a_slow_map_comes_coarse_first_and_ends_exact() {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let MapAxes { x, y } = axes(11).unwrap();
        let (x, y) = (sweep(&x).unwrap(), sweep(&y).unwrap());
        let evaluator = Evaluator::new(&scene, &[&x.key, &y.key]).unwrap();
        let mut maps = Vec::new();
        refine(&evaluator, &x, &y, &|| true, |stable, complete| maps.push((stable, complete))).unwrap();
        assert_eq!(maps.iter().map(|map| map.1).collect::<Vec<_>>(), [false, false, false, true]);
        assert_eq!(maps[3].0, stability_map(&scene, &x, Some(&y), true, &|_| ()).unwrap().stable);
        let given_up = refine(&evaluator, &x, &y, &|| false, |_, _| panic!("nobody wants it"));
        assert!(matches!(given_up, Err(SweepError::GivenUp)));
    }

    #[test]
    fn what_cannot_be_answered_is_said_and_what_nobody_wants_is_left() {
        let wrong = Some(MapAxes {
            x: MapAxis { key: "no.key".to_owned(), ..axes(4).unwrap().x },
            y: axes(4).unwrap().y,
        });
        let found = answers("single-axis", false, wrong, &|| true);
        assert!(matches!(&found[1..], [Answer::Failed("map", why)] if why.contains("no.key")), "{found:?}");
        assert!(answers("single-axis", true, axes(4), &|| false).is_empty());
    }
}
