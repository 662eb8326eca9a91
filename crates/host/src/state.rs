//! Everything about one host that changes: a plain value that can be copied, compared, saved and restored.

use cotouch_net::packet::{Entry, StatePacket};
use cotouch_net::play_out::PlayOutBuffer;
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::names::{Coordinate, HostIndex, Part, Quantity};
use cotouch_world::rigid::BodyState;
use serde::{Deserialize, Serialize};

use crate::model::HostModel;

/// A host's state between two ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostState {
    /// Ticks done so far.
    pub ticks_done: u64,
    /// The last network step that was done.
    pub last_step: Option<u64>,
    /// This host's copy of the object; at a client, the server's object as last heard of.
    pub object: BodyState,
    /// One entry a host; the own entry stays empty.
    pub peers: Vec<PeerState>,
    /// Set while a late joiner waits for the world's present state.
    pub adopting: bool,
    /// Set for good when the world left all bounds; it no longer moves and no force is rendered.
    pub diverged: bool,
}

/// What a host knows of one peer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeerState {
    /// Whether the peer takes part.
    pub present: bool,
    /// How far its coupling has faded in, 0 to 1.
    pub fade: f64,
    /// Set from when it went until its coupling has faded out: a return waits for that, so that nothing jumps.
    pub going: bool,
    /// Its samples: the one in use and those that wait.
    pub samples: PlayOutBuffer,
}

impl HostState {
    /// The state before the first tick: everything at rest at the origin, every peer absent.
    #[must_use]
    pub fn new(model: &HostModel) -> Self {
        let peer = |from: HostIndex| PeerState {
            present: false,
            fade: 0.0,
            going: false,
            samples: PlayOutBuffer::new(model.play_out, model.play_out_periods[from.index()]),
        };
        Self {
            ticks_done: 0,
            last_step: None,
            object: BodyState::default(),
            peers: HostIndex::all(model.users).map(peer).collect(),
            adopting: false,
            diverged: false,
        }
    }

    /// The value of one of this host's coordinates at network step `step`, before anything is sampled at it; `None`
    /// where it lives elsewhere (a hand in its device, a sample still in flight).
    #[must_use]
    pub fn coordinate(&self, model: &HostModel, step: u64, coordinate: Coordinate) -> Option<f64> {
        let mut value = None;
        // Reading and writing share one path, so that they cannot disagree about where a coordinate lives.
        self.clone().visit(model, step, coordinate, &mut |place| value = Some(*place));
        value
    }

    /// Sets one of this host's coordinates; whether it lives here.
    pub fn set_coordinate(
        &mut self,
        model: &HostModel,
        step: u64,
        coordinate: Coordinate,
        value: f64,
    ) -> bool {
        let mut found = false;
        self.visit(model, step, coordinate, &mut |place| {
            *place = value;
            found = true;
        });
        found
    }

    fn visit(&mut self, model: &HostModel, step: u64, coordinate: Coordinate, act: &mut dyn FnMut(&mut f64)) {
        match coordinate {
            Coordinate::Own { host, part: Part::OBJECT, quantity } if host == model.host => {
                along_axis(model, quantity, &mut self.object.pose, &mut self.object.twist, act);
            }
            Coordinate::Held { host, from, part, quantity, age } if host == model.host => {
                let Some(sampled) = step.checked_sub(u64::from(age)) else { return };
                if let Some(packet) = self.peers[from.index()].samples.sample_mut(sampled) {
                    visit_packet(packet, model, part, quantity, act);
                }
            }
            _ => {}
        }
    }
}

/// Reads or writes the number that `part` and `quantity` name in a packet, wherever that packet is.
pub fn visit_packet(
    packet: &mut StatePacket,
    model: &HostModel,
    part: Part,
    quantity: Quantity,
    act: &mut dyn FnMut(&mut f64),
) {
    for entry in &mut packet.entries {
        match (part, entry) {
            (Part::HAND, Entry::Hand { pose, twist, .. })
            | (Part::OBJECT, Entry::Object { pose, twist, .. }) => {
                along_axis(model, quantity, pose, twist, act);
            }
            (Part::FORCE, Entry::Force { wrench: Wrench { force, .. }, .. }) if quantity == Quantity::F => {
                component(model, force, act);
            }
            _ => {}
        }
    }
}

fn along_axis(
    model: &HostModel,
    quantity: Quantity,
    pose: &mut Pose,
    twist: &mut Twist,
    act: &mut dyn FnMut(&mut f64),
) {
    match quantity {
        Quantity::X => component(model, &mut pose.position, act),
        Quantity::V => component(model, &mut twist.linear, act),
        Quantity::F => {}
    }
}

fn component(model: &HostModel, vector: &mut glam::DVec3, act: &mut dyn FnMut(&mut f64)) {
    let mut value = vector.dot(model.axis);
    let across = *vector - model.axis * value;
    act(&mut value);
    *vector = across + model.axis * value;
}
