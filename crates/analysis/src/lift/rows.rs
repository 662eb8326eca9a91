//! Numbers of many states at once: a row for each number, a column for each state.

use std::ops::Range;

/// Rows of equal length.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    data: Vec<f64>,
    columns: usize,
}

impl Rows {
    pub(crate) fn clear(&mut self, rows: usize, columns: usize) {
        self.columns = columns;
        self.data.clear();
        self.data.resize(rows * columns, 0.0);
    }

    #[inline(always)]
    pub(crate) fn row(&self, index: usize) -> &[f64] {
        &self.data[index * self.columns..(index + 1) * self.columns]
    }

    #[inline(always)]
    pub(crate) fn row_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.data[index * self.columns..(index + 1) * self.columns]
    }

    pub(crate) fn fill(&mut self, value: f64) {
        self.data.fill(value);
    }

    pub(super) fn copy_row(&mut self, from: usize, to: usize) {
        self.data.copy_within(from * self.columns..(from + 1) * self.columns, to * self.columns);
    }

    pub(super) fn copy_from(&mut self, other: &Self) {
        self.data.copy_from_slice(&other.data);
    }

    /// Lets the first `by` of these rows follow the last of them.
    pub(super) fn rotate(&mut self, rows: Range<usize>, by: usize) {
        self.data[rows.start * self.columns..rows.end * self.columns].rotate_left(by * self.columns);
    }

    /// All numbers, row by row.
    pub(super) fn data(&self) -> &[f64] {
        &self.data
    }
}
