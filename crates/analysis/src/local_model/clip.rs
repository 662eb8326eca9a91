//! Convex polygons, cut by straight lines.

/// `constant + x·points.0 + y·points.1 ≥ 0`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfPlane {
    pub(super) constant: f64,
    pub(super) x: f64,
    pub(super) y: f64,
}

impl HalfPlane {
    /// The half plane where an affine function is not negative.
    pub(super) fn where_not_negative(affine: impl Fn(f64, f64) -> f64) -> Self {
        let constant = affine(0.0, 0.0);
        Self { constant, x: affine(1.0, 0.0) - constant, y: affine(0.0, 1.0) - constant }
    }

    fn value(self, [x, y]: [f64; 2]) -> f64 {
        self.constant + self.x * x + self.y * y
    }
}

/// What a half plane leaves of a convex polygon; its corners in order (Sutherland & Hodgman 1974).
pub(super) fn clip(polygon: &[[f64; 2]], half_plane: HalfPlane) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, &corner) in polygon.iter().enumerate() {
        let next = polygon[(index + 1) % polygon.len()];
        let (here, there) = (half_plane.value(corner), half_plane.value(next));
        if here >= 0.0 {
            kept.push(corner);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let share = here / (here - there);
            kept.push([0, 1].map(|axis| corner[axis] + share * (next[axis] - corner[axis])));
        }
    }
    kept.dedup();
    kept
}

/// Of a polygon whose corners are in order.
pub(super) fn area(polygon: &[[f64; 2]]) -> f64 {
    let twice: f64 = polygon
        .iter()
        .zip(polygon.iter().cycle().skip(1))
        .map(|(one, next)| one[0] * next[1] - next[0] * one[1])
        .sum();
    0.5 * twice.abs()
}
