//! Contacts that stick, from which the linear block of a law is made.

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
