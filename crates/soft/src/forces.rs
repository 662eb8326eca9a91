//! Forces on nodes that come of gravity and of forces on points of the material.

use glam::DVec3;
use nalgebra::DMatrix;

use crate::factor::Symbolic;
use crate::point::{MaterialPoint, PointForce};

/// Gravity and the points' forces on every node, N. Forces that are not finite count as none.
pub(crate) fn external_forces(mass_kg: &[f64], gravity_m_per_s2: DVec3, points: &[PointForce]) -> Vec<DVec3> {
    let mut forces: Vec<DVec3> = mass_kg.iter().map(|mass| *mass * gravity_m_per_s2).collect();
    for point in points.iter().filter(|point| point.force_n.is_finite()) {
        for (&node, weight) in point.at.nodes.iter().zip(point.at.weights) {
            if let Some(force) = forces.get_mut(node as usize) {
                *force += weight * point.force_n;
            }
        }
    }
    forces
}

/// The unit forces of every point along x, y and z, in the free coordinates: three columns a point.
pub(crate) fn unit_forces(symbolic: &Symbolic, points: &[MaterialPoint]) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(symbolic.coordinates(), 3 * points.len());
    for (index, point) in points.iter().enumerate() {
        for (&node, weight) in point.nodes.iter().zip(point.weights) {
            let Some(place) = symbolic.position(node) else { continue };
            (0..3).for_each(|axis| columns[(3 * place + axis, 3 * index + axis)] += weight);
        }
    }
    columns
}
