//! A linear sampled block, the form in which step functions are told to the analysis.

use nalgebra::DMatrix;

/// `x⁺ = A·x + B·u`, `y = C·x + D·u` at each instant of its clock, with n states, m inputs and p outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearBlock {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × m.
    pub b: DMatrix<f64>,
    /// p × n.
    pub c: DMatrix<f64>,
    /// p × m.
    pub d: DMatrix<f64>,
}

impl LinearBlock {
    /// A block without states: `y = D·u`.
    #[must_use]
    pub fn gain(d: DMatrix<f64>) -> Self {
        Self { a: DMatrix::zeros(0, 0), b: DMatrix::zeros(0, d.ncols()), c: DMatrix::zeros(d.nrows(), 0), d }
    }

    /// n.
    #[must_use]
    pub fn states(&self) -> usize {
        self.a.nrows()
    }

    /// m.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.d.ncols()
    }

    /// p.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.d.nrows()
    }
}
