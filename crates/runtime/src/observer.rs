//! Whether a run was quiet, judged from the forces that devices rendered: the one observer of sessions in real and in virtual
//! time, of the page and of the experiments.
//!
//! What counts is the force above 8 Hz at each finger: users do not move so fast. It is *shaking* where that force stays above
//! 0.05 N rms for half a second, and *diverging* where it grows from one quarter of a second to the next, or where a limit of
//! the governor acts for over 20 ms on end, or the world leaves its bounds. A touch and a release are over sooner. All of a run
//! counts, from the end of its soft start to the beginning of its release, and what has been seen stays seen: a run that goes on
//! cannot become quieter. There is one exception: growth that levels off by itself, below every limit, is a limit cycle and is
//! called shaking from then on.
//!
//! Where settings change while a session runs, each set of them is also judged for itself, from a second after the change on:
//! what the settings before had set off may take so long to die out.
//!
//! Bounded memory for a run of any length, and no allocation while it runs.

mod band;
mod finger;
mod force;
mod growth;
mod sums;
mod told;
mod watch;

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::Rate;

use self::band::Band;
use self::finger::FingerFilter;
use self::force::LEAST_S;
pub use self::told::{Diverged, Divergence, LiveVerdict, Rendered, RunVerdict, SettingsVerdict, Shaking};
use self::watch::Watch;

/// After settings have changed, what was shaking may shake for so long without being held against the new ones, s.
const SETTLING_S: f64 = 1.0;

/// Observes the fingers of one host.
#[derive(Clone, Debug)]
pub struct Observer {
    band: Band,
    control: Rate,
    fingers: ArrayVec<FingerFilter, MAX_FINGERS>,
    /// Of the whole run.
    run: Watch,
    /// Since settings changed last, and when that was.
    settings: Watch,
    settings_from: u64,
    /// The tick after the last one.
    next_tick: u64,
    observed_ticks: u64,
}

impl Observer {
    /// Of a host with so many fingers in a session of `scene`.
    #[must_use]
    pub fn new(scene: &Scene, fingers: usize) -> Self {
        let control = scene.rates.control_hz;
        Self {
            band: Band::of_scene(scene),
            control,
            fingers: std::iter::repeat_n(FingerFilter::new(control), fingers).collect(),
            run: Watch::new(control, fingers, 0),
            settings: Watch::new(control, fingers, 0),
            settings_from: 0,
            next_tick: 0,
            observed_ticks: 0,
        }
    }

    /// One tick, before the session's release; `lost` where the world has left its bounds.
    pub fn observe(&mut self, tick: u64, rendered: impl Iterator<Item = Rendered>, lost: bool) {
        (self.next_tick, self.observed_ticks) = (tick + 1, self.observed_ticks + 1);
        self.run.observe_world(tick, lost);
        self.settings.observe_world(tick, lost);
        for (index, (finger, rendered)) in self.fingers.iter_mut().zip(rendered).enumerate() {
            if let Some(seen) = finger.observe(&self.band, rendered) {
                self.run.observe_finger(tick, index, &seen);
                self.settings.observe_finger(tick, index, &seen);
            }
        }
    }

    /// Settings change before `tick`. What the run was with those before; what shakes now has a second in which to settle
    /// before it counts for the next ones. No allocation.
    pub fn change_settings(&mut self, tick: u64) -> SettingsVerdict {
        let before = SettingsVerdict { to: tick, ..self.with_present_settings() };
        // Nothing has to settle before there was anything.
        let settling = if self.observed_ticks == 0 { 0 } else { self.control.ticks_in(SETTLING_S) };
        self.settings = Watch::new(self.control, self.fingers.len(), tick + settling);
        self.settings_from = tick;
        before
    }

