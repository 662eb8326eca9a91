//! A session about an operating point, as a loop.

use std::collections::BTreeMap;
use std::sync::Arc;

use cotouch_scene::geometry::Pose;
use cotouch_scene::mechanism::finger_inertia;
use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::scene::{Architecture, PlayOut, SceneValues, Space, SpringDamper, VelocityEstimate};
use cotouch_world::coordination::{self, Scheme, SchemeSize, TickInput};
use glam::{DMat3, DQuat, DVec3};

use super::channel::ChannelEnd;
use crate::contact::{ChannelGains, Gains, Geometry, LinearForce, couple_copies, tie_to_ground};
use crate::dof::motion_quantities;
use crate::loop_spec::{
    BodyId, Delay, Dof, Dynamics, Estimate, ForceGains, LINE, Line, LineId, LoopBody, LoopSpec, Motion,
    PLANE_BODY, PLANE_POINT, Plant, SPACE_BODY, SPACE_POINT, Signal,
};
use crate::operating_point::{
    CornerContact, FingerContact, OperatingPoint, gains, has_surface, hosts_with_copies,
};

/// A latency that exceeds a whole number of ticks by no more than this counts as that number: instants are rounded
/// to nanoseconds.
const INSTANT_RESOLUTION_S: f64 = 1e-9;

/// The loop of a scene about a given operating point, with exactly its contacts closed.
///
/// Forces that depend on nothing do not enter, so the point need not be at rest by itself: only its poses, anchors and
/// contact forces count.
///
/// # Panics
/// When the operating point names hosts, bodies, fingers or walls that the scene does not have.
#[must_use]
pub fn compile_at(scene: &SceneValues, point: &OperatingPoint) -> LoopSpec {
    compile_with(
        scene,
        point,
        coordination::gains(&scene.coupling).map(|gains| coordination::scheme(scene, gains)),
    )
}

/// The same with schemes for translation and for rotation, whatever the scene names.
pub(super) fn compile_with(scene: &SceneValues, point: &OperatingPoint, schemes: Schemes) -> LoopSpec {
    SessionLoop::new(scene, point, &point.fingers, schemes).spec
}

/// For channels of translation, and of rotation.
pub(super) type Schemes = [Arc<dyn Scheme>; 2];

/// A session that is being written down.
pub(super) struct SessionLoop<'a> {
    pub(super) scene: &'a SceneValues,
    pub(super) point: &'a OperatingPoint,
    /// Where fingers are, the first of each counting; others are where they start.
    places: &'a [FingerContact],
    schemes: Schemes,
    bodies: Vec<cotouch_scene::scene::Body>,
    pub(super) spec: LoopSpec,
    /// `[user][finger]`.
    pub(super) fingers: Vec<Vec<BodyId>>,
    /// `[host][body]`; none for what is fixed, or not kept at this host.
    pub(super) copies: Vec<Vec<Option<BodyId>>>,
    lines: BTreeMap<(HostIndex, HostIndex, Part), LineId>,
}

/// One force between a finger and a copy of a body.
struct Touch {
    user: HostIndex,
    finger: usize,
    body: usize,
    law: LinearForce,
}

impl<'a> SessionLoop<'a> {
    pub(super) fn new(
        scene: &'a SceneValues,
        point: &'a OperatingPoint,
        places: &'a [FingerContact],
        schemes: Schemes,
    ) -> Self {
        let mut session = Self {
            scene,
            point,
            places,
            schemes,
            bodies: scene.world_bodies(),
            spec: LoopSpec::new(scene.schedule()),
            fingers: Vec::new(),
            copies: Vec::new(),
            lines: BTreeMap::new(),
        };
        let keepers: Vec<_> = hosts_with_copies(scene).collect();
        for host in scene.hosts() {
            let fingers = 0..scene.users[host.index()].fingers.len();
            let fingers = fingers.map(|finger| session.add_finger(host, finger)).collect();
            session.fingers.push(fingers);
            let copies = 0..session.bodies.len();
            let copies =
                copies.map(|body| keepers.contains(&host).then(|| session.add_copy(host, body)).flatten());
            let copies = copies.collect();
            session.copies.push(copies);
        }
        for host in keepers {
            session.add_touches(host);
            session.add_walls(host);
            if scene.session.architecture == Architecture::Distributed {
                session.add_couplers(host);
            }
        }
        if scene.session.architecture == Architecture::Distributed {
            session.add_channel_blocks();
        }
        session
    }

