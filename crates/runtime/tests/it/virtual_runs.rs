//! Whole runs in virtual time: the same bytes twice, replayed bit for bit, whole or cut off.

use std::fs;
use std::path::{Path, PathBuf};

use crate::sessions::{ARCHITECTURES, assert_adds_up, assert_replays, scene};
use cotouch_runtime::virtual_run::{self, VirtualRunError};
use cotouch_runtime::{Recording, RecordingReader, Replayed, Summary, replay};
use cotouch_scene::scene::{Scene, Space};

/// Everything that a link can do to packets.
const BAD_LINK: [&str; 5] = [
    "link.impairment.latency_s=0.004",
    "link.impairment.jitter_s=0.006",
    "link.impairment.loss_rate=0.1",
    "link.impairment.reorder_rate=0.1",
    "link.impairment.duplicate_rate=0.1",
];

fn run(scene: &Scene, path: &Path) -> Summary {
    virtual_run::run(scene, 2.5, Some(path), |_| true).unwrap()
}

fn bad_scene(architecture: &str, more: &[&str]) -> Scene {
    scene(architecture, &[&BAD_LINK[..], more].concat())
}

/// Forces fade out after a run's end, which takes ticks that the recording has and the summary leaves out. All hosts
/// go on until the last has let go; on a bad link their clocks differ by a tick or two.
fn assert_ticks_and_release(scene: &Scene, summary: &Summary, recorded: u64) {
    let release = (scene.governor.release_s * scene.rates.control_hz.hz()).ceil() as u64;
    let after_the_end = recorded - summary.haptic.ticks;
    let users = u64::from(summary.users);
    assert!((users * release..=users * (release + 3)).contains(&after_the_end), "{after_the_end}");
}

#[test]
fn the_same_scene_gives_the_same_bytes_and_replays() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    for architecture in ARCHITECTURES {
        let [first, second, other] = [path("first.mcap"), path("second.mcap"), path("other.mcap")];
        let scene = bad_scene(architecture, &[]);
        let summary = run(&scene, &first);
        run(&scene, &second);
        assert!(fs::read(&first).unwrap() == fs::read(&second).unwrap(), "{architecture}");
        run(&bad_scene(architecture, &["session.seed=2"]), &other);
        assert!(Recording::open(&first).unwrap().items != Recording::open(&other).unwrap().items);
        assert_adds_up(&summary);
        assert_eq!(summary.haptic.missed, 0);
        let network = &summary.network;
        assert!(network.lost > 0 && network.received + network.lost <= network.sent, "{network:?}");
        let replayed = assert_replays(&first);
        assert_eq!(replayed.skipped, 0);
        assert_ticks_and_release(&scene, &summary, replayed.comparison.ticks);
        assert!(!replayed.ended_abruptly);
    }
}

#[test]
fn every_user_of_a_large_session_replays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    for (architecture, play_out) in [("distributed", "on-arrival"), ("centralized", "scheduled")] {
        let play_out = format!("link.play_out={play_out}");
        let scene = bad_scene(architecture, &["session.users=5", &play_out, "session.coordination=average"]);
        let summary = run(&scene, &path);
        assert_ticks_and_release(&scene, &summary, assert_replays(&path).comparison.ticks);
    }
}

#[test]
fn a_recording_that_is_cut_off_replays_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    for architecture in ARCHITECTURES {
        run(&bad_scene(architecture, &[]), &path);
        let bytes = fs::read(&path).unwrap();
        let mut ticks = 0;
        for share in [0.2, 0.35, 0.5, 0.62, 0.77, 0.9, 0.98] {
            let replayed = replay_of(&bytes[..(share * bytes.len() as f64) as usize]);
            assert!(replayed.ended_abruptly, "{architecture} {share}");
            assert!(replayed.comparison.identical(), "{:?}", replayed.comparison);
            assert!(replayed.comparison.ticks >= ticks, "{architecture} {share}");
            ticks = replayed.comparison.ticks;
        }
        assert!(replay_of(&bytes).comparison.ticks > ticks && ticks > 1024);
    }
}

fn replay_of(bytes: &[u8]) -> Replayed {
    replay(RecordingReader::new(bytes).unwrap(), |_| {}).unwrap()
}

#[test]
fn a_run_that_is_told_to_end_ends_early_and_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut told = Vec::new();
    let summary = virtual_run::run(&scene("distributed", &[]), 3600.0, Some(&path), |time_s| {
        told.push(time_s);
        time_s < 2.0
    });
    let summary = summary.unwrap();
    assert!(told.last().is_some_and(|&last| last >= 2.0 && last == summary.duration_s), "{told:?}");
    assert!(summary.duration_s < 10.0);
    assert_adds_up(&summary);
    assert!(!assert_replays(&path).ended_abruptly);
}

#[test]
fn a_link_that_loses_nearly_everything_never_hangs_a_run() {
    for architecture in ARCHITECTURES {
        for seed in 1..=4 {
            let seed = format!("session.seed={seed}");
            let scene = scene(architecture, &["link.impairment.loss_rate=0.99", &seed]);
            match virtual_run::run(&scene, 0.5, None, |_| true) {
                Ok(summary) => assert_adds_up(&summary),
                Err(VirtualRunError::NotJoined { impaired }) => {
                    assert!(impaired.contains("link.impairment.loss_rate = 0.99"), "{impaired}");
                }
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn without_loss_every_packet_comes() {
    for architecture in ARCHITECTURES {
        let summary =
            virtual_run::run(&scene(architecture, &["session.users=3"]), 2.0, None, |_| true).unwrap();
        assert_adds_up(&summary);
        assert_eq!(summary.haptic.missed, 0);
        assert_eq!(summary.network.lost, 0, "{architecture}");
        assert_eq!(summary.network.sent, summary.network.received, "{architecture}");
        // Everyone's 256 steps to both others; or two clients to the server and back.
        let least = 256 * if architecture == "distributed" { 6 } else { 4 };
        assert!(summary.network.sent >= least, "{architecture}: {}", summary.network.sent);
        assert!(summary.objects.len() == 1 && summary.users_detail.len() == 3);
        assert!(summary.users_detail.iter().all(|user| user.peak_force_n > Some(0.0)));
    }
}

#[test]
fn built_in_scenes_are_judged_stable() {
    // One of them is there to be unstable.
    for name in cotouch_scene::builtin::names().filter(|&name| name != "grasp-centralized") {
        let scene = cotouch_scene::load(name, &[]).unwrap();
        // Where hands begin to touch, a run that ends just then has more energy at its end than before.
        let durations_s: &[f64] =
            if scene.space == Space::Line { &[1.0, 2.5, 3.0, 4.0, 8.0, 21.0] } else { &[1.0, 20.0] };
        for &duration_s in durations_s {
            let summary = virtual_run::run(&scene, duration_s, None, |_| true).unwrap();
            assert!(summary.stable, "{name} {duration_s} s: {:?} {:?}", summary.diverged, summary.shaking);
        }
    }
}
