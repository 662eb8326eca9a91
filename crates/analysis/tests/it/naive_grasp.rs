//! A session with one body in several fingers, written out tick by tick with its true, nonlinear forces: rotation
//! matrices instead of linear terms, packets and queues instead of delay lines.

use std::collections::VecDeque;

use cotouch_analysis::{FingerContact, OperatingPoint};
use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Architecture, Integrator, Scene, ShapeKind, SpringDamper, VelocityEstimate};
use glam::{DMat3, DQuat, DVec3};

#[derive(Clone, Copy, Debug)]
struct Motion {
    x: DVec3,
    v: DVec3,
    q: DQuat,
    w: DVec3,
}

impl Motion {
    fn at(x: DVec3, q: DQuat) -> Self {
        Self { x, v: DVec3::ZERO, q, w: DVec3::ZERO }
    }
}

#[derive(Clone, Debug)]
struct Packet {
    step: i64,
    hands: Vec<Motion>,
    object: Motion,
    forces: Vec<DVec3>,
}

#[derive(Clone, Debug)]
struct Host {
    hands: Vec<Motion>,
    last_read: Vec<DVec3>,
    last_told: Vec<DVec3>,
    object: Motion,
    inbox: Vec<VecDeque<Packet>>,
    held: Vec<Packet>,
}

pub(crate) struct Simulation {
    scene: Scene,
    point: OperatingPoint,
    inertia: DMat3,
    hosts: Vec<Host>,
    /// What holds everything still at the operating point.
    hand_bias: Vec<Vec<DVec3>>,
    object_bias: Vec<(DVec3, DVec3)>,
}

/// To full precision for small angles too.
fn rotation_vector(q: DQuat) -> DVec3 {
    let (imaginary, real) = if q.w < 0.0 { (-q.xyz(), -q.w) } else { (q.xyz(), q.w) };
    let sine = imaginary.length();
    if sine == 0.0 { DVec3::ZERO } else { imaginary * (2.0 * sine.atan2(real) / sine) }
}

/// Which directions are free.
fn free(scene: &Scene) -> (DVec3, DVec3) {
    use cotouch_scene::scene::Space::{Line, Plane, Space};
    match scene.space {
        Line => (DVec3::X, DVec3::ZERO),
        Plane => (DVec3::new(1.0, 1.0, 0.0), DVec3::Z),
        Space => (DVec3::ONE, DVec3::ONE),
    }
}

/// The force on a finger at `centre` moving at `velocity` from a body: the law of the scene's documentation.
pub(crate) fn contact_force(
    scene: &Scene,
    contact: &FingerContact,
    (centre, velocity): (DVec3, DVec3),
    body: (DVec3, DQuat, DVec3, DVec3),
) -> DVec3 {
    let (position, turn, linear, angular) = body;
    let own = contact.host == contact.user;
    let coupling = &scene.coupling;
    let (normal_spring, tangential) = if own {
        (coupling.hand_object, coupling.hand_object_tangential)
    } else {
        (coupling.remote_hand_object, coupling.remote_hand_object_tangential)
    };
    let local = turn.inverse() * (centre - position);
    let speed = turn.inverse() * (velocity - linear - angular.cross(centre - position));
    let radius = scene.hand.finger_radius_m;
    let (n, depth) = match scene.object.shape.kind {
        ShapeKind::Ball => (local.normalize(), scene.object.shape.radius_m + radius - local.length()),
        _ => {
            let half = (scene.object.shape.size_m * 0.5).dot(contact.normal.abs());
            (contact.normal, half + radius - local.dot(contact.normal))
        }
    };
    let along = |vector: DVec3| vector - n * n.dot(vector);
    let press = normal_spring.stiffness_n_per_m * depth - normal_spring.damping_n_s_per_m * n.dot(speed);
    let force = n * press
        - along(local - contact.anchor) * tangential.stiffness_n_per_m
        - along(speed) * tangential.damping_n_s_per_m;
    turn * force
}

