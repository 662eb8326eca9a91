//! Hosts that exchange packets hand to hand, without protocol, clocks or sockets.

use cotouch_device::{Device, SimulatedUser, WorldView};
use cotouch_host::{HostModel, HostState, TickOutput};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;

struct Hand2Hand {
    models: Vec<HostModel>,
    states: Vec<HostState>,
    hands: Vec<SimulatedUser>,
    tick: u64,
}

fn scene(overrides: &[&str]) -> Scene {
    built_in("single-axis", overrides)
}

impl Hand2Hand {
    fn new(scene: &Scene) -> Self {
        let models: Vec<_> = scene.hosts().map(|host| HostModel::new(scene, host)).collect();
        let mut states: Vec<_> = models.iter().map(HostState::new).collect();
        for (model, state) in models.iter().zip(&mut states) {
            model.host.others(model.users).for_each(|peer| state.set_present(peer, true));
        }
        let hands = scene.hosts().map(|host| SimulatedUser::new(scene, host).unwrap()).collect();
        Self { models, states, hands, tick: 0 }
    }

    fn tick(&mut self) -> Vec<TickOutput> {
        let (tick, users) = (self.tick, self.models.len());
        let readings: Vec<_> = self.hands.iter_mut().map(|hand| hand.read(tick).unwrap()).collect();
        let steps: Vec<_> =
            (0..users).map(|host| self.models[host].step_due(&self.states[host], tick)).collect();
        for from in 0..users {
            let Some(step) = steps[from] else { continue };
            let Some(packet) = self.models[from].sample(&mut self.states[from], step, &readings[from]) else {
                continue;
            };
            for to in 0..users {
                if self.models[to].sources().any(|source| source == self.models[from].host) {
                    self.models[to].receive(&mut self.states[to], self.models[from].host, &packet);
                }
            }
        }
        for (model, state) in self.models.iter().zip(&mut self.states) {
            model.play_out(state, tick);
        }
        for to in 1..users {
            let Some(step) = steps[0] else { continue };
            let client = self.models[to].host;
            let answer = self.models[0].respond(&self.states[0], step, &readings[0], client);
            if let Some(packet) = answer {
                self.models[to].receive(&mut self.states[to], self.models[0].host, &packet);
                self.models[to].play_out(&mut self.states[to], tick);
            }
        }
        let mut outputs = Vec::new();
        for (host, reading) in readings.iter().enumerate() {
            let bodies: Vec<_> = self.states[host].bodies.iter().map(|body| body.pose).collect();
            let output = self.models[host].tick(&mut self.states[host], tick, reading);
            self.hands[host].observe(&WorldView { bodies: &bodies });
            self.hands[host].write(&output.device).unwrap();
            outputs.push(output);
        }
        self.tick += 1;
        outputs
    }

    fn settle(&mut self) {
        for _ in 0..2048 {
            self.tick();
        }
    }

    fn momentum(&self, scene: &Scene, objects: usize) -> f64 {
        let hands: f64 = self.hands.iter().map(|hand| hand.states()[0].velocity.x).sum();
        let objects: f64 = self.states[..objects].iter().map(|state| state.bodies[0].twist.linear.x).sum();
        scene.hand.mass_kg * hands + scene.object.mass_kg * objects
    }
}

const RESTING: &str = "user=[{name=\"a\"},{name=\"b\"}]";

fn push(scene: &Scene, objects: usize, seconds: u32) -> (f64, f64) {
    let mut session = Hand2Hand::new(scene);
    session.settle();
    session.states[0].bodies[0].twist.linear.x = 0.1;
    let before = session.momentum(scene, objects);
    for _ in 0..seconds * 1024 {
        session.tick();
    }
    (before, session.momentum(scene, objects))
}

#[test]
fn momentum_is_conserved_where_opposite_forces_are_equal_at_every_tick() {
    // The coupler from a remote hand to the own copy has no opposite in the distributed architecture (4.28).
    let fresh = scene(&[
        RESTING,
        "rates.network_hz=1024",
        "link.delay_periods=0",
        "coupling.remote_hand_object={stiffness_n_per_m=0, damping_n_s_per_m=0}",
    ]);
    let (before, after) = push(&fresh, 2, 5);
    assert!((after / before - 1.0).abs() < 1e-9, "{before} {after}");

    let server = scene(&[
        RESTING,
        "session.architecture=centralized",
        "rates.network_hz=1024",
        "link.delay_periods=2",
        "coupling.remote_hand_object={stiffness_n_per_m=85, damping_n_s_per_m=3}",
    ]);
    let (before, after) = push(&server, 1, 5);
    assert!((after / before - 1.0).abs() < 1e-9, "{before} {after}");
}

