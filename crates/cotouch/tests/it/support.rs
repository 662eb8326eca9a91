//! A virtual session whose state can be read and written by the names of its coordinates.

use cotouch_analysis::LiftedMap;
use cotouch_device::{Acted, SimulatedUser};
use cotouch_net::{decode_state, encode_state};
use cotouch_runtime::{Station, TickRecord, VirtualSession};
use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Action, Scene};
use cotouch_testkit::scenes::{built_in, edited};

/// The move of a coordinate to either side; the loop is linear, so its size only matters to rounding.
const STEP: f64 = 1e-4;

/// `single-axis` with overrides; hands that do nothing of their own accord.
pub(crate) fn scene(settings: &[&str]) -> Scene {
    let centralized = settings.iter().any(|setting| setting.ends_with("=centralized"));
    let name = if centralized { "single-axis-centralized" } else { "single-axis" };
    edited(&built_in(name, settings), |scene| {
        for user in &mut scene.users {
            user.script = vec![Action::Relax { duration_s: 1.0 }];
            user.repeat = true;
        }
    })
}

/// The analysis's map of the scene's only contact mode.
pub(crate) fn lifted(scene: &Scene) -> LiftedMap {
    let modes = cotouch_analysis::compile(scene);
    assert_eq!(modes.len(), 1, "a linear scene has one contact mode");
    modes[0].spec.lift().unwrap()
}

/// A session at rest, with soft start and fading behind it, at an instant where the pattern begins.
pub(crate) struct Probe {
    session: VirtualSession<SimulatedUser>,
    tick: u64,
    ticks_per_pattern: u64,
}

impl Probe {
    pub(crate) fn at_rest(scene: &Scene) -> Self {
        Self::after(scene, 1.5)
    }

    /// As [`at_rest`](Self::at_rest), after so many seconds.
    pub(crate) fn after(scene: &Scene, seconds: f64) -> Self {
        let mut session = VirtualSession::new(scene, |host| {
            Station::new(scene, host, SimulatedUser::new(scene, host).unwrap(), None)
        });
        let ticks_per_pattern = scene.schedule().ticks_per_pattern();
        let settled = (seconds * scene.rates.control_hz.hz()) as u64;
        let tick = settled.next_multiple_of(ticks_per_pattern);
        assert!(session.run_to_tick(tick, |_, _| {}), "the hosts did not join");
        Self { session, tick, ticks_per_pattern }
    }

    /// The session, to look at and to prepare.
    pub(crate) fn session_mut(&mut self) -> &mut VirtualSession<SimulatedUser> {
        &mut self.session
    }

    /// Runs on by one pattern.
    pub(crate) fn run_one_pattern(&mut self, observe: impl FnMut(HostIndex, &TickRecord)) {
        self.tick += self.ticks_per_pattern;
        self.session.run_to_tick(self.tick, observe);
    }

    /// One column of the map by a central difference.
    pub(crate) fn column(&mut self, moved: Coordinate, coordinates: &[Coordinate]) -> Vec<f64> {
        self.column_by(STEP, moved, coordinates)
    }

    /// The same, with the coordinate moved by `step` to either side.
    pub(crate) fn column_by(&mut self, step: f64, moved: Coordinate, coordinates: &[Coordinate]) -> Vec<f64> {
        let above = self.run_moved(moved, step, coordinates);
        let below = self.run_moved(moved, -step, coordinates);
        above.iter().zip(below).map(|(above, below)| (above - below) / (2.0 * step)).collect()
    }

    /// Moves every hand by another share of `by_m`, m: two that moved alike would hide how they swing against each other.
    pub(crate) fn move_hands(&mut self, by_m: f64) {
        for index in 0..self.session.hosts().len() {
            let share = by_m * (-0.6_f64).powi(index as i32);
            let host = HostIndex(index as u8);
            visit_device(&mut self.session, host, Part::HAND, Quantity::X, &mut |value| *value += share);
        }
    }

    /// Runs one pattern. Where everything that moves is then and how fast, along the axis: hands, then objects.
    pub(crate) fn run_pattern(&mut self) -> Vec<(f64, f64)> {
        self.tick += self.ticks_per_pattern;
        self.session.run_to_tick(self.tick, assert_nothing_acted);
        let hosts = || self.session.hosts().iter().map(|host| &host.station);
        let hands = hosts().map(|station| {
            let hand = station.device.states()[0];
            (hand.position.x, hand.velocity.x)
        });
        let objects = hosts().map(|station| {
            let (position, velocity) = station.state.host.bodies[0].point();
            (position.x, velocity.x)
        });
        hands.chain(objects).collect()
    }

