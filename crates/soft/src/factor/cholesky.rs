//! The Cholesky factor of a [`BlockMatrix`], by supernodes.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SymbolicSupernodalCholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use glam::DMat3;
use nalgebra::DMatrix;

use super::block_matrix::BlockMatrix;
use super::substitution::{Arithmetic, solve_lower, solve_upper};
use super::symbolic::Symbolic;

/// A matrix that has no Cholesky factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub struct NotPositive;

/// A number that factors are kept in: `f64`, or `f32` where seven digits are enough and speed counts.
pub trait Number: faer::traits::RealField + Arithmetic {
    /// The nearest number of this kind.
    fn from_f64(value: f64) -> Self;
}

impl Number for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
}

impl Number for f32 {
    fn from_f64(value: f64) -> Self {
        value as Self
    }
}

/// The factor `L·Lᵀ` of a symmetric positive definite matrix. Pattern, order and memory stay when the values change; one core.
pub type Factor = FactorOf<f64>;

/// A [`Factor`] in numbers of some kind.
pub struct FactorOf<T> {
    shared: Arc<SharedPattern>,
    matrix_values: Vec<T>,
    factor_values: Vec<T>,
    workspace: MemBuffer,
}

/// What depends on the pattern only.
struct SharedPattern {
    symbolic: Arc<Symbolic>,
    column_start: Vec<u32>,
    rows: Vec<u32>,
    structure: SymbolicCholesky<u32>,
}

impl<T: Number> FactorOf<T> {
    /// Room for the factor of a matrix of this pattern; of no matrix yet.
    ///
    /// # Panics
    /// When the factor would have more than 2³² entries.
    #[must_use]
    pub fn new(symbolic: Arc<Symbolic>) -> Self {
        Self::with_shared(Arc::new(SharedPattern::new(symbolic)))
    }

    /// Room for another factor of the same pattern, in numbers of the same or another kind.
    #[must_use]
    pub fn like<U>(other: &FactorOf<U>) -> Self {
        Self::with_shared(other.shared.clone())
    }

    fn with_shared(shared: Arc<SharedPattern>) -> Self {
        let need = shared.structure.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
        let factor_values = vec![T::default(); shared.structure.len_val()];
        let matrix_values = vec![T::default(); shared.rows.len()];
        Self { matrix_values, factor_values, workspace: MemBuffer::new(need), shared }
    }

    /// The pattern of the matrices that it factorises.
    #[must_use]
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.shared.symbolic
    }

    /// Becomes the factor of `matrix`.
    ///
    /// # Errors
    /// When it is not positive definite; then this is the factor of no matrix.
    ///
    /// # Panics
    /// When the matrix has another pattern.
    pub fn refactor(&mut self, matrix: &BlockMatrix) -> Result<(), NotPositive> {
        let Self { shared, matrix_values, factor_values, workspace } = self;
        assert!(Arc::ptr_eq(matrix.symbolic(), &shared.symbolic), "the matrix is of another pattern");
        lower_triangle(matrix, matrix_values);
        let size = shared.symbolic.coordinates();
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, &shared.column_start, None, &shared.rows);
        shared
            .structure
            .factorize_numeric_llt(
                factor_values,
                SparseColMatRef::new(pattern, matrix_values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(workspace),
                Default::default(),
            )
            .map_err(|_| NotPositive)?;
        let finite = factor_values.iter().all(|value| faer::traits::math_utils::is_finite(value));
        if finite { Ok(()) } else { Err(NotPositive) }
    }

    /// `vector` becomes the solution of `matrix · solution = vector`.
    ///
    /// # Panics
    /// When the vector has not as many entries as the matrix has rows.
    pub fn solve_in_place(&self, vector: &mut [T]) {
        assert_eq!(vector.len(), self.shared.symbolic.coordinates());
        solve_lower(self.shared.supernodes(), &self.factor_values, vector);
        solve_upper(self.shared.supernodes(), &self.factor_values, vector);
    }

    /// The same for each column.
    ///
    /// # Panics
    /// When the columns have not as many entries as the matrix has rows.
    pub fn solve_columns_in_place(&self, columns: &mut DMatrix<T>) {
        let (rows, count) = columns.shape();
        let right_sides = MatMut::from_column_major_slice_mut(columns.as_mut_slice(), rows, count);
        let structure = &self.shared.structure;
        let mut memory = MemBuffer::new(structure.solve_in_place_scratch::<T>(count, Par::Seq));
        let factor = LltRef::new(structure, &self.factor_values);
        factor.solve_in_place_with_conj(Conj::No, right_sides, Par::Seq, MemStack::new(&mut memory));
    }

    /// How many entries the factor has.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.factor_values.len()
    }

    /// Bytes on the heap, without the part that depends on the pattern only.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        size_of::<T>() * (self.matrix_values.len() + self.factor_values.len()) + self.workspace.len()
    }

    /// Bytes on the heap of the part that depends on the pattern only, about.
    #[must_use]
    pub fn shared_bytes(&self) -> usize {
        let supernodes = self.shared.supernodes();
        let indices = self.shared.rows.len()
            + self.shared.column_start.len()
            + supernodes.row_idx().len()
            + 5 * supernodes.n_supernodes();
        self.shared.symbolic.memory_bytes() + size_of::<u32>() * indices
    }
}

