//! Numbers as functions of one or two keys.

/// `c₀ + c₁·u + c₂·v + c₃·u·v`, where u is the first key or its reciprocal and v the second key or its reciprocal; with
/// one key, v is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Form {
    coefficients: [f64; 4],
    reciprocal: [bool; 2],
}

/// Agreement, relative to the sum of the terms' absolute values.
const SAME: f64 = 1e-13;
/// A coefficient that is smaller than this, relative to the values at the points of the fit, is their rounding.
const ROUNDING: f64 = 2e-15;

/// Values of the keys from which forms are made: powers of 2, so that nothing is rounded that need not be, and far
/// apart, so that the rounding of a large constant does not pass for a slope.
const MIN: f64 = 1.0;
const MAX: f64 = 512.0;

/// All pairs of these.
pub(super) fn fit_points(keys: usize) -> Vec<Vec<f64>> {
    match keys {
        1 => vec![vec![MIN], vec![MAX]],
        _ => vec![vec![MIN, MIN], vec![MAX, MIN], vec![MIN, MAX], vec![MAX, MAX]],
    }
}

impl Form {
    /// The form that has `fit` at [`fit_points`] and `checks` at the points `at`, if there is one.
    pub(super) fn through(fit: &[f64], at: &[Vec<f64>], checks: &[f64]) -> Option<Self> {
        [[false, false], [true, false], [false, true], [true, true]].into_iter().find_map(|reciprocal| {
            let form = Self::fitted(fit, reciprocal);
            let agrees = |(point, &value): (&Vec<f64>, &f64)| {
                let (found, size) = form.value_and_size(point);
                (found - value).abs() <= SAME * size
            };
            at.iter().zip(checks).all(agrees).then_some(form)
        })
    }

    fn fitted(fit: &[f64], reciprocal: [bool; 2]) -> Self {
        let arguments = |index: usize| {
            if reciprocal[index] { (MIN.recip(), MAX.recip()) } else { (MIN, MAX) }
        };
        let (u, v) = (arguments(0), arguments(1));
        let coefficients = match *fit {
            [one, two] => {
                let slope = (two - one) / (u.1 - u.0);
                [one - slope * u.0, slope, 0.0, 0.0]
            }
            [f11, f21, f12, f22] => {
                let (low, high) = ((f21 - f11) / (u.1 - u.0), (f22 - f12) / (u.1 - u.0));
                let both = (high - low) / (v.1 - v.0);
                let (first, second) = (low - both * v.0, (f12 - f11) / (v.1 - v.0) - both * u.0);
                [f11 - first * u.0 - second * v.0 - both * u.0 * v.0, first, second, both]
            }
            _ => [f64::NAN; 4],
        };
        let largest = fit.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let keep = |value: f64| if value.abs() <= ROUNDING * largest { 0.0 } else { value };
        Self { coefficients: coefficients.map(keep), reciprocal }
    }

    /// At the keys' values.
    pub(super) fn value(&self, keys: &[f64]) -> f64 {
        self.terms(keys).iter().sum()
    }

    fn value_and_size(&self, keys: &[f64]) -> (f64, f64) {
        let terms = self.terms(keys);
        (terms.iter().sum(), terms.iter().map(|term| term.abs()).sum())
    }

    fn terms(&self, keys: &[f64]) -> [f64; 4] {
        let argument = |index: usize| match keys.get(index) {
            None => 0.0,
            Some(&value) if self.reciprocal[index] => value.recip(),
            Some(&value) => value,
        };
        let (u, v) = (argument(0), argument(1));
        let [constant, first, second, both] = self.coefficients;
        [constant, first * u, second * v, both * u * v]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(function: impl Fn(f64, f64) -> f64) -> Option<Form> {
        let checks = [vec![3.0, 7.0], vec![0.3, 11.0], vec![500.0, 0.01]];
        let value = |point: &Vec<f64>| function(point[0], point[1]);
        let fit: Vec<f64> = fit_points(2).iter().map(value).collect();
        Form::through(&fit, &checks, &checks.iter().map(value).collect::<Vec<_>>())
    }

    #[test]
    fn products_of_first_degree_are_found() {
        for function in [
            |x: f64, y: f64| 3.0 - x * 0.25 + 7.0 * y - x * y,
            |x: f64, y: f64| -(300.0 + x) / y,
            |x: f64, _: f64| x.recip(),
            |_: f64, y: f64| -y,
        ] {
            let form = through(function).unwrap();
            let (found, expected) = (form.value(&[0.7, 0.9]), function(0.7, 0.9));
            assert!((found - expected).abs() <= 1e-13 * expected.abs(), "{found} {expected}");
        }
    }

    #[test]
    fn everything_else_is_not() {
        assert_eq!(through(|x, y| x * x + y), None);
        assert_eq!(through(|x, y| (x + y).recip()), None);
        assert_eq!(through(|x, y| x.max(2.5) + y), None);
    }
}
