//! A session written out tick by tick, with packets and queues, and nothing in common with the analysis but the scene.

use std::collections::VecDeque;

use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Action, Architecture, Coordination, Integrator, PlayOut, Scene, SpringDamper};

#[derive(Clone, Copy, Debug, Default)]
struct Point {
    x: f64,
    v: f64,
}

fn pull(spring: SpringDamper, end: Point, anchor: Point) -> f64 {
    spring.stiffness_n_per_m * (anchor.x - end.x) + spring.damping_n_s_per_m * (anchor.v - end.v)
}

/// One sample on its way: hand, object (distributed), force (centralized, from the server).
#[derive(Clone, Copy, Debug, Default)]
struct Packet {
    step: i64,
    arrival_s: f64,
    hand: Point,
    object: Point,
    force: f64,
}

struct Host {
    hand: Point,
    object: Point,
    /// What came or will come from each host, oldest first.
    inbox: Vec<VecDeque<Packet>>,
    held: Vec<Packet>,
}

pub(crate) struct Simulation {
    scene: Scene,
    hosts: Vec<Host>,
    wall: bool,
}

/// Instants nearer than this are the same.
const SAME_S: f64 = 1e-9;

impl Simulation {
    /// At rest, with the samples of steps −1 … −`history` everywhere.
    pub(crate) fn new(scene: &Scene, wall: bool, history: i64) -> Self {
        let users = usize::from(scene.session.users);
        let host = |_| Host {
            hand: Point::default(),
            object: Point::default(),
            inbox: vec![VecDeque::new(); users],
            held: vec![Packet::default(); users],
        };
        let mut simulation = Self { scene: scene.clone(), hosts: (0..users).map(host).collect(), wall };
        for to in 0..users {
            for from in (0..users).filter(|&from| from != to) {
                for step in -history..0 {
                    let arrival_s = simulation.arrival_s(from, to, step);
                    let packet = Packet { step, arrival_s, ..Packet::default() };
                    simulation.hosts[to].inbox[from].push_back(packet);
                }
            }
        }
        simulation
    }

    pub(crate) fn number(&mut self, name: Coordinate, steps_done: i64) -> &mut f64 {
        match name {
            Coordinate::Own { host, part, quantity } => {
                let host = &mut self.hosts[host.index()];
                let point = if part == Part::HAND { &mut host.hand } else { &mut host.object };
                if quantity == Quantity::X { &mut point.x } else { &mut point.v }
            }
            Coordinate::Held { host, from, part, quantity, age } => {
                let inbox = &mut self.hosts[host.index()].inbox[from.index()];
                let step = steps_done - i64::from(age);
                let packet = inbox.iter_mut().find(|packet| packet.step == step).expect("kept long enough");
                let point = match part {
                    Part::FORCE => return &mut packet.force,
                    Part::HAND => &mut packet.hand,
                    Part::OBJECT => &mut packet.object,
                    _ => panic!("a session on a line has no {part}"),
                };
                if quantity == Quantity::X { &mut point.x } else { &mut point.v }
            }
            soft => panic!("{soft} is not of a rigid body"),
        }
    }

    /// One pattern of ticks.
    pub(crate) fn pattern(&mut self) {
        for tick in 0..self.scene.schedule().ticks_per_pattern() {
            match self.scene.schedule().step_at(tick) {
                Some(step) => self.network_step(tick, step as i64),
                None if self.scene.link.play_out == PlayOut::OnArrival => self.play_out(tick, None),
                None => {}
            }
            self.tick();
        }
    }

    fn centralized(&self) -> bool {
        self.scene.session.architecture == Architecture::Centralized
    }

    fn period_s(&self) -> f64 {
        self.scene.rates.control_hz.period_s()
    }

    /// When the packet of a step arrives, from the instant at which the step really happens.
    fn arrival_s(&self, from: usize, to: usize, step: i64) -> f64 {
        let ratio = self.scene.rates.control_hz.hz() / self.scene.rates.network_hz.hz();
        let tick = (step as f64 * ratio - 1e-6).ceil();
        let (from, to) = (HostIndex(from as u8), HostIndex(to as u8));
        tick * self.period_s() + self.scene.impairment(from, to).latency_s
    }

    fn send(&mut self, from: usize, to: usize, packet: Packet) {
        let arrival_s = self.arrival_s(from, to, packet.step);
        self.hosts[to].inbox[from].push_back(Packet { arrival_s, ..packet });
    }

    fn network_step(&mut self, tick: u64, step: i64) {
        let users = self.hosts.len();
        for from in 0..users {
            let Host { hand, object, .. } = self.hosts[from];
            for to in (0..users).filter(|&to| to != from) {
                // The server's packet waits for its force.
                if !self.centralized() || from != 0 {
                    self.send(from, to, Packet { step, hand, object, ..Packet::default() });
                }
            }
        }
        self.play_out(tick, Some(step));
        if self.centralized() {
            for client in 1..users {
                let held_hand = self.hosts[0].held[client].hand;
                let force = pull(self.scene.coupling.remote_hand_object, held_hand, self.hosts[0].object);
                self.send(0, client, Packet { step, force, ..Packet::default() });
            }
            self.play_out(tick, Some(step));
        }
    }

