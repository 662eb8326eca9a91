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
//! Bounded memory for a run of any length, and no allocation while it runs.

mod band;
mod finger;
mod told;

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_FINGERS;
use cotouch_scene::scene::Scene;
use cotouch_scene::time::Rate;

use self::band::Band;
use self::finger::FingerObserver;
pub use self::told::{Diverged, Divergence, LiveVerdict, Rendered, RunVerdict, Shaking};

/// Observes the fingers of one host.
#[derive(Clone, Debug)]
pub struct Observer {
    band: Band,
    control: Rate,
    fingers: ArrayVec<FingerObserver, MAX_FINGERS>,
    /// By limits, or by the world; growth is looked at when asked.
    diverged: Option<Diverged>,
    /// The last tick at which the world was out of its bounds.
    lost_at: Option<u64>,
    last_tick: u64,
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
            fingers: std::iter::repeat_n(FingerObserver::new(control), fingers).collect(),
            diverged: None,
            lost_at: None,
            last_tick: 0,
            observed_ticks: 0,
        }
    }

    /// One tick, before the session's release; `lost` where the world has left its bounds.
    pub fn observe(&mut self, tick: u64, rendered: impl Iterator<Item = Rendered>, lost: bool) {
        (self.last_tick, self.observed_ticks) = (tick, self.observed_ticks + 1);
        let mut cause = lost.then_some((Divergence::OutOfBounds, None));
        for (index, (finger, rendered)) in self.fingers.iter_mut().zip(rendered).enumerate() {
            finger.observe(&self.band, tick, rendered);
            if finger.is_limited_for_long() {
                cause = cause.or(Some((Divergence::GovernorLimit, Some(index as u8))));
            }
        }
        if lost {
            self.lost_at = Some(tick);
        }
        if let (Some((cause, finger)), None) = (cause, self.diverged) {
            self.diverged = Some(Diverged { cause, tick, finger });
        }
    }

    /// Of all that was observed.
    #[must_use]
    pub fn verdict(&self) -> RunVerdict {
        if self.diverged().is_some() {
            RunVerdict::Diverging
        } else if self.shaking().next().is_some() {
            RunVerdict::Shaking
        } else {
            RunVerdict::Quiet
        }
    }

    /// When and why it diverged first, where it did.
    #[must_use]
    pub fn diverged(&self) -> Option<Diverged> {
        let growth = |(index, finger): (usize, &FingerObserver)| {
            let tick = finger.grew_at()?;
            Some(Diverged { cause: Divergence::Growth, tick, finger: Some(index as u8) })
        };
        let grown = self.fingers.iter().enumerate().filter_map(growth);
        grown.chain(self.diverged).min_by_key(|diverged| diverged.tick)
    }

    /// When fingers shook, finger by finger.
    pub fn shaking(&self) -> impl Iterator<Item = Shaking> {
        let period_s = self.control.period_s();
        let fingers = self.fingers.iter().enumerate();
        fingers.flat_map(move |(index, finger)| finger.shaking(index as u8, period_s))
    }

    /// What goes on now. No allocation.
    #[must_use]
    pub fn now(&self) -> LiveVerdict {
        let second = self.control.ticks_in(1.0);
        let is_recent = |tick: Option<u64>| tick.is_some_and(|tick| tick + second > self.last_tick);
        let fingers = || self.fingers.iter();
        let verdict =
            if is_recent(self.lost_at) || fingers().any(|finger| is_recent(finger.last_diverging_tick())) {
                Some(RunVerdict::Diverging)
            } else if fingers().any(|finger| is_recent(finger.last_shaking_tick())) {
                Some(RunVerdict::Shaking)
            } else {
                (self.observed_ticks >= second).then_some(RunVerdict::Quiet)
            };
        LiveVerdict { verdict, fast_force_n: fingers().map(FingerObserver::fast_force_n).fold(0.0, f64::max) }
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
