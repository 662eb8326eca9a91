//! Contacts of local models on surfaces that stand still, and the joint compliance.

use std::sync::LazyLock;

use cotouch_scene::scene::LocalModel;
use cotouch_world::MeshSurface;
use cotouch_world::local::{
    ContactInput, JointContact, LocalContact, LocalGains, SoftContactModel, SurfaceInUse, joint_forces,
};
use glam::DVec3;

const BALL_M: f64 = 0.05;
const RADIUS_M: f64 = 0.005;

/// A ball about the origin: an octahedron whose faces were cut into four, `times` times.
fn ball(times: usize) -> MeshSurface {
    let mut vertices = vec![DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let mut triangles: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..times {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    vertices.iter_mut().for_each(|vertex| *vertex *= BALL_M);
    MeshSurface::new(vertices, &triangles).unwrap()
}

fn model(friction: f64) -> SoftContactModel {
    let scene = cotouch_scene::load("spring", &[]).unwrap();
    SoftContactModel {
        two_sided: false,
        friction,
        radius_m: RADIUS_M,
        exit_threshold_m: 0.0,
        entry_threshold_m: 0.0,
        tick_s: 1e-3,
        ..SoftContactModel::new(&scene)
    }
}

/// K_h = 100 N/m, 1 N/m a tick, drained in 10 ticks.
static GAINS: LazyLock<LocalGains> = LazyLock::new(|| {
    let (stiffness_n_per_m, integral_n_per_m, drain_periods) = (100.0, 1.0, 10.0);
    let model = LocalModel { stiffness_n_per_m, integral_n_per_m, drain_periods, ..LocalModel::default() };
    LocalGains::new(&model, 0.0, 1)
});

fn input<'a>(model: &'a SoftContactModel, surface: &'a SurfaceInUse<'a>, centre: DVec3) -> ContactInput<'a> {
    ContactInput { model, gains: &GAINS, surface, centre, velocity: DVec3::ZERO }
}

fn still(surface: &MeshSurface) -> SurfaceInUse<'_> {
    SurfaceInUse { latest: surface, before_m: &[], share: 1.0, speed_per_s: 0.0 }
}

#[test]
fn the_nearest_point_is_part_of_its_triangle() {
    let surface = ball(2);
    for at in 0..50 {
        let turn = f64::from(at) * 2.4;
        let point = DVec3::new(turn.cos(), turn.sin(), (0.7 * turn).sin()) * 0.08;
        let found = surface.nearest_point(point).unwrap();
        let again: DVec3 = found
            .vertices
            .iter()
            .zip(found.weights)
            .map(|(&at, weight)| surface.vertices()[at as usize] * weight)
            .sum();
        assert!(again.distance(found.point) < 1e-15 && found.outward.dot(found.point) > 0.0);
        let (distance, nearest) = surface.signed_distance(point).unwrap();
        assert!(distance == nearest.distance(point) && nearest == found.point);
        let on = surface.nearest_on(found.triangle, point).unwrap();
        assert!(on.point.distance(found.point) < 1e-15 && on.vertices == found.vertices);
    }
    assert_eq!(surface.nearest_on(100_000, DVec3::ZERO), None);
}

#[test]
fn a_copy_of_a_surface_goes_on_as_the_surface_does() {
    let mut surface = ball(2);
    let mut copy = surface.clone();
    let larger: Vec<DVec3> = surface.vertices().iter().map(|vertex| *vertex * 1.02).collect();
    surface.deform(&larger).unwrap();
    copy.copy_from(&surface);
    let finger = DVec3::X * (BALL_M + RADIUS_M);
    let probe = |surface: &MeshSurface| {
        let mut state = ball(2).seen_outside(finger);
        (surface.probe(&mut state, finger, RADIUS_M), state)
    };
    assert!(probe(&surface).0.is_some());
    assert_eq!(probe(&surface), probe(&copy));
    assert_eq!(surface.generation(), copy.generation());
}

/// Draws a finger round the ball, `depth_m` deep: the largest ratio of forces along to across the surface, and how far the
/// held centre got from its place outside the ball.
fn drawn_round(friction: f64, depth_m: f64) -> (f64, f64) {
    let (surface, model) = (ball(4), model(friction));
    let surface = still(&surface);
    let mut contact = LocalContact::default();
    let at = |turn: f64| DVec3::new(turn.cos(), turn.sin(), 0.1).normalize();
    contact.meet(&model, &surface, at(0.0) * (BALL_M + 2.0 * RADIUS_M));
    let (mut ratio, mut apart) = (0.0_f64, 0.0_f64);
    for tick in 0..3000 {
        let centre = at(f64::from(tick) * 2e-3) * (BALL_M + RADIUS_M - depth_m);
        if !contact.touching {
            contact.meet(&model, &surface, centre);
        }
        assert!(contact.touching, "at tick {tick}");
        let stretch = contact.stretch(&surface, centre);
        // The cone stands on the normal that the tick began with.
        let normal = contact.normal;
        let stretch =
            contact.slide(&input(&model, &surface, centre), stretch, friction * stretch.dot(normal));
        let across = stretch.dot(normal);
        assert!((stretch - normal * across).length() <= friction * across + 1e-12, "at tick {tick}");
        let along = contact.stretch(&surface, centre).reject_from(contact.normal).length();
        if tick > 500 {
            ratio = ratio.max(along / contact.depth_m(&surface, centre));
        }
        let held = surface.at(&contact.anchor) + contact.offset;
        apart = apart.max((held.length() - BALL_M - RADIUS_M).abs());
    }
    (ratio, apart)
}

