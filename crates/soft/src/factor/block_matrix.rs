//! A symmetric matrix of 3 × 3 blocks.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::symbolic::{BlockSlot, Symbolic};

/// The values of a symmetric matrix on the pattern of a [`Symbolic`]: the blocks of the diagonal, then those below it, column
/// by column.
#[derive(Clone, Debug)]
pub struct BlockMatrix {
    pub(super) symbolic: Arc<Symbolic>,
    pub(super) blocks: Vec<DMat3>,
}

impl BlockMatrix {
    /// A matrix of this pattern with all blocks zero.
    #[must_use]
    pub fn new(symbolic: Arc<Symbolic>) -> Self {
        let blocks = vec![DMat3::ZERO; symbolic.free_nodes() + symbolic.rows.len()];
        Self { symbolic, blocks }
    }

    /// The pattern on which the matrix has its values.
    #[must_use]
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }

    /// Sets every block to zero.
    pub fn clear(&mut self) {
        self.blocks.fill(DMat3::ZERO);
    }

    /// Adds a block at (row, column) and its transpose at (column, row). On the diagonal once; it should be symmetric there.
    pub fn add(&mut self, slot: BlockSlot, block: DMat3) {
        self.blocks[slot.block as usize] += if slot.turned { block.transpose() } else { block };
    }

    /// Adds a block that joins two nodes, and its transpose on the other side of the diagonal; nothing if one is fixed.
    pub(crate) fn add_pair(&mut self, row: u32, column: u32, block: DMat3) {
        if let Some(slot) = self.symbolic.slot(row, column) {
            self.add(slot, block);
        }
    }

    /// Adds a multiple of the identity to the diagonal block of the node at a position of the order.
    pub fn add_to_diagonal(&mut self, position: usize, value: f64) {
        self.blocks[position] += DMat3::from_diagonal(DVec3::splat(value));
    }

    /// Every entry times `factor`.
    pub fn scale(&mut self, factor: f64) {
        for block in &mut self.blocks {
            *block *= factor;
        }
    }

    /// Becomes the sum of multiples of two matrices of the same pattern.
    pub fn set_to_sum(&mut self, (a, first): (f64, &Self), (b, second): (f64, &Self)) {
        for ((sum, first), second) in self.blocks.iter_mut().zip(&first.blocks).zip(&second.blocks) {
            *sum = *first * a + *second * b;
        }
    }

    /// `product = matrix · vector`.
    pub fn multiply(&self, vector: &[f64], product: &mut [f64]) {
        let (x, y) = (vector.as_chunks::<3>().0, product.as_chunks_mut::<3>().0);
        let (diagonal, below) = self.blocks.split_at(self.symbolic.free_nodes());
        for ((y, x), block) in y.iter_mut().zip(x).zip(diagonal) {
            *y = (*block * DVec3::from_array(*x)).to_array();
        }
        for column in 0..diagonal.len() {
            let range = self.symbolic.below(column);
            let here = DVec3::from_array(x[column]);
            let mut sum = DVec3::ZERO;
            for (&row, block) in self.symbolic.rows[range.clone()].iter().zip(&below[range]) {
                let there = &mut y[row as usize];
                *there = (DVec3::from_array(*there) + *block * here).to_array();
                sum += block.transpose() * DVec3::from_array(x[row as usize]);
            }
            y[column] = (DVec3::from_array(y[column]) + sum).to_array();
        }
    }

    /// All entries of both triangles that are not zero by pattern: row, column and value, rows and columns in the order of
    /// elimination, three coordinates for each node.
    #[must_use]
    pub fn entries(&self) -> Vec<(u32, u32, f64)> {
        let free = self.symbolic.free_nodes();
        let mut entries = Vec::with_capacity(9 * (2 * self.blocks.len() - free));
        let mut push = |row: u32, column: u32, block: DMat3| {
            for (c, values) in block.to_cols_array_2d().iter().enumerate() {
                let place = |r: usize| (3 * row + r as u32, 3 * column + c as u32);
                entries.extend(values.iter().enumerate().map(|(r, &value)| (place(r).0, place(r).1, value)));
            }
        };
        for column in 0..free {
            push(column as u32, column as u32, self.blocks[column]);
            for entry in self.symbolic.below(column) {
                let (row, block) = (self.symbolic.rows[entry], self.blocks[free + entry]);
                push(row, column as u32, block);
                push(column as u32, row, block.transpose());
            }
        }
        entries
    }

    /// Bytes on the heap, without the shared pattern.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<DMat3>()
    }
}
