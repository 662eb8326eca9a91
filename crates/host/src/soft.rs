//! The slow loop of a soft body: what ticks tell it, what it tells them, and the simulation itself.
//!
//! Period p of the slow simulation begins at tick k_p. When the forces that p returns are known, the tick's output has a
//! [`SlowInput`]; [`SlowLoop::step`] makes a [`SlowFrame`] of it, elsewhere and in its own time; at tick
//! k_(p+1+d), d = `local_model.result_delay_periods`, [`HostModel::take_frame`] brings it into use.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_scene::scene::Scene;
use cotouch_soft::{MaterialPoint, SoftBody, SoftEnergy, SoftError};
use cotouch_world::local::LocalContact;
use cotouch_world::proxy::MeshSurface;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::model::HostModel;
use crate::state::HostState;

/// Most fingers in a scene with a soft body, of all users together.
pub const MAX_SOFT_CONTACTS: usize = 16;

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
    /// K_o: 1 over the largest eigenvalue of the joint compliance of all fingers that touch or are near, N/m.
    pub ko_n_per_m: f64,
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

/// The slow simulation of one host. A clone is independent.
#[derive(Clone)]
pub struct SlowLoop {
    body: Box<dyn SoftBody>,
    rest: Arc<SlowFrame>,
}

impl SlowLoop {
    /// The body of `scene` at rest.
    ///
    /// # Errors
    /// As [`cotouch_soft::soft_body`].
    pub fn new(scene: &Scene) -> Result<Self, SoftError> {
        let _ = scene;
        todo!()
    }

    /// The body before its first step: in use from the start.
    #[must_use]
    pub fn rest_frame(&self) -> Arc<SlowFrame> {
        self.rest.clone()
    }

    /// One period. Not for the haptic tick: it takes as long as it takes, and may allocate.
    pub fn step(&mut self, input: &SlowInput) -> Arc<SlowFrame> {
        let _ = input;
        todo!()
    }

    /// The body.
    #[must_use]
    pub fn body(&self) -> &dyn SoftBody {
        &*self.body
    }

    /// The body, to change its state.
    pub fn body_mut(&mut self) -> &mut dyn SoftBody {
        &mut *self.body
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
    /// The tick at which the frame in use was taken over.
    pub taken_at: u64,
    /// K_o before and after the last take-over, N/m.
    pub ko_n_per_m: [f64; 2],
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
            && self.taken_at == other.taken_at
            && self.ko_n_per_m == other.ko_n_per_m
            && period(&self.frame) == period(&other.frame)
            && period(&self.previous) == period(&other.previous)
    }
}

impl HostModel {
    /// Whether this host simulates a soft body.
    #[must_use]
    pub fn has_soft_body(&self) -> bool {
        todo!()
    }

    /// The period whose frame is to come into use at `tick`, if one is.
    #[must_use]
    pub fn frame_due(&self, tick: u64) -> Option<u64> {
        let _ = tick;
        todo!()
    }

    /// Brings a frame into use at `tick`, before the tick; gives back what is not needed any more. No allocation.
    pub fn take_frame(
        &self,
        state: &mut HostState,
        tick: u64,
        frame: Arc<SlowFrame>,
    ) -> Option<Arc<SlowFrame>> {
        let _ = (state, tick, frame);
        todo!()
    }
}