    /// A finger with its arm's and its tracking impedance, what is rendered at it whatever it touches, and what its sensor
    /// remembers.
    fn add_finger(&mut self, host: HostIndex, finger: usize) -> BodyId {
        let scene = self.scene;
        let user = &scene.users[host.index()];
        let impedance = scene.hand_impedance();
        let to_ground = impedance.arm + user.tracking_of(finger);
        let axes = point_axes(scene.space);
        let index = finger as u8;
        let of_finger = |contact: &&FingerContact| (contact.user, contact.finger) == (host, index);
        let position = self.places.iter().find(of_finger);
        let position = position.map_or(user.fingers[finger].position_m, |contact| contact.centre);
        let plant = Plant::endpoint(&finger_inertia(scene, host, index, position), axes.len(), to_ground);
        let mut states = names(host, Part::Hand(index), axes);
        let sensor = names(host, Part::Sensor(index), axes);
        let dynamics = match scene.device.velocity {
            VelocityEstimate::Exact => Dynamics::Plant(plant),
            VelocityEstimate::Difference => {
                states.extend(sensor.into_iter().take(axes.len()));
                Dynamics::Sensed { plant, estimate: Estimate::Difference }
            }
            VelocityEstimate::Filtered => {
                states.extend(sensor);
                let cutoff_rad_per_s = std::f64::consts::TAU * scene.device.velocity_cutoff_hz;
                Dynamics::Sensed { plant, estimate: Estimate::Filtered { cutoff_rad_per_s } }
            }
        };
        let hand = self.spec.body(LoopBody { states, axes, dynamics });
        self.spec.pull(hand, Motion::Ground, impedance.rendered);
        hand
    }

    /// A copy of a body with what ties it to the ground.
    fn add_copy(&mut self, host: HostIndex, index: usize) -> Option<BodyId> {
        let (scene, body) = (self.scene, &self.bodies[index]);
        if body.fixed {
            return None;
        }
        let (mass_kg, integrator) = (body.mass_kg, scene.session.integrator);
        let axes = body_axes(scene.space, has_surface(&body.shape));
        let dynamics = if axes.iter().any(|dof| dof.turns()) {
            let turn = DMat3::from_quat(self.point.poses[host.index()][index].orientation);
            let inertia = turn * body.shape.mass_properties(mass_kg).inertia_kg_m2 * turn.transpose();
            Dynamics::Rigid { mass_kg, inertia, integrator }
        } else {
            Dynamics::Mass { mass_kg, integrator }
        };
        let states = names(host, Part::Object(index as u8), axes);
        let copy = self.spec.body(LoopBody { states, axes, dynamics });
        let mut to_ground = ForceGains::new(axes.len());
        tie_to_ground(&mut to_ground, (Motion::Current(copy), axes), &scene.object.to_ground());
        self.act(copy, to_ground);
        Some(copy)
    }

    fn act(&mut self, body: BodyId, force: ForceGains) {
        if !force.terms.is_empty() {
            self.spec.act(body, force);
        }
    }

    /// Fingers on the copies at `host`, and for a client's finger the force that goes back to it.
    fn add_touches(&mut self, host: HostIndex) {
        let centralized = self.scene.session.architecture == Architecture::Centralized;
        for user in std::iter::once(host).chain(host.others(self.scene.session.users)) {
            for finger in 0..self.fingers[user.index()].len() {
                let touches = self.touches(host, user, finger);
                if touches.is_empty() {
                    continue;
                }
                let hand = self.fingers[user.index()][finger];
                let axes = self.spec.bodies[hand.0].axes;
                let own = user == host;
                let motion = if own {
                    Motion::Current(hand)
                } else {
                    Motion::Held(self.held(host, user, Part::Hand(finger as u8), hand))
                };
                let mut on_finger = ForceGains::new(axes.len());
                for touch in touches {
                    let copy = self.copies[host.index()][touch.body];
                    let body = copy.map(|copy| (Motion::Current(copy), self.spec.bodies[copy.0].axes));
                    touch.law.on_point(&mut on_finger, axes, (motion, axes), body);
                    if let (Some(copy), Some(body)) = (copy, body) {
                        let mut on_body = ForceGains::new(body.1.len());
                        touch.law.on_body(&mut on_body, body.1, (motion, axes), body);
                        self.act(copy, on_body);
                    }
                }
                if own {
                    self.act(hand, on_finger);
                } else if centralized {
                    self.send_force(host, user, finger, on_finger);
                }
            }
        }
    }