    /// What the run has been since settings changed last.
    #[must_use]
    pub fn with_present_settings(&self) -> SettingsVerdict {
        let (verdict, judged_ticks) = (self.settings.verdict(), self.settings.judged_ticks());
        let is_known = verdict != RunVerdict::Quiet || judged_ticks >= self.control.ticks_in(LEAST_S);
        SettingsVerdict {
            from: self.settings_from,
            to: self.next_tick,
            verdict: is_known.then_some(verdict),
            shaking: self.settings.shaking().count() as u32,
            judged_ticks,
        }
    }

    /// Of all that was observed.
    #[must_use]
    pub fn verdict(&self) -> RunVerdict {
        self.run.verdict()
    }

    /// When and why it diverged first, where it did.
    #[must_use]
    pub fn diverged(&self) -> Option<Diverged> {
        self.run.diverged()
    }

    /// When fingers shook, finger by finger.
    pub fn shaking(&self) -> impl Iterator<Item = Shaking> {
        self.run.shaking()
    }

    /// Ticks for which every finger was judged: those since the end of the soft start.
    #[must_use]
    pub fn judged_ticks(&self) -> u64 {
        self.run.judged_ticks()
    }

    /// Ticks that were observed, those of the soft start too.
    #[must_use]
    pub fn observed_ticks(&self) -> u64 {
        self.observed_ticks
    }

