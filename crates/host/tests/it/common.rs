//! A host with a soft body, ticked with its slow simulation in step.

use std::collections::VecDeque;
use std::sync::Arc;

use cotouch_host::{HostModel, HostState, SlowFrame, SlowLoop, TickOutput};
use cotouch_scene::geometry::{Reading, Readings};
use cotouch_scene::names::HostIndex;
use cotouch_scene::{Override, Scene, parse};
use glam::DVec3;

/// The paper's spring: K_o = 200 N/m, 1000 Hz and 20 Hz, so that N = 50. The surface is at x = 0, hands come from −x.
pub(crate) const SPRING: &str = r#"
[session]
users = 1
[rates]
control_hz = 1000
network_hz = 100
simulation_hz = 20
[hand]
mass_kg = 0.1
finger_radius_m = 0.005
[soft]
model = "mass-spring"
quasi_static = true
[soft.mesh]
generator = "spring"
stiffness_n_per_m = 200
[local_model]
kind = "p"
stiffness_ratio = 0.5
result_delay_periods = 0
friction = 0.5
[[user]]
name = "anna"
[[user.finger]]
position_m = [-0.005, 0, 0]
"#;

/// A block of 4 × 4 × 2 cells of 20 mm, fixed at z = 0; its top is at z = 0.04.
pub(crate) const BLOCK: &str = r#"
space = "space"
[session]
users = 2
[rates]
control_hz = 1000
network_hz = 100
simulation_hz = 50
[hand]
mass_kg = 0.1
finger_radius_m = 0.005
[soft]
model = "mass-spring"
poisson_ratio = 0.25
young_pa = 20000
fixed = [{ from_m = [-1, -1, -1], to_m = [1, 1, 0] }]
[soft.mesh]
generator = "block"
size_m = [0.08, 0.08, 0.04]
cells = [4, 4, 2]
[local_model]
kind = "p"
stiffness_ratio = 0.5
friction = 0.5
[[user]]
name = "anna"
[[user.finger]]
position_m = [0.025, 0.042, 0.06]
[[user]]
name = "ben"
[[user.finger]]
position_m = [0.055, 0.038, 0.06]
"#;

pub(crate) fn scene(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<Override> = overrides.iter().map(|text| text.parse().unwrap()).collect();
    parse(text, "test", None, &overrides).unwrap_or_else(|errors| panic!("{errors}"))
}

/// One host and its slow simulation, without a network.
#[derive(Clone)]
pub(crate) struct Rig {
    pub(crate) model: HostModel,
    pub(crate) state: HostState,
    pub(crate) slow: SlowLoop,
    pub(crate) tick: u64,
    /// Frames that are not due.
    pub(crate) frames: VecDeque<Arc<SlowFrame>>,
    pub(crate) output: TickOutput,
}

impl Rig {
    pub(crate) fn new(scene: &Scene) -> Self {
        let model = HostModel::new(scene, HostIndex::FIRST);
        let mut state = HostState::new(&model);
        let slow = SlowLoop::new(scene).unwrap();
        assert!(model.take_frame(&mut state, 0, slow.rest_frame()).is_none());
        Self { model, state, slow, tick: 0, frames: VecDeque::new(), output: TickOutput::default() }
    }

    /// One tick with the own finger there, at rest. The force on it, N.
    pub(crate) fn tick(&mut self, finger: DVec3) -> DVec3 {
        self.tick_with([Reading::point(finger, DVec3::ZERO)].into_iter().collect())
    }

    pub(crate) fn tick_with(&mut self, readings: Readings) -> DVec3 {
        self.begin();
        self.finish(&readings)
    }

    /// Takes over what is due.
    pub(crate) fn begin(&mut self) {
        if let Some(period) = self.model.frame_due(self.tick) {
            let frame = self.frames.pop_front().unwrap();
            assert_eq!(frame.period, Some(period));
            self.model.take_frame(&mut self.state, self.tick, frame);
        }
    }

    pub(crate) fn finish(&mut self, readings: &Readings) -> DVec3 {
        self.model.tick_into(&mut self.state, self.tick, readings, &mut self.output);
        if let Some(input) = &self.output.slow {
            self.frames.push_back(self.slow.step(input));
        }
        self.tick += 1;
        self.output.device[0].force
    }

    /// Where the frame in use has the anchor of a slot, m.
    pub(crate) fn anchor(&self, slot: usize) -> DVec3 {
        let soft = &self.state.soft;
        soft.contacts[slot].anchor.at(&soft.frame.as_ref().unwrap().positions_m)
    }
}
