//! The running code and the analysis describe the same loop where the object is soft, number by number.
//!
//! As in `agreement.rs`; here the state also has the body in all its coordinates, frames that wait or are in use, the
//! forces with which they were stepped, and integrals. Two-sided contacts make the loop linear about rest.

use std::sync::Arc;

use crate::support::{assert_nothing_acted, visit};
use cotouch_analysis::compile_unreduced;
use cotouch_analysis::loop_spec::LoopSpec;
use cotouch_device::SimulatedUser;
use cotouch_host::SlowFrame;
use cotouch_runtime::{SlowPort, VirtualSession};
use cotouch_scene::names::{Coordinate, HostIndex};
use cotouch_scene::parse;
use cotouch_scene::scene::Scene;
use cotouch_soft::MaterialPoint;
use cotouch_testkit::scenes::{edited, local_model_kinds};

type Session = VirtualSession<SimulatedUser>;

/// Largest difference of an element, as a share of the matrix's norm.
const TOLERANCE: f64 = 1e-9;
/// The move of a coordinate to either side: the tetrahedra turn, so that differences have errors of its square.
const STEP: f64 = 1e-6;

const BLOCK: &str = r#"
description = "A cube that two fingers hold for good."
space = "space"
[session]
architecture = "distributed"
users = 2
[rates]
control_hz = 1000
network_hz = 250
simulation_hz = 125
[link]
delay_periods = 1
[hand]
mass_kg = 0.1
damping_n_s_per_m = 5
stiffness_n_per_m = 40
[soft]
model = "corotational"
young_pa = 4e3
mesh = { generator = "block", size_m = [0.05, 0.05, 0.05], cells = [1, 1, 1] }
[[soft.fixed]]
from_m = [0, 0, 0]
to_m = [0, 0.05, 0.05]
[local_model]
sides = "two"
[[user]]
name = "anna"
[[user.finger]]
position_m = [0.06, 0.011, 0.03]
[[user]]
name = "ben"
[[user.finger]]
position_m = [0.055, 0.033, 0.017]
"#;

fn block(settings: &[&str]) -> Scene {
    let overrides: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    parse(BLOCK, "block", None, &overrides).unwrap()
}

fn spring(settings: &[&str]) -> Scene {
    let own = ["local_model.sides=two", "rates.simulation_hz=100", "rates.network_hz=500"];
    let overrides: Vec<_> = own.iter().chain(settings).map(|setting| setting.parse().unwrap()).collect();
    edited(&cotouch_scene::load("spring", &overrides).unwrap(), |scene| scene.users[0].script.clear())
}

/// A session about rest, at an instant where the pattern begins.
struct Probe {
    scene: Scene,
    of: LoopSpec,
    session: Session,
    tick: u64,
    /// Of every finger slot.
    anchors: Vec<MaterialPoint>,
    /// Node and axis of every free coordinate of the body.
    free: Vec<(u32, u8)>,
}

impl Probe {
    fn at_rest(scene: &Scene) -> Self {
        let of = compile_unreduced(scene).unwrap();
        let user = |host| (SimulatedUser::new(scene, host).unwrap(), None);
        let mut session = VirtualSession::with_devices(scene, user).unwrap();
        let settled = (1.5 * scene.rates.control_hz.hz()) as u64;
        let tick = settled.next_multiple_of(of.ticks_per_pattern());
        assert!(session.run_to_tick(tick, |_, _| {}), "the hosts did not join");
        let station = &session.hosts()[0].station;
        let simulation = station.soft().and_then(SlowPort::simulation).unwrap();
        let free = simulation.body().linear().unwrap().coordinates;
        let contacts = &station.state.host.soft.contacts;
        let anchors = contacts.iter().map(|contact| contact.anchor).collect();
        Self { scene: scene.clone(), of, session, tick, anchors, free }
    }

