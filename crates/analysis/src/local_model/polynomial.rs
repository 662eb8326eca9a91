//! Monic polynomials of degree 0 to 3: the largest absolute root, and Jury's conditions.

/// A monic polynomial, `z^n + a_(n−1)·z^(n−1) + … + a_0`, of degree 0 to 3.
#[derive(Clone, Debug, PartialEq)]
pub struct Polynomial {
    /// a_0 first; the leading 1 is left out.
    coefficients: Vec<f64>,
}

impl Polynomial {
    /// From a_0, a_1, … without the leading 1.
    ///
    /// # Panics
    /// With more than three coefficients.
    #[must_use]
    pub fn monic(coefficients: &[f64]) -> Self {
        assert!(coefficients.len() <= 3, "degree {} is not needed here", coefficients.len());
        Self { coefficients: coefficients.to_vec() }
    }

    /// a_0 first, without the leading 1.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// The largest absolute value of a root; 0 at degree 0.
    #[must_use]
    pub fn spectral_radius(&self) -> f64 {
        match self.coefficients[..] {
            [a0] => a0.abs(),
            [a0, a1] => quadratic(a1, a0),
            [a0, a1, a2] => cubic(a2, a1, a0),
            _ => 0.0,
        }
    }

    /// Jury's conditions for all roots to lie inside the circle of radius `radius`: all of these are above 0.
    ///
    /// Where the coefficients are affine functions of some gain, each of them is a polynomial of degree 1 or 2 of it, the
    /// same at every gain.
    #[must_use]
    pub fn jury(&self, radius: f64) -> Vec<f64> {
        let r = radius;
        match self.coefficients[..] {
            [a0] => vec![r - a0, r + a0],
            [a0, a1] => vec![r * r - a0, r * r + a1 * r + a0, r * r - a1 * r + a0],
            [a0, a1, a2] => {
                let (r2, r3) = (r * r, r * r * r);
                let (one, other) = (r3 * r3 - a0 * a0, r2 * (a1 * r2 - a0 * a2));
                vec![
                    r3 - a0,
                    r3 + a0,
                    r3 + a2 * r2 + a1 * r + a0,
                    r3 - a2 * r2 + a1 * r - a0,
                    one - other,
                    one + other,
                ]
            }
            _ => Vec::new(),
        }
    }

    /// Whether all roots lie inside the unit circle, by Jury's conditions.
    #[must_use]
    pub fn is_stable(&self) -> bool {
        self.jury(1.0).into_iter().all(|margin| margin > 0.0)
    }
}

/// `z² + b·z + c`.
fn quadratic(b: f64, c: f64) -> f64 {
    let discriminant = b * b - 4.0 * c;
    if discriminant < 0.0 { c.sqrt() } else { 0.5 * (b.abs() + discriminant.sqrt()) }
}

/// `z³ + a·z² + b·z + c`: one real root, and the quadratic that is left.
fn cubic(a: f64, b: f64, c: f64) -> f64 {
    let root = real_root(a, b, c);
    // Dividing from the end that keeps the other two roots' digits (Peters & Wilkinson 1971).
    let (linear, constant) = if root.abs().powi(3) <= c.abs() {
        let linear = a + root;
        (linear, b + root * linear)
    } else if root == 0.0 {
        (a, b)
    } else {
        let constant = -c / root;
        ((constant - b) / root, constant)
    };
    root.abs().max(quadratic(linear, constant))
}

/// By bisection: a cubic changes its sign.
fn real_root(a: f64, b: f64, c: f64) -> f64 {
    let value = |z: f64| ((z + a) * z + b) * z + c;
    let bound = 1.0 + a.abs().max(b.abs()).max(c.abs());
    let (mut low, mut high) = (-bound, bound);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        match value(middle) {
            0.0 => return middle,
            negative if negative < 0.0 => low = middle,
            positive if positive > 0.0 => high = middle,
            _ => return f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// z³ + … from a real root and a pair.
    fn from_roots(real: f64, sum: f64, product: f64) -> Polynomial {
        Polynomial::monic(&[-real * product, product + real * sum, -real - sum])
    }

    #[test]
    fn roots_are_found_where_they_were_put() {
        for (real, re, im, radius) in [
            (0.5, 0.3, 0.4, 0.5),
            (0.2, 0.3, 0.4, 0.5),
            (-1.5, 0.3, 0.4, 1.5),
            (0.0, 0.6, 0.8, 1.0),
            (1e-9, 0.6, 0.8, 1.0),
            (1e6, 0.6, 0.8, 1e6),
        ] {
            let found = from_roots(real, 2.0 * re, re * re + im * im).spectral_radius();
            assert!((found - radius).abs() < 1e-14 * radius, "{real} {re} {im}: {found}");
        }
        for (real, one, other) in [(0.25, 0.75, -0.875), (3.0, -2.0, 1e-7), (0.0, 0.0, 0.5)] {
            let found = from_roots(real, one + other, one * other).spectral_radius();
            let radius = [real, one, other].into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!((found - radius).abs() < 1e-14 * radius, "{real} {one} {other}: {found}");
        }
        assert_eq!(Polynomial::monic(&[0.0, 0.0, 0.0]).spectral_radius(), 0.0);
        assert_eq!(Polynomial::monic(&[]).spectral_radius(), 0.0);
    }
}
