//! What haptics knows of a soft body.

use glam::DVec3;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::linear::LinearBody;
use crate::point::{MaterialPoint, PointForce};

/// Everything about a soft body that changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoftState {
    /// Of every node, fixed ones included, m.
    pub positions_m: Vec<DVec3>,
    /// Of every node, m/s; zero in a quasi-static body.
    pub velocities_m_per_s: Vec<DVec3>,
}

/// What energy a body has, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SoftEnergy {
    /// Energy of deformation, counted from rest, J.
    pub elastic_j: f64,
    /// Energy of motion, J.
    pub kinetic_j: f64,
    /// Energy in gravity, counted from rest, J.
    pub potential_j: f64,
}

impl SoftEnergy {
    /// The sum of all three, J.
    #[must_use]
    pub fn total_j(&self) -> f64 {
        self.elastic_j + self.kinetic_j + self.potential_j
    }
}

/// Why there is no answer about a soft body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoftError {
    /// A static equilibrium that iteration does not find.
    #[error("no equilibrium was found: {0}")]
    NoEquilibrium(String),
    /// A point that is not in the body.
    #[error("the point ({}, {}, {}) m is {distance_m} m outside of the body", .point_m.x, .point_m.y, .point_m.z)]
    Outside {
        /// Where the point is, m.
        point_m: DVec3,
        /// How far it is from the nearest point of the body, m.
        distance_m: f64,
    },
    /// Material or mesh with which this technique cannot work.
    #[error("{0}")]
    Unsuitable(String),
}

/// A soft body, whatever the technique of its simulation. A clone is independent; two that were stepped alike are equal.
pub trait SoftBody: Send + Sync {
    /// Where the nodes rest, m.
    fn rest_m(&self) -> &[DVec3];

    /// The surface: three nodes each, counter-clockwise seen from outside.
    fn triangles(&self) -> &[[u32; 3]];

    /// Where the nodes are and how they move.
    fn state(&self) -> &SoftState;

    /// Puts the body into another state (of as many nodes; fixed nodes stay where they rest).
    fn set_state(&mut self, state: &SoftState);

    /// One period of the simulation under `forces` (gravity comes on top). Never fails: inverted elements recover, and a
    /// state that is not finite is replaced by the last one at rest in it.
    fn step(&mut self, forces: &[PointForce]);

    /// The static equilibrium under `forces` and gravity, from the present state.
    ///
    /// # Errors
    /// When iteration does not converge.
    fn settle(&mut self, forces: &[PointForce]) -> Result<(), SoftError>;

    /// The joint static compliance of `points` about rest, m/N, 3m × 3m: displacement of point i for a unit force at point j.
    /// `None` from a technique that cannot tell.
    fn compliance(&self, points: &[MaterialPoint]) -> Option<DMatrix<f64>>;

    /// The step's exact linearisation about the present state, for constant forces in whose equilibrium it is.
    fn linear(&self) -> Option<LinearBody>;

    /// Energy in the present state.
    fn energy(&self) -> SoftEnergy;

    /// Von Mises stress at every node (of a spring network: tension per area, an estimate), Pa; fills `stress`.
    fn stress_pa(&self, stress: &mut Vec<f32>);

    /// Length of a period, s.
    fn period_s(&self) -> f64;

    /// The same body once more.
    fn boxed_clone(&self) -> Box<dyn SoftBody>;
}

impl Clone for Box<dyn SoftBody> {
    fn clone(&self) -> Self {
        self.boxed_clone()
    }
}