impl Simulation {
    pub(crate) fn new(scene: &Scene, point: &OperatingPoint, inertia: DMat3, history: i64) -> Self {
        let users = usize::from(scene.session.users);
        let hands_of = |user: usize| -> Vec<Motion> {
            let fingers = 0..scene.users[user].fingers.len();
            let place = |finger: usize| {
                let found = point
                    .fingers
                    .iter()
                    .find(|contact| contact.user.index() == user && usize::from(contact.finger) == finger);
                let centre =
                    found.map_or(scene.users[user].fingers[finger].position_m, |contact| contact.centre);
                Motion::at(centre, DQuat::IDENTITY)
            };
            fingers.map(place).collect()
        };
        let object_of =
            |host: usize| Motion::at(point.poses[host][0].position, point.poses[host][0].orientation);
        let packet = |from: usize, step: i64| Packet {
            step,
            hands: hands_of(from),
            object: object_of(from),
            forces: vec![DVec3::ZERO; 4],
        };
        let host = |index: usize| Host {
            hands: hands_of(index),
            last_read: hands_of(index).iter().map(|hand| hand.x).collect(),
            last_told: vec![DVec3::ZERO; hands_of(index).len()],
            object: object_of(index),
            inbox: (0..users).map(|from| (-history..0).map(|step| packet(from, step)).collect()).collect(),
            held: (0..users).map(|from| packet(from, -1)).collect(),
        };
        let hosts: Vec<Host> = (0..users).map(host).collect();
        let hand_bias = hosts.iter().map(|host| vec![DVec3::ZERO; host.hands.len()]).collect();
        let mut simulation = Self {
            scene: scene.clone(),
            point: point.clone(),
            inertia,
            hosts,
            hand_bias,
            object_bias: vec![(DVec3::ZERO, DVec3::ZERO); users],
        };
        simulation.balance();
        simulation
    }

    /// Sets all biases, and the forces in flight.
    fn balance(&mut self) {
        let users = self.hosts.len();
        if self.centralized() {
            for client in 1..users {
                let forces: Vec<_> = (0..4).map(|finger| self.force_for(client, finger)).collect();
                self.hosts[client].held[0].forces.clone_from(&forces);
                for packet in &mut self.hosts[client].inbox[0] {
                    packet.forces.clone_from(&forces);
                }
            }
        }
        for host in 0..users {
            let (hands, force, torque) = self.forces(host);
            self.hand_bias[host] = hands.iter().map(|&force| -force).collect();
            self.object_bias[host] = (-force, -torque);
        }
    }

    fn centralized(&self) -> bool {
        self.scene.session.architecture == Architecture::Centralized
    }

    fn period_s(&self) -> f64 {
        self.scene.rates.control_hz.period_s()
    }

    fn told(&self, host: usize, finger: usize) -> Motion {
        let host = &self.hosts[host];
        let hand = host.hands[finger];
        let difference = (hand.x - host.last_read[finger]) / self.period_s();
        let v = match self.scene.device.velocity {
            VelocityEstimate::Exact => hand.v,
            VelocityEstimate::Difference => difference,
            VelocityEstimate::Filtered => {
                let omega = std::f64::consts::TAU * self.scene.device.velocity_cutoff_hz;
                let share = 1.0 - (-omega * self.period_s()).exp();
                host.last_told[finger] + (difference - host.last_told[finger]) * share
            }
        };
        Motion { v, ..hand }
    }

    /// What the server computes for a client's finger.
    fn force_for(&self, client: usize, finger: usize) -> DVec3 {
        let contacts = self.point.fingers.iter().filter(|contact| {
            contact.host.index() == 0
                && contact.user.index() == client
                && usize::from(contact.finger) == finger
        });
        contacts.map(|contact| self.contact(contact)).sum()
    }

    fn contact(&self, contact: &FingerContact) -> DVec3 {
        let (host, finger) = (contact.host.index(), usize::from(contact.finger));
        let hand = if contact.user == contact.host {
            self.told(host, finger)
        } else {
            self.hosts[host].held[contact.user.index()].hands[finger]
        };
        let Motion { x, v, q, w } = self.hosts[host].object;
        contact_force(&self.scene, contact, (hand.x, hand.v), (x, q, v, w))
    }

