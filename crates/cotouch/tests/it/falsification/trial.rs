//! One random scene: what the analysis says of it, and what the run's own observer says of hands that try to prove it wrong.

use std::fmt;

use cotouch_analysis::{Stability, analyze, analyze_loop, compile};
use cotouch_device::SimulatedUser;
use cotouch_runtime::{Observer, RunVerdict, VirtualSession, scripted_demand};
use cotouch_scene::scene::Scene;
use cotouch_testkit::Random;
use glam::DVec3;

use super::hands::{AIMS, Aim, EXCITED_UNTIL_S, Known, Policy};
use super::scenes::{Crowd, Drawn};

/// How long a run lasts at least, s.
const SHORTEST_S: f64 = EXCITED_UNTIL_S + 2.5;
/// What shakes to the end of a run that was to be quiet is run for so long, s: it may be dying out.
const LONG_S: f64 = 40.0;
/// From a force that is nothing to one that shakes.
const GROWTH: f64 = 1e3;
/// Over so long at the end it is looked at whether something shakes and how fast fingers are, s.
const LOOK_S: f64 = 0.25;

/// What came of one seed.
pub(super) struct Trial {
    pub(super) seed: u64,
    /// With hands that have yet to be told what to do.
    pub(super) scene: Scene,
    pub(super) stability: Stability,
    /// The first policy under which it kept shaking or diverged, with the scene.
    pub(super) moved: Option<Moved>,
}

/// A run that did not settle.
pub(super) struct Moved {
    pub(super) policy: Policy,
    pub(super) seconds: f64,
    pub(super) how: Ending,
    pub(super) scene: Scene,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// It was quiet.
    Settled,
    /// It shook for a while.
    Shook,
    /// It shook to its end.
    Shaking,
    Diverging,
}

impl Trial {
    /// Runs of up to `longest_s` show what grows. What is left open is run like what is called stable: it may be either.
    pub(super) fn new(seed: u64, crowd: Crowd, longest_s: f64) -> Self {
        let drawn = Drawn::new(seed, crowd);
        let stability = analyze(&drawn.scene, |scene| scripted_demand(scene, &|| true))
            .unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let moved = match stability.stable {
            Some(true) | None => attack(seed, &drawn, &stability, SHORTEST_S, Moved::lasts),
            Some(false) => {
                let seconds = time_to_show(&stability).min(longest_s);
                attack(seed, &drawn, &stability, seconds, Moved::is_shown)
            }
        };
        Self { seed, scene: drawn.scene, stability, moved }
    }
}

impl fmt::Display for Moved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, ", {:?} under {:?} in {:.1} s", self.how, self.policy, self.seconds)
    }
}

impl Moved {
    /// Whether it still shakes or diverges at the end of a long run.
    fn lasts(&self) -> bool {
        let moves = |how: Ending| matches!(how, Ending::Shaking | Ending::Diverging);
        moves(self.how) && moves(ending(&self.scene, LONG_S))
    }

    /// Whether it is what the observer calls shaking or diverging and not the hands' own rhythm.
    fn is_shown(&self) -> bool {
        match self.how {
            Ending::Settled => false,
            Ending::Shook => !self.policy.is_rhythmic(),
            Ending::Shaking | Ending::Diverging => true,
        }
    }
}

/// In which the fastest growth that the analysis predicts is seen, s.
fn time_to_show(stability: &Stability) -> f64 {
    let per_s = stability.spectral_radius.ln() / stability.period_s;
    SHORTEST_S + GROWTH.ln() / per_s.max(1e-6)
}

/// The first run that counts, of all policies.
fn attack(
    seed: u64,
    drawn: &Drawn,
    stability: &Stability,
    seconds: f64,
    counts: impl Fn(&Moved) -> bool,
) -> Option<Moved> {
    let mut random = Random::new(!seed);
    let hz = worst_pole_hz(drawn).unwrap_or_else(|| random.log_uniform(5.0, 60.0));
    let known = Known { hz, aims: aims(drawn, stability), seconds };
    Policy::ALL.into_iter().find_map(|policy| {
        let scene = policy.told(drawn, &known, &mut random)?;
        let how = ending(&scene, seconds);
        Some(Moved { policy, seconds, how, scene }).filter(&counts)
    })
}

