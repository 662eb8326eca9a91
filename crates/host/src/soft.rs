//! The slow loop of a soft body: what ticks tell it, what it tells them, and the simulation itself.
//!
//! Period p of the slow simulation begins at tick k_p. When the forces that p returns are known, the tick's output has a
//! [`SlowInput`]; [`SlowLoop::step`] makes a [`SlowFrame`] of it, elsewhere and in its own time; at tick
//! k_(p+1+d), d = `local_model.result_delay_periods`, [`HostModel::take_frame`] brings it into use. Before the first tick
//! it takes [`SlowLoop::rest_frame`] over; without any frame there is no force.
//!
//! [`HostModel::take_frame`]: crate::model::HostModel::take_frame

mod contacts;
mod estimate;
mod present;
mod returned;
mod slow_loop;
mod stiffness;

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use cotouch_soft::{MaterialPoint, SoftEnergy};
use cotouch_world::local::LocalContact;
use cotouch_world::proxy::{MeshSurface, SurfaceError};
use glam::DVec3;
use serde::{Deserialize, Serialize};

pub(crate) use contacts::{SoftContacts, force_on_fingers};
pub use slow_loop::SlowLoop;

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
    /// p.
    pub period: u64,
    /// All fingers that are there.
    pub contacts: ArrayVec<SlowContact, MAX_SOFT_CONTACTS>,
}

/// The body after a step, in the form in which ticks use it. Never changes once made.
#[derive(Clone, Debug)]
pub struct SlowFrame {
    /// The period whose forces led here; `None`: the body before all of them.
    pub period: Option<u64>,
    /// Where the nodes are, m.
    pub positions_m: Vec<DVec3>,
    /// The surface there.
    pub surface: MeshSurface,
    /// The least K_o of all fingers that touch or are near, N/m.
    pub ko_n_per_m: f64,
    /// K_o of every finger slot, N/m: see [`SlowLoop`].
    pub ko_of_slots_n_per_m: [f64; MAX_SOFT_CONTACTS],
    /// The slots in `compliance`.
    pub slots: ArrayVec<u8, MAX_SOFT_CONTACTS>,
    /// Joint compliance of these, m/N: row-major, 3 rows and columns each.
    pub compliance: Vec<f64>,
    /// The forces on the body with which it was stepped, one a slot in `slots`, N.
    pub forces_n: ArrayVec<DVec3, MAX_SOFT_CONTACTS>,
    /// Von Mises stress at each node, Pa.
    pub stress_pa: Vec<f32>,
    /// Energy of the body.
    pub energy: SoftEnergy,
}

impl SlowFrame {
    /// The same with the nodes elsewhere (m), all of it seen as if it had always been there: for who varies a state.
    ///
    /// # Errors
    /// When there are more or fewer nodes, or one is not finite.
    pub fn moved_to(&self, positions_m: Vec<DVec3>) -> Result<Self, SurfaceError> {
        let mut frame = self.clone();
        let generation = frame.surface.generation();
        frame.surface.deform(&positions_m)?;
        frame.surface.forget_motion(generation);
        frame.positions_m = positions_m;
        Ok(frame)
    }
}

/// What a host's state holds of a soft body. The frames come from outside, as samples do, and are not saved with it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SoftHostState {
    /// One entry a finger slot.
    pub contacts: Vec<LocalContact>,
    /// Sum of the returned forces of the present period so far, one entry a finger slot, N.
    pub returned_n: Vec<DVec3>,
    /// Ticks in these sums.
    pub returned_ticks: u32,
    /// The period that they are of.
    pub period: u64,
    /// Whether the simulation was told of that period.
    pub told: bool,
    /// The tick at which the frame in use was taken over.
    pub taken_at: u64,
    /// K_o of every finger slot before and after the last take-over, N/m. Of a finger that touches it only falls.
    pub ko_n_per_m: Vec<[f64; 2]>,
    /// The frame in use.
    #[serde(skip)]
    pub frame: Option<Arc<SlowFrame>>,
    /// The frame before it.
    #[serde(skip)]
    pub previous: Option<Arc<SlowFrame>>,
}

impl PartialEq for SoftHostState {
    fn eq(&self, other: &Self) -> bool {
        let period = |frame: &Option<Arc<SlowFrame>>| frame.as_ref().map(|frame| frame.period);
        self.contacts == other.contacts
            && self.returned_n == other.returned_n
            && self.returned_ticks == other.returned_ticks
            && self.period == other.period
            && self.told == other.told
            && self.taken_at == other.taken_at
            && self.ko_n_per_m == other.ko_n_per_m
            && period(&self.frame) == period(&other.frame)
            && period(&self.previous) == period(&other.previous)
    }
}

impl SoftHostState {
    /// Before the first tick, with so many finger slots.
    pub(crate) fn new(slots: usize) -> Self {
        Self {
            contacts: vec![LocalContact::default(); slots],
            returned_n: vec![DVec3::ZERO; slots],
            ko_n_per_m: vec![[0.0; 2]; slots],
            ..Self::default()
        }
    }
}
