//! Scenes for whole sessions, and what must hold of each.

use std::path::Path;

use cotouch_runtime::recording::RecordingReader;
use cotouch_runtime::replay::{Replayed, replay};
use cotouch_runtime::summary::Summary;
use cotouch_scene::scene::Scene;
use cotouch_scene::{Override, load};

pub(crate) const ARCHITECTURES: [&str; 2] = ["distributed", "centralized"];

/// The built-in scene of the architecture, with overrides.
pub(crate) fn scene(architecture: &str, settings: &[&str]) -> Scene {
    let name = if architecture == "centralized" { "single-axis-centralized" } else { "single-axis" };
    let overrides: Vec<Override> = settings.iter().map(|text| text.parse().unwrap()).collect();
    load(name, &overrides).unwrap()
}

/// Replays a recording; everything in it that can be compared is identical, and there is something.
pub(crate) fn assert_replays(path: &Path) -> Replayed {
    let replayed = replay(RecordingReader::open(path).unwrap(), |_| {}).unwrap();
    assert!(replayed.comparison.identical(), "{}", replayed.comparison.first_difference.unwrap());
    assert!(replayed.comparison.ticks > 0);
    replayed
}

/// What holds of every summary, whatever network and computer did.
pub(crate) fn assert_adds_up(summary: &Summary) {
    let haptic = &summary.haptic;
    assert_eq!(haptic.ticks + haptic.missed, haptic.due);
    assert!(haptic.ticks > 0);
}
