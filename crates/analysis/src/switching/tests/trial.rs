//! The table of `docs/VERDICTS.md`: random sets of gains at shares of the limit of their modes.

use cotouch_scene::scene::{SceneValues, SpringDamper};
use cotouch_testkit::scenes::BoxOnALine;

use super::super::random::Random;
use super::{ContactMode, compile, found, modes_of_copies};
use crate::poles::judge;

const SETS: u64 = 150;
const SHARES: [f64; 3] = [0.5, 0.7, 0.9];

/// A set of gains and its limit: by which common factor on all its springs fingers that touch all copies or none turn unstable.
fn random_set(seed: u64) -> Option<(SceneValues, f64)> {
    let mut random = Random::new(0x1234 + seed);
    let ticks = [1, 2, 4, 8][random.below(4)];
    let mut between = |low: f64, high: f64| low * (high / low).powf(random.share());
    let mut spring = |stiffness: [f64; 2], damping: [f64; 2]| {
        (between(stiffness[0], stiffness[1]), between(damping[0], damping[1]))
    };
    let springs = [
        spring([500.0, 10_000.0], [1.0, 40.0]),
        spring([100.0, 8000.0], [0.5, 20.0]),
        spring([100.0, 4000.0], [1.0, 20.0]),
    ];
    let (hand_kg, object_kg, hand_damping) = (between(0.03, 0.3), between(0.1, 1.0), between(0.5, 10.0));
    let delay_periods = random.below(2) as u32;
    let line = BoxOnALine { ticks, delay_periods, hand_kg, object_kg, hand_damping, springs };
    let scene = SceneValues::clone(&line.scene());
    let limit = limit(&scene)?;
    Some((scene, limit))
}

fn with_springs(scene: &SceneValues, factor: f64) -> SceneValues {
    let mut scene = scene.clone();
    let coupling = &mut scene.coupling;
    for SpringDamper { stiffness_n_per_m, .. } in
        [&mut coupling.hand_object, &mut coupling.remote_hand_object, &mut coupling.object_object]
    {
        *stiffness_n_per_m *= factor;
    }
    scene
}

fn all_stable(modes: &[ContactMode]) -> bool {
    modes.iter().all(|mode| judge(&mode.spec, false).unwrap().stable)
}

/// Within a factor of 20 either way.
fn limit(scene: &SceneValues) -> Option<f64> {
    let is_stable = |factor: f64| all_stable(&compile(&with_springs(scene, factor)));
    let (mut low, mut high) = (0.05, 20.0);
    if !is_stable(low) || is_stable(high) {
        return None;
    }
    let steps = (0..60).map(|step| 0.05 * 400f64.powf(f64::from(step) / 59.0));
    for factor in steps {
        if !is_stable(factor) {
            high = factor;
            break;
        }
        low = factor;
    }
    while high > low * 1.001 {
        let middle = (low * high).sqrt();
        if is_stable(middle) { low = middle } else { high = middle }
    }
    Some(low)
}

/// How far the set is, by the distance that verdicts state.
fn distance(scene: &SceneValues, modes: super::super::Modes) -> f64 {
    let radius = |mode: &ContactMode| judge(&mode.spec, false).unwrap().spectral_radius;
    let radii: Vec<f64> = modes(scene).iter().map(radius).collect();
    super::super::distance(scene, &radii, modes).unwrap()
}

#[derive(Default)]
struct Row {
    sets: usize,
    /// A mode in which a finger touches one copy only is unstable.
    one_copy: usize,
    /// Of the others: found, less than 0.1 N rms and more, and the farthest from the line.
    weak: Vec<f64>,
    strong: Vec<f64>,
    /// Of the others: far enough for a search to mean something, and called searched.
    far: usize,
    searched: usize,
}

/// `cargo test --release -p cotouch-analysis --lib random_sets -- --ignored --nocapture`
#[test]
#[ignore = "minutes: makes a table"]
fn random_sets() {
    println!(
        "| share | sets | one-copy mode unstable | found < 0.1 N (distances) | found, stronger (distances) | far | searched |"
    );
    for share in SHARES {
        let mut row = Row::default();
        for seed in 0..SETS {
            let Some((scene, limit)) = random_set(seed) else { continue };
            let scene = with_springs(&scene, share * limit);
            let modes = modes_of_copies(&scene);
            row.sets += 1;
            if !all_stable(&modes) {
                row.one_copy += 1;
                continue;
            }
            let distance = distance(&scene, &modes_of_copies);
            let is_far = distance >= super::super::MIN_DISTANCE;
            row.far += usize::from(is_far);
            let found = found(&scene, &modes);
            match found.as_ref().map(|found| found.rms_n.unwrap_or(f64::INFINITY)) {
                None => row.searched += usize::from(is_far),
                Some(rms_n) if rms_n < 0.1 => row.weak.push(distance),
                Some(_) => row.strong.push(distance),
            }
            if let Some(found) = found {
                println!("  seed {seed} at {share}: distance {distance:.3}, {}", found.told());
            }
        }
        let Row { sets, one_copy, weak, strong, far, searched } = row;
        println!(
            "| {share} | {sets} | {one_copy} | {} {weak:.2?} | {} {strong:.2?} | {far} | {searched} |",
            weak.len(),
            strong.len()
        );
    }
}

#[test]
fn the_limit_of_table_6_1_is_far() {
    let scene = BoxOnALine::TABLE_6_1.scene();
    assert!(limit(&scene).unwrap() > 1.0 / 0.7);
    assert!(distance(&scene, &modes_of_copies) > 1.0 / 0.7);
}
