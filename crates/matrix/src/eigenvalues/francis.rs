//! Eigenvalues by Householder's Hessenberg form and Francis's double-shift QR.
//!
//! A sweep asks for the eigenvalues of thousands of matrices of 8 to 32 rows, for which the set-up of a general library
//! costs more than the numbers (measured: `cargo bench -p cotouch-analysis --bench map`, group "eigenvalues"); larger ones
//! must be known to end. This is the algorithm of EISPACK's `hqr` (Martin, Peters & Wilkinson 1970; Wilkinson & Reinsch, Handbook for Automatic
//! Computation II/14) without vectors, with an exceptional shift every tenth iteration. It gives up after a fixed number
//! of iterations.
//!
//! `hqr` takes a subdiagonal element for zero beside its diagonal. Many equal eigenvalues near zero, as delay lines have them, leave
//! diagonals and subdiagonals far below the rounding errors of the form itself, and nothing to converge to; where that happens, what is
//! negligible beside the whole matrix is zero too, an error no larger than the form's own (Golub & Van Loan 2013, 7.5.1).

use nalgebra::{Complex, DMatrix};
use pulp::Arch;

/// Iterations for one eigenvalue or pair: three or four is usual, and what has not come off after 60 mostly does before 120.
const MAX_ITERATIONS: usize = 300;
const EXCEPTIONAL: usize = 10;

/// What a subdiagonal element is negligible beside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Beside {
    /// The two elements of the diagonal next to it, where they are not both zero: small eigenvalues of graded matrices keep
    /// their digits.
    Diagonal,
    /// The Frobenius norm of the matrix.
    Norm,
}

/// All eigenvalues of a square matrix; `None` where the iteration did not converge or overflowed.
///
/// Compiled for the vector instructions of this processor, which is why everything below is inlined.
pub(super) fn eigenvalues(matrix: &DMatrix<f64>, beside: Beside) -> Option<Vec<Complex<f64>>> {
    Arch::new().dispatch(|| iterated(matrix, beside))
}

#[inline(always)]
fn iterated(matrix: &DMatrix<f64>, beside: Beside) -> Option<Vec<Complex<f64>>> {
    let size = matrix.nrows();
    // The transpose, because nalgebra stores columns: its eigenvalues are the same.
    let mut work = Square { elements: matrix.as_slice().to_vec(), size };
    work.make_hessenberg();
    let mut values = Vec::with_capacity(size);
    let mut rest = size;
    let mut shift = 0.0;
    let norm = dot(&work.elements, &work.elements).sqrt();
    let is_negligible = |element: f64, diagonal: f64| {
        let size = if beside == Beside::Norm || diagonal == 0.0 { norm } else { diagonal };
        element.abs() <= f64::EPSILON * size
    };
    while rest > 0 {
        rest -= work.split_off(rest, is_negligible, &mut shift, &mut values)?;
    }
    let all_finite = values.iter().all(|value: &Complex<f64>| value.re.is_finite() && value.im.is_finite());
    all_finite.then_some(values)
}

/// A square matrix, row by row.
struct Square {
    elements: Vec<f64>,
    size: usize,
}

impl Square {
    #[inline(always)]
    fn at(&self, row: usize, column: usize) -> f64 {
        self.elements[row * self.size + column]
    }