#[test]
fn a_finger_slides_round_a_ball() {
    for friction in [0.0, 0.3, 0.8] {
        let (ratio, apart_m) = drawn_round(friction, 0.002);
        // The normal turns where the finger passes from one facet to the next.
        assert!((ratio - friction).abs() < 0.1, "{friction}: {ratio}");
        assert!(apart_m < 2e-4, "{friction}: the ball's facets are flat by this: {apart_m}");
    }
}

#[test]
fn a_finger_that_comes_off_is_met_again() {
    let surface = ball(4);
    let (model, surface) = (model(0.5), still(&surface));
    let mut contact = LocalContact::default();
    for round in 0..5 {
        contact.meet(&model, &surface, DVec3::X * (BALL_M + RADIUS_M + 1e-4));
        assert!(!contact.touching);
        contact.meet(&model, &surface, DVec3::X * (BALL_M + RADIUS_M - 0.01));
        assert!(contact.touching, "in round {round}");
        assert!((contact.depth_m(&surface, DVec3::X * (BALL_M + RADIUS_M - 0.01)) - 0.01).abs() < 1e-6);
        contact.come_off(&input(&model, &surface, DVec3::X * (BALL_M + RADIUS_M + 1e-4)));
    }
}

/// Two contacts with a joint compliance that is far from diagonal.
fn pair(stretches: [DVec3; 2], two_sided: bool) -> Vec<JointContact> {
    let contact = |(place, stretch)| JointContact {
        place,
        stiffness_n_per_m: 300.0,
        stretch,
        normal: DVec3::Z,
        two_sided,
    };
    stretches.into_iter().enumerate().map(contact).collect()
}

fn compliance() -> Vec<f64> {
    // A·Aᵀ of something.
    let a = |row: usize, column: usize| 0.03 * ((row * 7 + column * 5 + 1) as f64).sin();
    let entry = |row: usize, column: usize| (0..6).map(|k| a(row, k) * a(column, k)).sum::<f64>();
    (0..36).map(|at| entry(at / 6, at % 6)).collect()
}

#[test]
fn joint_forces_satisfy_their_equation() {
    let w = compliance();
    let before = [DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.0, 0.4, -0.1)];
    let stretches = [DVec3::new(1e-3, 0.0, 5e-3), DVec3::new(-2e-3, 1e-3, 4e-3)];
    let forces = joint_forces(&w, &before, &pair(stretches, true)).unwrap();
    for row in 0..6 {
        let answered: f64 =
            (0..6).map(|at| w[6 * row + at] * (-forces[at / 3][at % 3] - before[at / 3][at % 3])).sum();
        // e + W·(f − f_frame) = F/K_h
        let rest = stretches[row / 3][row % 3] + answered - forces[row / 3][row % 3] / 300.0;
        assert!(rest.abs() < 1e-15, "{row}: {rest}");
    }
}

#[test]
fn contacts_that_would_pull_are_left_out() {
    let stretches = [DVec3::Z * 5e-3, DVec3::Z * -1e-3];
    let forces = joint_forces(&compliance(), &[DVec3::ZERO; 2], &pair(stretches, false)).unwrap();
    assert!(forces[0].z > 0.0 && forces[1] == DVec3::ZERO, "{forces:?}");
    let alone = joint_forces(&compliance(), &[DVec3::ZERO; 2], &pair(stretches, false)[..1]).unwrap();
    assert_eq!(forces[0], alone[0]);
}

#[test]
fn a_compliance_that_is_none_gives_no_forces() {
    let contacts = pair([DVec3::Z * 1e-3; 2], false);
    let mut w = compliance();
    assert_eq!(joint_forces(&w[..9], &[DVec3::ZERO; 2], &contacts), None);
    assert_eq!(joint_forces(&w, &[DVec3::ZERO], &contacts), None);
    w[0] = f64::NAN;
    assert_eq!(joint_forces(&w, &[DVec3::ZERO; 2], &contacts), None);
    w[0] = -1.0;
    assert_eq!(joint_forces(&w, &[DVec3::ZERO; 2], &contacts), None);
}
