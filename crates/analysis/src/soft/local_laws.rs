//! The law of a session's local models, as the host runs it, in the form of blocks.

use cotouch_scene::Scene;
use cotouch_scene::time::Schedule;
use cotouch_world::LinearBlock;
use cotouch_world::local::{LawClock, LawState, LocalGains, SoftContactModel, StickingContacts, local_law};
use glam::DVec3;
use nalgebra::DMatrix;

/// A law of all contacts of a host. With m contacts, the error `e` has three numbers a contact, surface minus finger along the
/// axes of the world, and forces act on fingers.
pub(super) struct HostLaw {
    /// Forces on fingers per `[e; f]`, f being the forces with which the body in use was stepped; or per e.
    pub(super) direct: DMatrix<f64>,
    /// Whether these forces are those of the first tick of a slow period.
    pub(super) held: bool,
    /// What has a state: from e, gathered at every tick with these weights, to forces on fingers.
    pub(super) state: Option<(LinearBlock, Vec<Vec<f64>>)>,
    /// What the numbers of that state are, the same for every contact.
    pub(super) names: &'static [LawState],
}

impl HostLaw {
    /// The law of a scene for contacts with these K_o (N/m), outward unit normals and joint compliance (m/N).
    pub(super) fn new(
        scene: &Scene,
        ko_n_per_m: &[f64],
        normals: &[DVec3],
        compliance: &DMatrix<f64>,
    ) -> Self {
        let (local, model) = (&scene.local_model, SoftContactModel::new(scene));
        let law = local_law(local.kind);
        let in_period_of = |ticks: u64| {
            let gains: Vec<_> = ko_n_per_m.iter().map(|&ko| LocalGains::new(local, ko, ticks)).collect();
            let compliance = law.needs().joint_compliance.then_some(compliance);
            law.linear(&StickingContacts { model: &model, gains: &gains, normals, compliance })
        };
        let slow = scene.slow_schedule();
        let periods: Vec<u64> = ticks_of_periods(&slow).collect();
        let LinearBlock { a, b, c, d } = in_period_of(periods[0]);
        // Gains that count by the tick differ between periods of different lengths.
        let share = |ticks: u64| {
            let size = b.norm();
            if size > 0.0 { in_period_of(ticks).b.norm() / size } else { 1.0 }
        };
        let shares = periods.iter().flat_map(|&ticks| vec![vec![share(ticks)]; ticks as usize]);
        let weights = without_repetition(shares.collect());
        let without_direct = DMatrix::zeros(d.nrows(), d.ncols());
        Self {
            held: law.clock() == LawClock::SlowPeriod,
            state: (a.nrows() > 0).then_some((LinearBlock { a, b, c, d: without_direct }, weights)),
            direct: d,
            names: law.states(),
        }
    }
}

/// N, of each period of the pattern.
pub(super) fn ticks_of_periods(slow: &Schedule) -> impl Iterator<Item = u64> {
    let start = |period: u64| slow.tick_of_step(period);
    (0..slow.steps_per_pattern()).map(move |period| start(period + 1) - start(period))
}

/// One element where all are alike.
pub(super) fn without_repetition(mut weights: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    if weights.iter().all(|other| *other == weights[0]) {
        weights.truncate(1);
    }
    weights
}
