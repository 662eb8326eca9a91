//! What spheres find at boxes, balls, capsules and hulls: smooth round edges, and no way through.

use crate::common::{self, cuboid, hull, shape, vertices_of_cuboid};
use cotouch_scene::scene::{Shape, ShapeKind};
use cotouch_world::{Approach, MAX_CORNERS, Probe, Surface};
use glam::DVec3;
use proptest::prelude::*;

const HALF: DVec3 = DVec3::new(0.03, 0.02, 0.05);

fn vector(size: DVec3) -> impl Strategy<Value = DVec3> {
    [-size.x..size.x, -size.y..size.y, -size.z..size.z].prop_map(DVec3::from)
}

fn boxes() -> [Surface; 2] {
    [Surface::new(&cuboid(2.0 * HALF)), Surface::new(&hull(vertices_of_cuboid(HALF)))]
}

/// A sphere that was never there before.
fn fresh(surface: &Surface, centre: DVec3, radius: f64) -> Option<Probe> {
    surface.probe(&mut Approach::default(), centre, radius)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_box_and_the_hull_of_its_vertices_are_one_surface(centre in vector(1.3 * HALF)) {
        let [cuboid, hull] = boxes().map(|surface| fresh(&surface, centre, 0.01));
        prop_assert_eq!(cuboid.is_some(), hull.is_some());
        if let (Some(a), Some(b)) = (cuboid, hull) {
            prop_assert!((a.depth_m - b.depth_m).abs() < 1e-12);
            prop_assert!((a.normal - b.normal).length() < 1e-9, "{} {}", a.normal, b.normal);
            prop_assert!((a.point - b.point).length() < 1e-12);
        }
    }

    #[test]
    fn the_point_is_on_the_surface_and_the_normal_a_unit_vector(centre in vector(1.3 * HALF)) {
        let round = [shape(ShapeKind::Ball), shape(ShapeKind::Capsule)].map(|shape| Surface::new(&shape));
        for surface in boxes().iter().chain(&round) {
            let Some(probe) = fresh(surface, centre, 0.01) else { continue };
            prop_assert!((probe.normal.length() - 1.0).abs() < 1e-12);
            let above = centre + (probe.depth_m - 0.01) * probe.normal;
            prop_assert!((above - probe.point).length() < 1e-12);
            // A little above the point nothing is touched, a little beneath it something is.
            prop_assert!(fresh(surface, probe.point + 1e-6 * probe.normal, 0.9e-6).is_none());
            prop_assert!(fresh(surface, probe.point - 1e-6 * probe.normal, 0.9e-6).is_some());
        }
    }

    /// As long as the centre is outside, the force changes in proportion to the way: nothing jumps at edges or corners.
    #[test]
    fn the_push_is_continuous_round_edges_and_corners(
        from in vector(1.2 * HALF), way in vector(DVec3::splat(1.0)),
    ) {
        let round = [shape(ShapeKind::Ball), shape(ShapeKind::Capsule)].map(|shape| Surface::new(&shape));
        for surface in boxes().iter().chain(&round) {
            let mut proxy = Approach::default();
            let (step, radius) = (1e-5, 0.01);
            let mut before: Option<(DVec3, f64)> = None;
            for i in 0..1500 {
                let centre = from + way.normalize_or(DVec3::X) * step * f64::from(i);
                let probe = surface.probe(&mut proxy, centre, radius);
                let height = probe.map_or(radius, |probe| radius - probe.depth_m);
                let push = probe.map_or(DVec3::ZERO, |probe| probe.depth_m * probe.normal);
                if let Some((last, last_height)) = before {
                    // At a sharp edge the normal turns by step/height at most.
                    let lowest = height.min(last_height);
                    if lowest > 2.0 * step {
                        let most = step * (1.0 + 2.0 * radius / lowest);
                        prop_assert!((push - last).length() <= most, "{} at {centre}", (push - last).length());
                    }
                }
                before = Some((push, height));
            }
        }
    }
}

/// Leads a sphere and tells the normal and depth at the end of each step.
fn led(surface: &Surface, radius: f64, path: impl IntoIterator<Item = DVec3>) -> Vec<Option<(DVec3, f64)>> {
    let mut proxy = Approach::default();
    path.into_iter()
        .map(|centre| surface.probe(&mut proxy, centre, radius).map(|probe| (probe.normal, probe.depth_m)))
        .collect()
}

