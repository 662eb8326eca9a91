//! From a scene to the sampled-data loops of its contact modes.

use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Action, Architecture, Coordination, PlayOut, Scene, SpringDamper, WallSides};

use crate::loop_spec::{
    Body, BodyId, Coupling, Delay, Dynamics, Line, LineId, LoopSpec, Motion, Plant, Signal,
};

/// A latency that exceeds a whole number of ticks by no more than this counts as that number: instants are rounded
/// to nanoseconds.
const INSTANT_RESOLUTION_S: f64 = 1e-9;

/// The loop of a scene while a given set of switching contacts is closed.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactMode {
    /// The switching contacts that are closed, such as `["wall"]`. A two-sided wall never switches.
    pub contacts: Vec<String>,
    /// The loop.
    pub spec: LoopSpec,
}

/// The loops of a scene, one for each contact mode; the free one first.
///
/// A one-sided wall gives two: all copies of the object off it, and all against it. Links are taken with their
/// constant latency; loss, jitter and rate limits are not part of the linear loop.
#[must_use]
pub fn compile(scene: &Scene) -> Vec<ContactMode> {
    let mode = |contacts: &[&str], wall| ContactMode {
        contacts: contacts.iter().map(|&contact| contact.to_owned()).collect(),
        spec: compile_mode(scene, wall),
    };
    match (scene.wall.exists(), scene.wall.sides) {
        (false, _) => vec![mode(&[], false)],
        (true, WallSides::Two) => vec![mode(&[], true)],
        (true, WallSides::One) => vec![mode(&[], false), mode(&["wall"], true)],
    }
}

fn compile_mode(scene: &Scene, wall: bool) -> LoopSpec {
    match scene.session.architecture {
        Architecture::Distributed => distributed(scene, wall),
        Architecture::Centralized => centralized(scene, wall),
    }
}

/// Every host: its user's hand, a copy of the object, and the held samples of all other hosts (thesis Fig 4.4).
fn distributed(scene: &Scene, wall: bool) -> LoopSpec {
    let coupling = &scene.coupling;
    let mut spec = LoopSpec::new(scene.schedule());
    let bodies: Vec<_> = scene
        .hosts()
        .map(|host| (hand(&mut spec, scene, host), object(&mut spec, scene, host, wall)))
        .collect();
    let object_object = match scene.session.coordination {
        Coordination::Pairwise => coupling.object_object,
        // k_o·(mean − x_i) = Σ_j k_o/U·(x_j − x_i), the own copy adding nothing.
        Coordination::Average => scaled(coupling.object_object, 1.0 / f64::from(scene.session.users)),
    };
    for host in scene.hosts() {
        let (hand, object) = bodies[host.index()];
        spec.couple(hand, object, coupling.hand_object);
        for from in host.others(scene.session.users) {
            let (remote_hand, remote_object) = bodies[from.index()];
            let held_hand = motion_line(&mut spec, scene, host, from, Part::HAND, remote_hand);
            let held_object = motion_line(&mut spec, scene, host, from, Part::OBJECT, remote_object);
            spec.pull(object, Motion::Held(held_hand), coupling.remote_hand_object);
            spec.pull(object, Motion::Held(held_object), object_object);
        }
    }
    spec
}

/// The server keeps the object and its own user's hand; the others send their hands and get forces back
/// (thesis Fig 4.3).
fn centralized(scene: &Scene, wall: bool) -> LoopSpec {
    let server = HostIndex::FIRST;
    let coupling = &scene.coupling;
    let mut spec = LoopSpec::new(scene.schedule());
    let own_hand = hand(&mut spec, scene, server);
    let object = object(&mut spec, scene, server, wall);
    spec.couple(own_hand, object, coupling.hand_object);
    for client in server.others(scene.session.users) {
        let hand = hand(&mut spec, scene, client);
        let held_hand = motion_line(&mut spec, scene, server, client, Part::HAND, hand);
        spec.pull(object, Motion::Held(held_hand), coupling.remote_hand_object);
        let force = Coupling {
            spring: coupling.remote_hand_object,
            end: Motion::Held(held_hand),
            anchor: Motion::Current(object),
        };
        let held_force = spec.line(Line {
            host: client,
            from: server,
            part: Part::FORCE,
            signal: Signal::Force(force),
            delay: delay(scene, server, client),
        });
        spec.apply_held(hand, held_force);
    }
    spec
}

/// The hand with its arm's and its tracking impedance, and the governor's sampled damping.
fn hand(spec: &mut LoopSpec, scene: &Scene, host: HostIndex) -> BodyId {
    let user = &scene.users[host.index()];
    // Tracking stays on between a script's tracking actions, so that one linear loop describes the whole run.
    let tracking = user.script.iter().any(Action::tracks).then_some(user.tracking);
    let to_ground = SpringDamper {
        stiffness_n_per_m: scene.hand.stiffness_n_per_m + tracking.map_or(0.0, |t| t.stiffness_n_per_m),
        damping_n_s_per_m: scene.hand.damping_n_s_per_m + tracking.map_or(0.0, |t| t.damping_n_s_per_m),
    };
    let dynamics = Dynamics::Plant(Plant::mass(scene.hand.mass_kg, to_ground));
    let hand = spec.body(Body { states: motion_states(host, Part::HAND), dynamics });
    spec.pull(hand, Motion::Ground, damper(scene.governor.damping_n_s_per_m));
    hand
}

/// A copy of the object with its damping or compensation, and the wall where it touches.
fn object(spec: &mut LoopSpec, scene: &Scene, host: HostIndex, wall: bool) -> BodyId {
    let dynamics = Dynamics::Mass { mass_kg: scene.object.mass_kg, integrator: scene.session.integrator };
    let object = spec.body(Body { states: motion_states(host, Part::OBJECT), dynamics });
    spec.pull(object, Motion::Ground, damper(scene.object.damping_n_s_per_m));
    if wall {
        let spring = SpringDamper {
            stiffness_n_per_m: scene.wall.stiffness_n_per_m,
            damping_n_s_per_m: scene.wall.damping_n_s_per_m,
        };
        spec.pull(object, Motion::Ground, spring);
    }
    object
}

fn motion_states(host: HostIndex, part: Part) -> Vec<Coordinate> {
    [Quantity::X, Quantity::V].map(|quantity| Coordinate::Own { host, part, quantity }).to_vec()
}

fn motion_line(
    spec: &mut LoopSpec,
    scene: &Scene,
    host: HostIndex,
    from: HostIndex,
    part: Part,
    body: BodyId,
) -> LineId {
    spec.line(Line { host, from, part, signal: Signal::Motion(body), delay: delay(scene, from, host) })
}

/// The constant delay of samples from one host to another.
fn delay(scene: &Scene, from: HostIndex, to: HostIndex) -> Delay {
    let latency_s = scene.impairment(from, to).latency_s;
    let transit_ticks =
        ((latency_s - INSTANT_RESOLUTION_S) * scene.rates.control_hz.hz()).ceil().max(0.0) as u64;
    match scene.link.play_out {
        PlayOut::Scheduled => Delay::Scheduled { periods: scene.play_out_periods(from), transit_ticks },
        PlayOut::OnArrival => Delay::OnArrival { transit_ticks },
    }
}

fn damper(damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m: 0.0, damping_n_s_per_m }
}

fn scaled(spring: SpringDamper, factor: f64) -> SpringDamper {
    SpringDamper {
        stiffness_n_per_m: spring.stiffness_n_per_m * factor,
        damping_n_s_per_m: spring.damping_n_s_per_m * factor,
    }
}