    /// What goes on now. No allocation.
    #[must_use]
    pub fn now(&self) -> LiveVerdict {
        let second = self.control.ticks_in(1.0);
        let is_recent = |tick: Option<u64>| tick.is_some_and(|tick| tick + second >= self.next_tick);
        let verdict = if is_recent(self.run.last_diverging_tick()) {
            Some(RunVerdict::Diverging)
        } else if is_recent(self.run.last_shaking_tick()) {
            Some(RunVerdict::Shaking)
        } else {
            (self.observed_ticks >= second).then_some(RunVerdict::Quiet)
        };
        LiveVerdict { verdict, fast_force_n: self.run.fast_force_n() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotouch_device::Acted;
    use glam::DVec3;

    const HZ: f64 = 1024.0;

    /// So many seconds of a force along x (N), and of what the governor did, as they are at a time (s).
    fn run(seconds: f64, at: impl Fn(f64) -> (f64, Acted)) -> Observer {
        let scene = cotouch_scene::load("single-axis", &[]).expect("a built-in scene");
        let mut observer = Observer::new(&scene, 1);
        for tick in 0..(seconds * HZ) as u64 {
            let (force_n, acted) = at(tick as f64 / HZ);
            let rendered = Rendered { force_n: DVec3::X * force_n, acted };
            observer.observe(tick, std::iter::once(rendered), false);
        }
        observer
    }

    fn force(seconds: f64, at: impl Fn(f64) -> f64) -> Observer {
        run(seconds, |t| (at(t), Acted::empty()))
    }

    fn sine(hz: f64, t: f64) -> f64 {
        (t * hz * std::f64::consts::TAU).sin()
    }

    #[test]
    fn shaking_has_its_time_strength_and_frequency() {
        // 0.1 N rms from the second to the fourth second, in a press that changes slowly.
        let observer = force(8.0, |t| {
            let shakes = (2.0..4.0).contains(&t);
            3.0 * sine(0.5, t) + if shakes { 0.1 * 2.0_f64.sqrt() * sine(40.0, t) } else { 0.0 }
        });
        assert_eq!(observer.verdict(), RunVerdict::Shaking);
        let [shaking] = observer.shaking().collect::<Vec<_>>()[..] else { panic!("one stretch") };
        let time = |tick: u64| tick as f64 / HZ;
        assert!(
            (time(shaking.from) - 2.0).abs() < 0.15 && (time(shaking.to) - 4.0).abs() < 0.15,
            "{shaking:?}"
        );
        assert!((shaking.rms_n / 0.1 - 1.0).abs() < 0.1, "{shaking:?}");
        assert!((shaking.hz / 40.0 - 1.0).abs() < 0.05, "{shaking:?}");
        assert_eq!(observer.now().verdict, Some(RunVerdict::Quiet), "what is over is over, now");
    }

    #[test]
    fn the_verdict_is_the_same_however_long_a_quiet_end_lasts() {
        for seconds in [3.0, 5.0, 8.0, 20.0, 60.0] {
            let observer = force(seconds, |t| if t < 2.5 { sine(30.0, t) } else { 0.0 });
            assert_eq!(observer.verdict(), RunVerdict::Shaking, "{seconds} s");
        }
    }

    #[test]
    fn what_users_do_is_quiet() {
        let pressing = |t: f64| 2.0 + 1.5 * sine(1.0, t);
        assert_eq!(force(10.0, pressing).verdict(), RunVerdict::Quiet);
        // A touch once a second: a step that rings off within a fifth of a second.
        let touch =
            |t: f64| (1.0 - (-(t.fract()) * 40.0).exp()) + 0.5 * (-(t.fract()) * 20.0).exp() * sine(25.0, t);
        assert_eq!(force(10.0, touch).verdict(), RunVerdict::Quiet);
    }

    #[test]
    fn too_weak_or_too_short_does_not_count() {
        assert_eq!(force(10.0, |t| 0.045 * 2.0_f64.sqrt() * sine(40.0, t)).verdict(), RunVerdict::Quiet);
        assert_eq!(
            force(10.0, |t| if t.fract() < 0.3 { sine(40.0, t) } else { 0.0 }).verdict(),
            RunVerdict::Quiet
        );
        assert_eq!(
            force(10.0, |t| if t % 2.0 < 0.7 { sine(40.0, t) } else { 0.0 }).verdict(),
            RunVerdict::Shaking
        );
    }

    #[test]
    fn growth_diverges_and_what_levels_off_below_the_limits_shakes() {
        let growing = |t: f64| 1e-3 * (1.5 * t).exp();
        let observer = force(4.0, |t| growing(t) * sine(40.0, t));
        let diverged = observer.diverged().expect("it grows");
        assert_eq!((diverged.cause, diverged.finger), (Divergence::Growth, Some(0)));
        assert_eq!(observer.now().verdict, Some(RunVerdict::Diverging));
        let levels_off = |t: f64| growing(t.min(4.0)) * sine(40.0, t);
        assert_eq!(force(4.2, levels_off).verdict(), RunVerdict::Diverging);
        for seconds in [5.5, 10.0, 40.0] {
            assert_eq!(force(seconds, levels_off).verdict(), RunVerdict::Shaking, "{seconds} s");
        }
    }

    #[test]
    fn growth_that_meets_a_limit_stays_divergence() {
        // Chatter: at the limit for less than 20 ms each time.
        let at = |t: f64| {
            let asked = 1e-3 * (3.0 * t).exp() * sine(40.0, t);
            let acted = if asked.abs() > 20.0 { Acted::FORCE_LIMIT } else { Acted::empty() };
            (asked.clamp(-20.0, 20.0), acted)
        };
        for seconds in [5.0, 10.0, 30.0] {
            let observer = run(seconds, at);
            assert_eq!(observer.verdict(), RunVerdict::Diverging, "{seconds} s");
            assert_eq!(observer.diverged().map(|diverged| diverged.cause), Some(Divergence::Growth));
        }
    }

    #[test]
    fn slow_growth_shakes_in_the_end_and_decay_does_not() {
        let growing = |rate: f64| move |t: f64| 0.01 * (rate * t).exp() * sine(20.0, t);
        assert_eq!(force(30.0, growing(0.15)).verdict(), RunVerdict::Shaking);
        assert_eq!(force(30.0, growing(-0.15)).verdict(), RunVerdict::Quiet);
    }

    #[test]
    fn limits_that_act_for_over_20_ms_on_end_diverge() {
        for (ticks, expected) in [(20, RunVerdict::Quiet), (21, RunVerdict::Diverging)] {
            let limited = |t: f64| (1.0..1.0 + f64::from(ticks) / HZ).contains(&t);
            let at = |t: f64| (1.0, if limited(t) { Acted::FORCE_LIMIT } else { Acted::empty() });
            assert_eq!(run(30.0, at).verdict(), expected, "{ticks} ticks");
            let fading =
                |t: f64| (1.0, if limited(t) { Acted::FORCE_LIMIT | Acted::RELEASE } else { Acted::empty() });
            assert_eq!(run(30.0, fading).verdict(), RunVerdict::Quiet, "{ticks} ticks of a release");
        }
    }

    #[test]
    fn the_first_soft_start_does_not_count_and_a_later_one_does() {
        let start = |from: f64, to: f64| {
            move |t: f64| {
                (
                    if t < to { sine(40.0, t) } else { 0.0 },
                    if t >= from && t < to { Acted::SOFT_START } else { Acted::empty() },
                )
            }
        };
        assert_eq!(run(4.0, start(0.0, 2.0)).verdict(), RunVerdict::Quiet);
        assert_eq!(run(4.0, start(1.0, 2.0)).verdict(), RunVerdict::Shaking);
    }

    /// So many seconds of shaking, with settings that change after `change_s`: what the run was with those before, and with
    /// those after, and all of it.
    fn changed(seconds: f64, change_s: f64, shakes: impl Fn(f64) -> bool) -> [Option<RunVerdict>; 3] {
        let mut observer = force(0.0, |_| 0.0);
        let mut before = None;
        for tick in 0..(seconds * HZ) as u64 {
            let t = tick as f64 / HZ;
            if tick == (change_s * HZ) as u64 {
                before = observer.change_settings(tick).verdict;
            }
            let force_n = DVec3::X * if shakes(t) { sine(40.0, t) } else { 0.0 };
            observer.observe(tick, std::iter::once(Rendered { force_n, acted: Acted::empty() }), false);
        }
        [before, observer.with_present_settings().verdict, Some(observer.verdict())]
    }

    #[test]
    fn what_settings_before_have_set_off_has_a_second_to_die_out() {
        use RunVerdict::{Quiet, Shaking};
        let shook = |from: f64, to: f64| move |t: f64| (from..to).contains(&t);
        assert_eq!(changed(9.0, 4.0, shook(2.0, 4.9)), [Some(Shaking), Some(Quiet), Some(Shaking)]);
        assert_eq!(changed(9.0, 4.0, shook(2.0, 5.6)), [Some(Shaking), Some(Shaking), Some(Shaking)]);
        assert_eq!(changed(9.0, 4.0, shook(6.0, 8.0)), [Some(Quiet), Some(Shaking), Some(Shaking)]);
        assert_eq!(changed(5.4, 4.0, shook(2.0, 4.0)), [Some(Shaking), None, Some(Shaking)], "too short");
    }

    #[test]
    fn many_stretches_are_kept_in_bounded_memory() {
        let observer = force(60.0, |t| if t % 1.5 < 0.9 { sine(40.0, t) } else { 0.0 });
        let stretches: Vec<_> = observer.shaking().collect();
        assert!(stretches.len() <= 17, "{}", stretches.len());
        assert!(stretches.last().unwrap().to as f64 / HZ > 58.0);
    }

    #[test]
    fn the_worst_host_counts_and_one_that_is_young_leaves_it_open() {
        let now = |verdict| LiveVerdict { verdict, fast_force_n: 0.0 };
        let of = |verdicts: &[Option<RunVerdict>]| {
            LiveVerdict::combine(verdicts.iter().map(|&verdict| now(verdict))).verdict
        };
        use RunVerdict::{Diverging, Quiet, Shaking};
        assert_eq!(of(&[Some(Quiet), Some(Shaking), Some(Quiet)]), Some(Shaking));
        assert_eq!(of(&[None, Some(Diverging)]), Some(Diverging));
        assert_eq!(of(&[Some(Quiet), None]), None);
        assert_eq!(of(&[None, Some(Quiet)]), None);
        assert_eq!(of(&[Some(Quiet), Some(Quiet)]), Some(Quiet));
        assert_eq!(of(&[]), None);
    }
}
