//! A plant over a stretch of time in which its input is constant or moves linearly.

use nalgebra::DMatrix;

use crate::plant::Plant;

/// `x(t) = a·x(0) + level·u(0) + slope·u̇`, with `u(τ) = u(0) + u̇·τ`.
#[derive(Clone, Debug)]
pub(crate) struct HeldPlant {
    /// e^(A·t).
    pub(crate) a: DMatrix<f64>,
    /// ∫ e^(A·(t−τ))·B dτ.
    pub(crate) level: DMatrix<f64>,
    /// ∫ e^(A·(t−τ))·B·τ dτ.
    pub(crate) slope: DMatrix<f64>,
}

impl HeldPlant {
    /// By the exponential of the plant augmented with its input and the input's slope: Fotoohi Ghiam 2006, (3.15), with
    /// a ramp.
    pub(crate) fn new(plant: &Plant, seconds: f64) -> Self {
        let (n, m) = plant.b.shape();
        // Linear in B, whose unit then does not matter.
        let scale = plant.b.amax() * seconds;
        let input = if scale > 0.0 { &plant.b * (seconds / scale) } else { plant.b.clone() };
        let mut augmented = DMatrix::zeros(n + 2 * m, n + 2 * m);
        augmented.view_mut((0, 0), (n, n)).copy_from(&(&plant.a * seconds));
        augmented.view_mut((0, n), (n, m)).copy_from(&input);
        augmented.view_mut((n, n + m), (m, m)).fill_with_identity();
        let exponential = augmented.exp();
        let part = |first: usize, count: usize| exponential.view((0, first), (n, count)).into_owned();
        Self { a: part(0, n), level: part(n, m) * scale, slope: part(n + m, m) * (scale * seconds) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::dmatrix;

    #[test]
    fn a_double_integrator_moves_as_in_school() {
        let plant = Plant { a: dmatrix![0.0, 1.0; 0.0, 0.0], b: dmatrix![0.0; 5.0], c: dmatrix![1.0, 0.0] };
        let t = 0.3;
        let held = HeldPlant::new(&plant, t);
        assert!((&held.a - dmatrix![1.0, t; 0.0, 1.0]).amax() < 1e-15);
        assert!((&held.level - dmatrix![5.0 * t * t / 2.0; 5.0 * t]).amax() < 1e-15);
        assert!((&held.slope - dmatrix![5.0 * t * t * t / 6.0; 5.0 * t * t / 2.0]).amax() < 1e-15);
    }

    #[test]
    fn a_first_order_lag_follows_a_ramp() {
        let plant = Plant { a: dmatrix![-2.0], b: dmatrix![3.0], c: dmatrix![1.0] };
        let held = HeldPlant::new(&plant, 0.7);
        let decay = (-1.4f64).exp();
        assert!((held.level[0] - 1.5 * (1.0 - decay)).abs() < 1e-15);
        assert!((held.slope[0] - 1.5 * (0.7 - (1.0 - decay) / 2.0)).abs() < 1e-15);
    }
}
