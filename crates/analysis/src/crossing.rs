//! Where a verdict changes between two values.

use crate::verdict::PointVerdict;

/// A place where the verdict is known.
#[derive(Clone, Copy, Debug)]
struct Known {
    place: f64,
    /// ln ρ, at or below 0 where stable.
    height: f64,
}

/// More steps than halving needs from any interval to any accuracy.
const MAX_STEPS: usize = 200;

/// Where in 0 to 1 the verdict changes, to within `accuracy`, given the verdicts at both ends, which differ.
///
/// Inverse quadratic interpolation of ln ρ, kept between places of different verdicts, which are halved whenever
/// interpolation is slow: some three steps on smooth ground, and never more than about twice as many as by halving.
pub(crate) fn crossing<E>(
    from: PointVerdict,
    to: PointVerdict,
    accuracy: f64,
    mut verdict_at: impl FnMut(f64) -> Result<PointVerdict, E>,
) -> Result<f64, E> {
    let known = |place: f64, verdict: PointVerdict| Known { place, height: verdict.spectral_radius.ln() };
    let (from_known, to_known) = (known(0.0, from), known(1.0, to));
    let (mut inside, mut outside) = if from.stable { (from_known, to_known) } else { (to_known, from_known) };
    let mut before: Option<Known> = None;
    let mut widths = [f64::INFINITY; 2];
    for _ in 0..MAX_STEPS {
        let width = (outside.place - inside.place).abs();
        if width <= accuracy {
            break;
        }
        let is_slow = width > 0.5 * widths[0];
        widths = [widths[1], width];
        let middle = 0.5 * (inside.place + outside.place);
        let guess = if is_slow { middle } else { interpolated(inside, outside, before).unwrap_or(middle) };
        // A little beyond the best place, so that the next step has the crossing between two near ones.
        let beyond = if inside.height.abs() < outside.height.abs() { outside } else { inside };
        let guess = guess + 0.4 * accuracy * (beyond.place - guess).signum();
        let (least, largest) = (inside.place.min(outside.place), inside.place.max(outside.place));
        let guess = if guess > least && guess < largest { guess } else { middle };
        if guess <= least || guess >= largest {
            // Neighbouring numbers.
            break;
        }
        let verdict = verdict_at(guess)?;
        let replaced = if verdict.stable { &mut inside } else { &mut outside };
        before = Some(std::mem::replace(replaced, known(guess, verdict)));
    }
    Ok(interpolated(inside, outside, None).unwrap_or(0.5 * (inside.place + outside.place)))
}

/// Where in 0 to 1 ln ρ is expected to be 0, going straight from one end to the other, whose verdicts differ.
pub(crate) fn expected_crossing(from: PointVerdict, to: PointVerdict) -> f64 {
    let known = |place: f64, verdict: PointVerdict| Known { place, height: verdict.spectral_radius.ln() };
    let (from_known, to_known) = (known(0.0, from), known(1.0, to));
    let (inside, outside) = if from.stable { (from_known, to_known) } else { (to_known, from_known) };
    interpolated(inside, outside, None).unwrap_or(0.5)
}

/// Where ln ρ is expected to be 0.
fn interpolated(inside: Known, outside: Known, before: Option<Known>) -> Option<f64> {
    let usable = |known: &Known| known.height.is_finite();
    if !usable(&inside) || !usable(&outside) || inside.height >= 0.0 || outside.height <= 0.0 {
        return None;
    }
    let (a, b) = (inside, outside);
    let straight = a.place + (b.place - a.place) * a.height / (a.height - b.height);
    let within = |place: &f64| (*place - a.place) * (*place - b.place) < 0.0;
    let curved = before.filter(usable).and_then(|c| {
        let term = |one: Known, two: Known, three: Known| {
            one.place * two.height * three.height / ((one.height - two.height) * (one.height - three.height))
        };
        Some(term(a, b, c) + term(b, a, c) + term(c, a, b)).filter(|place| place.is_finite())
    });
    curved.filter(within).or(Some(straight)).filter(within)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds where `height` changes its sign, and counts.
    fn find(accuracy: f64, height: impl Fn(f64) -> f64) -> (f64, usize) {
        let verdict = |place: f64| {
            let spectral_radius = height(place).exp();
            PointVerdict { spectral_radius, stable: spectral_radius < 1.0 + 1e-11 }
        };
        let mut count = 0;
        let place = crossing::<()>(verdict(0.0), verdict(1.0), accuracy, |place| {
            count += 1;
            Ok(verdict(place))
        });
        (place.unwrap(), count)
    }

    #[test]
    fn smooth_crossings_take_few_steps() {
        for root in [0.003, 0.2, 0.5, 0.77, 0.9999] {
            let bent = |x: f64| (x - root) * (0.1 + 0.03 * x);
            for sign in [1.0, -1.0] {
                let (place, count) = find(1e-4, |x| sign * bent(x));
                assert!((place - root).abs() < 1e-4 && count <= 5, "{root}: {place} after {count}");
            }
        }
    }

    #[test]
    fn rough_crossings_are_found_too() {
        let root = 0.3719;
        let kinked = |x: f64| if x < root { -1e-6 } else { 30.0 * (x - root) };
        let steep = |x: f64| (x - root).signum() * (x - root).abs().sqrt();
        let sudden = |x: f64| if x < root { -0.1 } else { f64::INFINITY };
        let flat = |x: f64| (x - root).powi(5);
        let touching = |x: f64| if x < root { 0.0 } else { 1.0 };
        let rough: [&dyn Fn(f64) -> f64; 5] = [&kinked, &steep, &sudden, &flat, &touching];
        for (index, height) in rough.into_iter().enumerate() {
            // A radius within 1e-11 of 1 is stable, which moves the crossing where ln ρ is flat.
            let allowed = if index == 3 { 1e-2 } else { 1e-9 };
            let (place, count) = find(1e-9, height);
            assert!((place - root).abs() <= allowed && count < 80, "{index}: {place} after {count}");
        }
    }
}
