//! One tick of a sphere on a box: pressed and sliding slowly, with the body's turning, in a plane and in space.
#![allow(missing_docs, reason = "criterion's macros")]

use std::hint::black_box;

use cotouch_scene::geometry::Twist;
use cotouch_scene::scene::{Integrator, Shape, ShapeKind, SpringDamper};
use cotouch_world::{
    BodyState, ContactModel, ContactState, Freedom, Inertia, Sphere, Stepper, Surface, touch,
};
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DMat3, DQuat, DVec3};

const T: f64 = 1.0 / 1024.0;

const MODEL: ContactModel = ContactModel {
    normal: SpringDamper { stiffness_n_per_m: 2000.0, damping_n_s_per_m: 8.0 },
    tangential: SpringDamper { stiffness_n_per_m: 1500.0, damping_n_s_per_m: 5.0 },
    static_friction: 0.8,
    dynamic_friction: 0.6,
    stick_speed_m_per_s: 0.002,
    period_s: T,
    cancellation: None,
};

fn cube() -> Surface {
    Surface::new(&Shape {
        kind: ShapeKind::Box,
        size_m: DVec3::splat(0.06),
        radius_m: 0.0,
        length_m: 0.0,
        mesh: String::new(),
        mesh_scale: 1.0,
        surface: None,
    })
}

fn sphere_on_a_box(criterion: &mut Criterion) {
    let surface = cube();
    let mut group = criterion.benchmark_group("sphere on a box");
    for (name, orientation) in [
        ("plane", DQuat::from_rotation_z(0.3)),
        ("space", DQuat::from_scaled_axis(DVec3::new(0.3, -0.5, 0.2))),
    ] {
        let mut body = BodyState::at_rest(DVec3::ZERO);
        body.pose.orientation = orientation;
        body.twist = Twist { linear: DVec3::X * 0.01, angular: orientation * DVec3::Z * 0.1 };
        let sphere = Sphere {
            centre: body.pose.to_world(DVec3::new(0.004, 0.036, 0.0)),
            velocity: DVec3::X * 0.02,
            radius_m: 0.008,
        };
        let mut state = ContactState::default();
        group.bench_function(format!("{name}, touch"), |bencher| {
            bencher.iter(|| {
                touch(&MODEL, &mut state, &surface, (&body.pose, &body.twist), black_box(&sphere), 2.0)
            });
        });
        let inertia = Inertia::new(0.4, DMat3::from_diagonal(DVec3::new(2.0, 2.4, 3.1) * 1e-4));
        let freedom = if name == "plane" { Freedom::Plane(DVec3::Z) } else { Freedom::Space };
        let stepper = Stepper::rigid(inertia, T, Integrator::ExactHold, freedom);
        let start = body;
        group.bench_function(format!("{name}, touch and step"), |bencher| {
            bencher.iter(|| {
                let mut body = start;
                let force =
                    touch(&MODEL, &mut state, &surface, (&body.pose, &body.twist), black_box(&sphere), 2.0);
                let force = force.expect("it touches");
                let wrench = force.on_surface(body.pose.position);
                stepper.step(&mut body, &wrench);
                body
            });
        });
    }
    group.finish();
}

criterion_group!(benches, sphere_on_a_box);
criterion_main!(benches);
