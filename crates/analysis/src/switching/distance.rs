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

/// What a common factor is on: of contacts, for the couplings of copies never switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scaled {
    /// Springs alone.
    Springs,
    /// Springs and dampers alike.
    SpringsAndDampers,
}

impl Scaled {
    /// Both.
    pub(crate) const EACH: [Self; 2] = [Self::Springs, Self::SpringsAndDampers];
}

/// The largest common factor on the springs of all contacts, at most [`MAX_DISTANCE`], up to which every contact mode stays
/// stable, to 1e-3 of it; or on springs and dampers together, if that is smaller. `here` has the spectral radii of the scene as
/// it is, where all modes are stable.
///
/// # Errors
/// When a loop cannot be analysed.
pub(super) fn distance(scene: &SceneValues, here: &[f64], modes: Modes) -> Result<f64, AnalysisError> {
    let springs = Line { scene, scaled: Scaled::Springs, modes };
    let all = Line { scene, scaled: Scaled::SpringsAndDampers, modes };
    let here: Vec<_> = here.iter().copied().enumerate().collect();
    let factor = springs.first_crossing(MAX_DISTANCE, &here)?;
    all.first_crossing(factor, &here)
}

/// Scenes with contacts that are stiffer by a common factor.
struct Line<'a> {
    scene: &'a SceneValues,
    scaled: Scaled,
    modes: Modes<'a>,
}

impl Line<'_> {
    /// The largest factor, at most `upper`, up to which all modes are stable, given their spectral radii without a factor.
    fn first_crossing(&self, upper: f64, here: &[(usize, f64)]) -> Result<f64, AnalysisError> {
        let mut watched = worst(here);
        let mut upper = upper;
        let mut at_upper = self.verdicts(upper, None)?;
        let radii: Vec<_> =
            at_upper.iter().map(|&(place, verdict)| (place, verdict.spectral_radius)).collect();
        watched.extend(worst(&radii));
        // What was not watched may turn first.
        while at_upper.iter().any(|(_, verdict)| !verdict.stable) {
            watched.extend(at_upper.iter().filter(|(_, verdict)| !verdict.stable).map(|&(place, _)| place));
            watched.sort_unstable();
            watched.dedup();
            upper = self.first_crossing_of(upper, &watched)?;
            at_upper = self.verdicts(upper, None)?;
        }
        Ok(upper)
    }

    /// Of some modes: on the stable side.
    fn first_crossing_of(&self, upper: f64, watched: &[usize]) -> Result<f64, AnalysisError> {
        let is_stable = |factor| -> Result<bool, AnalysisError> {
            Ok(self.verdicts(factor, Some(watched))?.iter().all(|(_, verdict)| verdict.stable))
        };
        let (mut stable, mut unstable) = (1.0, upper);
        for look in 1..LOOKS {
            let factor = upper.powf(f64::from(look) / f64::from(LOOKS));
            if !is_stable(factor)? {
                unstable = factor;
                break;
            }
            stable = factor;
        }
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

    /// Of all modes, or of some, with their places.
    fn verdicts(
        &self,
        factor: f64,
        some: Option<&[usize]>,
    ) -> Result<Vec<(usize, PointVerdict)>, AnalysisError> {
        let modes = (self.modes)(&stiffer(self.scene, self.scaled, factor)).into_iter().enumerate();
        let wanted: Vec<_> =
            modes.filter(|(place, _)| some.is_none_or(|some| some.contains(place))).collect();
        let verdict = |(place, mode): &(usize, ContactMode)| {
            let found = judge(&mode.spec, false)?;
            Ok((*place, PointVerdict { spectral_radius: found.spectral_radius, stable: found.stable }))
        };
        wanted.par_iter().map(verdict).collect()
    }
}

/// The places of those with the largest spectral radius.
fn worst(radii: &[(usize, f64)]) -> Vec<usize> {
    let mut radii = radii.to_vec();
    radii.sort_by(|(_, one), (_, other)| other.total_cmp(one));
    radii.into_iter().take(WORST).map(|(place, _)| place).collect()
}

/// The scene with the gains of all contacts times a factor; the couplings of copies stay.
pub(crate) fn stiffer(scene: &SceneValues, scaled: Scaled, factor: f64) -> SceneValues {
    let mut stiffer = scene.clone();
    let damper = if scaled == Scaled::Springs { 1.0 } else { factor };
    let of = |spring: &mut SpringDamper| {
        spring.stiffness_n_per_m *= factor;
        spring.damping_n_s_per_m *= damper;
    };
    let coupling = &mut stiffer.coupling;
    of(&mut coupling.hand_object);
    of(&mut coupling.hand_object_tangential);
    of(&mut coupling.remote_hand_object);
    of(&mut coupling.remote_hand_object_tangential);
    of(&mut stiffer.contact.body_body);
    of(&mut stiffer.contact.body_body_tangential);
    let wall = &mut stiffer.wall;
    wall.stiffness_n_per_m *= factor;
    wall.tangential_stiffness_n_per_m *= factor;
    wall.damping_n_s_per_m *= damper;
    wall.tangential_damping_n_s_per_m *= damper;
    stiffer
}
