//! How hosts of a distributed session keep their copies of a body together: one scheme a file.
//!
//! Between the copies of one body at two hosts there are two *channels*, one for translation and one for rotation. At the
//! receiving end of each stands a [`Scheme`]: at every tick it turns what it knows of the two copies into a force (or
//! torque) on the own one, and at every network step it may put vectors of its own into the sample that the peer gets.
//! What it remembers in between is part of the host's state. It acts on all axes alike, so that scalar blocks
//! ([`Scheme::tick_block`], [`Scheme::step_block`]) say the same for the analysis, which compiles them into its loop.
//!
//! At one instant: [`Scheme::network_step`] at every host, samples are exchanged and come into use, [`Scheme::tick`] at
//! every host. The host fades each peer's force in and out, and multiplies it by [`Scheme::weight`].
//!
//! # Adding a scheme
//! 1. A file beside `pairwise.rs` with a type that implements [`Scheme`].
//! 2. Its line in [`scheme`], below, and its module.
//! 3. Its name in [`Coordination`], and whether it sends; its parameters, if it has some, as keys of the scene.
//!
//! `tests/it/coordination.rs` holds the step functions of every scheme to its blocks; a case in
//! `crates/cotouch/tests/it/agreement.rs` holds the running session to the whole loop.

mod average;
mod pairwise;
mod scheme;

use std::sync::Arc;

use cotouch_scene::scene::{Coordination, Coupling, SceneValues};

pub use scheme::{CouplingGains, OwnMotion, Scheme, SchemeSize, StepInput, TickInput, TickMotion};

use average::Average;
use pairwise::Pairwise;

/// The scheme that a scene asks for, with the gains of one kind of channel.
#[must_use]
pub fn scheme(scene: &SceneValues, gains: CouplingGains) -> Arc<dyn Scheme> {
    match scene.session.coordination {
        Coordination::Pairwise => Arc::new(Pairwise::new(gains)),
        Coordination::Average => Arc::new(Average::new(gains)),
    }
}

/// The gains of the channels for translation, and of those for rotation.
#[must_use]
pub fn gains(coupling: &Coupling) -> [CouplingGains; 2] {
    let (linear, rotational) = (coupling.object_object, coupling.object_object_rotational);
    [
        CouplingGains { stiffness: linear.stiffness_n_per_m, damping: linear.damping_n_s_per_m },
        CouplingGains {
            stiffness: rotational.stiffness_n_m_per_rad,
            damping: rotational.damping_n_m_s_per_rad,
        },
    ]
}