    /// The forces between one finger and the copies at `host`.
    fn touches(&self, host: HostIndex, user: HostIndex, finger: usize) -> Vec<Touch> {
        let Gains { normal, .. } = gains(self.scene, host, user);
        let mut touches = Vec::new();
        // Without a surface: coupled to the centre of the first body.
        if self.bodies.first().is_some_and(|body| !has_surface(&body.shape)) {
            touches.push(Touch { user, finger, body: 0, law: LinearForce::bilateral(normal) });
        }
        let here = |contact: &&FingerContact| {
            (contact.host, contact.user, usize::from(contact.finger)) == (host, user, finger)
        };
        touches.extend(self.point.fingers.iter().filter(here).map(|contact| self.touch(contact)));
        touches.retain(|touch| (touch.user, touch.finger) == (user, finger));
        touches
    }

    fn touch(&self, contact: &FingerContact) -> Touch {
        let body = usize::from(contact.body);
        let pose: Pose = self.point.poses[contact.host.index()][body];
        let geometry = Geometry {
            normal: contact.normal,
            curvature: contact.curvature,
            stretch: pose.to_local(contact.centre) - contact.anchor,
        };
        let gains = gains(self.scene, contact.host, contact.user);
        let arm = contact.centre - pose.position;
        let law = match contact.slides {
            None => LinearForce::contact(&gains, &geometry, pose.orientation, arm, contact.force),
            Some(direction) => {
                let press_n = (pose.orientation.conjugate() * contact.force).dot(contact.normal);
                let friction = self.scene.contact.dynamic_friction;
                LinearForce::sliding(&gains, &geometry, pose.orientation, arm, (direction, friction, press_n))
            }
        };
        Touch { user: contact.user, finger: usize::from(contact.finger), body, law }
    }

    pub(super) fn send_force(
        &mut self,
        server: HostIndex,
        client: HostIndex,
        finger: usize,
        force: ForceGains,
    ) -> LineId {
        let line = self.spec.line(Line {
            host: client,
            from: server,
            part: Part::Force(finger as u8),
            signal: Signal::Force(force),
            delay: delay(self.scene, server, client),
        });
        self.spec.apply_held(self.fingers[client.index()][finger], line);
        line
    }

    fn add_walls(&mut self, host: HostIndex) {
        let (scene, point) = (self.scene, self.point);
        let walls = scene.walls();
        for &CornerContact { wall, body, corner, force, .. } in
            point.corners.iter().filter(|at| at.host == host)
        {
            let index = usize::from(body);
            let Some(copy) = self.copies[host.index()][index] else { continue };
            let wall_spring =
                |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
            let along = if has_surface(&self.bodies[index].shape) { 1.0 } else { 0.0 };
            let gains = Gains {
                normal: wall_spring(scene.wall.stiffness_n_per_m, scene.wall.damping_n_s_per_m),
                tangential: wall_spring(
                    along * scene.wall.tangential_stiffness_n_per_m,
                    along * scene.wall.tangential_damping_n_s_per_m,
                ),
            };
            let normal = walls[wall].normal.normalize();
            let flat = Geometry { normal, curvature: DMat3::ZERO, stretch: DVec3::ZERO };
            let arm = point.poses[host.index()][index].orientation * corner;
            let law = LinearForce::contact(&gains, &flat, DQuat::IDENTITY, arm, force);
            let axes = self.spec.bodies[copy.0].axes;
            let mut on_body = ForceGains::new(axes.len());
            law.on_own_point(&mut on_body, axes, (Motion::Current(copy), axes));
            self.act(copy, on_body);
        }
    }

    /// What keeps the copies at `host` together with all others: the coordination scheme.
    fn add_couplers(&mut self, host: HostIndex) {
        let weight = self.schemes[0].weight(f64::from(self.scene.session.users) - 1.0);
        let direct = self.schemes.each_ref().map(|scheme| direct_gains(&**scheme, weight));
        for from in host.others(self.scene.session.users) {
            for body in 0..self.bodies.len() {
                let Some(end) = self.channel_end(host, from, body) else { continue };
                let mut force = ForceGains::new(end.axes.len());
                couple_copies(
                    &mut force,
                    (Motion::Current(end.near), end.axes),
                    Motion::Held(end.far),
                    direct,
                    end.turned,
                );
                self.act(end.near, force);
            }
        }
    }

    /// The end at `host` of the channels to the copy of a body that `from` has; none where one of the two has no copy.
    fn channel_end(&mut self, host: HostIndex, from: HostIndex, body: usize) -> Option<ChannelEnd> {
        let (near, copy) = (self.copies[host.index()][body]?, self.copies[from.index()][body]?);
        let object = body as u8;
        let far = self.held(host, from, Part::Object(object), copy);
        let orientation = |host: HostIndex| self.point.poses[host.index()][body].orientation;
        let start = DQuat::from_scaled_axis(self.bodies[body].rotation_rad);
        let turned =
            (orientation(from) * orientation(host).conjugate(), orientation(host) * start.conjugate());
        let axes = self.spec.bodies[near.0].axes;
        Some(ChannelEnd { host, from, object, turns: false, near, far, axes, turned })
    }

