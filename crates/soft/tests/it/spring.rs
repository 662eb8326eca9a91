//! Nodes that are tied to where they rest: Barbagli et al.'s spring.

use crate::common::{central_differences, exact_step, spring_scene};
use cotouch_soft::{MaterialPoint, PointForce, soft_body};
use glam::DVec3;

const STIFFNESS: f64 = 200.0;

fn middle() -> MaterialPoint {
    MaterialPoint::on_triangle([0, 1, 2], [1.0 / 3.0; 3])
}

fn press(force_n: DVec3) -> PointForce {
    PointForce { at: middle(), force_n }
}

#[test]
fn without_inertia_the_middle_is_a_spring() {
    let mut body = soft_body(&spring_scene(STIFFNESS, true)).unwrap();
    let start = middle().at(body.rest_m());
    for force in [DVec3::new(1.5, 0.0, 0.0), DVec3::new(-0.3, 2.0, 0.7), DVec3::ZERO] {
        body.step(&[press(force)]);
        let moved = middle().at(&body.state().positions_m) - start;
        assert!(moved.distance(force / STIFFNESS) < 1e-15, "{moved} under {force}");
    }
}

#[test]
fn its_compliance_in_the_middle_is_exactly_one_over_its_stiffness() {
    let body = soft_body(&spring_scene(STIFFNESS, false)).unwrap();
    let compliance = body.compliance(&[middle()]).unwrap();
    let error = (compliance - nalgebra::DMatrix::identity(3, 3) / STIFFNESS).amax();
    assert!(error < 1e-15 / STIFFNESS * 10.0, "{error}");
}

#[test]
fn with_inertia_it_is_a_damped_mass_on_a_spring() {
    let scene = spring_scene(STIFFNESS, false);
    let mut body = soft_body(&scene).unwrap();
    let linear = body.linear().unwrap();
    let mass: f64 = linear.mass_kg.iter().sum::<f64>() / 3.0;
    let (h, alpha, beta) = (linear.period_s, linear.mass_damping_per_s, linear.stiffness_damping_s);
    assert_eq!((alpha, beta), (scene.soft.mass_damping_per_s, scene.soft.stiffness_damping_s));
    let (mut x, mut v) = (0.0, 0.0);
    let start = middle().at(body.rest_m());
    for period in 0..100 {
        let force = if period < 50 { 0.8 } else { 0.0 };
        body.step(&[press(force * DVec3::X)]);
        let s = (1.0 + h * alpha) * mass + h * beta * STIFFNESS + h * h * STIFFNESS;
        v = (mass * v + h * (force - STIFFNESS * x)) / s;
        x += h * v;
        let moved = middle().at(&body.state().positions_m) - start;
        assert!((moved.x - x).abs() < 1e-14 && moved.y.abs() + moved.z.abs() < 1e-16, "{moved} {x}");
    }
}

#[test]
fn a_step_is_what_its_linearisation_says() {
    for quasi_static in [false, true] {
        let mut body = soft_body(&spring_scene(STIFFNESS, quasi_static)).unwrap();
        let press = [press(DVec3::new(0.4, -0.2, 0.1))];
        body.settle(&press).unwrap();
        let exact = exact_step(&body.linear().unwrap());
        let differences = central_differences(&*body, &press, 1e-6);
        // Without inertia a step forgets where it began: all is zero.
        assert!((exact - &differences).amax() < 1e-9 * differences.amax().max(1.0));
    }
}

#[test]
fn settling_finds_the_place_where_forces_balance() {
    let mut body = soft_body(&spring_scene(STIFFNESS, false)).unwrap();
    let force = DVec3::new(3.0, 0.0, -1.0);
    body.settle(&[press(force)]).unwrap();
    let moved = middle().at(&body.state().positions_m) - middle().at(body.rest_m());
    assert!(moved.distance(force / STIFFNESS) < 1e-14);
    let energy = body.energy();
    assert!((energy.elastic_j - 0.5 * force.length_squared() / STIFFNESS).abs() < 1e-14);
}

#[test]
fn forces_and_states_that_are_not_numbers_change_nothing_but_its_speed() {
    let mut body = soft_body(&spring_scene(STIFFNESS, false)).unwrap();
    body.step(&[press(DVec3::X)]);
    let before = body.state().clone();
    let mut broken = before.clone();
    broken.positions_m[1].y = f64::NAN;
    body.set_state(&broken);
    assert_eq!(body.state().positions_m, before.positions_m);
    assert!(body.state().velocities_m_per_s.iter().all(|velocity| *velocity == DVec3::ZERO));
    for force in [f64::NAN, f64::INFINITY, 1e300] {
        body.step(&[press(force * DVec3::X)]);
        let state = body.state();
        assert!(state.positions_m.iter().chain(&state.velocities_m_per_s).all(|vector| vector.is_finite()));
    }
}