    /// Forces on the hands, force and torque on the object of a host, biases included.
    fn forces(&self, index: usize) -> (Vec<DVec3>, DVec3, DVec3) {
        let (scene, host) = (&self.scene, &self.hosts[index]);
        let mut hands: Vec<DVec3> = self.hand_bias[index].clone();
        let (mut force, mut torque) = self.object_bias[index];
        for (finger, on_hand) in hands.iter_mut().enumerate() {
            *on_hand -= self.told(index, finger).v * scene.governor.damping_n_s_per_m;
            if self.centralized() && index > 0 {
                *on_hand += host.held[0].forces[finger];
            }
        }
        let Motion { x, v, q, w } = host.object;
        for contact in self.point.fingers.iter().filter(|contact| contact.host.index() == index) {
            let on_finger = self.contact(contact);
            let finger = usize::from(contact.finger);
            let own = contact.user == contact.host;
            if own {
                hands[finger] += on_finger;
            }
            let centre =
                if own { host.hands[finger].x } else { host.held[contact.user.index()].hands[finger].x };
            force -= on_finger;
            torque -= (centre - x).cross(on_finger);
        }
        for corner in self.point.corners.iter().filter(|corner| corner.host.index() == index) {
            let at = self.point.poses[index][0];
            let rest = at.position + at.orientation * corner.corner;
            let arm = q * corner.corner;
            let n = scene.walls()[corner.wall].normal.normalize();
            let split = |vector: DVec3, normal: f64, tangential: f64| {
                let across = n * n.dot(vector);
                across * normal + (vector - across) * tangential
            };
            let wall = &scene.wall;
            let on_body = corner.force
                - split(x + arm - rest, wall.stiffness_n_per_m, wall.tangential_stiffness_n_per_m)
                - split(v + w.cross(arm), wall.damping_n_s_per_m, wall.tangential_damping_n_s_per_m);
            force += on_body;
            torque += arm.cross(on_body);
        }
        let damping = scene.object.axis_damping_n_s_per_m + DVec3::splat(scene.object.damping_n_s_per_m);
        force -= damping * v;
        torque -= w * scene.object.rotational_damping_n_m_s_per_rad;
        if !self.centralized() {
            let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = scene.coupling.object_object;
            let turning = scene.coupling.object_object_rotational;
            for other in (0..self.hosts.len()).filter(|&other| other != index) {
                let far = host.held[other].object;
                force += (far.x - x) * k + (far.v - v) * b;
                torque += rotation_vector(far.q * q.inverse()) * turning.stiffness_n_m_per_rad
                    + (far.w - w) * turning.damping_n_m_s_per_rad;
            }
        }
        (hands, force, torque)
    }

    pub(crate) fn pattern(&mut self) {
        for tick in 0..self.scene.schedule().ticks_per_pattern() {
            if let Some(step) = self.scene.schedule().step_at(tick) {
                self.network_step(step as i64);
            }
            self.tick();
        }
    }

    fn network_step(&mut self, step: i64) {
        let users = self.hosts.len();
        for from in 0..users {
            let hands: Vec<_> =
                (0..self.hosts[from].hands.len()).map(|finger| self.told(from, finger)).collect();
            let object = self.hosts[from].object;
            for to in (0..users).filter(|&to| to != from) {
                if !self.centralized() || from != 0 {
                    let packet = Packet { step, hands: hands.clone(), object, forces: vec![] };
                    self.hosts[to].inbox[from].push_back(packet);
                }
            }
        }
        self.play_out(step);
        if self.centralized() {
            for client in 1..users {
                let forces: Vec<_> = (0..4).map(|finger| self.force_for(client, finger)).collect();
                let host = &mut self.hosts[client];
                let packet = Packet { step, forces, ..host.held[0].clone() };
                host.inbox[0].push_back(packet);
            }
            self.play_out(step);
        }
    }