    #[inline(always)]
    fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.elements[row * self.size + column]
    }

    /// By reflections, one for each column; what lies below the subdiagonal is 0 afterwards.
    #[inline(always)]
    fn make_hessenberg(&mut self) {
        let size = self.size;
        let mut normal = vec![0.0; size];
        let mut along = vec![0.0; size];
        for column in 0..size.saturating_sub(2) {
            let first = column + 1;
            let below: f64 = (first + 1..size).map(|row| self.at(row, column).abs()).sum();
            if below == 0.0 {
                continue;
            }
            let scale = below + self.at(first, column).abs();
            let mut square = 0.0;
            for (row, element) in normal.iter_mut().enumerate().skip(first) {
                *element = self.at(row, column) / scale;
                square += *element * *element;
            }
            let length = square.sqrt().copysign(normal[first]);
            // H = I − n·nᵀ/half, with half = nᵀ·n/2.
            let half = square + normal[first] * length;
            normal[first] += length;
            along[column..].fill(0.0);
            let rows = self.elements[first * size..].chunks_exact(size);
            for (row, factor) in rows.zip(&normal[first..]) {
                for (sum, element) in along[column..].iter_mut().zip(&row[column..]) {
                    *sum += factor * element;
                }
            }
            let rows = self.elements[first * size..].chunks_exact_mut(size);
            for (row, n) in rows.zip(&normal[first..]) {
                let factor = n / half;
                for (element, sum) in row[column..].iter_mut().zip(&along[column..]) {
                    *element -= factor * sum;
                }
            }
            for row in self.elements.chunks_exact_mut(size) {
                let (row, normal) = (&mut row[first..], &normal[first..]);
                let factor = dot(row, normal) / half;
                for (element, n) in row.iter_mut().zip(normal) {
                    *element -= factor * n;
                }
            }
            for row in first + 1..size {
                *self.at_mut(row, column) = 0.0;
            }
        }
    }

    /// Iterates on the first `rest` rows until one or two eigenvalues have come off at their end; says how many.
    /// `shift` was subtracted from the diagonal.
    #[inline(always)]
    fn split_off(
        &mut self,
        rest: usize,
        is_negligible: impl Fn(f64, f64) -> bool,
        shift: &mut f64,
        values: &mut Vec<Complex<f64>>,
    ) -> Option<usize> {
        let last = rest - 1;
        for iteration in 0..MAX_ITERATIONS {
            let first = self.first_of_block(last, &is_negligible);
            let x = self.at(last, last);
            if first == last {
                values.push(Complex::new(x + *shift, 0.0));
                return Some(1);
            }
            let y = self.at(last - 1, last - 1);
            let w = self.at(last, last - 1) * self.at(last - 1, last);
            if first + 1 == last {
                values.extend(pair(x, y, w).map(|value| value + *shift));
                return Some(2);
            }
            let exceptional = iteration > 0 && iteration % EXCEPTIONAL == 0;
            let shifts = if exceptional { self.exceptional_shifts(last, shift) } else { (x, y, w) };
            self.double_step(first, last, shifts);
        }
        None
    }

    /// Where the block begins that ends with row `last`: its subdiagonal elements are not negligible beside their diagonals.
    #[inline(always)]
    fn first_of_block(&mut self, last: usize, is_negligible: impl Fn(f64, f64) -> bool) -> usize {
        let mut row = last;
        while row > 0 {
            let diagonal = self.at(row - 1, row - 1).abs() + self.at(row, row).abs();
            if is_negligible(self.at(row, row - 1), diagonal) {
                *self.at_mut(row, row - 1) = 0.0;
                break;
            }
            row -= 1;
        }
        row
    }

    /// Wilkinson's, which lead out of a cycle.
    #[inline(always)]
    fn exceptional_shifts(&mut self, last: usize, shift: &mut f64) -> (f64, f64, f64) {
        let x = self.at(last, last);
        *shift += x;
        for row in 0..=last {
            *self.at_mut(row, row) -= x;
        }
        let sum = self.at(last, last - 1).abs() + self.at(last - 1, last - 2).abs();
        (0.75 * sum, 0.75 * sum, -0.4375 * sum * sum)
    }

    /// A double step of QR on rows `first` to `last`, at least three; the shifts' sum is x + y, their product x·y − w.
    #[inline(always)]
    fn double_step(&mut self, first: usize, last: usize, (x, y, w): (f64, f64, f64)) {
        let mut start = last - 2;
        let mut column = loop {
            let column = self.first_column(start, x, y, w);
            if start == first || self.may_start(start, column) {
                break column;
            }
            start -= 1;
        };
        for row in start + 2..=last {
            *self.at_mut(row, row - 2) = 0.0;
            if row > start + 2 {
                *self.at_mut(row, row - 3) = 0.0;
            }
        }
        for step in start..last {
            let three = step + 1 < last;
            if step > start {
                let third = if three { self.at(step + 2, step - 1) } else { 0.0 };
                column = [self.at(step, step - 1), self.at(step + 1, step - 1), third];
            }
            let scale: f64 = column.iter().map(|value| value.abs()).sum();
            if scale == 0.0 {
                continue;
            }
            let per_scale = scale.recip();
            let column = column.map(|value| value * per_scale);
            let [p, q, r] = column;
            let length = (p * p + q * q + r * r).sqrt().copysign(p);
            if step > start {
                *self.at_mut(step, step - 1) = -length * scale;
            } else if start > first {
                *self.at_mut(step, step - 1) *= -1.0;
            }
            let head = p + length;
            let (per_length, per_head) = (length.recip(), head.recip());
            let left = [head * per_length, q * per_length, r * per_length];
            let right = [1.0, q * per_head, r * per_head];
            self.reflect(step, first, last, three, left, right);
        }
    }

    /// What the first column of (A − s₁)(A − s₂) would be if the block began at `start`, over its
    /// subdiagonal element.
    #[inline(always)]
    fn first_column(&self, start: usize, x: f64, y: f64, w: f64) -> [f64; 3] {
        let z = self.at(start, start);
        let (r, s) = (x - z, y - z);
        [
            (r * s - w) / self.at(start + 1, start) + self.at(start, start + 1),
            self.at(start + 1, start + 1) - z - r - s,
            self.at(start + 2, start + 1),
        ]
    }

    /// Whether two small subdiagonal elements in a row allow to begin at `start`.
    #[inline(always)]
    fn may_start(&self, start: usize, [p, q, r]: [f64; 3]) -> bool {
        let beside = self.at(start - 1, start - 1).abs()
            + self.at(start, start).abs()
            + self.at(start + 1, start + 1).abs();
        self.at(start, start - 1).abs() * (q.abs() + r.abs()) <= f64::EPSILON * p.abs() * beside
    }

    /// The similarity with `I − left·rightᵀ` in rows `step` and after.
    #[inline(always)]
    fn reflect(
        &mut self,
        step: usize,
        first: usize,
        last: usize,
        three: bool,
        left: [f64; 3],
        right: [f64; 3],
    ) {
        let size = self.size;
        let (one, rest) = self.elements[step * size..].split_at_mut(size);
        let (two, rest) = rest.split_at_mut(size);
        if three {
            let columns = step..last + 1;
            let rows = one[columns.clone()].iter_mut().zip(&mut two[columns.clone()]).zip(&mut rest[columns]);
            for ((a, b), c) in rows {
                let sum = *a + right[1] * *b + right[2] * *c;
                *a -= sum * left[0];
                *b -= sum * left[1];
                *c -= sum * left[2];
            }
        } else {
            for (a, b) in one[step..=last].iter_mut().zip(&mut two[step..=last]) {
                let sum = *a + right[1] * *b;
                *a -= sum * left[0];
                *b -= sum * left[1];
            }
        }
        let lowest = last.min(step + 3);
        for row in self.elements[first * size..(lowest + 1) * size].chunks_exact_mut(size) {
            if let ([a, b, c, ..], true) = (&mut row[step..], three) {
                let sum = left[0] * *a + left[1] * *b + left[2] * *c;
                *a -= sum;
                *b -= sum * right[1];
                *c -= sum * right[2];
            } else if let [a, b, ..] = &mut row[step..] {
                let sum = left[0] * *a + left[1] * *b;
                *a -= sum;
                *b -= sum * right[1];
            }
        }
    }
}

