//! What ticks tell the slow simulation.

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use cotouch_soft::MaterialPoint;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// One finger, as the slow simulation is told of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SlowContact {
    /// Which finger: counted over all users' fingers in order.
    pub slot: u8,
    /// Where it touches; `None` when it does not.
    pub anchor: Option<MaterialPoint>,
    /// The returned force on the body, N.
    pub force_n: DVec3,
    /// The finger's centre, m.
    pub centre_m: DVec3,
}

/// What goes to the simulation for one of its periods.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SlowInput {
    /// The period p of which the forces are.
    pub period: u64,
    /// All fingers that are there.
    pub contacts: ArrayVec<SlowContact, MAX_SOFT_CONTACTS>,
}
