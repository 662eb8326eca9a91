//! What counts as an oscillation that grows.

/// Above this the couplers' motion counts as oscillation rather than as what the users do, Hz.
pub(super) const CORNER_HZ: f64 = 8.0;
/// Growth from the last quarter but one to the last that is called unstable.
const GROWTH: f64 = 1.5;

/// Means that a monitor keeps of a run.
pub(super) const BINS: usize = 4096;

/// Whether an energy grew from `before_j` to `last_j`, to more than `least_j`, all in J.
pub(super) fn grows_over(least_j: f64, before_j: f64, last_j: f64) -> bool {
    !last_j.is_finite() || last_j > least_j && last_j > GROWTH * before_j
}

/// The median of at most a quarter of [`BINS`] values; 0 of none, not a number where one is none. On the stack.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = [0.0; BINS / 4];
    let sorted = &mut sorted[..values.len()];
    sorted.copy_from_slice(values);
    if sorted.is_empty() {
        return 0.0;
    }
    if sorted.iter().any(|value| !value.is_finite()) {
        return f64::NAN;
    }
    let middle = sorted.len() / 2;
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}
