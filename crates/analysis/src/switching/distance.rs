//! How far a scene is from the line at which one of its contact modes turns unstable.

use cotouch_scene::scene::{SceneValues, SpringDamper};
use rayon::prelude::*;

use crate::compile::ContactMode;
use crate::poles::judge;
use crate::verdict::{AnalysisError, PointVerdict};

/// Distances are not looked for beyond this factor.
pub const MAX_DISTANCE: f64 = 4.0;
/// Of a factor, relative.
const ACCURACY: f64 = 1e-3;
/// Factors that are looked at before the nearest crossing is bisected.
const LOOKS: i32 = 12;
/// Modes that are followed: so many of the worst of the scene as it is, and of the scene at the farthest factor.
const WORST: usize = 8;

/// The loops of a scene's contact modes: the same modes in the same order, whatever the gains are.
pub(super) type Modes<'a> = &'a (dyn Fn(&SceneValues) -> Vec<ContactMode> + Sync);

/// The largest common factor on the springs of all contacts, at most [`MAX_DISTANCE`], up to which every contact mode stays
/// stable, to 1e-3 of it.
///
/// # Errors
/// When a loop cannot be analysed.
pub(super) fn distance(scene: &SceneValues, modes: Modes) -> Result<f64, AnalysisError> {
    let far = Verdicts::of_all(scene, MAX_DISTANCE, modes)?;
    let mut watched = Verdicts::of_all(scene, 1.0, modes)?.worst(WORST);
    watched.extend(far.worst(WORST));
    let mut upper = MAX_DISTANCE;
    loop {
        watched.sort_unstable();
        watched.dedup();
        upper = first_crossing(scene, upper, modes, &watched)?;
        // What was not watched may turn first.
        let missed = Verdicts::of_all(scene, upper, modes)?.unstable();
        if missed.iter().all(|mode| watched.contains(mode)) {
            return Ok(upper);
        }
        watched.extend(missed);
    }
}

/// The largest factor up to which these modes are stable: on the stable side, at most `upper`.
fn first_crossing(
    scene: &SceneValues,
    upper: f64,
    modes: Modes,
    watched: &[usize],
) -> Result<f64, AnalysisError> {
    let is_stable = |factor| -> Result<bool, AnalysisError> {
        Ok(Verdicts::of_some(scene, factor, modes, watched)?.unstable().is_empty())
    };
    let (mut stable, mut unstable) = (1.0, None);
    for look in 1..=LOOKS {
        let factor = upper.powf(f64::from(look) / f64::from(LOOKS));
        if !is_stable(factor)? {
            unstable = Some(factor);
            break;
        }
        stable = factor;
    }
    let Some(mut unstable) = unstable else { return Ok(upper) };
    while unstable > stable * (1.0 + ACCURACY) {
        let middle = (stable * unstable).sqrt();
        if is_stable(middle)? {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    Ok(stable)
}

/// Of modes, by their places.
struct Verdicts(Vec<(usize, PointVerdict)>);

impl Verdicts {
    fn of_all(scene: &SceneValues, factor: f64, modes: Modes) -> Result<Self, AnalysisError> {
        Self::of(modes(&with_springs(scene, factor)), |_| true)
    }

    fn of_some(scene: &SceneValues, factor: f64, modes: Modes, some: &[usize]) -> Result<Self, AnalysisError> {
        Self::of(modes(&with_springs(scene, factor)), |place| some.contains(&place))
    }

    fn of(modes: Vec<ContactMode>, is_wanted: impl Fn(usize) -> bool) -> Result<Self, AnalysisError> {
        let wanted: Vec<_> = modes.into_iter().enumerate().filter(|&(place, _)| is_wanted(place)).collect();
        let verdict = |(place, mode): &(usize, ContactMode)| -> Result<_, AnalysisError> {
            let found = judge(&mode.spec, false)?;
            Ok((*place, PointVerdict { spectral_radius: found.spectral_radius, stable: found.stable }))
        };
        Ok(Self(wanted.par_iter().map(verdict).collect::<Result<_, _>>()?))
    }

    fn unstable(&self) -> Vec<usize> {
        self.0.iter().filter(|(_, verdict)| !verdict.stable).map(|&(place, _)| place).collect()
    }

    /// So many, those with the largest spectral radius.
    fn worst(mut self, count: usize) -> Vec<usize> {
        self.0.sort_by(|(_, one), (_, other)| other.spectral_radius.total_cmp(&one.spectral_radius));
        self.0.into_iter().take(count).map(|(place, _)| place).collect()
    }
}

/// The scene with the springs of all contacts times a factor; dampers, and the couplings of copies, stay.
pub(super) fn with_springs(scene: &SceneValues, factor: f64) -> SceneValues {
    let mut scaled = scene.clone();
    let of = |spring: &mut SpringDamper| spring.stiffness_n_per_m *= factor;
    let coupling = &mut scaled.coupling;
    of(&mut coupling.hand_object);
    of(&mut coupling.hand_object_tangential);
    of(&mut coupling.remote_hand_object);
    of(&mut coupling.remote_hand_object_tangential);
    of(&mut scaled.contact.body_body);
    of(&mut scaled.contact.body_body_tangential);
    scaled.wall.stiffness_n_per_m *= factor;
    scaled.wall.tangential_stiffness_n_per_m *= factor;
    scaled
}
