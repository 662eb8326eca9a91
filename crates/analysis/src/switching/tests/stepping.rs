//! What is stepped between contacts is what is judged; contacts are the running law.

use cotouch_scene::names::{Coordinate, HostIndex};
use cotouch_scene::scene::{Architecture, Scene, SceneValues, SpringDamper};
use cotouch_testkit::scenes::{BoxOnALine, grasp};
use glam::{DMat3, DVec3};
use nalgebra::{DMatrix, Matrix2, Vector2};

use super::ContactPoints;
use crate::compile::{OneSidedLoop, compile_at, one_sided};
use crate::lift::LiftedMap;
use crate::loop_spec::BodyId;
use crate::modes::contact_points;
use crate::operating_point::{FingerContact, OperatingPoint};
use crate::switching::ensemble::Ensemble;

/// How far hands press in, or stay away, m.
const AWAY_M: f64 = 0.05;
/// What a number of the state is changed by.
const CHANGE: f64 = 1e-3;

/// Contacts without preload on flat faces, which never slip.
fn unloaded(scene: &Scene) -> (SceneValues, ContactPoints) {
    let mut values = SceneValues::clone(scene);
    values.contact.static_friction = 1e9;
    values.contact.dynamic_friction = 1e9;
    let mut points = contact_points(&values);
    points.switching.corners.clear();
    for contact in &mut points.switching.fingers {
        let pose = points.switching.poses[contact.host.index()][usize::from(contact.body)];
        contact.force = DVec3::ZERO;
        contact.curvature = DMat3::ZERO;
        contact.anchor = pose.to_local(contact.centre);
    }
    (values, points)
}

/// One pattern's map, from trajectories that differ in one number each, hands being `depth_m` deep.
fn stepped(session: &OneSidedLoop, points: &ContactPoints, depth_m: f64) -> LiftedMap {
    let contacts: Vec<usize> = (0..session.contacts.len()).collect();
    let coordinates = Ensemble::new(session, &contacts, 1).layout.coordinates.clone();
    let size = coordinates.len();
    let mut ensemble = Ensemble::new(session, &contacts, size + 1);
    let inwards = |body: BodyId| {
        let hand = |at: &&FingerContact| session.hands[at.user.index()][usize::from(at.finger)] == body;
        points.switching.fingers.iter().find(hand).map_or(DVec3::ZERO, |at| {
            points.switching.poses[at.host.index()][usize::from(at.body)].orientation * -at.normal
        })
    };
    let axes = |body: BodyId| session.spec.bodies[body.0].axes.len();
    ensemble.start(|body, number, _| {
        let is_hand = session.hands.iter().flatten().any(|&hand| hand == body);
        if is_hand && number < axes(body) { inwards(body)[number] * depth_m } else { 0.0 }
    });
    // Anchors are set where all trajectories are still the same.
    ensemble.advance();
    ensemble.visit(&mut |place, row| row[place + 1] += CHANGE);
    ensemble.advance();
    let mut matrix = DMatrix::zeros(size, size);
    ensemble.visit(&mut |place, row| {
        for column in 0..size {
            matrix[(place, column)] = (row[column + 1] - row[0]) / CHANGE;
        }
    });
    LiftedMap { matrix, coordinates }
}

/// All that `expected` has is the same in `found`; what that has besides acts on nothing of it.
fn assert_same(found: &LiftedMap, expected: &LiftedMap, what: &str) {
    let places: Vec<Option<usize>> =
        found.coordinates.iter().map(|&name: &Coordinate| expected.index_of(name)).collect();
    assert_eq!(places.iter().flatten().count(), expected.coordinates.len(), "{what}: all names");
    let scale = expected.matrix.norm();
    for (row, of_row) in places.iter().enumerate() {
        let Some(of_row) = *of_row else { continue };
        for (column, of_column) in places.iter().enumerate() {
            let wanted = of_column.map_or(0.0, |of_column| expected.matrix[(of_row, of_column)]);
            let error = (found.matrix[(row, column)] - wanted).abs();
            let (to, from) = (found.coordinates[row], found.coordinates[column]);
            assert!(error <= 1e-10 * scale, "{what}: {to} from {from}: {error:e} of {scale:e}");
        }
    }
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let in_space =
        |scene: Scene| scene.edit_unchecked(|scene| scene.space = cotouch_scene::scene::Space::Space);
    vec![
        ("line", BoxOnALine::COUNTER_EXAMPLE.scene()),
        ("plane", grasp(Architecture::Distributed)),
        ("plane, centralized", grasp(Architecture::Centralized)),
        ("space", in_space(grasp(Architecture::Distributed))),
    ]
}

