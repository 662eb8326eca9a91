//! The slow simulation of one host: periods in, frames out.

use std::sync::Arc;

use arrayvec::ArrayVec;
use cotouch_scene::limits::MAX_SOFT_CONTACTS;
use cotouch_scene::scene::Scene;
use cotouch_soft::{PointForce, SoftBody, SoftError, soft_body};
use cotouch_world::MeshSurface;
use glam::DVec3;

use super::frame::SlowFrame;
use super::input::SlowInput;
use super::stiffness::ContactStiffness;

/// Most frames that are kept to be used again: as many as ticks, displays and recorders may hold at a time.
const MAX_KEPT: usize = 16;

/// The slow simulation of one host, and what it says of the body's stiffness at every finger. A clone is independent.
pub struct SlowLoop {
    body: Box<dyn SoftBody>,
    /// The surface with its history: every frame has a copy.
    surface: MeshSurface,
    stiffness: ContactStiffness,
    rest: Arc<SlowFrame>,
    /// Frames that were handed out. They are kept here so that a tick that lets go of one frees no memory.
    frames: Vec<Arc<SlowFrame>>,
}

impl Clone for SlowLoop {
    fn clone(&self) -> Self {
        Self {
            body: self.body.clone(),
            surface: self.surface.clone(),
            stiffness: self.stiffness.clone(),
            rest: self.rest.clone(),
            frames: Vec::new(),
        }
    }
}

impl SlowLoop {
    /// The body of `scene` at rest; under gravity, where that has let it sag to.
    ///
    /// # Errors
    /// As [`cotouch_soft::soft_body`]; and when the body does not come to rest under gravity.
    pub fn new(scene: &Scene) -> Result<Self, SoftError> {
        let mut body = soft_body(scene)?;
        if scene.gravity_m_per_s2 != DVec3::ZERO {
            body.settle(&[])?;
        }
        Self::with_body(scene, body)
    }

    /// The same with a body that was made elsewhere, whatever its technique.
    ///
    /// # Errors
    /// When its surface is none.
    pub fn with_body(scene: &Scene, body: Box<dyn SoftBody>) -> Result<Self, SoftError> {
        let unsuitable = |error| SoftError::Unsuitable(format!("the soft object's surface: {error}"));
        let surface =
            MeshSurface::new(body.state().positions_m.clone(), body.triangles()).map_err(unsuitable)?;
        let stiffness = ContactStiffness::new(scene, &*body, &surface);
        let mut rest = SlowFrame {
            period: None,
            positions_m: body.state().positions_m.clone(),
            surface: surface.clone(),
            ko_n_per_m: stiffness.least_ko_n_per_m(),
            slot_ko_n_per_m: *stiffness.slot_ko_n_per_m(),
            slots: ArrayVec::new(),
            compliance: Vec::new(),
            forces_n: ArrayVec::new(),
            stress_pa: Vec::new(),
            energy: body.energy(),
        };
        body.stress_pa(&mut rest.stress_pa);
        stiffness.tell(&mut rest, &SlowInput::default());
        Ok(Self { body, surface, stiffness, rest: Arc::new(rest), frames: Vec::new() })
    }

    /// The body before its first step: in use from the start.
    #[must_use]
    pub fn rest_frame(&self) -> Arc<SlowFrame> {
        self.rest.clone()
    }

    /// One period. Not for the haptic tick: it takes as long as it takes, and may allocate.
    pub fn step(&mut self, input: &SlowInput) -> Arc<SlowFrame> {
        let mut forces = ArrayVec::<PointForce, MAX_SOFT_CONTACTS>::new();
        let acting = input.contacts.iter().filter(|contact| contact.force_n != DVec3::ZERO);
        forces.extend(
            acting.filter_map(|contact| Some(PointForce { at: contact.anchor?, force_n: contact.force_n })),
        );
        self.body.step(&forces);
        // A body is always finite and keeps its nodes.
        let _ = self.surface.deform(&self.body.state().positions_m);
        self.stiffness.follow(&*self.body, &self.surface, input);
        self.frame(input)
    }

    /// The body that is simulated.
    #[must_use]
    pub fn body(&self) -> &dyn SoftBody {
        &*self.body
    }

    /// The body, to change its state.
    pub fn body_mut(&mut self) -> &mut dyn SoftBody {
        &mut *self.body
    }

    /// What there is to tell after a step: in a frame that nobody holds any more, if there is one.
    fn frame(&mut self, input: &SlowInput) -> Arc<SlowFrame> {
        let at = self.frames.iter_mut().position(|frame| Arc::get_mut(frame).is_some());
        let mut frame = at.map_or_else(|| Arc::new((*self.rest).clone()), |at| self.frames.swap_remove(at));
        if let Some(frame) = Arc::get_mut(&mut frame) {
            frame.period = Some(input.period);
            frame.positions_m.clone_from(&self.body.state().positions_m);
            frame.surface.copy_from(&self.surface);
            frame.ko_n_per_m = self.stiffness.least_ko_n_per_m();
            frame.slot_ko_n_per_m = *self.stiffness.slot_ko_n_per_m();
            frame.energy = self.body.energy();
            self.body.stress_pa(&mut frame.stress_pa);
            self.stiffness.tell(frame, input);
        }
        if self.frames.len() < MAX_KEPT {
            self.frames.push(frame.clone());
        }
        frame
    }
}