    /// Every host holds the newest sample that is due.
    fn play_out(&mut self, tick: u64, step: Option<i64>) {
        let now_s = tick as f64 * self.period_s() + SAME_S;
        for to in 0..self.hosts.len() {
            for from in (0..self.hosts.len()).filter(|&from| from != to) {
                let periods = i64::from(self.scene.play_out_periods(HostIndex(from as u8)));
                let on_arrival = self.scene.link.play_out == PlayOut::OnArrival;
                let is_due = |packet: &&Packet| {
                    let scheduled = step.is_some_and(|step| packet.step + periods <= step);
                    packet.arrival_s <= now_s && (on_arrival || scheduled)
                };
                let host = &mut self.hosts[to];
                if let Some(packet) = host.inbox[from].iter().filter(is_due).max_by_key(|packet| packet.step)
                {
                    host.held[from] = *packet;
                }
            }
        }
    }

    fn tick(&mut self) {
        let forces: Vec<_> = (0..self.hosts.len()).map(|host| self.forces(host)).collect();
        for (index, (on_hand, on_object)) in forces.into_iter().enumerate() {
            let period_s = self.period_s();
            let hand = self.hosts[index].hand;
            self.hosts[index].hand = self.step_hand(index, hand, on_hand);
            let Point { x, v } = self.hosts[index].object;
            let a = on_object / self.scene.object.mass_kg;
            let new_v = v + period_s * a;
            let new_x = match self.scene.session.integrator {
                Integrator::ExactHold => x + period_s * v + period_s * period_s / 2.0 * a,
                Integrator::SemiImplicitEuler => x + period_s * new_v,
            };
            self.hosts[index].object = Point { x: new_x, v: new_v };
        }
    }

    fn forces(&self, index: usize) -> (f64, f64) {
        let (scene, host, users) = (&self.scene, &self.hosts[index], self.hosts.len());
        let coupling = &scene.coupling;
        let Host { hand, object, held, .. } = host;
        let governor = -scene.governor.damping_n_s_per_m * hand.v;
        if self.centralized() && index > 0 {
            return (held[0].force + governor, 0.0);
        }
        let mut on_object =
            pull(coupling.hand_object, *object, *hand) - scene.object.damping_n_s_per_m * object.v;
        if self.wall {
            on_object -= scene.wall.stiffness_n_per_m * object.x + scene.wall.damping_n_s_per_m * object.v;
        }
        let others = || (0..users).filter(|&other| other != index);
        for other in others() {
            on_object += pull(coupling.remote_hand_object, *object, held[other].hand);
        }
        if !self.centralized() {
            let copies: Vec<_> = others().map(|other| held[other].object).collect();
            on_object += match scene.session.coordination {
                Coordination::Pairwise => {
                    copies.iter().map(|&copy| pull(coupling.object_object, *object, copy)).sum::<f64>()
                }
                Coordination::Average => {
                    let count = users as f64;
                    let mean = Point {
                        x: (object.x + copies.iter().map(|copy| copy.x).sum::<f64>()) / count,
                        v: (object.v + copies.iter().map(|copy| copy.v).sum::<f64>()) / count,
                    };
                    pull(coupling.object_object, *object, mean)
                }
            };
        }
        (pull(coupling.hand_object, *hand, *object) + governor, on_object)
    }

    /// The Taylor series of the hand's motion under a constant force: derivative after derivative.
    fn step_hand(&self, index: usize, hand: Point, force: f64) -> Point {
        let user = &self.scene.users[index];
        let tracks = user.script.iter().any(Action::tracks);
        let tracking = if tracks {
            user.tracking
        } else {
            SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m: 0.0 }
        };
        let k = self.scene.hand.stiffness_n_per_m + tracking.stiffness_n_per_m;
        let b = self.scene.hand.damping_n_s_per_m + tracking.damping_n_s_per_m;
        let (m, period_s) = (self.scene.hand.mass_kg, self.period_s());
        let mut derivatives = vec![hand.x, hand.v, (force - k * hand.x - b * hand.v) / m];
        for order in 3..40 {
            derivatives.push((-k * derivatives[order - 2] - b * derivatives[order - 1]) / m);
        }
        let sum = |skip: usize| {
            let mut factor = 1.0;
            let mut sum = 0.0;
            for (order, derivative) in derivatives[skip..].iter().enumerate() {
                sum += derivative * factor;
                factor *= period_s / (order + 1) as f64;
            }
            sum
        };
        Point { x: sum(0), v: sum(1) }
    }
}
