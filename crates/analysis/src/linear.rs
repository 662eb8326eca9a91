//! Discrete linear systems.

use nalgebra::DMatrix;

/// `y_k = C·x_k + D·u_k`, `x_{k+1} = A·x_k + B·u_k`.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// n × n.
    pub a: DMatrix<f64>,
    /// n × inputs.
    pub b: DMatrix<f64>,
    /// Outputs × n.
    pub c: DMatrix<f64>,
    /// Outputs × inputs.
    pub d: DMatrix<f64>,
}

impl Linear {
    /// `y = D·u`, without a state.
    #[must_use]
    pub fn gain(d: DMatrix<f64>) -> Self {
        let (outputs, inputs) = d.shape();
        Self { a: DMatrix::zeros(0, 0), b: DMatrix::zeros(0, inputs), c: DMatrix::zeros(outputs, 0), d }
    }

    /// n.
    #[must_use]
    pub fn states(&self) -> usize {
        self.a.nrows()
    }

    /// How many numbers go in.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.d.ncols()
    }

    /// How many numbers come out.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.d.nrows()
    }
}
