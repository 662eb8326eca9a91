//! What a coordination scheme is asked, whichever it is.

use std::fmt;

use glam::{DQuat, DVec3};
use nalgebra::DMatrix;

use crate::coupler::{Stretch, rotation_vector};
use crate::linear_block::LinearBlock;
use crate::rigid::BodyState;

/// Stiffness and damping of one kind of channel: N/m and N·s/m for translation, N·m/rad and N·m·s/rad for rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CouplingGains {
    /// k_o.
    pub stiffness: f64,
    /// b_o.
    pub damping: f64,
}

impl CouplingGains {
    /// The force (N, N·m) that draws the own copy to the other: Fotoohi Ghiam 2006, (4.28)–(4.29).
    #[must_use]
    pub fn force(self, apart: Stretch) -> DVec3 {
        self.stiffness * apart.position + self.damping * apart.velocity
    }

    /// The same as a block without memory.
    #[must_use]
    pub fn block(self) -> LinearBlock {
        LinearBlock::gain(DMatrix::from_row_slice(1, 4, &[self.stiffness, self.damping, 0.0, 0.0]))
    }
}

/// How many vectors a scheme has for one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SchemeSize {
    /// Remembered from tick to tick, at most [`MAX_CHANNEL_MEMORY`](cotouch_scene::limits::MAX_CHANNEL_MEMORY).
    pub tick_memory: usize,
    /// Remembered from network step to network step, at most [`MAX_CHANNEL_MEMORY`](cotouch_scene::limits::MAX_CHANNEL_MEMORY).
    pub step_memory: usize,
    /// Added to every sample, in one entry a body and peer for which `cotouch_scene`'s check of a scene's entries must leave
    /// room; at most [`MAX_CHANNEL_VECTORS`](cotouch_scene::limits::MAX_CHANNEL_VECTORS).
    pub sent: usize,
}

/// The own copy's motion in the world's frame, as one channel sees it.
#[derive(Clone, Copy, Debug)]
pub enum OwnMotion<'a> {
    /// Of its centre of mass.
    Translation(&'a BodyState),
    /// Of its orientation.
    Rotation {
        /// The copy.
        body: &'a BodyState,
        /// Its orientation at the scene's start.
        start: DQuat,
    },
}

impl OwnMotion<'_> {
    /// Position of the centre of mass, m; or the rotation vector from the orientation at the start, rad.
    #[must_use]
    pub fn position(&self) -> DVec3 {
        match *self {
            Self::Translation(body) => body.pose.position,
            Self::Rotation { body, start } => rotation_vector(body.pose.orientation * start.conjugate()),
        }
    }

    /// Velocity of the centre of mass, m/s; or angular velocity, rad/s.
    #[must_use]
    pub fn velocity(&self) -> DVec3 {
        match self {
            Self::Translation(body) => body.twist.linear,
            Self::Rotation { body, .. } => body.twist.angular,
        }
    }
}

/// What a scheme knows of one channel at a tick.
#[derive(Clone, Copy, Debug)]
pub struct TickMotion<'a> {
    /// From the own copy to the held one, m and m/s; or rad and rad/s.
    pub apart: Stretch,
    /// The own copy.
    pub own: OwnMotion<'a>,
    /// What the peer's scheme added to the held sample; zeros where that had nothing for this channel.
    pub received: &'a [DVec3],
}

/// The inputs of [`Scheme::tick_block`]: in this order, then a number for every vector received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TickInput {
    /// Of [`TickMotion::apart`].
    ApartPosition,
    /// Of [`TickMotion::apart`].
    ApartVelocity,
    /// [`OwnMotion::position`].
    OwnPosition,
    /// [`OwnMotion::velocity`].
    OwnVelocity,
}

/// The inputs of [`Scheme::step_block`]: in this order, then a number for every vector of tick memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepInput {
    /// [`OwnMotion::position`].
    OwnPosition,
    /// [`OwnMotion::velocity`].
    OwnVelocity,
}

/// One end of a channel. All of it is constant; what changes is in the memories, which begin as zeros, and do so again
/// when a peer has gone.
///
/// Nothing here allocates but the blocks, or fails; the work is bounded.
pub trait Scheme: fmt::Debug + Send + Sync {
    /// How many vectors it remembers and sends; none unless it says so.
    fn size(&self) -> SchemeSize {
        SchemeSize::default()
    }

    /// How much of the force counts while so many peers are there, those that fade in or out by their share.
    fn weight(&self, _present_peers: f64) -> f64 {
        1.0
    }

    /// The force on the own copy (N, N·m) at a tick, and its memory one tick on.
    fn tick(&self, memory: &mut [DVec3], at: &TickMotion<'_>) -> DVec3;

    /// What goes into the sample of this network step, before anything is received at it, and its memory one step on;
    /// `ticks` is the memory of ticks. Nothing unless it says so.
    fn network_step(
        &self,
        _ticks: &[DVec3],
        _memory: &mut [DVec3],
        _own: &OwnMotion<'_>,
        _sent: &mut [DVec3],
    ) {
    }

    /// [`tick`](Self::tick) along one axis: its states are the memory, its inputs [`TickInput`] and the vectors received,
    /// its output the force.
    fn tick_block(&self) -> LinearBlock;

    /// [`network_step`](Self::network_step) along one axis: its states are the memory, its inputs [`StepInput`] and the
    /// memory of ticks, its outputs what is sent.
    fn step_block(&self) -> LinearBlock {
        let SchemeSize { tick_memory, sent, .. } = self.size();
        LinearBlock::gain(DMatrix::zeros(sent, 2 + tick_memory))
    }
}