/// In four sums at once.
#[inline(always)]
fn dot(one: &[f64], other: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (ones, others) = (one.chunks_exact(4), other.chunks_exact(4));
    let rest: f64 = ones.remainder().iter().zip(others.remainder()).map(|(a, b)| a * b).sum();
    for (one, other) in ones.zip(others) {
        for lane in 0..4 {
            sums[lane] += one[lane] * other[lane];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

/// The eigenvalues of [y ·; · x] whose off-diagonal elements' product is `w`.
fn pair(x: f64, y: f64, w: f64) -> [Complex<f64>; 2] {
    let p = 0.5 * (y - x);
    let q = p * p + w;
    let root = q.abs().sqrt();
    if q < 0.0 {
        return [Complex::new(x + p, root), Complex::new(x + p, -root)];
    }
    let sum = p + root.copysign(p);
    let one = x + sum;
    let other = if sum == 0.0 { one } else { x - w / sum };
    [Complex::new(one, 0.0), Complex::new(other, 0.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigenvalues::balance;
    use cotouch_testkit::Random;

    /// Eigenvalues of larger absolute value than `above`, in an order.
    fn sorted(mut values: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        values.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        values
    }

    /// Numbers in −1 to 1, uniformly.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut random = Random::new(seed);
        move || 2.0 * random.unit() - 1.0
    }

    /// Every value has a partner among the others, no partner twice.
    fn assert_same(ours: Vec<Complex<f64>>, theirs: Vec<Complex<f64>>, tolerance: f64) {
        assert_eq!(ours.len(), theirs.len());
        let mut left = sorted(theirs);
        for value in sorted(ours) {
            let distance = |other: &Complex<f64>| (other - value).norm();
            let (place, nearest) = left
                .iter()
                .enumerate()
                .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))
                .map(|(place, other)| (place, distance(other)))
                .unwrap();
            assert!(nearest <= tolerance, "{value} is {nearest} from the nearest of {left:?}");
            left.remove(place);
        }
    }

    /// By faer, which below 75 rows is LAPACK's `dlahqr`.
    fn by_library(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
        let values = faer::Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)]).eigenvalues();
        values.unwrap().iter().map(|value| Complex::new(value.re, value.im)).collect()
    }

    /// By either measure of what is negligible.
    fn both(matrix: &DMatrix<f64>) -> [Vec<Complex<f64>>; 2] {
        [Beside::Diagonal, Beside::Norm].map(|beside| eigenvalues(matrix, beside).unwrap())
    }

    #[test]
    fn equal_to_the_library_on_random_matrices() {
        for size in 1..=40 {
            for seed in 0..20 {
                let mut next = numbers(size as u64 * 100 + seed);
                let sparse = seed % 2 == 0;
                let mut matrix = DMatrix::from_fn(size, size, |_, _| {
                    let value = next();
                    if sparse && next() > 0.0 { 0.0 } else { value }
                });
                if seed % 5 == 0 {
                    for row in 0..size {
                        matrix.row_mut(row).scale_mut(10f64.powi(row as i32 % 9 - 4));
                        matrix.column_mut(row).scale_mut(10f64.powi(4 - row as i32 % 9));
                    }
                }
                balance(&mut matrix);
                let scale = 1.0 + matrix.norm();
                let [ours, beside_norm] = both(&matrix);
                // Sparse random matrices may have defective zeros.
                let tolerance = if sparse { 1e-4 } else { 1e-9 };
                assert_same(ours, by_library(&matrix), tolerance * scale);
                assert_same(beside_norm, by_library(&matrix), tolerance * scale);
            }
        }
    }

    #[test]
    fn defective_ones_are_found_as_well_as_they_can_be() {
        for size in 2..=12 {
            let jordan = DMatrix::from_fn(size, size, |i, j| if i == j || i + 1 == j { 1.0 } else { 0.0 });
            let mut next = numbers(size as u64);
            let normal = nalgebra::DVector::from_fn(size, |_, _| next()).normalize();
            let reflect = DMatrix::identity(size, size) - &normal * normal.transpose() * 2.0;
            let allowed = 4.0 * (1e-15 * size as f64).powf((size as f64).recip());
            for found in both(&(&reflect * jordan * &reflect)) {
                assert!(
                    found.iter().all(|value| (value - Complex::new(1.0, 0.0)).norm() < allowed),
                    "{found:?}"
                );
            }
        }
    }

    #[test]
    fn shifts_and_cycles_end() {
        for size in 1..=40 {
            for corner in [0.0_f64, 1.0, 1e-8, -1.0] {
                let mut matrix = DMatrix::from_fn(size, size, |i, j| {
                    if i == j + 1 {
                        1.0
                    } else if (i, j) == (0, size - 1) {
                        corner
                    } else {
                        0.0
                    }
                });
                balance(&mut matrix);
                let expected = corner.abs().powf((size as f64).recip());
                for value in both(&matrix).into_iter().flatten() {
                    assert!((value.norm() - expected).abs() < 1e-10, "{size} {corner} {value}");
                }
            }
        }
    }

    /// Pairs of one absolute value, as delay lines have them, in a basis that is aligned with nothing.
    #[test]
    fn many_pairs_of_one_size_are_found() {
        for pairs in [20, 50, 120] {
            let size = 2 * pairs;
            let angle = |pair: usize| 0.01 + 3.1 * (pair as f64 + 0.5) / pairs as f64;
            let radius = |pair: usize| 0.9 + 1e-13 * pair as f64;
            let mut matrix = DMatrix::zeros(size, size);
            let mut expected = Vec::new();
            for pair in 0..pairs {
                let (sin, cos) = angle(pair).sin_cos();
                let block = nalgebra::Matrix2::new(cos, -sin, sin, cos) * radius(pair);
                matrix.fixed_view_mut::<2, 2>(2 * pair, 2 * pair).copy_from(&block);
                expected.extend([sin, -sin].map(|im| Complex::new(cos, im) * radius(pair)));
            }
            for seed in 0..3 {
                let mut next = numbers(seed);
                let normal = nalgebra::DVector::from_fn(size, |_, _| next()).normalize();
                let reflect = DMatrix::identity(size, size) - &normal * normal.transpose() * 2.0;
                matrix = &reflect * matrix * &reflect;
            }
            for found in both(&matrix) {
                assert_same(found, expected.clone(), 1e-11);
            }
        }
    }

    /// Delay lines of two to seven steps in a basis that is aligned with nothing, beside eigenvalues between −1 and 1, of which
    /// the largest absolute value comes along: each zero is as uncertain as a root of the rounding error.
    fn delay_lines(seed: u64) -> (DMatrix<f64>, f64) {
        let mut random = Random::new(seed);
        let size = 4 + (random.unit() * 40.0) as usize;
        let steps = 2 + (random.unit() * 6.0) as usize;
        let others = (0.5 * random.unit() * size as f64) as usize;
        let mut matrix = DMatrix::from_fn(size, size, |i, j| {
            let in_line = i > others && i == j + 1 && i % steps != 0;
            if i == j && i < others {
                2.0 * random.unit() - 1.0
            } else if in_line {
                random.unit()
            } else {
                0.0
            }
        });
        let largest = matrix.diagonal().amax();
        for _ in 0..(4.0 * random.unit()) as usize {
            let normal = nalgebra::DVector::from_fn(size, |_, _| 2.0 * random.unit() - 1.0).normalize();
            let reflect = DMatrix::identity(size, size) - &normal * normal.transpose() * 2.0;
            matrix = &reflect * matrix * &reflect;
        }
        (matrix, largest)
    }

    #[test]
    fn delay_lines_are_found_however_long_that_takes() {
        // The first two take more than 60 iterations, the others do not come off beside their diagonals at all.
        let hard = [20, 7235, 35_364, 42_599];
        for seed in (0..200).chain(hard) {
            let (matrix, largest) = delay_lines(seed);
            let found = crate::eigenvalues::of_balanced(&matrix).unwrap();
            let radius = crate::eigenvalues::spectral_radius(&found);
            // Larger than what a zero may be taken for.
            assert!(largest < 0.1 || (radius - largest).abs() < 1e-9, "{seed}: {radius} and {largest}");
        }
        for seed in &hard[..2] {
            assert!(eigenvalues(&delay_lines(*seed).0, Beside::Norm).is_some(), "{seed}");
        }
        for seed in &hard[2..] {
            assert!(eigenvalues(&delay_lines(*seed).0, Beside::Diagonal).is_none(), "{seed} is not hard");
        }
    }

    #[test]
    fn what_overflows_has_none() {
        let matrix = DMatrix::from_element(5, 5, f64::MAX);
        let found = eigenvalues(&matrix, Beside::Norm);
        assert!(found.is_none_or(|values| values.iter().all(|value| value.re.is_finite())));
    }
}
