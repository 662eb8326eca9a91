//! The running code and the analysis describe the same loop about a settled grasp, coordinate by coordinate.
//!
//! A session is run until two users hold a box and nothing moves. Where everything is then (poses, anchors, contact
//! forces) is the point at which the analysis linearises; its map over one pattern is held against central differences on
//! the running session, with contact states unchanged.

use crate::support::Probe;
use cotouch_analysis::{FingerContact, OperatingPoint, compile_at};
use cotouch_host::ContactPoint;
use cotouch_net::{Entry, StatePacket};
use cotouch_runtime::TickRecord;
use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{Action, Scene, VelocityEstimate};
use cotouch_scene::{Override, load};
use cotouch_testkit::scenes::edited;
use cotouch_world::Phase;
use glam::{DMat3, DVec3};

/// Largest difference of an element, as a share of the matrix's norm.
const TOLERANCE: f64 = 1e-6;
/// Small enough that nothing slides.
const STEP: f64 = 1e-6;
/// By then nothing moves any more.
const SETTLED_S: f64 = 8.0;

/// Both users hold the box; nothing slides on the ground, which would not be linear.
fn holding(name: &str, settings: &[&str]) -> Scene {
    let common = ["ground.friction_coefficient=0", "ground.rotational_friction_coefficient=0"];
    let overrides: Vec<Override> = common.iter().chain(settings).map(|text| text.parse().unwrap()).collect();
    edited(&load(name, &overrides).unwrap(), |scene| {
        for user in &mut scene.users {
            user.script = vec![
                Action::WaitUntil { until_s: 0.5 },
                Action::Grasp { body: "object".into(), force_n: 2.0, speed_m_per_s: 0.05, duration_s: 2.0 },
                Action::Hold { duration_s: 1000.0 },
            ];
        }
    })
}

/// Where the running session is.
fn measured(probe: &mut Probe, scene: &Scene) -> OperatingPoint {
    let mut last: Vec<Option<TickRecord>> = vec![None; scene.users.len()];
    probe.run_one_pattern(|host, record| last[host.index()] = Some(record.clone()));
    let half = 0.5 * scene.object.shape.size_m;
    let mut point = OperatingPoint::default();
    for host in probe.session_mut().hosts() {
        let (model, state) = (&host.station.model, &host.station.state.host);
        let poses = state.bodies.iter().map(|body| body.pose).collect();
        let record = last[model.host.index()].as_ref().unwrap();
        for contact in &record.contacts {
            let ContactPoint::Finger { host: user, finger } = contact.point else { panic!("{contact:?}") };
            assert_eq!(contact.phase, Phase::PreSlide);
            let held = state.peers[user.index()].samples.held();
            let centre = match held {
                Some(packet) if user != model.host => hand_in(packet, finger),
                _ => record.readings[usize::from(finger)].pose.position,
            };
            let pose: &cotouch_scene::geometry::Pose = &state.bodies[0].pose;
            let local = pose.to_local(centre);
            let beyond = local.abs() - half;
            let axis = (0..2).max_by(|&a, &b| beyond[a].total_cmp(&beyond[b])).unwrap();
            let normal = DVec3::AXES[axis] * local[axis].signum();
            let slot = state.finger_contact(model, user, usize::from(finger), 0).unwrap();
            let (host, body) = (model.host, 0);
            let (anchor, curvature, force) = (slot.anchor, DMat3::ZERO, contact.force);
            point.fingers.push(FingerContact {
                host,
                user,
                finger,
                body,
                centre,
                normal,
                anchor,
                curvature,
                force,
                slides: None,
            });
        }
        point.poses.push(poses);
    }
    point
}

fn hand_in(packet: &StatePacket, finger: u8) -> DVec3 {
    let hand = packet.entries.iter().find_map(|entry| match entry {
        Entry::Hand { point, pose, .. } if *point == finger => Some(pose.position),
        _ => None,
    });
    hand.expect("a packet has all fingers")
}

fn assert_agreement(scene: &Scene, label: &str) {
    let worst = worst_difference(scene, label, |_| {});
    assert!(worst.share <= TOLERANCE, "{label}: {}", worst.what);
}

/// The largest difference of an element, as a share of the matrix's norm.
struct Difference {
    share: f64,
    what: String,
}

