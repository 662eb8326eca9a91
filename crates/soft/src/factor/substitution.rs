//! Forward and backward substitution of one vector, supernode by supernode.
//!
//! Every entry of the factor is read once, in the order in which it lies in memory: that, not arithmetic, is what takes time.

use std::ops::{AddAssign, Div, Mul, Sub, SubAssign};

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

/// What substitution does with numbers.
pub trait Arithmetic:
    Copy
    + Default
    + AddAssign
    + SubAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + nalgebra::Scalar
{
}

impl Arithmetic for f64 {}
impl Arithmetic for f32 {}

/// Sums are kept in so many parts, which the processor adds side by side.
const LANES: usize = 16;

/// A supernode's columns: its own rows first, then those of `pattern`.
struct Supernode<'a, T> {
    begin: usize,
    width: usize,
    pattern: &'a [u32],
    values: &'a [T],
}

fn supernode<'a, T>(
    structure: &'a SymbolicSupernodalCholesky<u32>,
    values: &'a [T],
    index: usize,
) -> Supernode<'a, T> {
    let begin = structure.supernode_begin()[index] as usize;
    let end = structure.supernode_end()[index] as usize;
    let start = structure.col_ptr_for_val();
    let values = &values[start[index] as usize..start[index + 1] as usize];
    Supernode { begin, width: end - begin, pattern: structure.supernode(index).pattern(), values }
}

/// `L·x = b`, in place.
pub(super) fn solve_lower<T: Arithmetic>(
    structure: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    vector: &mut [T],
) {
    let mut below = vec![T::default(); vector.len()];
    for index in 0..structure.n_supernodes() {
        let Supernode { begin, width, pattern, values } = supernode(structure, values, index);
        let below = &mut below[..pattern.len()];
        below.fill(T::default());
        let own = &mut vector[begin..begin + width];
        for (column, entries) in values.chunks_exact(width + pattern.len()).enumerate() {
            let solved = own[column] / entries[column];
            own[column] = solved;
            subtract_multiple(&mut own[column + 1..], solved, &entries[column + 1..width]);
            subtract_multiple(below, solved, &entries[width..]);
        }
        for (&row, &change) in pattern.iter().zip(below.iter()) {
            vector[row as usize] += change;
        }
    }
}

/// `Lᵀ·x = b`, in place.
pub(super) fn solve_upper<T: Arithmetic>(
    structure: &SymbolicSupernodalCholesky<u32>,
    values: &[T],
    vector: &mut [T],
) {
    let mut below = vec![T::default(); vector.len()];
    for index in (0..structure.n_supernodes()).rev() {
        let Supernode { begin, width, pattern, values } = supernode(structure, values, index);
        let below = &mut below[..pattern.len()];
        for (&row, value) in pattern.iter().zip(below.iter_mut()) {
            *value = vector[row as usize];
        }
        let own = &mut vector[begin..begin + width];
        for (column, entries) in values.chunks_exact(width + pattern.len()).enumerate().rev() {
            let mut left = own[column] - dot(&own[column + 1..], &entries[column + 1..width]);
            left -= dot(below, &entries[width..]);
            own[column] = left / entries[column];
        }
    }
}

fn subtract_multiple<T: Arithmetic>(sum: &mut [T], factor: T, vector: &[T]) {
    for (sum, &part) in sum.iter_mut().zip(vector) {
        *sum -= factor * part;
    }
}

fn dot<T: Arithmetic>(one: &[T], other: &[T]) -> T {
    let mut sums = [T::default(); LANES];
    let (ones, ones_left) = one.as_chunks::<LANES>();
    let (others, others_left) = other.as_chunks::<LANES>();
    for (one, other) in ones.iter().zip(others) {
        for lane in 0..LANES {
            sums[lane] += one[lane] * other[lane];
        }
    }
    let mut sum = T::default();
    sums.into_iter().for_each(|part| sum += part);
    for (&one, &other) in ones_left.iter().zip(others_left) {
        sum += one * other;
    }
    sum
}
