//! Pointers that come and go in virtual time: in every scene the session stays as calm as it was.

use std::sync::{Arc, Mutex};

use cotouch_device::{Guide, GuidedUser, Targets};
use cotouch_runtime::real_time::realisable;
use cotouch_runtime::{HostChange, LiveVerdict, RunVerdict, Station, TickRecord, VirtualSession};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use glam::DVec3;

#[derive(Clone, Default)]
struct Pointer(Arc<Mutex<Option<Targets>>>);

impl Guide for Pointer {
    fn targets(&mut self) -> Option<Targets> {
        self.0.lock().unwrap().clone()
    }
}

struct Session {
    virtual_session: VirtualSession<GuidedUser<Pointer>>,
    pointers: Vec<Pointer>,
    rate_hz: f64,
    tick: u64,
    /// The force that was commanded last at every host's first finger, N, and the largest change from tick to tick.
    forces: Vec<DVec3>,
    largest_step_n: f64,
    diverged: bool,
}

impl Session {
    fn new(scene: &Scene) -> Self {
        let pointers: Vec<Pointer> = scene.hosts().map(|_| Pointer::default()).collect();
        let station = |host: HostIndex| {
            let user = GuidedUser::new(scene, host, pointers[host.index()].clone()).unwrap();
            Station::new(scene, host, user, None)
        };
        Self {
            virtual_session: VirtualSession::new(scene, station),
            forces: vec![DVec3::ZERO; pointers.len()],
            pointers,
            rate_hz: scene.rates.control_hz.hz(),
            tick: 0,
            largest_step_n: 0.0,
            diverged: false,
        }
    }

    /// Runs on for so long; the largest step of a force at a finger meanwhile, N.
    fn run(&mut self, seconds: f64) -> f64 {
        self.tick += (seconds * self.rate_hz) as u64;
        self.largest_step_n = 0.0;
        let Self { forces, largest_step_n, diverged, .. } = self;
        let observe = |host: HostIndex, record: &TickRecord| {
            let force = record.commanded[0].force;
            *largest_step_n = largest_step_n.max(force.distance(forces[host.index()]));
            forces[host.index()] = force;
            *diverged |= record.diverged;
        };
        assert!(self.virtual_session.run_to_tick(self.tick, observe));
        self.largest_step_n
    }

    fn places(&self, host: usize) -> Targets {
        let states = self.virtual_session.hosts()[host].station.device.user().states();
        states.iter().map(|state| state.position).collect()
    }

    /// All pointers take their hands and swing them, told thirty times a second; the largest step of a force, N.
    fn swing(&mut self, seconds: f64, amplitude: DVec3) -> f64 {
        let from: Vec<Targets> = (0..self.pointers.len()).map(|host| self.places(host)).collect();
        let mut largest_n: f64 = 0.0;
        for step in 0..(seconds * 30.0) as u32 {
            let shift = amplitude * (f64::from(step) / 30.0 * std::f64::consts::PI).sin();
            for (pointer, from) in self.pointers.iter().zip(&from) {
                *pointer.0.lock().unwrap() = Some(from.iter().map(|&place| place + shift).collect());
            }
            largest_n = largest_n.max(self.run(1.0 / 30.0));
        }
        largest_n
    }

    fn change(&mut self, to: &Scene) {
        for host in to.hosts() {
            let station = &mut self.virtual_session.host_mut(host).station;
            assert!(station.change(&mut HostChange::new(to, host)));
        }
    }

    /// Where the first host's copy of the object is, m.
    fn object_m(&self) -> DVec3 {
        self.virtual_session.hosts()[0].station.state.host.bodies[0].pose.position
    }

    fn leave(&self) {
        self.pointers.iter().for_each(|pointer| *pointer.0.lock().unwrap() = None);
    }

    /// Of the run so far, at the worst host.
    fn verdict(&self) -> RunVerdict {
        let stations = self.virtual_session.hosts().iter().map(|host| &host.station);
        stations.map(|station| station.observer.verdict()).max().unwrap_or_default()
    }
}

#[test]
fn forces_do_not_jump_when_pointers_take_and_leave() {
    for name in ["single-axis", "single-axis-centralized"] {
        let mut session = Session::new(&realisable(&cotouch_scene::load(name, &[]).unwrap()).0);
        session.run(2.0);
        session.pointers.iter().for_each(|pointer| *pointer.0.lock().unwrap() = Some(Targets::new()));
        let taken_n = session.run(1.0);
        let swung_n = session.swing(2.0, DVec3::X * 0.03);
        session.leave();
        let left_n = session.run(3.0);
        // A target that jumped by 3 cm would pull with 4.5 N more from one tick to the next.
        let largest_n = taken_n.max(swung_n).max(left_n);
        assert!(largest_n < 0.15, "{name}: {taken_n}, {swung_n} and {left_n} N in one tick");
        assert!(swung_n > 0.001, "something is felt");
    }
}

#[test]
fn with_a_hand_taken_an_unstable_object_shakes_where_it_is_and_settles_there() {
    for (name, stiffness) in [("single-axis", 4000.0), ("single-axis-centralized", 4000.0)] {
        let scene = realisable(&cotouch_scene::load(name, &[]).unwrap()).0;
        let key = "coupling.remote_hand_object.stiffness_n_per_m";
        let unstable = cotouch_scene::with_override(&scene, key, stiffness).unwrap();
        let mut session = Session::new(&scene);
        session.run(4.0);
        *session.pointers[0].0.lock().unwrap() = Some(Targets::new());
        session.run(1.0);
        let began_m = session.object_m();
        session.change(&unstable);
        let mut furthest_m: f64 = 0.0;
        for _ in 0..30 {
            session.run(0.1);
            furthest_m = furthest_m.max(session.object_m().distance(began_m));
        }
        let now = |session: &Session| {
            let stations = session.virtual_session.hosts().iter().map(|host| &host.station);
            LiveVerdict::combine(stations.map(|station| station.observer.now()))
        };
        let shaking = now(&session);
        assert!(
            shaking.verdict > Some(RunVerdict::Quiet) && shaking.saturated_s > 1.0,
            "{name}: {shaking:?}"
        );
        session.change(&scene);
        session.run(2.0);
        let settled = now(&session);
        assert!(
            settled.verdict == Some(RunVerdict::Quiet) && settled.saturated_s == 0.0,
            "{name}: {settled:?}"
        );
        let off_m = session.object_m().distance(began_m);
        assert!(furthest_m < 0.2 && off_m < 0.1, "{name}: {furthest_m} m while it shook, {off_m} m after");
    }
}

#[test]
fn scenes_are_as_stable_with_pointers_as_without() {
    for name in
        ["single-axis", "single-axis-centralized", "grasp", "sinusoid", "push-wall", "hand-over", "stack"]
    {
        let mut session = Session::new(&realisable(&cotouch_scene::load(name, &[]).unwrap()).0);
        session.run(2.0);
        session.swing(3.0, DVec3::new(0.02, 0.01, 0.0));
        session.swing(3.0, DVec3::ZERO);
        assert_eq!(session.verdict(), RunVerdict::Quiet, "{name}, held");
        session.leave();
        session.run(3.0);
        assert_eq!(session.verdict(), RunVerdict::Quiet, "{name}, let go of");
    }
}