    /// One column of the map by a central difference.
    fn column(&self, moved: Coordinate, coordinates: &[Coordinate]) -> Vec<f64> {
        let above = self.run_moved(moved, STEP, coordinates);
        let below = self.run_moved(moved, -STEP, coordinates);
        above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * STEP)).collect()
    }

    fn run_moved(&self, moved: Coordinate, by: f64, coordinates: &[Coordinate]) -> Vec<f64> {
        let mut session = self.session.fork();
        self.visit(&mut session, moved, self.tick, &mut |value| *value += by);
        let end = self.tick + self.of.ticks_per_pattern();
        session.run_to_tick(end, assert_nothing_acted);
        let read = |coordinate: &Coordinate| {
            let mut found = 0.0;
            self.visit(&mut session, *coordinate, end, &mut |value| found = *value);
            found
        };
        coordinates.iter().map(read).collect()
    }

    /// Reads or writes a number wherever it is at the instant of `tick`.
    fn visit(&self, session: &mut Session, coordinate: Coordinate, tick: u64, act: &mut dyn FnMut(&mut f64)) {
        match coordinate {
            Coordinate::Integral { host, slot } => {
                let soft = &mut session.host_mut(host).station.state.host.soft;
                act(&mut soft.contacts[usize::from(slot)].integral_n);
            }
            Coordinate::LawMemory { host, slot, number } => {
                let soft = &mut session.host_mut(host).station.state.host.soft;
                act(&mut soft.contacts[usize::from(slot)].memory[usize::from(number)]);
            }
            Coordinate::SoftBody { host, index } => self.visit_body(session, host, index as usize, act),
            Coordinate::Surface { host, age, slot, axis } => {
                self.visit_surface(frame(session, host, age), usize::from(slot), axis.index(), act);
            }
            Coordinate::SteppedForce { host, age, slot, axis } => {
                let frame = frame(session, host, age);
                let place = frame.slots.iter().position(|&known| known == slot).unwrap();
                act(&mut frame.forces_n[place][axis.index()]);
            }
            name => assert!(visit(session, name, tick, act), "{name} is nowhere"),
        }
    }

    /// The body after its last step, and the frame that shows it.
    fn visit_body(
        &self,
        session: &mut Session,
        host: HostIndex,
        index: usize,
        act: &mut dyn FnMut(&mut f64),
    ) {
        let soft = session.host_mut(host).station.soft_mut().unwrap();
        let body = soft.simulation_mut().unwrap().body_mut();
        let mut state = body.state().clone();
        let (node, axis) = self.free[index % self.free.len()];
        let (node, axis) = (node as usize, usize::from(axis));
        if index < self.free.len() {
            let mut moved = state.positions_m[node][axis] - body.rest_m()[node][axis];
            let before = moved;
            act(&mut moved);
            if moved != before {
                state.positions_m[node][axis] += moved - before;
            }
        } else {
            act(&mut state.velocities_m_per_s[node][axis]);
        }
        body.set_state(&state);
        let newest = frame(session, host, 1);
        newest.positions_m.clone_from(&state.positions_m);
        newest.surface.deform(&state.positions_m).unwrap();
    }

    /// How far an anchor is from rest in a frame; written, all others stay where they are.
    fn visit_surface(&self, frame: &mut SlowFrame, slot: usize, axis: usize, act: &mut dyn FnMut(&mut f64)) {
        let anchor = self.anchors[slot];
        let rest =
            anchor.at(self.session.hosts()[0].station.soft().unwrap().simulation().unwrap().body().rest_m());
        let before = anchor.at(&frame.positions_m)[axis] - rest[axis];
        let mut moved = before;
        act(&mut moved);
        if moved == before {
            return;
        }
        for (node, share) in lone_move(&self.anchors, slot) {
            frame.positions_m[node as usize][axis] += share * (moved - before);
        }
        let positions = frame.positions_m.clone();
        frame.surface.deform(&positions).unwrap();
    }

    fn assert_agreement(&self, label: &str) {
        let map = self.of.lift().unwrap();
        let norm = map.matrix.norm();
        assert!(norm > 1.0, "{label}: a map without content agrees with anything");
        for (column, &coordinate) in map.coordinates.iter().enumerate() {
            let measured = self.column(coordinate, &map.coordinates);
            for (row, value) in measured.iter().enumerate() {
                let expected = map.matrix[(row, column)];
                assert!(
                    (value - expected).abs() <= TOLERANCE * norm,
                    "{label}: d {} / d {coordinate} is {expected} in the analysis and {value} in the running code of {} (norm {norm})",
                    map.coordinates[row],
                    self.scene.name,
                );
            }
        }
    }
}