#[test]
fn nothing_gets_through_a_thin_plate() {
    let half = DVec3::new(0.05, 0.0005, 0.05);
    let plates = [Surface::new(&cuboid(2.0 * half)), Surface::new(&hull(vertices_of_cuboid(half)))];
    for plate in &plates {
        for radius in [0.0, 0.002] {
            let path = (0..4000).map(|i| DVec3::new(0.01, 0.01 - f64::from(i) * 1e-5, 0.02));
            for (i, found) in (0..4000).zip(led(plate, radius, path)) {
                let depth = radius + 0.0005 - (0.01 - f64::from(i) * 1e-5);
                let expected = (depth > 0.0).then_some((DVec3::Y, depth));
                match (found, expected) {
                    (Some((normal, depth)), Some((n, d))) => {
                        assert!((normal - n).length() < 1e-9 && (depth - d).abs() < 1e-12, "step {i}");
                    }
                    (found, expected) => assert!(found.is_none() && (expected.is_none() || depth < 1e-12)),
                }
            }
            // In one step from above to far beneath.
            let jump = led(plate, radius, [DVec3::Y * 0.004, DVec3::Y * -0.004]);
            let (normal, depth) = jump[1].expect("held");
            assert!((normal - DVec3::Y).length() < 1e-9 && (depth - (radius + 0.0045)).abs() < 1e-12);
            // Back above it is free; and past the plate's edge too.
            let up = led(plate, radius, [0.004, -0.004, 0.004].map(|y| DVec3::Y * y));
            assert_eq!(up[2], None);
            let aside = led(
                plate,
                radius,
                [(0.0, 0.004), (0.0, -0.004), (0.06, -0.004)].map(|(x, y)| DVec3::new(x, y, 0.0)),
            );
            assert!(aside[1].is_some() && aside[2].is_none());
        }
    }
}

#[test]
fn nothing_gets_through_a_ball_or_a_capsule() {
    for kind in [ShapeKind::Ball, ShapeKind::Capsule] {
        let surface = Surface::new(&shape(kind));
        let path = (0..5000).map(|i| DVec3::new(0.04 - f64::from(i) * 1.2e-5, 0.0, 1e-4));
        let found = led(&surface, 0.005, path);
        let (normal, depth) = found.last().copied().flatten().expect("held");
        assert!(normal.x > 0.7 && depth > 0.03, "{kind:?}: {normal}, {depth}");
        let steepest = found.windows(2).filter_map(|two| Some((two[0]?.1, two[1]?.1)));
        for (before, after) in steepest {
            assert!((before - after).abs() < 2e-5, "{kind:?}: the depth jumps from {before} to {after}");
        }
        let way_round = [(0.03, 0.0), (0.03, 0.2), (-0.03, 0.2), (-0.03, 0.0)];
        let way_round = way_round.map(|(x, y)| DVec3::new(x, y, 0.0));
        let (normal, _) = led(&surface, 0.005, way_round)[3].expect("in contact");
        assert!((normal + DVec3::X).length() < 1e-12, "{kind:?}: it came round, and touches the other side");
    }
}

#[test]
fn a_centre_that_sinks_in_keeps_its_face_without_a_jump() {
    for surface in boxes() {
        // Into the face, then close to another face, deeper than that is far.
        let down = (0..2500).map(|i| DVec3::new(0.0, 0.03 - f64::from(i) * 1e-5, 0.0));
        let aside = (0..2900).map(|i| DVec3::new(f64::from(i) * 1e-5, 0.005, 0.0));
        let found = led(&surface, 0.008, down.chain(aside));
        let mut last = 0.0;
        for (normal, depth) in found.into_iter().flatten() {
            assert!((normal - DVec3::Y).length() < 1e-9);
            assert!((depth - last) < 1.1e-5, "the depth jumps to {depth}");
            last = depth;
        }
        assert!((last - (0.008 + 0.015)).abs() < 1e-9);
    }
}

