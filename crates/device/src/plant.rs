//! One axis of a hand, m·x″ = u − k·x − b·v, advanced exactly over a period in which u is held.

/// The exact zero-order-hold step of `m·x″ = u − k·x − b·v` over a period T.
///
/// Let φ(t) be the position's response to a unit initial velocity and γ(t) = ∫₀ᵗ φ. Everything else follows:
///
/// ```text
/// x(T) = x + φ(T)·v + γ(T)/m·(u − k·x)
/// v(T) = v + φ(T)/m·(u − k·x − b·v) − k·γ(T)/m·v
/// ```
///
/// φ and γ come from their power series over T/2ˢ and s doublings,
/// `φ(2t) = 2φ·(1 − (k·γ + b·φ/2)/m)`, `γ(2t) = γ·(2 − k·γ/m) + φ²`, in which errors do not grow: no case has to be told
/// from another (free, over-, under- or critically damped), and none loses digits.
/// Written as an increment, a plant at rest with u = k·x stays there to the bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrderPlant {
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    /// φ(T), in seconds: position per velocity.
    position_per_velocity_s: f64,
    /// γ(T)/m: position per held force.
    position_per_force_m_per_n: f64,
    /// φ(T)/m: velocity per held force.
    velocity_per_force_m_per_n_s: f64,
}

impl SecondOrderPlant {
    /// The plant of mass `mass_kg` > 0 with damping and stiffness to the origin, stepped by `period_s` > 0.
    #[must_use]
    pub fn new(mass_kg: f64, damping_n_s_per_m: f64, stiffness_n_per_m: f64, period_s: f64) -> Self {
        let per_period = period_s / mass_kg;
        let (phi, gamma) =
            responses(stiffness_n_per_m * period_s * per_period, damping_n_s_per_m * per_period);
        Self {
            stiffness_n_per_m,
            damping_n_s_per_m,
            position_per_velocity_s: phi * period_s,
            position_per_force_m_per_n: gamma * period_s * per_period,
            velocity_per_force_m_per_n_s: phi * per_period,
        }
    }

    /// Position and velocity one period after `x` (m), `v` (m/s) under the held force `u` (N).
    ///
    /// `T` is a number, or a vector of axes that do not influence each other. No allocation, bounded work.
    #[must_use]
    pub fn step<T>(&self, x: T, v: T, u: T) -> (T, T)
    where
        T: Copy + std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
    {
        let force = u - x * self.stiffness_n_per_m;
        let softened = self.stiffness_n_per_m * self.position_per_force_m_per_n;
        (
            x + v * self.position_per_velocity_s + force * self.position_per_force_m_per_n,
            v + (force - v * self.damping_n_s_per_m) * self.velocity_per_force_m_per_n_s - v * softened,
        )
    }
}

/// φ(1) and γ(1) of `y″ = −p·y − q·y′`.
fn responses(p: f64, q: f64) -> (f64, f64) {
    // Over a part in which p·t² and q·t are at most 1/4 and 1/2 the series needs no more than 16 terms.
    let mut doublings = 0;
    let mut part = 1.0;
    while p * part * part > 0.25 || q.abs() * part > 0.5 {
        part *= 0.5;
        doublings += 1;
    }
    let (phi, gamma) = response_series(p * part * part, q * part);
    let (mut phi, mut gamma) = (phi * part, gamma * part * part);
    for _ in 0..doublings {
        (phi, gamma) = (2.0 * phi * (1.0 - p * gamma - 0.5 * q * phi), gamma * (2.0 - p * gamma) + phi * phi);
    }
    (phi, gamma)
}