    fn play_out(&mut self, step: i64) {
        for to in 0..self.hosts.len() {
            for from in (0..self.hosts.len()).filter(|&from| from != to) {
                let periods = i64::from(self.scene.play_out_periods(HostIndex(from as u8)));
                let host = &mut self.hosts[to];
                if let Some(packet) = host.inbox[from].iter().find(|packet| packet.step == step - periods) {
                    host.held[from] = packet.clone();
                }
            }
        }
    }

    fn tick(&mut self) {
        let forces: Vec<_> = (0..self.hosts.len()).map(|host| self.forces(host)).collect();
        let (moves, turns) = free(&self.scene);
        let period_s = self.period_s();
        for (index, (on_hands, force, torque)) in forces.into_iter().enumerate() {
            for (finger, on_hand) in on_hands.into_iter().enumerate() {
                let told = self.told(index, finger);
                let rest = self.rest(index, finger);
                self.hosts[index].last_read[finger] = told.x;
                self.hosts[index].last_told[finger] = told.v;
                let hand = &mut self.hosts[index].hands[finger];
                (hand.x, hand.v) = step_hand(&self.scene, index, *hand, rest, on_hand * moves, period_s);
            }
            let object = &mut self.hosts[index].object;
            let euler = self.scene.session.integrator == Integrator::SemiImplicitEuler;
            let half = if euler { 1.0 } else { 0.5 };
            let a = force * moves / self.scene.object.mass_kg;
            object.x += object.v * period_s + a * (half * period_s * period_s);
            object.v += a * period_s;
            let turn = DMat3::from_quat(object.q);
            let inertia = turn * self.inertia * turn.transpose();
            let torque = torque - object.w.cross(inertia * object.w);
            let spin = if turns == DVec3::Z {
                DVec3::Z * (torque.z / inertia.z_axis.z)
            } else {
                inertia.inverse() * torque
            };
            let by = object.w * period_s + spin * (half * period_s * period_s);
            object.q = (DQuat::from_scaled_axis(by) * object.q).normalize();
            object.w += spin * period_s;
        }
    }

    fn rest(&self, user: usize, finger: usize) -> DVec3 {
        let contact = self
            .point
            .fingers
            .iter()
            .find(|contact| contact.user.index() == user && usize::from(contact.finger) == finger);
        contact.map_or(self.scene.users[user].fingers[finger].position_m, |contact| contact.centre)
    }

    /// Moves one coordinate away from the operating point.
    pub(crate) fn displace(&mut self, name: Coordinate, by: f64) {
        if let Coordinate::Held {
            host,
            from,
            part: Part::Force(finger),
            quantity: Quantity::Force(axis),
            age,
        } = name
        {
            let packet = self.packet(host, from, -i64::from(age));
            packet.forces[usize::from(finger)][axis.index()] += by;
            return;
        }
        let quantity = quantity(name);
        let unit = |axis: Axis| DVec3::AXES[axis.index()] * by;
        if let Coordinate::Own { host, part: Part::Sensor(finger), .. } = name {
            let host = &mut self.hosts[host.index()];
            match quantity {
                Quantity::Position(axis) => host.last_read[usize::from(finger)] += unit(axis),
                Quantity::Velocity(axis) => host.last_told[usize::from(finger)] += unit(axis),
                _ => panic!("a sensor has no {quantity}"),
            }
            return;
        }
        let motion = self.motion(name, 0);
        match quantity {
            Quantity::Position(axis) => motion.x += unit(axis),
            Quantity::Velocity(axis) => motion.v += unit(axis),
            Quantity::Rotation(axis) => motion.q = DQuat::from_scaled_axis(unit(axis)) * motion.q,
            Quantity::AngularVelocity(axis) => motion.w += unit(axis),
            Quantity::Force(_) => panic!("a motion has no force"),
        }
    }

