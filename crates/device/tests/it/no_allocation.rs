//! A haptic tick of user, governors and ports allocates nothing.

use std::hint::black_box;

use crate::support::{point, scene_with_box};
use cotouch_device::{
    Device, Governor, GovernorInput, Guide, GuidedUser, PortEnergy, SimulatedUser, Targets, WorldView,
};
use cotouch_scene::geometry::{Pose, Reading, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Action, DeviceKind, DeviceSpec, GovernorLimits, Space, VelocityEstimate};
use cotouch_testkit::allocations;
use cotouch_testkit::scenes::edited;
use glam::DVec3;

/// A pointer that comes and goes.
struct Visitor(u64);

impl Guide for Visitor {
    fn targets(&mut self) -> Option<Targets> {
        self.0 += 1;
        (self.0 % 1500 > 700).then(|| [DVec3::X * 1e-5 * self.0 as f64].into_iter().collect())
    }
}

#[test]
fn a_tick_allocates_nothing() {
    let (amplitude, duration_s) = (DVec3::new(0.02, 0.01, 0.0), 0.25);
    let script = vec![
        Action::Relax { duration_s },
        Action::Hold { duration_s },
        Action::Reach { to_m: amplitude, duration_s },
        Action::Sinusoid { amplitude_m: amplitude, frequency_hz: 2.0, phase_rad: 0.0, duration_s },
        Action::Force { force_n: amplitude, duration_s },
        Action::SinusoidalForce { amplitude_n: amplitude, frequency_hz: 2.0, phase_rad: 0.0, duration_s },
        Action::Tremor { rms_n: amplitude, duration_s },
        Action::PushAndLetGo { force_n: amplitude, push_s: 0.1, duration_s },
        Action::Grasp { body: "box".into(), force_n: 0.2, speed_m_per_s: 0.2, duration_s },
        Action::Carry { by_m: amplitude, duration_s },
        Action::CarryTo { to_m: amplitude, duration_s },
        Action::Turn { angle_rad: 0.3, duration_s },
        Action::Push { force_n: amplitude, duration_s },
        Action::Lift { height_m: 0.01, duration_s },
        Action::HandOver { duration_s },
        Action::LetGo { distance_m: 0.02, duration_s },
        Action::WaitUntil { until_s: 4.0 },
    ];
    let starts = [DVec3::X * -0.05, DVec3::X * 0.05, DVec3::Y * 0.05];
    let scene = edited(&scene_with_box(Space::Plane, &script, &starts, DVec3::splat(0.05)), |scene| {
        scene.users[0].repeat = true;
        scene.users[0].fingers[2].script = script[5..7].to_vec();
        scene.device = DeviceSpec {
            kind: DeviceKind::Pantograph,
            encoder_counts_per_turn: 20_000,
            velocity: VelocityEstimate::Filtered,
            max_joint_torque_n_m: 0.3,
            inertia: true,
            ..point()
        };
        scene.governor = GovernorLimits {
            passivity_control: false,
            max_force_n: 8.0,
            max_slew_n_per_s: 100.0,
            watchdog_s: 0.02,
            soft_start_s: 0.5,
            release_s: 0.1,
            damping_n_s_per_m: 1.0,
        };
    });
    let mut user = SimulatedUser::new(&scene, HostIndex::FIRST).unwrap();
    let mut guided = GuidedUser::new(&scene, HostIndex::FIRST, Visitor(0)).unwrap();
    let governor = Governor::new(&scene, user.limits());
    let mut states = [governor.start(), governor.start(), governor.start()];
    let mut port = PortEnergy::default();

    let mut drawn = false;
    let counted = allocations(|| {
        for tick in (0..9000).filter(|tick| tick % 100 != 17) {
            let readings = user.read(tick).unwrap();
            user.observe(&WorldView { bodies: &[Pose::default()] });
            let mut wrenches = Wrenches::new();
            for (reading, state) in readings.iter().zip(&mut states) {
                let requested = Wrench::force(reading.pose.position * -50.0);
                let stop = tick > 4000 && tick < 4500;
                let output = governor
                    .govern(state, &GovernorInput { stop, ..GovernorInput::healthy(requested, *reading) });
                port.observe(reading, output.commanded);
                wrenches.push(output.commanded);
            }
            user.write(&wrenches).unwrap();
            let readings = guided.read(tick).unwrap();
            guided.observe(&WorldView { bodies: &[Pose::default()] });
            let pull = |reading: &Reading| Wrench::force(reading.pose.position * -50.0);
            guided.write(&readings.iter().map(pull).collect::<Wrenches>()).unwrap();
            drawn |= !guided.pointer_targets().is_empty();
        }
    });
    black_box((&states, &port));
    assert!(drawn);
    assert_eq!(counted, 0);
}