    /// The channels of a scheme that remembers or sends, as blocks: first at every end, then what they send each other.
    fn add_channel_blocks(&mut self) {
        for (turns, scheme) in [false, true].into_iter().zip(self.schemes.clone()) {
            if scheme.size() == SchemeSize::default() {
                continue;
            }
            let weight = scheme.weight(f64::from(self.scene.session.users) - 1.0);
            let mut blocks = BTreeMap::new();
            for (host, from, body) in self.ends() {
                let Some(end) = self.channel_end(host, from, body).map(|end| ChannelEnd { turns, ..end })
                else {
                    continue;
                };
                let ticks = self.spec.block(end.tick_block(&*scheme, &self.spec));
                let steps = self.spec.block(end.step_block(&*scheme, &self.spec, ticks));
                self.act(end.near, end.force(ticks, weight));
                blocks.insert((host, from, body), (end, ticks, steps));
            }
            for (&(host, from, body), (end, ticks, _)) in &blocks {
                let (peer, _, steps) = &blocks[&(from, host, body)];
                for vector in 0..scheme.size().sent {
                    let line = self.spec.line(Line {
                        host,
                        from,
                        part: end.part(vector),
                        signal: Signal::Force(peer.sent(*steps, vector)),
                        delay: delay(self.scene, from, host),
                    });
                    end.receive(&mut self.spec.blocks[ticks.0].input, vector, line);
                }
            }
        }
    }

    /// Every host, every other one, and every body.
    fn ends(&self) -> Vec<(HostIndex, HostIndex, usize)> {
        let users = self.scene.session.users;
        let pairs = HostIndex::all(users).flat_map(|host| host.others(users).map(move |from| (host, from)));
        pairs.flat_map(|(host, from)| (0..self.bodies.len()).map(move |body| (host, from, body))).collect()
    }

    /// The line on which `host` gets the samples of a body of `from`.
    pub(super) fn held(&mut self, host: HostIndex, from: HostIndex, part: Part, body: BodyId) -> LineId {
        let (spec, scene) = (&mut self.spec, self.scene);
        *self.lines.entry((host, from, part)).or_insert_with(|| {
            let delay = delay(scene, from, host);
            spec.line(Line { host, from, part, signal: Signal::Motion(body), delay })
        })
    }
}

/// What a channel adds to the wrench on an own copy where it neither remembers nor sends; else its blocks do.
fn direct_gains(scheme: &dyn Scheme, weight: f64) -> ChannelGains {
    if scheme.size() != SchemeSize::default() {
        return ChannelGains::default();
    }
    let force = scheme.tick_block().d;
    let gain = |input: TickInput| force[(0, input as usize)] * weight;
    ChannelGains {
        apart: [gain(TickInput::ApartPosition), gain(TickInput::ApartVelocity)],
        own: [gain(TickInput::OwnPosition), gain(TickInput::OwnVelocity)],
    }
}

fn names(host: HostIndex, part: Part, axes: &'static [Dof]) -> Vec<Coordinate> {
    motion_quantities(axes).map(|quantity| Coordinate::Own { host, part, quantity }).collect()
}

pub(super) fn point_axes(space: Space) -> &'static [Dof] {
    match space {
        Space::Line => LINE,
        Space::Plane => PLANE_POINT,
        Space::Space => SPACE_POINT,
    }
}

/// What has no surface has no inertia of turning, and does not turn.
fn body_axes(space: Space, turns: bool) -> &'static [Dof] {
    match space {
        Space::Plane if turns => PLANE_BODY,
        Space::Space if turns => SPACE_BODY,
        Space::Line | Space::Plane | Space::Space => point_axes(space),
    }
}

/// The constant delay of samples from one host to another.
pub(crate) fn delay(scene: &SceneValues, from: HostIndex, to: HostIndex) -> Delay {
    let latency_s = scene.impairment(from, to).latency_s;
    let transit_ticks =
        ((latency_s - INSTANT_RESOLUTION_S) * scene.rates.control_hz.hz()).ceil().max(0.0) as u64;
    match scene.link.play_out {
        PlayOut::Scheduled => Delay::Scheduled { periods: scene.play_out_periods(from), transit_ticks },
        PlayOut::OnArrival => Delay::OnArrival { transit_ticks },
    }
}