#[test]
fn corners_stand_for_the_body() {
    let cuboid = Surface::new(&cuboid(2.0 * HALF));
    assert_eq!(cuboid.corners().len(), 8);
    let hull = Surface::new(&hull(vertices_of_cuboid(HALF)));
    assert_eq!(hull.corners().len(), 8);
    for corner in cuboid.corners().iter().chain(hull.corners()) {
        let reach = corner.centre.abs() + DVec3::splat(corner.radius_m);
        assert!(corner.radius_m > 0.0 && (reach - HALF).length() < 1e-8, "{corner:?}");
    }
    let planar = Surface::planar(&common::cuboid(2.0 * HALF));
    assert_eq!(planar.corners().len(), 4);
    assert!(planar.corners().iter().all(|corner| corner.centre.z == 0.0));
    let reach = planar.corners()[3].centre + DVec3::splat(planar.corners()[3].radius_m);
    assert!((reach.truncate() - HALF.truncate()).length() < 1e-15);
    let flat = Surface::planar(&common::hull(vertices_of_cuboid(HALF)));
    assert_eq!(flat.corners().len(), 4);

    let ball = Surface::new(&shape(ShapeKind::Ball));
    assert_eq!((ball.corners().len(), ball.corners()[0].radius_m), (1, 0.03));
    let capsule = Surface::new(&shape(ShapeKind::Capsule));
    assert_eq!(capsule.corners()[1].centre, DVec3::Y * 0.025);
    assert!((capsule.bounding_radius_m() - 0.055).abs() < 1e-15);
}

#[test]
fn a_flat_box_in_a_plane_pushes_in_the_plane() {
    // Thinner than it is deep in: in space the nearest face would be across z.
    let surface = Surface::planar(&cuboid(DVec3::new(0.06, 0.05, 0.002)));
    let probe = fresh(&surface, DVec3::new(0.002, 0.015, 0.0), 0.005).expect("in contact");
    assert_eq!(probe.normal, DVec3::Y);
    assert!((surface.bounding_radius_m() - 0.03_f64.hypot(0.025)).abs() < 1e-15);
    assert!((probe.depth_m - 0.015).abs() < 1e-15);
}

#[test]
fn what_is_not_a_number_touches_nothing_and_is_forgotten() {
    let round = [shape(ShapeKind::Ball), shape(ShapeKind::Capsule)].map(|shape| Surface::new(&shape));
    for surface in boxes().iter().chain(&round) {
        let above = DVec3::Y * (surface.bounding_radius_m() + 0.001);
        for bad in [DVec3::NAN, DVec3::new(0.0, f64::NAN, 0.0), DVec3::splat(f64::INFINITY)] {
            let found = led(surface, 0.005, [above, bad, DVec3::X * 0.029]);
            assert_eq!(found[1], None);
            let (normal, _) = found[2].expect("in contact");
            assert!((normal - DVec3::X).length() < 1e-9, "{normal}");
        }
    }
}

#[test]
fn a_hull_with_many_vertices_has_corners_all_over() {
    let at = |i: u32| {
        let (turn, height) = (f64::from(i) * 2.399_963, 1.0 - 2.0 * (f64::from(i) + 0.5) / 500.0);
        let across = (1.0 - height * height).sqrt();
        0.05 * DVec3::new(across * turn.cos(), height, across * turn.sin())
    };
    let surface = Surface::new(&hull((0..500).map(at).collect()));
    let corners = surface.corners();
    assert_eq!(corners.len(), MAX_CORNERS);
    for (i, a) in corners.iter().enumerate() {
        assert!((a.centre.length() + a.radius_m - 0.05).abs() < 1e-4, "{a:?}");
        for b in &corners[i + 1..] {
            assert!(a.centre.distance(b.centre) > 0.02);
        }
    }
    let found = fresh(&surface, DVec3::new(0.03, 0.03, 0.03), 0.004).expect("in contact");
    assert!((found.normal - DVec3::ONE.normalize()).length() < 0.1);
    assert!((found.depth_m - (0.004 + 0.05 - 0.03 * 3.0_f64.sqrt())).abs() < 5e-4);
}

#[test]
fn what_encloses_nothing_has_no_surface() {
    assert!(!Surface::new(&shape(ShapeKind::Point)).exists());
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y];
    for vertices in [Vec::new(), flat[..3].to_vec(), flat.to_vec()] {
        let surface = Surface::new(&hull(vertices));
        assert!(!surface.exists() && surface.corners().is_empty());
        assert_eq!(fresh(&surface, DVec3::ZERO, 1.0), None);
    }
    assert!(!Surface::new(&Shape { surface: None, ..hull(Vec::new()) }).exists());
}
