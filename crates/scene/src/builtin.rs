//! The scenes that are in the program.

use std::iter::Iterator;

const SCENES: &[(&str, &str)] = &[
    ("single-axis", include_str!("../scenes/single-axis.toml")),
    ("single-axis-centralized", include_str!("../scenes/single-axis-centralized.toml")),
    ("grasp", include_str!("../scenes/grasp.toml")),
    ("grasp-centralized", include_str!("../scenes/grasp-centralized.toml")),
    ("sinusoid", include_str!("../scenes/sinusoid.toml")),
    ("push-wall", include_str!("../scenes/push-wall.toml")),
    ("hand-over", include_str!("../scenes/hand-over.toml")),
    ("stack", include_str!("../scenes/stack.toml")),
    ("four-hands", include_str!("../scenes/four-hands.toml")),
    ("spring", include_str!("../scenes/spring.toml")),
    ("soft-block", include_str!("../scenes/soft-block.toml")),
    ("balloon", include_str!("../scenes/balloon.toml")),
    ("organ", include_str!("../scenes/organ.toml")),
];

/// The names of the built-in scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.iter().map(|&(name, _)| name)
}

/// The text of a built-in scene, with its comments.
#[must_use]
pub fn source(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|scene| scene.0 == name).map(|scene| scene.1)
}
