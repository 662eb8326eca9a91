//! Any scene survives being written and read; no text and no override makes the reader panic.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{
    Action, Architecture, Body, Coordination, DeviceKind, Finger, FixedRegion, Impairment, Integrator,
    LocalModelKind, PlayOut, ReturnedForce, SceneValues, Shape, ShapeKind, SoftMeshKind, SoftModel, Space,
    StiffnessFrom, SurfaceHold, VelocityEstimate, WallPlane, WallSides, Way,
};
use cotouch_scene::{Override, Scene, builtin, load, parse, parse_bytes, scene_hash, to_toml, with_override};
use glam::DVec3;
use proptest::prelude::*;

fn vector() -> impl Strategy<Value = DVec3> {
    let component = || -10.0..10.0f64;
    prop_oneof![
        component().prop_map(|x| DVec3::new(x, 0.0, 0.0)),
        [component(), component(), component()].prop_map(DVec3::from),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    (0..17, vector(), 0.001..500.0f64, -1e3..1e3f64, 0.001..86_400.0f64, 0.0..=1.0f64).prop_map(
        |(kind, vector, frequency_hz, phase_rad, duration_s, part)| match kind {
            0 => Action::Relax { duration_s },
            1 => Action::Hold { duration_s },
            2 => Action::Reach { to_m: vector, duration_s },
            3 => Action::Sinusoid { amplitude_m: vector, frequency_hz, phase_rad, duration_s },
            4 => Action::Force { force_n: vector, duration_s },
            5 => Action::SinusoidalForce { amplitude_n: vector, frequency_hz, phase_rad, duration_s },
            6 => Action::Tremor { rms_n: vector, duration_s },
            7 => Action::Grasp {
                body: "a".to_owned(),
                force_n: frequency_hz,
                speed_m_per_s: part.max(0.001),
                duration_s,
            },
            8 => Action::Carry { by_m: vector, duration_s },
            9 => Action::CarryTo { to_m: vector, duration_s },
            10 => Action::Lift { height_m: vector.x, duration_s },
            11 => Action::Turn { angle_rad: phase_rad / 10.0, duration_s },
            12 => Action::Push { force_n: vector, duration_s },
            13 => Action::HandOver { duration_s },
            14 => Action::LetGo { distance_m: part.max(0.001), duration_s },
            15 => Action::WaitUntil { until_s: duration_s },
            _ => Action::PushAndLetGo { force_n: vector, push_s: (part * duration_s).max(0.001), duration_s },
        },
    )
}

fn impairment() -> impl Strategy<Value = Impairment> {
    (0.0..10.0f64, 0.0..10.0f64, 0.0..0.99f64, 1.0..900.0f64, 0.0..=1.0f64, any::<bool>()).prop_map(
        |(latency_s, jitter_s, loss_rate, longer, reorder_rate, independent)| {
            let alone = 1.0 / (1.0 - loss_rate);
            Impairment {
                latency_s,
                jitter_s,
                loss_rate,
                loss_burst_packets: if independent { alone } else { alone * longer },
                reorder_rate,
                duplicate_rate: 1.0 - reorder_rate,
                rate_limit_bytes_per_s: latency_s * 1e5,
                outage_from_s: jitter_s * 3.0,
                outage_duration_s: jitter_s,
            }
        },
    )
}

fn shape(kind: u8, size_m: DVec3, radius_m: f64) -> Shape {
    let kind = [ShapeKind::Ball, ShapeKind::Box, ShapeKind::Capsule, ShapeKind::Point][usize::from(kind)];
    let (mesh, length_m) = (String::new(), radius_m / 3.0);
    Shape {
        kind,
        size_m: size_m.abs() + 0.001,
        radius_m,
        length_m,
        mesh,
        mesh_scale: 1.0 / 3.0,
        surface: None,
    }
}

/// The first body is called "a" and can be grasped; none is a point, except the object.
fn bodies() -> impl Strategy<Value = Vec<Body>> {
    let body = (0..3u8, [0.0..9.0f64, 0.0..9.0, 0.0..9.0], 0.001..1.0f64, vector(), vector(), any::<bool>());
    prop::collection::vec(body, 1..6).prop_map(|bodies| {
        let numbered = bodies.into_iter().enumerate();
        numbered
            .map(|(index, (kind, size, radius_m, position_m, rotation_rad, fixed))| Body {
                name: char::from(b'a' + index as u8).to_string(),
                shape: shape(kind, size.into(), radius_m),
                mass_kg: radius_m,
                position_m,
                rotation_rad,
                fixed: fixed && index > 0,
            })
            .collect()
    })
}

/// The scene of these values, which must be allowed.
fn checked(values: SceneValues) -> Scene {
    load("single-axis", &[]).unwrap().edit(|scene| *scene = values).unwrap()
}

/// `scene` with walls, bodies, fingers and all that goes with them.
fn with_bodies() -> impl Strategy<Value = Scene> {
    let fingers = prop::collection::vec((vector(), prop::collection::vec(action(), 0..2)), 1..5);
    let planes = prop::collection::vec((vector(), [0.1..1.0f64, -1.0..1.0, -1.0..1.0]), 0..3);
    let words = (any::<bool>(), 0..4u8, any::<bool>());
    (scene(), bodies(), fingers, planes, words, prop::array::uniform8(0.0..1.0f64)).prop_map(
        |(scene, bodies, fingers, planes, words, at)| {
            let mut scene = SceneValues::clone(&scene);
            scene.object.shape = shape(words.1, DVec3::splat(at[0]), at[1] + 0.1);
            scene.object.axis_damping_n_s_per_m = DVec3::new(at[0], 1.0 - at[1], at[2]);
            scene.object.rotational_damping_n_m_s_per_rad = at[2] - 0.5;
            (scene.object.position_m, scene.object.rotation_rad) = (DVec3::splat(at[3]), DVec3::Y * at[4]);
            scene.bodies = bodies;
            scene.space = if words.0 { Space::Plane } else { Space::Space };
            scene.device.kind = if words.0 { DeviceKind::Pantograph } else { DeviceKind::Phantom };
            scene.device.velocity =
                if words.2 { VelocityEstimate::Difference } else { VelocityEstimate::Filtered };
            (scene.device.encoder_counts_per_turn, scene.device.inertia) = (4096, words.2);
            scene.device.max_joint_torque_n_m = at[5];
            scene.gravity_m_per_s2 = DVec3::new(0.0, at[5], at[6] - 9.81);
            scene.hand.finger_radius_m = 0.001 + at[7] * 0.9;
            scene.ground.friction_coefficient = at[0];
            scene.ground.rotational_friction_coefficient = at[1];
            scene.contact.static_friction = at[2];
            scene.contact.dynamic_friction = at[2] * if words.2 { at[3] } else { 1.0 };
            scene.contact.moment_cancellation = words.2;
            scene.contact.body_body_tangential.damping_n_s_per_m = at[4];
            scene.coupling.hand_object_tangential.stiffness_n_per_m = at[5];
            scene.coupling.remote_hand_object_tangential = scene.coupling.remote_hand_object;
            scene.coupling.object_object_rotational.damping_n_m_s_per_rad = at[6];
            scene.wall.tangential_stiffness_n_per_m = at[7];
            scene.wall.dynamic_friction = at[0] * 0.6;
            let plane = |(index, (point_m, normal)): (usize, (DVec3, [f64; 3]))| WallPlane {
                name: format!("wall {index}"),
                point_m,
                normal: normal.into(),
            };
            scene.wall.planes = planes.into_iter().enumerate().map(plane).collect();
            let finger = |(position_m, script)| Finger { position_m, script };
            scene.users[0].fingers = fingers.into_iter().map(finger).collect();
            checked(scene)
        },
    )
}

/// A built-in scene with everything about it changed, but without bodies.
fn scene() -> impl Strategy<Value = Scene> {
    let words = (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>());
    let numbers = prop::array::uniform16(0.0..1.0f64);
    let users =
        prop::collection::vec(("[a-zé\"\\\\'#=]{1,20}", prop::collection::vec(action(), 0..4)), 2..17);
    let rates = (1u32..20_000, 1u32..1000, 0u32..64, 0u64..1 << 63);
    (words, numbers, users, rates, impairment(), prop::option::of(impairment())).prop_map(
        |(words, at, users, (control, divisor, delay, seed), impairment, way)| {
            let mut scene = SceneValues::clone(&load("single-axis", &[]).unwrap());
            if words.0 {
                scene.session.architecture = Architecture::Centralized;
            }
            if words.1 {
                scene.session.coordination = Coordination::Average;
                scene.session.integrator = Integrator::SemiImplicitEuler;
            }
            if words.2 {
                scene.link.play_out = PlayOut::OnArrival;
                scene.wall.sides = WallSides::One;
            }
            scene.session.users = users.len() as u8;
            scene.session.seed = seed;
            scene.rates.control_hz = format!("{control}").parse().unwrap();
            scene.rates.network_hz = format!("{control}/{}", divisor.min(control)).parse().unwrap();
            (scene.link.delay_periods, scene.link.return_delay_periods) = (delay, delay / 2);
            scene.link.impairment = impairment;
            let way = way.map(|impairment| Way { from: HostIndex(0), to: HostIndex(1), impairment });
            scene.link.ways = way.into_iter().collect();
            scene.hand.mass_kg = 1e-4 + at[0];
            scene.hand.damping_n_s_per_m = at[1] * 1e4;
            scene.hand.stiffness_n_per_m = at[2] * 1e6;
            scene.object.mass_kg = 1e-4 + at[3] * 999.0;
            scene.object.damping_n_s_per_m = at[4] * 1e4 - 1e3;
            scene.coupling.hand_object.stiffness_n_per_m = at[5] * 1e-9;
            scene.coupling.remote_hand_object.damping_n_s_per_m = at[6];
            scene.wall.stiffness_n_per_m = at[7] * 1e7;
            scene.wall.position_m = at[8] * 20.0 - 10.0;
            scene.governor.max_force_n = 0.1 + at[9] * 999.0;
            let following = scene.governor.max_force_n * scene.rates.control_hz.hz();
            scene.governor.max_slew_n_per_s = if words.3 { following } else { 0.01 + at[10] * 1e8 };
            let tracking = scene.coupling.object_object;
            let template = scene.users[0].clone();
            scene.users.clear();
            for (index, (name, script)) in users.into_iter().enumerate() {
                let name = format!("{name}{index}");
                let script: Vec<Action> =
                    script.into_iter().filter(|action| !matches!(action, Action::Grasp { .. })).collect();
                scene.users.push(cotouch_scene::scene::User { name, script, tracking, ..template.clone() });
            }
            checked(scene)
        },
    )
}

/// `scene` with a soft object, held at its lower end, in place of the rigid one.
fn with_soft() -> impl Strategy<Value = Scene> {
    let mesh = (0..4u8, [1..4u32, 1..4, 1..4], [0.2..0.3f64, 0.2..0.3, 0.2..0.3], vector());
    let kinds = 0..LocalModelKind::ALL.len();
    let words = (0..3u8, kinds, 0..3u8, any::<bool>(), any::<bool>());
    (scene(), mesh, words, prop::array::uniform16(0.0..1.0f64)).prop_map(
        |(scene, (generator, cells, size, origin_m), words, at)| {
            let mut scene = SceneValues::clone(&scene);
            scene.wall.stiffness_n_per_m = 0.0;
            scene.rates.simulation_hz = scene.rates.network_hz;
            let soft = &mut scene.soft;
            soft.mesh.generator =
                [SoftMeshKind::Beam, SoftMeshKind::Block, SoftMeshKind::Ball, SoftMeshKind::Organ]
                    [usize::from(generator)];
            soft.model =
                [SoftModel::MassSpring, SoftModel::Corotational, SoftModel::Balloon][usize::from(words.0)];
            (soft.mesh.cells, soft.mesh.size_m, soft.mesh.radius_m) = (cells, size.into(), size[0]);
            (soft.mesh.origin_m, soft.mesh.edge_m) = (origin_m, 0.1 + 0.05 * at[0]);
            (soft.young_pa, soft.poisson_ratio) = (1.0 + at[0] * 1e6, 0.2 + at[1] * 0.1);
            (soft.density_kg_per_m3, soft.mass_damping_per_s) = (1.0 + at[2], at[3] / 3.0);
            (soft.stiffness_damping_s, soft.newton_steps, soft.quasi_static) = (at[4], 20, words.3);
            (soft.skin_thickness_m, soft.skin_stretch) = (1e-6 + at[5] * 0.09, 1.01 + 0.98 * at[6]);
            let reach = DVec3::from(size) * 2.0;
            let middle = origin_m.z + if generator < 2 { 0.0 } else { 0.05 };
            let to_m = (origin_m + reach).with_z(middle);
            soft.fixed = vec![FixedRegion { from_m: origin_m - reach, to_m }];
            let local = &mut scene.local_model;
            local.kind = LocalModelKind::ALL[words.1];
            local.returned_force =
                [ReturnedForce::First, ReturnedForce::Mean, ReturnedForce::Last][usize::from(words.2)];
            local.result_delay_periods = words.1 as u32 % 4;
            (local.stiffness_n_per_m, local.stiffness_ratio) = (at[7] * 1e3, at[8]);
            (local.integral_n_per_m, local.integral_ratio) = (at[9], at[10] * 10.0);
            if words.3 {
                (local.stiffness_from, local.hold) = (StiffnessFrom::Estimate, SurfaceHold::First);
            }
            local.sides = if words.4 { WallSides::Two } else { WallSides::One };
            (local.exit_threshold_m, local.entry_threshold_m) = (at[11] * 0.1, at[12] * 0.1);
            (local.threshold_force_n, local.drain_periods, local.friction) = (at[13], 0.01 + at[14], at[15]);
            checked(scene)
        },
    )
}

/// A built-in scene's text with one stretch replaced.
fn mutated() -> impl Strategy<Value = String> {
    let texts: Vec<&'static str> = builtin::names().filter_map(builtin::source).collect();
    let piece = prop_oneof![
        "\\PC{0,12}",
        Just("[[user]]\n".to_owned()),
        Just("link = 3\n".to_owned()),
        Just(" = [1, {}]\n".to_owned()),
        Just("nan".to_owned()),
        Just("-1e999".to_owned()),
        Just("99999999999999999999".to_owned()),
    ];
    (prop::sample::select(texts), any::<prop::sample::Index>(), 0..40usize, piece)
        .prop_map(|(text, start, length, piece)| {
            let bytes = text.as_bytes();
            let start = start.index(bytes.len());
            let end = (start + length).min(bytes.len());
            [&bytes[..start], piece.as_bytes(), &bytes[end..]].concat()
        })
        .prop_map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
}

proptest! {
    #[test]
    fn a_scene_survives_being_written_and_read(scene in scene()) {
        let text = to_toml(&scene);
        let read = parse(&text, "copy.toml", None, &[]).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(&to_toml(&read), &text);
        prop_assert_eq!(&read, &scene);
        prop_assert_eq!(scene_hash(&read), scene_hash(&scene));
    }

    #[test]
    fn a_scene_of_bodies_survives_being_written_and_read(scene in with_bodies()) {
        let text = to_toml(&scene);
        let read = parse(&text, "copy.toml", None, &[]).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(&to_toml(&read), &text);
        prop_assert_eq!(&read, &scene);
        prop_assert_eq!(scene_hash(&read), scene_hash(&scene));
    }

    #[test]
    fn a_soft_scene_survives_being_written_and_read(scene in with_soft()) {
        let text = to_toml(&scene);
        let read = parse(&text, "copy.toml", None, &[]).map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
        prop_assert_eq!(&to_toml(&read), &text);
        prop_assert_eq!(&read, &scene);
        prop_assert_eq!(scene_hash(&read), scene_hash(&scene));
        let softer = with_override(&scene, "soft.young_pa", 7.0).unwrap();
        prop_assert_eq!(parse(&to_toml(&softer), "copy.toml", None, &[]).unwrap(), softer);
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = parse_bytes(&bytes, "bytes", None, &[]);
    }

    #[test]
    fn no_slip_in_a_scene_makes_the_reader_panic(text in mutated()) {
        match parse(&text, "slip.toml", None, &[]) {
            Ok(scene) => prop_assert_eq!(parse(&to_toml(&scene), "slip.toml", None, &[]).unwrap(), scene),
            // Whatever is wrong, each problem is one line with its place.
            Err(errors) => for line in errors.to_string().lines() {
                prop_assert!(line.starts_with("slip.toml"), "{}", line);
            },
        }
    }

    #[test]
    fn no_override_makes_the_reader_panic(key in "[a-z_.0-9]{1,30}", value in "\\PC{0,20}", known in any::<prop::sample::Index>()) {
        let keys = cotouch_scene::reference::keys();
        let known = &keys[known.index(keys.len())].name;
        for text in [format!("{key}={value}"), format!("{known}={value}"), format!("{known}.{key}={value}")] {
            if let Ok(set) = text.parse::<Override>() {
                let _ = load("single-axis", &[set]);
            }
        }
    }
}
