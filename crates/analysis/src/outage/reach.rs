//! How far a motion or a force can be driven by pushes of which each is bounded.
//!
//! `y = Σ_j G_j·p_j` with one push p_j of at most 1 a finger: the largest |y| is `max over |u| = 1 of Σ_j |G_jᵀ·u|`, since for a
//! direction u the best push is along `G_jᵀ·u`. Along one axis that is `Σ_j |g_j|`. Otherwise the maximum of this convex function
//! is climbed to from several directions by `u ← Σ_j G_j·p_j(u)`, on which |y| never goes down (the generalised power method: Journée,
//! Nesterov, Richtárik & Sepulchre 2010, §3).

use glam::DVec3;

/// Steps of a climb.
const STEPS: usize = 500;
/// A climb that gains less than this share is at its top.
const ACCURACY: f64 = 1e-12;

/// `[G_1 … G_n]`: a row for each axis of y, and as many columns for each push as there are axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains<'a> {
    rows: [&'a [f64]; 3],
    axes: usize,
}

/// The largest |y|, reached by the best pushes for a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) size: f64,
    pub(super) direction: DVec3,
}

impl<'a> Gains<'a> {
    /// `row` gives the row of each of so many axes, 1 to 3.
    pub(super) fn new(axes: usize, row: impl Fn(usize) -> &'a [f64]) -> Self {
        let rows = std::array::from_fn(|axis| if axis < axes { row(axis) } else { &[][..] });
        Self { rows, axes }
    }

    fn pushes(&self) -> usize {
        self.rows[0].len() / self.axes
    }

    fn element(&self, axis: usize, push: usize, along: usize) -> f64 {
        self.rows[axis][push * self.axes + along]
    }

    fn squares_of(&self, push: usize) -> f64 {
        let columns = push * self.axes..(push + 1) * self.axes;
        self.rows[..self.axes].iter().flat_map(|row| &row[columns.clone()]).map(|gain| gain * gain).sum()
    }

    /// No smaller than the reach; the reach itself where there is one axis.
    pub(super) fn bound(&self) -> f64 {
        (0..self.pushes()).map(|push| self.squares_of(push).sqrt()).sum()
    }

    /// Of |y| where every push has a random direction and a mean square of 1, independent of all others.
    pub(super) fn mean_square(&self) -> f64 {
        (0..self.pushes()).map(|push| self.squares_of(push)).sum::<f64>() / self.axes as f64
    }

    /// `G_jᵀ·u`.
    fn answer(&self, push: usize, u: DVec3) -> DVec3 {
        let mut answer = DVec3::ZERO;
        for along in 0..self.axes {
            answer[along] = (0..self.axes).map(|axis| self.element(axis, push, along) * u[axis]).sum();
        }
        answer
    }

    /// Every push that drives y farthest along u.
    pub(super) fn best_pushes(&self, u: DVec3) -> Vec<DVec3> {
        (0..self.pushes()).map(|push| self.answer(push, u).normalize_or_zero()).collect()
    }

    pub(super) fn reach(&self) -> Reach {
        let starts = (0..self.axes).map(|axis| DVec3::AXES[axis]);
        let diagonals = (1..1 << self.axes).map(|signs: usize| {
            let sign = |axis: usize| {
                if axis < self.axes { 1.0 - 2.0 * f64::from((signs >> axis & 1) as u8) } else { 0.0 }
            };
            DVec3::new(sign(0), sign(1), sign(2)).normalize()
        });
        let tops = starts.chain(diagonals).map(|start| self.climb(start));
        let nowhere = Reach { size: 0.0, direction: DVec3::X };
        tops.fold(nowhere, |best, top| if top.size > best.size { top } else { best })
    }

    fn climb(&self, start: DVec3) -> Reach {
        let mut top = Reach { size: 0.0, direction: start };
        let mut direction = start;
        for _ in 0..STEPS {
            let driven = self.driven_by(&self.best_pushes(direction));
            let size = driven.length();
            if size <= top.size * (1.0 + ACCURACY) {
                break;
            }
            top = Reach { size, direction };
            direction = driven / size;
        }
        top
    }

    /// y.
    fn driven_by(&self, pushes: &[DVec3]) -> DVec3 {
        let mut y = DVec3::ZERO;
        for axis in 0..self.axes {
            let by = |(push, p): (usize, &DVec3)| -> f64 {
                (0..self.axes).map(|along| self.element(axis, push, along) * p[along]).sum()
            };
            y[axis] = pushes.iter().enumerate().map(by).sum();
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotouch_testkit::Random;

    #[test]
    fn along_one_axis_sizes_add_up() {
        let row = [2.0, -3.0, 0.5];
        let gains = Gains::new(1, |_| &row);
        assert_eq!((gains.bound(), gains.reach().size, gains.mean_square()), (5.5, 5.5, 13.25));
        assert_eq!(gains.best_pushes(DVec3::X), [DVec3::X, -DVec3::X, DVec3::X]);
    }

    #[test]
    fn no_pushes_drive_farther_than_the_reach_and_the_best_ones_drive_so_far() {
        let mut random = Random::new(5);
        let mut unit = |axes: usize| {
            let mut component = |axis: usize| if axis < axes { 2.0 * random.unit() - 1.0 } else { 0.0 };
            DVec3::new(component(0), component(1), component(2)).normalize()
        };
        for axes in [2, 3] {
            for _ in 0..20 {
                let rows: Vec<Vec<f64>> = (0..axes)
                    .map(|_| (0..4).flat_map(|_| unit(axes).to_array()[..axes].to_vec()).collect())
                    .collect();
                let gains = Gains::new(axes, |axis| &rows[axis]);
                let driven = |pushes: &[DVec3]| {
                    let along = |axis: usize| -> f64 {
                        let pushes = pushes.iter().flat_map(|push| push.to_array()[..axes].to_vec());
                        rows[axis].iter().zip(pushes).map(|(gain, push)| gain * push).sum()
                    };
                    (0..axes).map(along).map(|y| y * y).sum::<f64>().sqrt()
                };
                let Reach { size, direction } = gains.reach();
                assert!((driven(&gains.best_pushes(direction)) / size - 1.0).abs() < 1e-9);
                assert!(size <= gains.bound() * (1.0 + 1e-12));
                for _ in 0..200 {
                    let pushes: Vec<_> = (0..4).map(|_| unit(axes)).collect();
                    assert!(driven(&pushes) <= size * (1.0 + 1e-6), "{axes}: {size}");
                    let direction = unit(axes);
                    assert!(driven(&gains.best_pushes(direction)) <= size * (1.0 + 1e-6), "{axes}: {size}");
                }
            }
        }
    }
}
