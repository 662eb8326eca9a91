//! Faults on every kind of scene, in virtual time: what hands feel of them, beside the same run without the fault.

use cotouch_device::{Fault, FaultyDevice, SimulatedUser};
use cotouch_runtime::{TickRecord, VirtualSession};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Impairment, Scene};
use cotouch_testkit::{built_in, scenes::edited};
use glam::DVec3;

/// When faults begin, s of session time.
const FROM_S: f64 = 4.0;
/// Until when runs are looked at, s.
const END_S: f64 = 12.0;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Injected {
    Nothing,
    /// No packet arrives.
    Outage(f64),
    /// The device of the first user cannot be read.
    DeviceFails(f64),
    /// The haptic loop of the last user's host stands still.
    StandsStill(f64),
}

/// What the worst finger feels from the beginning of the fault on.
#[derive(Clone, Copy, Debug, Default)]
struct Felt {
    /// Largest change of force in one tick, N.
    step_n: f64,
    /// Largest force, N.
    peak_n: f64,
    /// Most energy that was got out of a device, J.
    energy_j: f64,
    /// Most kinetic energy of a copy of a body.
    speed_m_per_s: f64,
}

fn felt(scene: &Scene, fault: Injected) -> Felt {
    let scene = match fault {
        Injected::Outage(duration_s) => edited(scene, |scene| {
            scene.link.impairment = Impairment {
                outage_from_s: FROM_S,
                outage_duration_s: duration_s,
                ..scene.link.impairment.clone()
            };
        }),
        _ => scene.clone(),
    };
    let control = scene.rates.control_hz;
    let device = |host: HostIndex| {
        let user = SimulatedUser::new(&scene, host).unwrap();
        let lasts_s = match fault {
            Injected::DeviceFails(lasts_s) if host == HostIndex::FIRST => lasts_s,
            _ => -1.0,
        };
        let from_s = if lasts_s > 0.0 { FROM_S } else { 1e6 };
        (FaultyDevice::new(user, Fault::Fail, from_s, lasts_s.max(0.0), control), None)
    };
    let mut session = VirtualSession::with_devices(&scene, device).unwrap();
    let from = control.ticks_in(FROM_S);
    assert!(session.run_to_tick(from, |_, _| {}));
    if let Injected::StandsStill(lasts_s) = fault {
        session.stand_still(HostIndex(scene.session.users - 1), control.ticks_in(lasts_s));
    }
    let mut felt = Felt::default();
    let mut last: Vec<Vec<DVec3>> = vec![Vec::new(); usize::from(scene.session.users)];
    let mut energy: Vec<f64> = vec![f64::NAN; usize::from(scene.session.users)];
    let debug = std::env::var("FELT").is_ok();
    session.run_to_tick(control.ticks_in(END_S), |host, record: &TickRecord| {
        let forces: Vec<DVec3> = record.commanded.iter().map(|wrench| wrench.force).collect();
        let last = &mut last[host.index()];
        for (now, before) in forces.iter().zip(last.iter()) {
            if (*now - *before).length() > felt.step_n {
                if debug && (*now - *before).length() > 0.4 {
                    println!("  {host} {:.4} s: {before:.2} -> {now:.2}", record.instant.as_secs_f64());
                }
            }
            felt.step_n = felt.step_n.max((*now - *before).length());
        }
        felt.peak_n = forces.iter().map(|force| force.length()).fold(felt.peak_n, f64::max);
        *last = forces;
        if energy[host.index()].is_nan() {
            energy[host.index()] = record.energy_j;
        }
        felt.energy_j = felt.energy_j.max(record.energy_j - energy[host.index()]);
        let speeds = record.bodies.iter().map(|body| body.twist.linear.length());
        felt.speed_m_per_s = speeds.fold(felt.speed_m_per_s, f64::max);
    });
    felt
}

const FAULTS: [Injected; 8] = [
    Injected::Nothing,
    Injected::Outage(0.06),
    Injected::Outage(0.2),
    Injected::Outage(0.6),
    Injected::Outage(3.0),
    Injected::DeviceFails(0.3),
    Injected::StandsStill(0.3),
    Injected::StandsStill(1.0),
];

const SCENES: [(&str, &[&str]); 11] = [
    ("single-axis", &[]),
    ("single-axis-centralized", &[]),
    ("grasp", &[]),
    ("hand-over", &[]),
    ("hand-over", &["session.architecture=centralized"]),
    ("sinusoid", &[]),
    ("stack", &[]),
    ("four-hands", &[]),
    ("soft-block", &[]),
    ("balloon", &[]),
    ("organ", &[]),
];

#[test]
fn a_fault_throws_nobodys_hand() {
    let only = std::env::var("ONLY").unwrap_or_default();
    for (name, settings) in SCENES {
        if !name.starts_with(&only) { continue }
        for fault in FAULTS {
            let mut line = format!("{name:24} {settings:?} {fault:20?}");
            for rejoin in ["session.rejoin_s=0", "session.rejoin_s=1.5"] {
                let scene = built_in(name, &[settings, &[rejoin]].concat());
                let felt = felt(&scene, fault);
                line += &format!(
                    " | {:6.2} N/tick {:6.2} N {:7.3} J {:6.3} m/s",
                    felt.step_n, felt.peak_n, felt.energy_j, felt.speed_m_per_s
                );
            }
            println!("{line}");
        }
    }
}