/// The same by the power series `γ = Σ cₙ/n!`, `φ = γ′ = Σ cₙ/(n−1)!`, `c₂ = 1`, `cₙ₊₂ = −p·cₙ − q·cₙ₊₁`.
fn response_series(p: f64, q: f64) -> (f64, f64) {
    const TERMS: usize = 18;
    let mut terms = [(0.0, 0.0); TERMS];
    let (mut before, mut coefficient, mut factorial) = (0.0, 1.0, 1.0);
    for (index, term) in terms.iter_mut().enumerate() {
        let n = (index + 2) as f64;
        *term = (coefficient / factorial, coefficient / (factorial * n));
        factorial *= n;
        (before, coefficient) = (coefficient, -p * before - q * coefficient);
    }
    // Smallest first, so that the sum is right to the last bit or two.
    terms.iter().rev().fold((0.0, 0.0), |(phi, gamma), term| (phi + term.0, gamma + term.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ([m, b, k, T], [Φ₁₁, Φ₁₂, Γ₁, Φ₂₁, Φ₂₂, Γ₂]) from the exponential of the augmented matrix with 60 digits (mpmath,
    /// Taylor series).
    #[rustfmt::skip]
    const EXACT: &[([f64; 4], [f64; 6])] = &[
        ([0.25, 0.0, 0.0, 0.0009765625],
            [1.0, 0.0009765625, 1.9073486328125e-06, 0.0, 1.0, 0.00390625]),
        ([0.25, 10.0, 0.0, 0.0009765625],
            [1.0, 0.0009577349598643676, 1.8827540135632392e-06, 0.0, 0.9616906016054253, 0.0038309398394574703]),
        ([0.25, 0.0, 300.0, 0.0009765625],
            [0.9994278499777567, 0.0009763762461429275, 1.9071667408108974e-06, -1.1716514953715131, 0.9994278499777567, 0.00390550498457171]),
        ([0.25, 5.0, 200.0, 0.0009765625],
            [0.9996210257849469, 0.000966964576955561, 1.8948710752652037e-06, -0.7735716615644488, 0.9802817342458358, 0.003867858307822244]),
        ([0.1, 40.0, 4000.0, 0.001],
            [0.9824769036935782, 0.0008187307530779819, 4.380774076605442e-06, -32.749230123119276, 0.6549846024623855, 0.008187307530779819]),
        ([0.1, 1000.0, 1.0, 0.001],
            [0.99999909999579, 9.999538000160177e-05, 9.000042099989449e-07, -0.0009999538000160177, 4.5299979772440725e-05, 0.0009999538000160177]),
        ([0.25, 1e-12, 1e-09, 0.0009765625],
            [0.9999999999999981, 0.0009765624999999975, 1.9073486328124968e-06, -3.90624999999999e-12, 0.9999999999999942, 0.00390624999999999]),
        ([0.25, 1e-09, 1e-300, 0.0009765625],
            [1.0, 0.0009765624999980927, 1.9073486328100165e-06, -3.906249999992371e-303, 0.9999999999960938, 0.0039062499999923707]),
        ([0.001, 20.0, 100000.0, 0.001],
            [0.0004993992273873331, 4.5399929762484835e-08, 9.995006007726126e-06, -4.539992976248484, -0.00040859936786236356, 4.5399929762484834e-05]),
        ([0.1, 2.0, 10.0, 0.001],
            [0.9999503320866597, 0.000990049833749168, 4.966791334026589e-06, -0.0990049833749168, 0.9801493354116764, 0.00990049833749168]),
        ([0.5, 0.03, 10000.0, 0.015625],
            [-0.5958729916659787, 0.005673603230324807, 0.00015958729916659787, -113.47206460649615, -0.5962134078597983, 0.011347206460649614]),
        ([0.01, 1000.0, 10000.0, 0.1],
            [0.3678794430116982, 3.679162383154282e-06, 6.321205569883018e-05, -3.679162383154282, -3.679530372994246e-05, 0.0003679162383154282]),
        ([1.0, 2.0, 1.0, 0.125],
            [0.9928090154076699, 0.11031211282307443, 0.007190984592330172, -0.11031211282307443, 0.7721847897615209, 0.11031211282307443]),
        ([0.001, 50.0, 10.0, 0.03333333333333333],
            [0.9933594532349435, 1.9867268534090883e-05, 0.0006640546765056556, -0.19867268534090884, -3.973469600760156e-06, 0.019867268534090883]),
        ([80.0, 200.0, 1000.0, 5e-05],
            [0.9999999843756511, 4.9996874869803874e-05, 1.5624348937989808e-11, -0.0006249609358725484, 0.9998749921884765, 6.249609358725484e-07]),
        ([0.3, -2.0, 100.0, 0.002],
            [0.9993304349345761, 0.0020129454011838873, 6.695650654238787e-06, -0.6709818003946291, 1.0127500709424686, 0.0067098180039462905]),
    ];

    fn columns(plant: &SecondOrderPlant) -> [f64; 6] {
        let (a, b, c) = (plant.step(1.0, 0.0, 0.0), plant.step(0.0, 1.0, 0.0), plant.step(0.0, 0.0, 1.0));
        [a.0, b.0, c.0, a.1, b.1, c.1]
    }

    #[test]
    fn the_map_is_exact() {
        let mut worst: f64 = 0.0;
        for (input @ [m, b, k, period], exact) in EXACT {
            let found = columns(&SecondOrderPlant::new(*m, *b, *k, *period));
            // Each against itself; what is a difference of terms about 1, or has all but died out, against its size
            // in the undamped, unhurried case.
            let died_out = 0.01 * period;
            let scale = [1.0, died_out, 0.0, died_out * k / m, 1.0, died_out / m];
            for ((found, exact), scale) in found.into_iter().zip(exact).zip(scale) {
                let error = (found - exact).abs() / exact.abs().max(scale).max(f64::MIN_POSITIVE);
                worst = worst.max(error);
                assert!(error < 2e-15, "{input:?}: {found} instead of {exact}: {error:e}");
            }
        }
        assert!(worst < 2e-15, "{worst:e}");
    }

    #[test]
    fn a_free_mass_moves_as_in_the_textbook() {
        let (m, period) = (0.25, 1.0 / 1024.0);
        let plant = SecondOrderPlant::new(m, 0.0, 0.0, period);
        let (mut x, mut v) = (0.0, 0.0);
        for tick in 1..=4096 {
            (x, v) = plant.step(x, v, 0.5);
            let t = f64::from(tick) * period;
            // These are sums of few bits: exact.
            assert_eq!((x, v), (t * t, 2.0 * t));
        }
    }

    #[test]
    fn a_damped_oscillator_rings_as_in_the_textbook() {
        let (m, b, k, period) = (0.5, 1.0, 200.0, 1e-3);
        let plant = SecondOrderPlant::new(m, b, k, period);
        let decay: f64 = b / (2.0 * m);
        let rate = (k / m - decay * decay).sqrt();
        let (mut x, mut v) = (0.1, 0.0);
        for tick in 1..=3000 {
            (x, v) = plant.step(x, v, 0.0);
            let t = f64::from(tick) * period;
            let (sine, cosine) = (rate * t).sin_cos();
            let envelope = 0.1 * (-decay * t).exp();
            assert!((x - envelope * (cosine + decay / rate * sine)).abs() < 1e-14);
            assert!((v + envelope * (k / m) / rate * sine).abs() < 1e-13);
        }
    }

    #[test]
    fn rest_is_rest_to_the_bit() {
        for (m, b, k) in [(0.3, 7.0, 123.4), (0.01, 0.0, 1e4), (2.0, 100.0, 0.1)] {
            let plant = SecondOrderPlant::new(m, b, k, 1e-3);
            let x = 0.0317;
            assert_eq!(plant.step(x, 0.0, x * k), (x, 0.0));
        }
    }

    #[test]
    fn a_doubled_step_is_two_steps() {
        let (whole, half) =
            (SecondOrderPlant::new(0.2, 30.0, 5000.0, 0.02), SecondOrderPlant::new(0.2, 30.0, 5000.0, 0.01));
        let (x, v) = half.step(0.1, -2.0, 3.0);
        let (two, one) = (half.step(x, v, 3.0), whole.step(0.1, -2.0, 3.0));
        assert!((two.0 - one.0).abs() < 1e-16 && (two.1 - one.1).abs() < 1e-14);
    }
}