/// The worst modes, each set of fingers once.
fn aims(drawn: &Drawn, stability: &Stability) -> Vec<Aim> {
    let mut modes: Vec<_> = stability.modes.iter().filter(|mode| !mode.contacts.is_empty()).collect();
    modes.sort_by(|one, other| other.spectral_radius.total_cmp(&one.spectral_radius));
    let mut aims: Vec<Aim> = Vec::new();
    for mode in modes {
        let aim = Aim::new(&drawn.scene, &mode.contacts);
        if aims.len() < AIMS && !aims.contains(&aim) {
            aims.push(aim);
        }
    }
    aims
}

/// The frequency of the slowest motion of the worst mode of the pressed scene, Hz; none where it does not swing.
fn worst_pole_hz(drawn: &Drawn) -> Option<f64> {
    let poles = compile(&drawn.pressed()).into_iter().filter_map(|mode| {
        let verdict = analyze_loop(&mode.spec).ok()?;
        let dominant = verdict.eigenvalues.iter().max_by(|one, other| one.norm().total_cmp(&other.norm()))?;
        Some((verdict.spectral_radius, dominant.arg().abs() / std::f64::consts::TAU / mode.spec.pattern_s()))
    });
    let (_, hz) = poles.max_by(|(one, _), (other, _)| one.total_cmp(other))?;
    (hz > 1.0).then_some(hz)
}

/// Runs a scene in virtual time.
fn ending(scene: &Scene, seconds: f64) -> Ending {
    let device = |host| (SimulatedUser::new(scene, host).expect("hands"), None);
    let mut session = VirtualSession::with_devices(scene, device).expect("a soft body that can be simulated");
    let [look, end] = [seconds - LOOK_S, seconds].map(|at_s| scene.rates.control_hz.ticks_in(at_s));
    assert!(session.run_to_tick(look, |_, _| {}), "the hosts did not join");
    let before = places(&session);
    session.run_to_tick(end, |_, _| {});
    // Not before the end: growth that levels off is no divergence.
    if observers(&session).any(|observer| observer.verdict() == RunVerdict::Diverging) {
        return Ending::Diverging;
    }
    let moved = before.iter().zip(places(&session)).map(|(before, now)| before.distance(now));
    let ripple_n = ripple_n(scene, moved.fold(0.0, f64::max) / LOOK_S);
    let shook = || observers(&session).flat_map(Observer::shaking).filter(|shaking| shaking.rms_n > ripple_n);
    match shook().next() {
        None => Ending::Settled,
        Some(_) if shook().any(|shaking| shaking.to >= look) => Ending::Shaking,
        Some(_) => Ending::Shook,
    }
}

fn observers(session: &VirtualSession<SimulatedUser>) -> impl Iterator<Item = &Observer> {
    session.hosts().iter().map(|host| &host.station.observer)
}

/// Where all fingers are, m.
fn places(session: &VirtualSession<SimulatedUser>) -> Vec<DVec3> {
    let fingers = session.hosts().iter().flat_map(|host| host.station.device.states());
    fingers.map(|finger| finger.position).collect()
}

/// The force above 8 Hz that held samples make by themselves while things are carried at a speed (m/s), N rms: of a sawtooth of
/// k·v·T_t, which is in proportion to the speed and grows no further.
fn ripple_n(scene: &Scene, speed: f64) -> f64 {
    let coupling = &scene.coupling;
    let held = [coupling.remote_hand_object, coupling.remote_hand_object_tangential, coupling.object_object];
    let stiffest = held.iter().map(|spring| spring.stiffness_n_per_m).fold(0.0, f64::max);
    stiffest * speed * scene.rates.network_hz.period_s() / 12.0_f64.sqrt()
}
