//! Several contacts on one elastic object: ways in which they move together.

use nalgebra::DMatrix;

use super::error::LocalModelError;
use super::gains::PiLocalModel;
use super::simulation_loop::SimulationLoop;

/// Compliances of the ways in which contacts move together, relative to 1/K_o: their largest and least.
///
/// With the same gains at every contact, the joint loop falls apart into one loop for each eigenvector of the joint
/// compliance; that of eigenvalue λ/K_o is a single contact on an object of K_o/λ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliances {
    /// Of the stiffest way.
    pub least: f64,
    /// Of the softest way.
    pub largest: f64,
}

impl Compliances {
    /// One contact.
    pub const ONE: Self = Self { least: 1.0, largest: 1.0 };

    /// `contacts` of which each moves the surface under any other by `correlation` times what it moves its own: the
    /// eigenvalues are 1 − R and 1 + (n−1)·R. They enclose those of any fewer of these contacts.
    ///
    /// # Errors
    /// When there is no contact, or the correlation is not between 0 and below 1.
    pub fn correlated(contacts: u32, correlation: f64) -> Result<Self, LocalModelError> {
        if !(0.0..1.0).contains(&correlation) {
            let (what, allowed) = ("the correlation of contacts", "from 0 to below 1");
            return Err(LocalModelError::Number { what, allowed, found: correlation });
        }
        match contacts {
            0 => Err(LocalModelError::Number {
                what: "the number of contacts",
                allowed: "1 or more",
                found: 0.0,
            }),
            1 => Ok(Self::ONE),
            n => Ok(Self { least: 1.0 - correlation, largest: 1.0 + f64::from(n - 1) * correlation }),
        }
    }

    /// Of a joint compliance matrix in m/N, displacement of contact i for a unit force at contact j, relative to 1/K_o.
    ///
    /// # Errors
    /// When the matrix is empty, not square, not finite, not symmetric (to 1e-9) or not positive definite.
    pub fn of_matrix(compliance_m_per_n: &DMatrix<f64>, ko_n_per_m: f64) -> Result<Self, LocalModelError> {
        let refuse = |reason: String| Err(LocalModelError::Compliance(reason));
        let (rows, columns) = compliance_m_per_n.shape();
        if rows != columns || rows == 0 {
            return refuse(format!("found {rows}×{columns}"));
        }
        if let Some(place) = compliance_m_per_n.iter().position(|value| !value.is_finite()) {
            return refuse(format!("row {}, column {} is not finite", place % rows, place / rows));
        }
        if (compliance_m_per_n - compliance_m_per_n.transpose()).amax() > 1e-9 * compliance_m_per_n.amax() {
            return refuse("it is not symmetric".into());
        }
        let eigenvalues = (compliance_m_per_n * ko_n_per_m).symmetric_eigenvalues();
        let (least, largest) = (eigenvalues.min(), eigenvalues.max());
        if least > 0.0 {
            Ok(Self { least, largest })
        } else {
            refuse(format!("its least eigenvalue is {least:.3e}/K_o"))
        }
    }

    /// The same when K_o may be wrong by a share of itself, either way.
    ///
    /// # Errors
    /// When the share is not between 0 and below 1.
    pub fn with_error(self, share: f64) -> Result<Self, LocalModelError> {
        if !(0.0..1.0).contains(&share) {
            let (what, allowed) = ("the error of K_o", "from 0 to below 1");
            return Err(LocalModelError::Number { what, allowed, found: share });
        }
        Ok(Self { least: self.least / (1.0 + share), largest: self.largest / (1.0 - share) })
    }
}

/// The largest spectral radius among all compliances in the range, ends included.
///
/// The worst lies at an end: as an object softens, the radius first falls and then rises. Under a zero-order hold that is
/// the root locus of `1 + c·(g·(z−1) + i)/(z·(z−1))` with poles at 0 and 1 and one zero, at 1 − i/g. Where i ≤ g, one
/// real root falls from 1 towards the zero while the other goes from 0 to −∞. Where i > g, two real roots meet, run as a
/// pair with |z|² = c·(i−g), which rises, and part left of the zero, where the outer one goes to −∞. (Under a
/// first-order hold this is checked by scanning, in the tests.)
#[must_use]
pub fn worst_spectral_radius(slow_loop: &SimulationLoop, model: &PiLocalModel, range: Compliances) -> f64 {
    [range.least, range.largest]
        .into_iter()
        .map(|compliance| slow_loop.spectral_radius(&model.on_softer(compliance)))
        .fold(0.0, f64::max)
}