impl<T: Number> Clone for FactorOf<T> {
    fn clone(&self) -> Self {
        let mut clone = Self::with_shared(self.shared.clone());
        clone.factor_values.copy_from_slice(&self.factor_values);
        clone
    }
}

impl<T: Number> std::fmt::Debug for FactorOf<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Factor({} rows, {} entries)", self.symbolic().coordinates(), self.entries())
    }
}

impl SharedPattern {
    fn new(symbolic: Arc<Symbolic>) -> Self {
        let (column_start, rows) = lower_pattern(&symbolic);
        let structure = structure(&column_start, &rows);
        Self { symbolic, column_start, rows, structure }
    }

    fn supernodes(&self) -> &SymbolicSupernodalCholesky<u32> {
        match self.structure.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) => supernodes,
            SymbolicCholeskyRaw::Simplicial(_) => unreachable!("supernodes were asked for"),
        }
    }
}

/// The supernodes of the factor of a matrix with this lower triangle.
fn structure(column_start: &[u32], rows: &[u32]) -> SymbolicCholesky<u32> {
    let size = column_start.len() - 1;
    let (upper_start, upper_rows) = transposed(column_start, rows);
    let upper = SymbolicSparseColMatRef::new_checked(size, size, &upper_start, None, &upper_rows);
    let parameters = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        ..Default::default()
    };
    factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, parameters)
        .expect("the factor of a mesh of at most 200 000 elements has room")
}

/// Columns of the lower triangle, coordinate by coordinate: where they begin, and the rows.
fn lower_pattern(symbolic: &Symbolic) -> (Vec<u32>, Vec<u32>) {
    let (mut column_start, mut rows) = (vec![0], Vec::new());
    for column in 0..symbolic.free_nodes() {
        for axis in 0..3 {
            rows.extend((axis..3).map(|row| (3 * column + row) as u32));
            let below = &symbolic.rows[symbolic.below(column)];
            rows.extend(below.iter().flat_map(|&row| [3 * row, 3 * row + 1, 3 * row + 2]));
            column_start.push(rows.len() as u32);
        }
    }
    (column_start, rows)
}

/// The values in the order of [`lower_pattern`].
fn lower_triangle<T: Number>(matrix: &BlockMatrix, values: &mut [T]) {
    let symbolic = &*matrix.symbolic;
    let (diagonal, below) = matrix.blocks.split_at(symbolic.free_nodes());
    let mut next = 0;
    for (column, block) in diagonal.iter().enumerate() {
        for axis in 0..3 {
            let of_axis = |block: &DMat3| block.col(axis).to_array().map(T::from_f64);
            values[next..next + 3 - axis].copy_from_slice(&of_axis(block)[axis..]);
            next += 3 - axis;
            for block in &below[symbolic.below(column)] {
                values[next..next + 3].copy_from_slice(&of_axis(block));
                next += 3;
            }
        }
    }
}

/// The pattern of the transposed matrix.
fn transposed(column_start: &[u32], rows: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let size = column_start.len() - 1;
    let mut start = vec![0_u32; size + 1];
    for &row in rows {
        start[row as usize + 1] += 1;
    }
    for row in 0..size {
        start[row + 1] += start[row];
    }
    let mut next = start.clone();
    let mut turned = vec![0; rows.len()];
    for column in 0..size {
        for &row in &rows[column_start[column] as usize..column_start[column + 1] as usize] {
            turned[next[row as usize] as usize] = column as u32;
            next[row as usize] += 1;
        }
    }
    (start, turned)
}
