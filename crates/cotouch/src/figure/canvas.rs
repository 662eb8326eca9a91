//! What all pictures share: sizes, colours, type, and how a failure to draw is told.

use plotters::coord::Shift;
use plotters::prelude::*;

pub(super) const WIDTH: u32 = 960;
pub(super) const FONT: &str = "sans-serif";
pub(super) const INK: RGBColor = RGBColor(29, 31, 33);
pub(super) const QUIET: RGBColor = RGBColor(91, 96, 102);
pub(super) const GRID: RGBColor = RGBColor(229, 229, 224);

/// One colour a user; told apart by most eyes, dark enough on white.
pub(super) const COLOURS: [RGBColor; 8] = [
    RGBColor(31, 95, 191),
    RGBColor(194, 65, 12),
    RGBColor(21, 128, 61),
    RGBColor(126, 34, 206),
    RGBColor(14, 116, 144),
    RGBColor(161, 98, 7),
    RGBColor(190, 24, 93),
    RGBColor(71, 85, 105),
];

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub(super) fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// A user's colour, lighter from finger to finger, so that both of a hand are told apart.
pub(super) fn finger_colour(user: usize, finger: usize) -> RGBColor {
    let lighter = [0.0, 0.45, 0.65][finger.min(2)];
    let RGBColor(red, green, blue) = colour(user);
    let mix = |part: u8| (f64::from(part) + lighter * (255.0 - f64::from(part))).round() as u8;
    RGBColor(mix(red), mix(green), mix(blue))
}

pub(super) fn text(size: u32, colour: RGBColor) -> TextStyle<'static> {
    (FONT, size).into_font().color(&colour)
}

pub(super) fn undrawable(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("the picture cannot be drawn: {error}")
}