    /// How far one coordinate is from a fixed place (turns: from the operating point).
    pub(crate) fn read(&mut self, name: Coordinate, steps_done: i64) -> f64 {
        if let Coordinate::Held {
            host,
            from,
            part: Part::Force(finger),
            quantity: Quantity::Force(axis),
            age,
        } = name
        {
            return self.packet(host, from, steps_done - i64::from(age)).forces[usize::from(finger)]
                [axis.index()];
        }
        let quantity = quantity(name);
        if let Coordinate::Own { host, part: Part::Sensor(finger), .. } = name {
            let host = &self.hosts[host.index()];
            return match quantity {
                Quantity::Position(axis) => host.last_read[usize::from(finger)][axis.index()],
                Quantity::Velocity(axis) => host.last_told[usize::from(finger)][axis.index()],
                _ => panic!("a sensor has no {quantity}"),
            };
        }
        let owner = match name {
            Coordinate::Own { host, .. } => host,
            Coordinate::Held { from, .. } => from,
            soft => panic!("{soft} is not of a rigid body"),
        };
        let rest = self.point.poses[owner.index()][0].orientation;
        let motion = self.motion(name, steps_done);
        match quantity {
            Quantity::Position(axis) => motion.x[axis.index()],
            Quantity::Velocity(axis) => motion.v[axis.index()],
            Quantity::Rotation(axis) => rotation_vector(motion.q * rest.inverse())[axis.index()],
            Quantity::AngularVelocity(axis) => motion.w[axis.index()],
            Quantity::Force(_) => panic!("a motion has no force"),
        }
    }

    fn packet(&mut self, host: HostIndex, from: HostIndex, step: i64) -> &mut Packet {
        let inbox = &mut self.hosts[host.index()].inbox[from.index()];
        inbox.iter_mut().find(|packet| packet.step == step).expect("kept long enough")
    }

    fn motion(&mut self, name: Coordinate, steps_done: i64) -> &mut Motion {
        match name {
            Coordinate::Own { host, part, .. } => {
                let host = &mut self.hosts[host.index()];
                match part {
                    Part::Hand(finger) => &mut host.hands[usize::from(finger)],
                    _ => &mut host.object,
                }
            }
            Coordinate::Held { host, from, part, age, .. } => {
                let packet = self.packet(host, from, steps_done - i64::from(age));
                match part {
                    Part::Hand(finger) => &mut packet.hands[usize::from(finger)],
                    _ => &mut packet.object,
                }
            }
            soft => panic!("{soft} is not of a rigid body"),
        }
    }
}

fn quantity(name: Coordinate) -> Quantity {
    match name {
        Coordinate::Own { quantity, .. } | Coordinate::Held { quantity, .. } => quantity,
        soft => panic!("{soft} is not of a rigid body"),
    }
}

/// Many small steps of a hand under a constant force, by the classical Runge–Kutta method.
fn step_hand(
    scene: &Scene,
    user: usize,
    hand: Motion,
    rest: DVec3,
    force: DVec3,
    period_s: f64,
) -> (DVec3, DVec3) {
    const STEPS: u32 = 8;
    let tracking = scene.users[user].tracking;
    let tracks = scene.users[user].script.iter().any(cotouch_scene::scene::Action::tracks);
    let share = if tracks { 1.0 } else { 0.0 };
    let k = scene.hand.stiffness_n_per_m + share * tracking.stiffness_n_per_m;
    let b = scene.hand.damping_n_s_per_m + share * tracking.damping_n_s_per_m;
    let acceleration = |x: DVec3, v: DVec3| (force - (x - rest) * k - v * b) / scene.hand.mass_kg;
    let h = period_s / f64::from(STEPS);
    let (mut x, mut v) = (hand.x, hand.v);
    for _ in 0..STEPS {
        let (x1, v1) = (v, acceleration(x, v));
        let (x2, v2) = (v + v1 * (h / 2.0), acceleration(x + x1 * (h / 2.0), v + v1 * (h / 2.0)));
        let (x3, v3) = (v + v2 * (h / 2.0), acceleration(x + x2 * (h / 2.0), v + v2 * (h / 2.0)));
        let (x4, v4) = (v + v3 * h, acceleration(x + x3 * h, v + v3 * h));
        x += (x1 + x2 * 2.0 + x3 * 2.0 + x4) * (h / 6.0);
        v += (v1 + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
    }
    (x, v)
}
