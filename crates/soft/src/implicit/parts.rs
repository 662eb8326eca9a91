//! What a body is made of.

use glam::DVec3;

use crate::enclosed::Enclosed;

/// What a body that an [`Elastic`](crate::elastic::Elastic) holds together is made of.
#[derive(Clone)]
pub(crate) struct Parts<E> {
    pub(crate) elastic: E,
    /// The volume that it keeps, if it does.
    pub(crate) enclosed: Option<Enclosed>,
    pub(crate) rest_m: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) mass_kg: Vec<f64>,
    pub(crate) fixed: Vec<bool>,
    /// Pairs of nodes that act on each other.
    pub(crate) pairs: Vec<[u32; 2]>,
}
