//! A box about the origin. Faces are counted +x, −x, +y, −y, +z, −z.

use glam::DVec3;

use crate::convex::{Convex, Over};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Cuboid {
    /// Half of each edge, m.
    pub(crate) half: DVec3,
}

impl Cuboid {
    /// The face across an axis on the side of `coordinate`.
    fn across(axis: usize, coordinate: f64) -> u32 {
        2 * axis as u32 + u32::from(coordinate < 0.0)
    }
}

impl Convex for Cuboid {
    fn faces(&self) -> u32 {
        6
    }

    fn face(&self, face: u32) -> (DVec3, f64) {
        let axis = (face / 2) as usize;
        let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
        (sign * DVec3::AXES[axis], self.half[axis])
    }

    fn over(&self, face: u32, point: DVec3) -> Over {
        let across = (face / 2) as usize;
        let past = |axis: &usize| *axis != across && point[*axis].abs() > self.half[*axis];
        let farthest = |axis: &usize, other: &usize| {
            f64::total_cmp(&self.beyond(*axis, point), &self.beyond(*other, point))
        };
        match (0..3).filter(past).max_by(farthest) {
            None => Over::Within,
            Some(axis) => Over::Past(Self::across(axis, point[axis])),
        }
    }

    fn closest_from_outside(&self, centre: DVec3) -> Option<(DVec3, f64, DVec3)> {
        let point = centre.clamp(-self.half, self.half);
        let away = centre - point;
        let axes_away = (0..3).filter(|&axis| away[axis] != 0.0).count();
        if axes_away > 1 {
            let distance = away.length();
            return Some((away / distance, distance, point));
        }
        let axis = (0..3).find(|&axis| centre[axis].abs() >= self.half[axis])?;
        let axis = (0..3).find(|&axis| away[axis] != 0.0).unwrap_or(axis);
        Some((DVec3::AXES[axis] * centre[axis].signum(), away[axis].abs(), point))
    }
}

impl Cuboid {
    fn beyond(&self, axis: usize, point: DVec3) -> f64 {
        point[axis].abs() - self.half[axis]
    }
}
