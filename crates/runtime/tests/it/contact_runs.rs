//! Two users with two fingers each and a box: what a recording shows of their contacts, and that it replays.

use std::path::Path;
use std::sync::Arc;

use crate::sessions::{ARCHITECTURES, assert_adds_up, assert_replays};
use cotouch_device::{Device, DeviceError, DeviceLimits, ForceSwitch, SimulatedUser, WorldView};
use cotouch_runtime::{RecordKind, Recording, Station, TickRecord, VirtualSession, virtual_run};
use cotouch_scene::geometry::{Readings, Wrench, Wrenches};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;
use cotouch_world::Phase;
use glam::DVec3;

fn grasp(architecture: &str, more: &[&str]) -> Scene {
    let architecture = format!("session.architecture={architecture}");
    let overrides = [&[architecture.as_str()][..], more].concat();
    built_in("grasp", &overrides)
}

fn ticks_of(path: &Path, host: HostIndex) -> Vec<TickRecord> {
    let tick = |item: cotouch_runtime::RecordItem| match item.kind {
        RecordKind::Tick(record) if item.host == host => Some(record),
        _ => None,
    };
    Recording::open(path).unwrap().items.into_iter().filter_map(tick).collect()
}

/// The phases of a finger, each once for every time it begins: 0 free, 1 moment cancellation, 2 pre-slide, 3 slide.
fn phases(ticks: &[TickRecord], host: HostIndex, finger: usize) -> Vec<u8> {
    let number = |tick: &TickRecord| match tick.contact_of(host, finger).map(|contact| contact.phase) {
        None | Some(Phase::Free) => 0,
        Some(Phase::MomentCancellation { .. }) => 1,
        Some(Phase::PreSlide) => 2,
        Some(Phase::Slide) => 3,
    };
    let mut phases: Vec<u8> = ticks.iter().map(number).collect();
    phases.dedup();
    phases
}

#[test]
fn contact_sessions_replay_and_show_how_each_finger_came_to_hold_the_box() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grasp.mcap");
    for architecture in ARCHITECTURES {
        let scene = grasp(architecture, &[]);
        let summary = virtual_run::run(&scene, 4.5, Some(&path), |_| true).unwrap();
        assert_adds_up(&summary);
        assert_eq!(assert_replays(&path).skipped, 0);
        assert_eq!(summary.objects.len(), 1);
        let carried = summary.objects[0].position_m;
        assert!(carried[1] > 0.01 && carried[2] == 0.0, "{architecture}: {carried:?}");
        assert!(summary.users_detail.iter().all(|user| user.peak_force_n > Some(1.0)), "{architecture}");

        let ticks = ticks_of(&path, HostIndex::FIRST);
        for host in scene.hosts() {
            for finger in 0..2 {
                let phases = phases(&ticks, host, finger);
                assert!(phases[0] == 0 && phases.contains(&2), "{architecture} {host} {finger}: {phases:?}");
                if host != HostIndex::FIRST {
                    assert!(!phases.contains(&1), "only the own device is pushed to a stop: {phases:?}");
                }
            }
        }
        let held = ticks[4 * 1024].contacts.iter().filter(|contact| contact.depth_m > 0.0).count();
        assert!(held >= 4, "{architecture}: {held} fingers hold the box");
        assert!(ticks.iter().all(|tick| tick.readings.len() == 2 && tick.commanded.len() == 2));
    }
}

#[test]
fn a_device_that_is_weak_for_its_mass_is_pushed_to_a_stop_on_first_contact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grasp.mcap");
    let scene = grasp("distributed", &["governor.max_force_n=1"]);
    virtual_run::run(&scene, 2.5, Some(&path), |_| true).unwrap();
    assert_replays(&path);
    for host in scene.hosts() {
        let ticks = ticks_of(&path, host);
        for finger in 0..2 {
            let phases = phases(&ticks, host, finger);
            assert_eq!(phases[..3], [0, 1, 2], "{host} {finger}: {phases:?}");
        }
    }
}

/// A user one of whose fingers tells nonsense from a tick on.
struct Broken {
    user: SimulatedUser,
    from_tick: u64,
}

impl Device for Broken {
    fn name(&self) -> &str {
        "broken"
    }

    fn fingers(&self) -> usize {
        self.user.fingers()
    }

    fn limits(&self) -> DeviceLimits {
        self.user.limits()
    }

    fn force_switch(&self) -> Arc<dyn ForceSwitch> {
        self.user.force_switch()
    }

    fn start(&mut self, tick: u64) {
        self.user.start(tick);
    }

    fn recentre(&mut self, position: DVec3) {
        self.user.recentre(position);
    }

    fn observe(&mut self, view: &WorldView<'_>) {
        self.user.observe(view);
    }

    fn read(&mut self, tick: u64) -> Result<Readings, DeviceError> {
        let mut readings = self.user.read(tick)?;
        if tick >= self.from_tick {
            readings[1].pose.position = DVec3::new(f64::NAN, 1e300, f64::INFINITY);
        }
        Ok(readings)
    }

    fn write(&mut self, wrenches: &[Wrench]) -> Result<(), DeviceError> {
        self.user.write(wrenches)
    }

    fn rendered(&self) -> Wrenches {
        self.user.rendered()
    }
}

#[test]
fn a_finger_that_tells_nonsense_is_let_go_of_smoothly_with_all_others() {
    const BREAKS: u64 = 3 * 1024;
    for architecture in ARCHITECTURES {
        let scene = grasp(architecture, &["governor.max_slew_n_per_s=2000"]);
        let slew_n = 2000.0 / scene.rates.control_hz.hz() * (1.0 + 1e-9);
        let mut session = VirtualSession::new(&scene, |host| {
            let user = SimulatedUser::new(&scene, host).unwrap();
            let from_tick = if host == HostIndex::FIRST { BREAKS } else { u64::MAX };
            Station::new(&scene, host, Broken { user, from_tick }, None)
        });
        let mut last = [[DVec3::ZERO; 2]; 2];
        let mut before_n: f64 = 0.0;
        assert!(session.run_to_tick(BREAKS + 1024, |host, tick| {
            for (finger, wrench) in tick.commanded.iter().enumerate() {
                assert!(wrench.is_finite());
                let last = &mut last[host.index()][finger];
                assert!(
                    (wrench.force - *last).length() <= slew_n,
                    "{architecture} {host} at {:?}",
                    tick.instant
                );
                *last = wrench.force;
                if tick.instant.as_secs_f64() < 3.0 {
                    before_n = wrench.force.length();
                }
            }
        }));
        assert!(before_n > 0.1, "{architecture}: there was something to let go of");
        assert_eq!(last[0], [DVec3::ZERO; 2], "{architecture}");
        // The world is not lost with it.
        assert!(session.hosts().iter().all(|host| !host.station.state.host.diverged), "{architecture}");
        assert!(session.hosts()[0].station.state.governors.iter().all(|state| state.is_released()));
    }
}