/// The frame that came so many periods before the next one: waiting, in use, or used before.
fn frame(session: &mut Session, host: HostIndex, age: u32) -> &mut SlowFrame {
    let station = &mut session.host_mut(host).station;
    let waiting = station.soft().unwrap().waiting().len();
    let age = age as usize;
    let frame = if age <= waiting {
        &mut station.soft_mut().unwrap().waiting_mut()[waiting - age]
    } else {
        let soft = &mut station.state.host.soft;
        match age - waiting {
            1 => soft.frame.as_mut().unwrap(),
            2 => soft.previous.as_mut().unwrap(),
            _ => panic!("nobody needs a frame of age {age}"),
        }
    };
    Arc::make_mut(frame)
}

/// Shares of a move of nodes that moves one anchor by the whole and up to one other not at all: Jᵀ·(J·Jᵀ)⁻¹·e.
fn lone_move(anchors: &[MaterialPoint], slot: usize) -> Vec<(u32, f64)> {
    let overlap = |one: &MaterialPoint, other: &MaterialPoint| -> f64 {
        let pairs = one.nodes.iter().zip(one.weights).flat_map(|(node, weight)| {
            other.nodes.iter().zip(other.weights).map(move |(&known, share)| (node == &known, weight * share))
        });
        pairs.filter(|(same, _)| *same).map(|(_, product)| product).sum()
    };
    let own = anchors[slot];
    let shares = |anchor: &MaterialPoint, by: f64| {
        anchor.nodes.iter().copied().zip(anchor.weights.map(|weight| weight * by)).collect::<Vec<_>>()
    };
    match anchors {
        [_] => shares(&own, 1.0 / overlap(&own, &own)),
        [_, _] => {
            let other = anchors[1 - slot];
            let [a, b, c] = [overlap(&own, &own), overlap(&own, &other), overlap(&other, &other)];
            let determinant = a * c - b * b;
            let mut all = shares(&own, c / determinant);
            all.extend(shares(&other, -b / determinant));
            all
        }
        _ => panic!("at most two anchors are told apart"),
    }
}

fn assert_agreement(scene: &Scene, label: &str) {
    Probe::at_rest(scene).assert_agreement(label);
}

#[test]
fn one_finger_on_a_spring() {
    for kind in local_model_kinds() {
        for returned in ["first", "mean", "last"] {
            for hold in ["zero", "first"] {
                for delay in ["0", "1"] {
                    let settings = [
                        format!("local_model.kind={kind}"),
                        format!("local_model.returned_force={returned}"),
                        format!("local_model.hold={hold}"),
                        format!("local_model.result_delay_periods={delay}"),
                    ];
                    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
                    assert_agreement(&spring(&settings), &settings.join(" "));
                }
            }
        }
    }
}

#[test]
fn two_users_on_tetrahedra() {
    let distributed =
        [("first", "zero", "0"), ("mean", "zero", "1"), ("mean", "first", "0"), ("last", "first", "1")];
    let centralized =
        [("mean", "zero", "1"), ("first", "first", "1"), ("last", "zero", "1"), ("mean", "zero", "0")];
    for (architecture, periods) in [("distributed", distributed), ("centralized", centralized)] {
        for (kind, (returned, hold, delay)) in local_model_kinds().iter().zip(periods.into_iter().cycle()) {
            let settings = [
                format!("session.architecture={architecture}"),
                format!("local_model.kind={kind}"),
                format!("local_model.returned_force={returned}"),
                format!("local_model.hold={hold}"),
                format!("local_model.result_delay_periods={delay}"),
            ];
            let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
            assert_agreement(&block(&settings), &settings.join(" "));
        }
    }
}

#[test]
fn other_bodies_rates_and_devices() {
    for settings in [
        &["soft.model=mass-spring", "soft.poisson_ratio=0.25", "local_model.kind=compliance"][..],
        &["soft.quasi_static=true", "local_model.kind=pi", "local_model.hold=first"],
        // Neither a slow period nor a network period is a whole number of ticks.
        &["rates.control_hz=600", "rates.network_hz=250", "rates.simulation_hz=80", "local_model.kind=pi"],
        &["device.velocity=difference", "governor.damping_n_s_per_m=1.5", "link.delay_periods=2"],
        &["session.architecture=centralized", "link.delay_periods=3", "link.return_delay_periods=1"],
        &["link.impairment.latency_s=0.007", "link.play_out=on-arrival", "local_model.kind=pi"],
    ] {
        assert_agreement(&block(settings), &settings.join(" "));
    }
}