#[test]
fn without_delay_a_common_drift_meets_no_force() {
    let scene = scene(&[RESTING, "rates.network_hz=1024", "link.delay_periods=0"]);
    let mut session = Hand2Hand::new(&scene);
    session.settle();
    for (state, hand) in session.states.iter_mut().zip(&mut session.hands) {
        state.bodies[0].twist.linear.x = 0.1;
        let mut moving = hand.states()[0];
        moving.velocity.x = 0.1;
        hand.set_state(0, moving);
    }
    for _ in 0..1024 {
        let outputs = session.tick();
        assert!(outputs.iter().all(|output| output.device[0].force.length() < 1e-9));
    }
    assert!((session.states[1].bodies[0].twist.linear.x - 0.1).abs() < 1e-9);
}

#[test]
fn held_samples_damp_the_drift() {
    let (before, after) = push(&scene(&[RESTING, "link.delay_periods=0"]), 2, 2);
    assert!(after > 0.0 && after < 0.2 * before, "{before} {after}");
}

#[test]
fn a_peer_fades_in_and_out_and_is_forgotten() {
    let mut session = Hand2Hand::new(&scene(&[RESTING]));
    let mut last = 0.0;
    for _ in 0..1024 {
        session.tick();
        let fade = session.states[0].peers[1].fade;
        assert!(fade >= last && fade - last < 0.005, "no jump");
        last = fade;
    }
    assert_eq!(last, 1.0);
    let model = session.models[0].clone();
    session.states[0].set_present(model.host.others(2).next().unwrap(), false);
    for _ in 0..1024 {
        session.tick();
    }
    assert_eq!(session.states[0].peers[1].fade, 0.0);
}

#[test]
fn a_snapshot_restores_the_run_bit_for_bit() {
    for architecture in ["distributed", "centralized"] {
        let scene = scene(&[
            &format!("session.architecture={architecture}"),
            "session.users=3",
            "link.delay_periods=3",
            "coupling.remote_hand_object={stiffness_n_per_m=85, damping_n_s_per_m=3}",
        ]);
        let mut session = Hand2Hand::new(&scene);
        session.settle();
        let saved = (session.states.clone(), session.hands.clone(), session.tick);
        let first: Vec<_> = (0..300).flat_map(|_| session.tick()).collect();
        (session.states, session.hands, session.tick) = saved;
        let again: Vec<_> = (0..300).flat_map(|_| session.tick()).collect();
        assert_eq!(first, again);
        assert!(first.iter().any(|output| output.device[0] != Wrench::default()));
    }
}

#[test]
fn a_world_that_leaves_all_bounds_stops_and_renders_nothing() {
    let scene = scene(&["object.damping_n_s_per_m=-100"]);
    let mut session = Hand2Hand::new(&scene);
    let mut last = TickOutput::default();
    for _ in 0..60 * 1024 {
        last = session.tick().swap_remove(0);
        assert!(last.device.iter().all(Wrench::is_finite));
    }
    assert!(last.diverged && last.device[..] == [Wrench::default()]);
    assert!(session.states[0].bodies[0].is_within(1e3));
}

#[test]
fn a_late_joiner_takes_the_world_as_it_is() {
    let scene = scene(&[RESTING]);
    let mut session = Hand2Hand::new(&scene);
    session.settle();
    session.states[0].bodies[0].pose.position.x = 0.3;
    let mut hand = session.hands[0].states()[0];
    hand.position.x = 0.3;
    session.hands[0].set_state(0, hand);
    session.states[1] = HostState::new(&session.models[1]);
    session.states[1].set_present(session.models[0].host, true);
    session.states[1].adopting = true;
    session.tick();
    while session.states[1].adopting {
        session.tick();
    }
    assert!((session.states[1].bodies[0].pose.position.x - 0.3).abs() < 0.01);
}