#[test]
fn with_all_contacts_closed_it_is_the_map_of_their_mode() {
    for (what, scene) in scenes() {
        let (scene, points) = unloaded(&scene);
        let session = one_sided(&scene, &points.always, &points.switching);
        let closed = OperatingPoint { fingers: points.switching.fingers.clone(), ..points.always.clone() };
        let expected = compile_at(&scene, &closed).lift().unwrap();
        assert_same(&stepped(&session, &points, AWAY_M), &expected, what);
    }
}

#[test]
fn with_all_contacts_open_it_is_the_free_map() {
    for (what, scene) in scenes() {
        let (scene, points) = unloaded(&scene);
        let session = one_sided(&scene, &points.always, &points.switching);
        let expected = compile_at(&scene, &points.always).lift().unwrap();
        assert_same(&stepped(&session, &points, -AWAY_M), &expected, what);
    }
}

/// A mass that a constant force pushes against a one-sided spring and damper to the ground, by parabolas and matrix powers.
struct Falling {
    mass_kg: f64,
    spring: SpringDamper,
    push_n: f64,
    period_s: f64,
    /// Since which tick it has been pressed, or free, and how it was then: m, m/s.
    begin: u32,
    state: Vector2<f64>,
    pressed: bool,
}

impl Falling {
    fn at(&self, tick: u32) -> Vector2<f64> {
        let ticks = tick - self.begin;
        let [x, v] = [self.state.x, self.state.y];
        let acceleration = self.push_n / self.mass_kg;
        if !self.pressed {
            let time = f64::from(ticks) * self.period_s;
            return Vector2::new(x + v * time + 0.5 * acceleration * time * time, v + acceleration * time);
        }
        let SpringDamper { stiffness_n_per_m: k, damping_n_s_per_m: b } = self.spring;
        let (travel, speed) = (0.5 * self.period_s.powi(2) / self.mass_kg, self.period_s / self.mass_kg);
        let held = Matrix2::new(1.0 - travel * k, self.period_s - travel * b, -speed * k, 1.0 - speed * b);
        let rest = Vector2::new(self.push_n / k, 0.0);
        rest + held.pow(ticks) * (self.state - rest)
    }

    /// Whether it is pressed from a tick on: deep, and not so fast on its way out that the damper would pull.
    fn turn(&mut self, tick: u32) -> bool {
        let now = self.at(tick);
        let force_n = self.spring.stiffness_n_per_m * now.x + self.spring.damping_n_s_per_m * now.y;
        let pressed = now.x > 0.0 && force_n > 0.0;
        let turns = pressed != self.pressed;
        if turns {
            (self.begin, self.state, self.pressed) = (tick, now, pressed);
        }
        turns
    }
}

#[test]
fn a_mass_on_a_one_sided_spring_is_as_in_closed_form() {
    // So heavy a body is the ground.
    let scene =
        BoxOnALine { ticks: 1, object_kg: 1.0, hand_damping: 0.0, ..BoxOnALine::COUNTER_EXAMPLE }.scene();
    let spring = SpringDamper { stiffness_n_per_m: 900.0, damping_n_s_per_m: 4.0 };
    let scene = scene.edit_unchecked(|scene| {
        scene.object.mass_kg = 1e15;
        scene.coupling.hand_object = spring;
    });
    let points = contact_points(&scene);
    let session = one_sided(&scene, &points.always, &points.switching);
    let is_own = |at: &FingerContact| (at.user, at.host) == (HostIndex(0), HostIndex(0));
    let own = points.switching.fingers.iter().position(is_own).unwrap();
    let (hand, push_n) = (session.hands[0][0], 1.5);
    let mut ensemble = Ensemble::new(&session, &[own], 1);
    let start = Vector2::new(-0.01, 0.0);
    ensemble.start(|body, number, _| if body == hand && number == 0 { start.x } else { 0.0 });
    ensemble.push_with(0)[0][0] = push_n;
    let (mass_kg, period_s) = (scene.hand.mass_kg, 1.0 / 1024.0);
    let mut falling = Falling { mass_kg, spring, push_n, period_s, begin: 0, state: start, pressed: false };
    let first = ensemble.layout.bodies[hand.0];
    let mut turns = 0;
    for tick in 0..2000 {
        turns += u32::from(falling.turn(tick));
        ensemble.advance();
        let mut now = [0.0; 2];
        ensemble.visit(&mut |place, row| {
            if (first..first + 2).contains(&place) {
                now[place - first] = row[0];
            }
        });
        let error = (Vector2::from(now) - falling.at(tick + 1)).norm();
        assert!(error <= 1e-11, "tick {tick}: {error:e}");
    }
    assert!(turns > 2, "it must bounce");
}