/// How far running code and analysis are apart when the analysis is told of a point that `change` has changed.
fn worst_difference(scene: &Scene, label: &str, change: impl Fn(&mut OperatingPoint)) -> Difference {
    let mut probe = Probe::after(scene, SETTLED_S);
    let mut point = measured(&mut probe, scene);
    change(&mut point);
    let hosts: Vec<HostIndex> = scene.hosts().collect();
    for &host in &hosts {
        // Small turns are counted from where the box is held.
        let station = &mut probe.session_mut().host_mut(host).station;
        station.model.about = point.poses[host.index()].iter().map(|pose| pose.orientation).collect();
    }
    let map = compile_at(scene, &point).lift().unwrap();
    let norm = map.matrix.norm();
    assert!(point.fingers.len() >= 4 && norm > 1.0, "{label}: nothing is held");
    let turns = |coordinate: &Coordinate| {
        matches!(coordinate, Coordinate::Own { part: Part::Object(_), quantity: Quantity::Rotation(_), .. })
    };
    assert!(map.coordinates.iter().any(turns), "{label}: the box does not turn");
    let mut worst = Difference { share: 0.0, what: String::new() };
    for (column, &coordinate) in map.coordinates.iter().enumerate() {
        let measured = probe.column_by(STEP, coordinate, &map.coordinates);
        for (row, value) in measured.iter().enumerate() {
            let expected = map.matrix[(row, column)];
            let share = (value - expected).abs() / norm;
            // What is not a number is as far away as can be.
            if share.is_nan() || share > worst.share {
                let of = map.coordinates[row];
                let what = format!(
                    "d {of} / d {coordinate} is {expected} in the analysis and {value} in the running code"
                );
                worst = Difference { share, what };
            }
        }
    }
    worst
}

const SOFT_REMOTE: &[&str] = &[
    "coupling.remote_hand_object.stiffness_n_per_m=170",
    "coupling.remote_hand_object_tangential.stiffness_n_per_m=270",
    "coupling.remote_hand_object_tangential.damping_n_s_per_m=5",
];

#[test]
fn distributed() {
    assert_agreement(&holding("grasp", &[]), "n = 1");
    assert_agreement(&holding("grasp", &["link.delay_periods=0"]), "n = 0");
    assert_agreement(
        &holding("grasp", &["object.damping_n_s_per_m=-0.88", "device.kind=point"]),
        "compensated",
    );
}

#[test]
fn centralized() {
    assert_agreement(&holding("grasp-centralized", SOFT_REMOTE), "n = 1");
    let split = [SOFT_REMOTE, &["link.delay_periods=2", "link.return_delay_periods=1"]].concat();
    assert_agreement(&holding("grasp-centralized", &split), "n = 2, one period each way");
}

#[test]
fn velocities_that_are_told_from_positions() {
    for velocity in [VelocityEstimate::Difference, VelocityEstimate::Filtered] {
        let scene = edited(&holding("grasp", &[]), |scene| {
            scene.device.velocity = velocity;
            scene.device.velocity_cutoff_hz = 60.0;
        });
        assert_agreement(&scene, &format!("{velocity:?}"));
    }
}

#[test]
fn links_with_inertia() {
    assert_agreement(&holding("grasp", &["device.inertia=true"]), "pantographs");
}

#[test]
fn uneven_boxes_and_grips() {
    let scene = edited(&holding("grasp", &[]), |scene| {
        scene.object.rotation_rad = DVec3::Z * 0.1;
        scene.users[0].fingers[0].position_m.x -= 0.012;
        scene.users[1].fingers[1].position_m.x += 0.009;
    });
    assert_agreement(&scene, "a turned box");
}

#[test]
fn what_the_analysis_is_not_told_shows() {
    let scene = holding("grasp", &[]);
    let without_preload = |point: &mut OperatingPoint| {
        point.fingers.iter_mut().for_each(|finger| finger.force = DVec3::ZERO);
    };
    let without_a_finger = |point: &mut OperatingPoint| point.fingers.truncate(point.fingers.len() - 1);
    assert!(worst_difference(&scene, "no preload", without_preload).share > 10.0 * TOLERANCE);
    assert!(worst_difference(&scene, "a finger too few", without_a_finger).share > 1000.0 * TOLERANCE);
}
