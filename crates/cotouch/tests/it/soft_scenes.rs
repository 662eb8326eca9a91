//! Scenes with a soft object: Barbagli et al.'s figures out of the running session, its claim, and hours of random
//! hands.

use cotouch_analysis::local_model::{HandStep, PiLocalModel, SimulationLoop};
use cotouch_device::{Device, TrajectoryDevice};
use cotouch_runtime::VirtualSession;
use cotouch_scene::geometry::Reading;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::scene::{Scene, Shape, ShapeKind};
use cotouch_testkit::scenes::{built_in, edited};
use glam::DVec3;

/// A session whose users each have one finger, on the trajectory (s to m) that `path` gives the user.
fn on_paths<F>(scene: &Scene, mut path: impl FnMut(HostIndex) -> F) -> VirtualSession<impl Device>
where
    F: Fn(f64) -> DVec3 + Send,
{
    let session = VirtualSession::with_devices(scene, |host| {
        let path = path(host);
        let reading = move |time_s| [Reading::point(path(time_s), DVec3::ZERO)].into_iter().collect();
        (TrajectoryDevice::new(scene.rates.control_hz, reading), None)
    });
    session.unwrap()
}

fn start(scene: &Scene, host: HostIndex) -> DVec3 {
    scene.users[host.index()].fingers[0].position_m
}

/// What each tick of one slow step of the hand asks the device to render, N along x; the hand steps at the beginning of a
/// slow period, from just touching.
fn step_response(scene: &Scene, input_m: f64, seconds: f64) -> Vec<f64> {
    let touching = DVec3::NEG_X * scene.hand.finger_radius_m;
    let begin = scene.slow_schedule().tick_of_step(20);
    let begin_s = scene.rates.control_hz.instant(begin).as_secs_f64();
    let step = move |time_s| if time_s < begin_s { 0.0 } else { input_m };
    let mut session = on_paths(scene, |_| move |time_s| touching + DVec3::X * step(time_s));
    assert!(session.run_to_tick(begin, |_, _| {}));
    let mut forces = Vec::new();
    let end = begin + (seconds * scene.rates.control_hz.hz()) as u64;
    session.run_to_tick(end, |_, record| forces.push(record.requested[0].force.x));
    forces
}

#[test]
fn the_step_responses_of_figs_7_8_and_9_come_out_of_the_running_spring() {
    for (ko, kh) in [(900.0, 100.0), (200.0, 190.0), (200.0, 220.0)] {
        for sides in ["one", "two"] {
            let settings = [
                format!("soft.mesh.stiffness_n_per_m={ko}"),
                format!("local_model.stiffness_n_per_m={kh}"),
                format!("local_model.sides={sides}"),
                "user.1.finger.1.position_m=[-0.008,0,0]".to_owned(),
                "governor.max_force_n=1000".to_owned(),
            ];
            let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
            let running = step_response(&built_in("spring", &settings), 0.025, 4.0);
            let exact = HandStep {
                model: PiLocalModel::new(kh, 0.0, ko).unwrap(),
                slow_loop: SimulationLoop::new(50, ReturnedForce::First, SurfaceHold::Zero).unwrap(),
                period_s: 1e-3,
                input_m: 0.025,
                one_sided: sides == "one",
            };
            let exact = exact.response(Some(4.0)).unwrap().samples;
            for (tick, (running, exact)) in running.iter().zip(&exact).enumerate() {
                // The force on the hand points against its way in.
                assert!(
                    (running + exact.force_n).abs() < 1e-9 * (1.0 + exact.force_n.abs()),
                    "K_o = {ko}, K_h = {kh}, sides {sides}, tick {tick}: {running} N, exactly {} N",
                    -exact.force_n
                );
            }
        }
    }
}

/// The force on ben's finger, which comes to press the balloon, when anna's has gone to `anna`, N.
fn felt_by_ben(scene: &Scene, anna: DVec3) -> DVec3 {
    let ben = HostIndex(1);
    let depth = 0.004;
    let (from_anna, from_ben) = (start(scene, HostIndex::FIRST), start(scene, ben));
    let touching = from_ben - DVec3::X * (from_ben.x - 0.06 - scene.hand.finger_radius_m + depth);
    let period_s = scene.rates.control_hz.period_s();
    let mut session = on_paths(scene, |host| {
        let (from, to) = if host == ben { (from_ben, touching) } else { (from_anna, anna) };
        move |time_s| from.lerp(to, ((time_s / period_s - 512.0) / 1024.0).clamp(0.0, 1.0))
    });
    let mut force = DVec3::ZERO;
    let joined = session.run_to_tick(512 + 3072, |host, record| {
        if host == ben {
            force = record.requested[0].force;
        }
    });
    assert!(joined);
    force
}

#[test]
fn who_touches_the_balloon_feels_the_other_press_it_and_would_not_on_a_rigid_shell() {
    let (away, pressing) = (DVec3::X * -0.09, DVec3::X * -0.045);
    let balloon = built_in("balloon", &[]);
    let alone = felt_by_ben(&balloon, away);
    let together = felt_by_ben(&balloon, pressing);
    assert!(alone.x > 0.05, "ben touches the balloon: {alone} N");
    assert!(together.x > 1.2 * alone.x, "alone {alone} N, while anna presses {together} N");

    let shell = edited(&built_in("single-axis", &["session.users=2", "space=space"]), |shell| {
        shell.users.clone_from(&balloon.users);
        shell.hand = balloon.hand.clone();
        shell.bodies = vec![cotouch_scene::scene::Body {
            name: "shell".into(),
            shape: Shape { kind: ShapeKind::Ball, radius_m: 0.06, ..shell.object.shape.clone() },
            mass_kg: 1.0,
            position_m: DVec3::ZERO,
            rotation_rad: DVec3::ZERO,
            fixed: true,
        }];
    });
    let alone = felt_by_ben(&shell, away);
    let together = felt_by_ben(&shell, pressing);
    assert!(alone.x > 0.05, "ben touches the shell: {alone} N");
    assert!((together - alone).length() < 1e-9, "alone {alone} N, while anna presses {together} N");
}
