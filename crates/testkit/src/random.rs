//! Random numbers that are the same in every run.

/// A linear congruential generator (Knuth's MMIX).
pub struct Random(u64);

impl Random {
    /// Begins at a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In 0 to 1, 1 excluded, uniformly.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between two positive numbers, their logarithm uniformly.
    pub fn log_uniform(&mut self, least: f64, largest: f64) -> f64 {
        least * (largest / least).powf(self.unit())
    }

    /// One of the first `count` whole numbers, uniformly.
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}
