//! Sparse symmetric positive definite systems on the graph of a mesh's nodes, three coordinates each: ordered by nested
//! dissection once, then factorised again and again with new values in the same memory.
//!
//! Vectors hold the coordinates of the free nodes in the order of elimination: [`Symbolic::gather`] and
//! [`Symbolic::scatter`] translate from and to the nodes' own order.
//!
//! ```
//! use std::sync::Arc;
//! use cotouch_soft::factor::{BlockMatrix, Factor, Symbolic};
//! use glam::{DMat3, DVec3};
//!
//! // Three nodes on a line, the first one fixed, joined by two springs of 10 N/m that also resist shear.
//! let rest = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X];
//! let symbolic = Arc::new(Symbolic::new(&rest, &[true, false, false], &[[0, 1], [1, 2]]));
//! let mut matrix = BlockMatrix::new(symbolic.clone());
//! for [a, b] in [[0, 1], [1, 2]] {
//!     let stiffness = 10.0 * DMat3::IDENTITY;
//!     for (row, column, sign) in [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0)] {
//!         if let Some(slot) = symbolic.slot(row, column) {
//!             matrix.add(slot, sign * stiffness);
//!         }
//!     }
//! }
//! let mut factor = Factor::new(symbolic.clone());
//! factor.refactor(&matrix).unwrap();
//! let mut vector = symbolic.gather(&[DVec3::ZERO, DVec3::ZERO, DVec3::Y]);
//! factor.solve_in_place(&mut vector);
//! let mut moved = [DVec3::ZERO; 3];
//! symbolic.scatter(&vector, &mut moved);
//! assert!((moved[2].y - 0.2).abs() < 1e-12);
//! ```

mod block_matrix;
mod cholesky;
mod dissection;
mod substitution;
mod symbolic;

pub use block_matrix::BlockMatrix;
pub use cholesky::{Factor, FactorOf, NotPositive, Number};
pub use substitution::Arithmetic;
pub use symbolic::{BlockSlot, Symbolic};
