//! What a law is while its contacts stick: a linear system, which the analysis compiles.

use glam::DVec3;
use nalgebra::DMatrix;

use super::gains::LocalGains;
use super::model::SoftContactModel;

/// The m contacts of one host that stick.
#[derive(Clone, Copy, Debug)]
pub struct StickingContacts<'a> {
    /// Constants of all of them.
    pub model: &'a SoftContactModel,
    /// Gains in the present slow period, one element a contact.
    pub gains: &'a [LocalGains],
    /// Outward unit normals, one a contact.
    pub normals: &'a [DVec3],
    /// Joint compliance W, m/N, 3m × 3m, where the law needs it.
    pub compliance: Option<&'a DMatrix<f64>>,
}

/// A law's linear block for m contacts, once every instant of its clock:
///
/// ```text
/// x⁺ = a·x + b·u,   y = c·x + d·u
/// ```
///
/// `u` stacks the errors e = x_a + o − x_h of all contacts (3m, m) and, of a law that needs the joint compliance, the forces
/// on the body with which the frame in use was made (3m, N); `y` stacks the forces on the fingers (3m, N); `x` stacks the
/// law's state numbers contact by contact.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearLaw {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × 3m, or n × 6m.
    pub b: DMatrix<f64>,
    /// 3m × n.
    pub c: DMatrix<f64>,
    /// 3m × 3m, or 3m × 6m.
    pub d: DMatrix<f64>,
}

impl StickingContacts<'_> {
    /// The number of contacts, m.
    #[must_use]
    pub fn count(&self) -> usize {
        self.gains.len()
    }

    /// K_h of every contact along its three axes, N/m: a diagonal 3m × 3m matrix.
    #[must_use]
    pub fn stiffness(&self) -> DMatrix<f64> {
        let size = 3 * self.count();
        DMatrix::from_fn(
            size,
            size,
            |row, column| {
                if row == column { self.gains[row / 3].stiffness_n_per_m } else { 0.0 }
            },
        )
    }
}

impl LinearLaw {
    /// A law without state: `y = d·u`.
    #[must_use]
    pub fn stateless(d: DMatrix<f64>) -> Self {
        let (outputs, inputs) = d.shape();
        Self { a: DMatrix::zeros(0, 0), b: DMatrix::zeros(0, inputs), c: DMatrix::zeros(outputs, 0), d }
    }
}
