//! Scenes with a soft object: the paper's figures out of the running session, its claim, and hours of random hands.

use cotouch_analysis::local_model::step::Step;
use cotouch_analysis::local_model::{LocalModel, ReturnedForce, SlowLoop, SurfaceHold};
use cotouch_device::device::{DeviceLimits, IdealDevice};
use cotouch_runtime::slow::{self, SlowPort};
use cotouch_runtime::station::Station;
use cotouch_runtime::virtual_time::VirtualSession;
use cotouch_scene::geometry::Reading;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, Shape, ShapeKind};
use cotouch_testkit::built_in;
use glam::DVec3;

/// A session whose users each have one finger, led from outside.
fn led(scene: &Scene) -> VirtualSession<IdealDevice> {
    let simulation = slow::simulation_of(scene).unwrap();
    VirtualSession::new(scene, |host| {
        let mut device = IdealDevice::new("led", DeviceLimits::POINT);
        device.set_reading(Reading::point(start(scene, host), DVec3::ZERO));
        let station = Station::new(scene, host, device, None);
        match &simulation {
            Some(simulation) => station.with_soft(SlowPort::inline(scene, simulation.clone())),
            None => station,
        }
    })
}

fn start(scene: &Scene, host: HostIndex) -> DVec3 {
    scene.users[host.index()].fingers[0].position_m
}

fn lead(session: &mut VirtualSession<IdealDevice>, host: HostIndex, to: DVec3) {
    session.host_mut(host).station.device.set_reading(Reading::point(to, DVec3::ZERO));
}

/// What each tick of one slow step of the hand asks the device to render, N along x; the hand steps at the beginning of a
/// slow period, from just touching.
fn step_response(scene: &Scene, input_m: f64, seconds: f64) -> Vec<f64> {
    let touching = DVec3::NEG_X * scene.hand.finger_radius_m;
    let mut session = led(scene);
    lead(&mut session, HostIndex::FIRST, touching);
    let begin = scene.slow_schedule().tick_of_step(20);
    assert!(session.run_to_tick(begin, |_, _| {}));
    lead(&mut session, HostIndex::FIRST, touching + DVec3::X * input_m);
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
            let exact = Step {
                model: LocalModel::new(kh, 0.0, ko).unwrap(),
                slow_loop: SlowLoop::new(50, ReturnedForce::First, SurfaceHold::Zero).unwrap(),
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

/// The force on ben's finger, which rests in the balloon, while anna's is at `anna`, N.
fn felt_by_ben(scene: &Scene, anna: DVec3) -> DVec3 {
    let ben = HostIndex(1);
    let mut session = led(scene);
    let depth = 0.004;
    assert!(session.run_to_tick(512, |_, _| {}));
    let (from_anna, from_ben) = (start(scene, HostIndex::FIRST), start(scene, ben));
    let touching = from_ben - DVec3::X * (from_ben.x - 0.06 - scene.hand.finger_radius_m + depth);
    let mut force = DVec3::ZERO;
    for tick in 0..3072_u32 {
        let share = (f64::from(tick) / 1024.0).min(1.0);
        lead(&mut session, HostIndex::FIRST, from_anna.lerp(anna, share));
        lead(&mut session, ben, from_ben.lerp(touching, share));
        session.run_to_tick(513 + u64::from(tick), |host, record| {
            if host == ben {
                force = record.requested[0].force;
            }
        });
    }
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

    let mut shell = built_in("single-axis", &["session.users=2", "space=space"]);
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
    let alone = felt_by_ben(&shell, away);
    let together = felt_by_ben(&shell, pressing);
    assert!(alone.x > 0.05, "ben touches the shell: {alone} N");
    assert!((together - alone).length() < 1e-9, "alone {alone} N, while anna presses {together} N");
}
