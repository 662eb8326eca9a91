//! Scenes for whole sessions, and what must hold of each.

use std::path::Path;
use std::thread;
use std::time::Duration;

use cotouch_runtime::{RecordingReader, Replayed, Summary, clock, replay};
use cotouch_scene::scene::Scene;
use cotouch_testkit::built_in;

pub(crate) const ARCHITECTURES: [&str; 2] = ["distributed", "centralized"];

/// The built-in scene of the architecture, with overrides.
pub(crate) fn scene(architecture: &str, settings: &[&str]) -> Scene {
    let name = if architecture == "centralized" { "single-axis-centralized" } else { "single-axis" };
    built_in(name, settings)
}

/// Replays a recording; everything in it that can be compared is identical, and there is something.
pub(crate) fn assert_replays(path: &Path) -> Replayed {
    let replayed = replay(RecordingReader::open(path).unwrap(), |_| {}).unwrap();
    assert!(replayed.comparison.identical(), "{}", replayed.comparison.first_difference.unwrap());
    assert!(replayed.comparison.ticks > 0);
    replayed
}

/// Looks for what comes sooner or later; on a busy computer that may take long. A session tells nobody of it, so there is
/// a pause of some ticks between two looks.
pub(crate) fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let patience = clock::now().plus_ns(60_000_000_000);
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(clock::now() < patience, "in vain: {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// What holds of every summary, whatever network and computer did.
pub(crate) fn assert_adds_up(summary: &Summary) {
    let haptic = &summary.haptic;
    assert_eq!(haptic.ticks + haptic.missed, haptic.due);
    assert!(haptic.ticks > 0);
    assert_eq!(summary.failures, [""; 0]);
}
