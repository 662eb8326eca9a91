//! Gains, radii and conventions of a local model in words.

use cotouch_scene::scene::{ReturnedForce, SurfaceHold};

/// N, which force and which hold, in words.
pub(super) fn how_it_is_closed(ratio: u32, returned: ReturnedForce, hold: SurfaceHold) -> String {
    let returned = match returned {
        ReturnedForce::First => "the first force",
        ReturnedForce::Mean => "the mean force",
        ReturnedForce::Last => "the last force",
    };
    let hold = match hold {
        SurfaceHold::Zero => "the surface jumps (zero-order hold)",
        SurfaceHold::First => "the surface moves linearly (first-order hold)",
    };
    format!("{ratio} haptic ticks a slow period, {returned} goes to the simulation, {hold}")
}

/// Six digits, or what lies below rounding.
pub(super) fn radius(radius: f64) -> String {
    if radius < 1e-6 { "0 (dead beat)".to_owned() } else { format!("{radius:.6}") }
}

/// A gain with four digits.
pub(super) fn gain(n_per_m: f64) -> String {
    let digits = if n_per_m == 0.0 { 0 } else { (3 - n_per_m.abs().log10().floor() as i32).clamp(0, 9) };
    let text = format!("{n_per_m:.*}", digits as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} N/m")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people_have_the_digits_that_count() {
        assert_eq!(
            [0.0, 200.0, 812.345, 0.0123456].map(gain),
            ["0 N/m", "200 N/m", "812.3 N/m", "0.01235 N/m"]
        );
        assert_eq!([radius(0.95), radius(3e-9)], ["0.950000", "0 (dead beat)"]);
    }
}
