//! A tick of contacts, couplers, ground and bodies allocates nothing.

use std::hint::black_box;

use crate::common::{self, T, cuboid, floor, hull, model, shape, vertices_of_cuboid};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::scene::{Ground, Integrator, ShapeKind};
use cotouch_testkit::allocations;
use cotouch_world::coordination::CouplingGains;
use cotouch_world::coupler::Stretch;
use cotouch_world::{
    BodyState, ContactState, Freedom, GroundFriction, Inertia, Sphere, Stepper, Surface, touch, touch_plane,
};
use glam::{DQuat, DVec3};

#[test]
fn a_tick_allocates_nothing() {
    let size = DVec3::splat(0.06);
    let shapes = [
        cuboid(size),
        shape(ShapeKind::Ball),
        shape(ShapeKind::Capsule),
        hull(vertices_of_cuboid(0.5 * size)),
    ];
    let surfaces = shapes.map(|shape| Surface::new(&shape));
    let inertia = Inertia::from_body(&common::body(cuboid(size), 0.4, DVec3::ZERO));
    let steppers = [Freedom::Plane(DVec3::Z), Freedom::Space]
        .map(|freedom| Stepper::rigid(inertia, T, Integrator::ExactHold, freedom));
    let ground = Ground { friction_coefficient: 0.3, rotational_friction_coefficient: 0.2 };
    let ground = GroundFriction::new(&ground, inertia, T, Freedom::Plane(DVec3::Z));
    let gains = CouplingGains { stiffness: 0.1, damping: 0.001 };
    let mut touched = 0;

    let counted = allocations(|| {
        for surface in &surfaces {
            let (mut state, mut on_floor) = (ContactState::default(), ContactState::default());
            let mut body = BodyState::at_rest(DVec3::ZERO);
            for tick in 0..2000 {
                let way = f64::from(tick) * 1e-5;
                let sphere = Sphere {
                    centre: DVec3::new(way, 0.045 - 2.0 * way, 0.004),
                    velocity: DVec3::NEG_Y,
                    radius_m: 0.01,
                };
                let frame = (&Pose::default(), &Twist::default());
                let force = touch(&model(), &mut state, surface, frame, black_box(&sphere), 2.0);
                touched += u32::from(force.is_some());
                let force = touch_plane(&model(), &mut on_floor, &floor(), black_box(&sphere));
                touched += u32::from(force.is_some());
                let orientation = (body.pose.orientation, body.twist.angular);
                let apart = Stretch::between_orientations(orientation, (DQuat::IDENTITY, DVec3::ONE));
                let mut wrench = Wrench { force: DVec3::X, torque: gains.force(apart) };
                let resistance = ground.resist(&body, &wrench);
                common::add(&mut wrench, resistance);
                for stepper in &steppers {
                    stepper.step(&mut body, black_box(&wrench));
                }
            }
        }
    });
    assert_eq!(counted, 0);
    assert!(touched > 4000);
}