    fn run_moved(&mut self, moved: Coordinate, by: f64, coordinates: &[Coordinate]) -> Vec<f64> {
        let mut session = self.session.fork();
        let at_rest = visit(&mut session, moved, self.tick, &mut |value| *value += by);
        assert!(at_rest, "{moved} is nowhere in the running session");
        let end = self.tick + self.ticks_per_pattern;
        session.run_to_tick(end, assert_nothing_acted);
        let read = |coordinate: &Coordinate| {
            let mut value = None;
            visit(&mut session, *coordinate, end, &mut |place| value = Some(*place));
            value.unwrap_or_else(|| panic!("{coordinate} is nowhere in the running session"))
        };
        coordinates.iter().map(read).collect()
    }
}

pub(crate) fn assert_nothing_acted(host: HostIndex, record: &TickRecord) {
    let acted = u32::from(Acted::empty().bits());
    assert!(record.governor_acted.iter().all(|&bits| bits == acted), "the governor of {host} acted");
    assert!(!record.diverged && record.fades.iter().all(|&fade| fade == 0.0 || fade == 1.0));
}

/// Reads or writes a coordinate wherever it is at the instant of `tick`: in a hand, in a host, or on the way.
pub(crate) fn visit(
    session: &mut VirtualSession<SimulatedUser>,
    coordinate: Coordinate,
    tick: u64,
    act: &mut dyn FnMut(&mut f64),
) -> bool {
    match coordinate {
        Coordinate::Own { host, part: part @ (Part::Hand(_) | Part::Sensor(_)), quantity } => {
            visit_device(session, host, part, quantity, act)
        }
        Coordinate::Own { host, .. } | Coordinate::SchemeMemory { host, .. } => {
            visit_host(session, host, coordinate, tick, act)
        }
        Coordinate::Held { host, .. } => {
            // A sample may wait at the host and, duplicated, be on its way as well; it is the same sample.
            let at_host = visit_host(session, host, coordinate, tick, act);
            at_host || visit_in_flight(session, coordinate, tick, act)
        }
        // What a soft body has; see its own test.
        _ => false,
    }
}

fn visit_device(
    session: &mut VirtualSession<SimulatedUser>,
    host: HostIndex,
    part: Part,
    quantity: Quantity,
    act: &mut dyn FnMut(&mut f64),
) -> bool {
    let user = &mut session.host_mut(host).station.device;
    let (Part::Hand(index) | Part::Sensor(index)) = part else { return false };
    let index = usize::from(index);
    let Some(mut finger) = user.states().get(index).copied() else { return false };
    let is_sensor = matches!(part, Part::Sensor(_));
    match quantity {
        Quantity::Position(axis) if is_sensor => act(&mut finger.sensor.position[axis.index()]),
        Quantity::Velocity(axis) if is_sensor => act(&mut finger.sensor.velocity[axis.index()]),
        Quantity::Position(axis) => act(&mut finger.position[axis.index()]),
        Quantity::Velocity(axis) => act(&mut finger.velocity[axis.index()]),
        Quantity::Rotation(_) | Quantity::AngularVelocity(_) | Quantity::Force(_) => return false,
    }
    user.set_state(index, finger);
    true
}

fn visit_host(
    session: &mut VirtualSession<SimulatedUser>,
    host: HostIndex,
    coordinate: Coordinate,
    tick: u64,
    act: &mut dyn FnMut(&mut f64),
) -> bool {
    let station = &mut session.host_mut(host).station;
    let step = station.model.schedule.last_step_at(tick);
    let Some(mut value) = station.state.host.coordinate(&station.model, step, coordinate) else {
        return false;
    };
    act(&mut value);
    station.state.host.set_coordinate(&station.model, step, coordinate, value)
}

fn visit_in_flight(
    session: &mut VirtualSession<SimulatedUser>,
    coordinate: Coordinate,
    tick: u64,
    act: &mut dyn FnMut(&mut f64),
) -> bool {
    let Coordinate::Held { host, from, part, quantity, age } = coordinate else { return false };
    let model = session.host_mut(host).station.model.clone();
    let sampled = model.schedule.last_step_at(tick) - u64::from(age);
    let mut found = false;
    for (_, bytes) in session.link_mut(from, host).in_flight_mut() {
        let Ok((header, time, mut packet)) = decode_state(bytes) else { continue };
        if packet.step == sampled {
            cotouch_host::visit_packet(&mut packet, &model, part, quantity, &mut |place| {
                found = true;
                act(place);
            });
            encode_state(header.session, from, time, &packet, bytes).unwrap();
        }
    }
    found
}
