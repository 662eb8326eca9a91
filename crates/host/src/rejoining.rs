//! What came apart while a peer was not heard, or while this host or its device stood still, and how it is brought together:
//! [`cotouch_world::Offset`] for copies of bodies, for fingers that touch them, and for forces that a server sends.
//!
//! A peer is *met* when its coupling begins to fade in, and when a sample of it comes after a gap of `session.rejoin_after_s`. A
//! distributed host then sees the peer's whole sample displaced: its copy of each body from where that is to where the own copy
//! is, and its fingers along with it. A server, and every host with its own fingers after they moved unseen, see a finger displaced to
//! the point that it is coupled to, or out of the surface that it is found in.

use arrayvec::ArrayVec;
use cotouch_net::{Entry, StatePacket};
use cotouch_scene::geometry::Readings;
use cotouch_scene::limits::{MAX_BODIES, MAX_FINGERS};
use cotouch_scene::scene::Scene;
use cotouch_world::coupler::Stretch;
use cotouch_world::{Approach, BodyState, Offset, RejoiningPace};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::bodies::Bodies;
use crate::peers::PeerState;
use crate::samples;

/// A finger in contact goes on from where it was if that is no farther than this (m); else it begins to touch anew.
const SAME_PLACE_M: f64 = 0.02;

/// By how much a peer's copy of a body counts as elsewhere than its sample says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyOffset {
    /// m.
    pub translation: Offset,
    /// A rotation vector, rad.
    pub rotation: Offset,
}

impl BodyOffset {
    fn is_over(&self) -> bool {
        self.translation.is_over() && self.rotation.is_over()
    }

    /// A place (m) and velocity (m/s) that the peer's sample has, as they are to the own copy of the body.
    pub(crate) fn seen(&self, own: &BodyState, (place, velocity): (DVec3, DVec3)) -> (DVec3, DVec3) {
        if self.is_over() {
            return (place, velocity);
        }
        let (translation, rotation) = (self.translation.value(), self.rotation.value());
        let turn = DQuat::from_scaled_axis(-rotation.position);
        let arm = turn * (place - own.pose.position - translation.position);
        let velocity = turn * (velocity - translation.velocity) - rotation.velocity.cross(arm);
        (own.pose.position + arm, velocity)
    }
}

/// By how much a finger counts as elsewhere than it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FingerOffset {
    /// m.
    pub offset: Offset,
    /// The body that it is seen at, by its place in the scene's order.
    pub body: u8,
}

/// The constants of a host's re-joining.
#[derive(Clone, Debug)]
pub(crate) struct Rejoining {
    pub(crate) pace: RejoiningPace,
    /// A sample that is of more network steps after the one before it meets what came apart.
    gap_steps: u64,
    finger_radius_m: f64,
}

/// What counted of a peer before a gap in its samples.
#[derive(Clone, Debug)]
pub(crate) struct Before {
    step: u64,
    /// Of each body that moves, how its copy stood to the own one, by place and by turning.
    bodies: ArrayVec<(Stretch, Stretch), MAX_BODIES>,
    /// Where each finger was seen, m, and how it moved, m/s, and at which body.
    fingers: ArrayVec<(usize, (DVec3, DVec3)), MAX_FINGERS>,
    /// What a server's sample said of the forces on the own fingers, N.
    forces: ArrayVec<DVec3, MAX_FINGERS>,
}

impl Rejoining {
    pub(crate) fn new(scene: &Scene) -> Self {
        let session = &scene.session;
        Self {
            pace: RejoiningPace::new(
                session.rejoin_s,
                session.peer_fade_s,
                scene.rates.control_hz.period_s(),
            ),
            gap_steps: scene.rejoin_gap_steps(),
            finger_radius_m: scene.hand.finger_radius_m,
        }
    }

    /// What counts of a peer, if a sample that comes into use at network step `now` would come after a gap.
    pub(crate) fn before(
        &self,
        (bodies, states): (&Bodies, &[BodyState]),
        peer: &PeerState,
        now: u64,
    ) -> Option<Before> {
        let held = peer.samples.held()?;
        if !self.pace.exists() || peer.fade == 0.0 || now.saturating_sub(held.step) <= self.gap_steps {
            return None;
        }
        let of_body = |&body: &usize| {
            let (offset, apart) =
                (peer.bodies.get(body)?, apart(held, body, &states[body]).unwrap_or_default());
            Some((apart.0 - offset.translation.value(), apart.1 - offset.rotation.value()))
        };
        let of_finger = |(finger, _): (usize, &FingerOffset)| {
            let hand = samples::hand(held, finger).unwrap_or_default();
            let body = nearest(bodies.moving(), states, hand.0);
            (body, seen(peer, states, finger, body, hand))
        };
        Some(Before {
            step: held.step,
            bodies: bodies.moving().iter().filter_map(of_body).collect(),
            fingers: peer.fingers.iter().enumerate().map(of_finger).collect(),
            forces: forces(held)
                .zip(&peer.forces)
                .map(|(force, offset)| force - offset.value().position)
                .collect(),
        })
    }

    /// Whether the sample in use now came after a gap.
    pub(crate) fn is_after_gap(&self, before: &Before, peer: &PeerState) -> bool {
        peer.samples.held().is_some_and(|held| held.step.saturating_sub(before.step) > self.gap_steps)
    }

    /// Meets a peer: all that its sample in use says counts from now on as it did before, or as if nothing had come apart. Fingers
    /// that begin to touch anew are told to `anew`.
    pub(crate) fn meet(
        &self,
        (bodies, states): (&Bodies, &[BodyState]),
        peer: &mut PeerState,
        before: Option<&Before>,
        anew: impl FnMut(usize),
    ) {
        let Some(held) = peer.samples.held().filter(|_| self.pace.exists()) else { return };
        for (nth, &body) in bodies.moving().iter().enumerate() {
            let Some(offset) = peer.bodies.get_mut(body) else { break };
            let Some((translation, rotation)) = apart(held, body, &states[body]) else { continue };
            let former = before.and_then(|before| before.bodies.get(nth)).copied().unwrap_or_default();
            *offset = BodyOffset {
                translation: Offset::met(self.pace, translation, former.0),
                rotation: Offset::met(self.pace, rotation, former.1),
            };
        }
        let former = before.map(|before| before.forces.as_slice()).unwrap_or_default();
        for ((offset, force), former) in peer.forces.iter_mut().zip(forces(held)).zip(former) {
            *offset = Offset::met(
                self.pace.at_the_pace_of_rates(),
                Stretch::at_rest(force),
                Stretch::at_rest(*former),
            );
        }
        self.meet_fingers((bodies, states), peer, before, anew);
    }

    fn meet_fingers(
        &self,
        (bodies, states): (&Bodies, &[BodyState]),
        peer: &mut PeerState,
        before: Option<&Before>,
        mut anew: impl FnMut(usize),
    ) {
        peer.fingers.fill(FingerOffset::default());
        for finger in 0..peer.fingers.len() {
            let Some(hand) = peer.samples.held().and_then(|held| samples::hand(held, finger)) else {
                continue;
            };
            let former = before.and_then(|before| before.fingers.get(finger)).copied();
            let (body, from_target) = if peer.bodies.is_empty() {
                self.reference((bodies, states), hand)
            } else {
                (former.map_or(0, |(body, _)| body), None)
            };
            let now = seen(peer, states, finger, body, hand);
            let found = Found { now, from_target, former: former.map(|(_, was)| was) };
            let offset = self.offset(bodies.have_surfaces(), &found);
            if offset.is_none() {
                anew(finger);
            }
            let offset = offset.unwrap_or_else(|| found.anew(self.pace));
            peer.fingers[finger] = FingerOffset { offset, body: body as u8 };
        }
    }

    /// The offset with which a finger goes on from where it counted as; `None` of one that would have to be dragged along a surface.
    fn offset(&self, have_surfaces: bool, found: &Found) -> Option<Offset> {
        let Some(was) = found.former else { return Some(found.anew(self.pace)) };
        let apart = found.from_target.unwrap_or_default();
        let target = (found.now.0 - apart.position, found.now.1 - apart.velocity);
        let rest = Stretch::between(target, was);
        let is_far = have_surfaces && rest.position.length() > SAME_PLACE_M;
        (!is_far).then(|| Offset::met(self.pace, apart, rest))
    }

    /// Has an own finger that moved from `was` to `now` (m, m/s) unseen count as where it was, or as where it begins to touch anew; whether
    /// it does.
    pub(crate) fn move_unseen(
        &self,
        world: (&Bodies, &[BodyState]),
        finger: &mut FingerOffset,
        (was, now): ((DVec3, DVec3), (DVec3, DVec3)),
    ) -> bool {
        let counted = finger.offset.value();
        let former = Some((was.0 - counted.position, was.1 - counted.velocity));
        let (body, from_target) = self.reference(world, now);
        let found = Found { now, from_target, former };
        let goes_on = self.offset(world.0.have_surfaces(), &found);
        let begins_anew = goes_on.is_none();
        let offset = goes_on.unwrap_or_else(|| found.anew(self.pace));
        *finger = FingerOffset { offset, body: body as u8 };
        begins_anew
    }

    /// One tick on for a peer.
    pub(crate) fn advance(&self, world: (&Bodies, &[BodyState]), peer: &mut PeerState) {
        let Some(held) = peer.samples.held() else { return };
        for &body in world.0.moving() {
            let Some(offset) = peer.bodies.get_mut(body).filter(|offset| !offset.is_over()) else { continue };
            let Some((translation, rotation)) = apart(held, body, &world.1[body]) else { continue };
            offset.translation.advance(self.pace, translation.position);
            offset.rotation.advance(self.pace, rotation.position);
        }
        let pace = self.pace.at_the_pace_of_rates();
        for (offset, force) in peer.forces.iter_mut().zip(forces(held)) {
            offset.advance(pace, force);
        }
        let is_server = peer.bodies.is_empty();
        for (finger, offset) in peer.fingers.iter_mut().enumerate() {
            let hand = samples::hand(held, finger).filter(|_| is_server).map(|(place, _)| place);
            self.advance_finger(world, offset, hand);
        }
    }

    /// One tick on for an own finger, or for one that a server knows of.
    pub(crate) fn advance_finger(
        &self,
        world: (&Bodies, &[BodyState]),
        finger: &mut FingerOffset,
        place: Option<DVec3>,
    ) {
        if finger.offset.is_over() {
            return;
        }
        let place = place.map(|place| (place, DVec3::ZERO));
        let apart = place.and_then(|place| self.stretch_at(world, usize::from(finger.body), place));
        finger.offset.advance(self.pace, apart.unwrap_or_default().position);
    }

    /// The body that a finger is seen at, and how it stands to where it would be without force there.
    fn reference(&self, world: (&Bodies, &[BodyState]), hand: (DVec3, DVec3)) -> (usize, Option<Stretch>) {
        let (bodies, states) = world;
        let depth = |apart: &Stretch| apart.position.length_squared();
        let deepest = (0..states.len())
            .filter(|&body| bodies.models()[body].surface.exists())
            .filter_map(|body| Some((body, self.stretch_at(world, body, hand)?)))
            .max_by(|(_, one), (_, other)| depth(one).total_cmp(&depth(other)));
        if let Some((body, apart)) = deepest {
            return (body, Some(apart));
        }
        let body = nearest(bodies.moving(), states, hand.0);
        (body, self.stretch_at(world, body, hand))
    }

    /// How a finger stands to where it would be without force at a body: at a point, or out of the surface that it is in.
    fn stretch_at(
        &self,
        (bodies, states): (&Bodies, &[BodyState]),
        body: usize,
        hand: (DVec3, DVec3),
    ) -> Option<Stretch> {
        let (model, state) = (bodies.models().get(body)?, states.get(body)?);
        let from_centre = Stretch::between(state.point(), hand);
        if !model.surface.exists() {
            return (!model.is_fixed()).then_some(from_centre);
        }
        let orientation = state.pose.orientation;
        let centre = orientation.conjugate() * from_centre.position;
        let probe = model.surface.probe(&mut Approach::default(), centre, self.finger_radius_m)?;
        Some(Stretch { position: orientation * (-probe.depth_m * probe.normal), ..from_centre })
    }
}

/// A finger that is seen again.
struct Found {
    /// m, m/s.
    now: (DVec3, DVec3),
    /// How it stands to where it would be without force, where there is such a place.
    from_target: Option<Stretch>,
    /// Where it counted as until now, and how it moved.
    former: Option<(DVec3, DVec3)>,
}

impl Found {
    /// Its offset if it begins to touch anew.
    fn anew(&self, pace: RejoiningPace) -> Offset {
        Offset::met(pace, self.from_target.unwrap_or_default(), Stretch::default())
    }
}

/// These readings with every finger where it counts as.
pub(crate) fn displaced(offsets: &[FingerOffset], readings: &Readings) -> Readings {
    let mut displaced = readings.clone();
    for (reading, finger) in displaced.iter_mut().zip(offsets) {
        let Stretch { position, velocity } = finger.offset.value();
        reading.pose.position -= position;
        reading.twist.linear -= velocity;
    }
    displaced
}

/// Where a peer's finger counts as at a body, m, and how it moves, m/s.
fn seen(
    peer: &PeerState,
    states: &[BodyState],
    finger: usize,
    body: usize,
    hand: (DVec3, DVec3),
) -> (DVec3, DVec3) {
    let (place, velocity) = match (peer.bodies.get(body), states.get(body)) {
        (Some(offset), Some(own)) => offset.seen(own, hand),
        _ => hand,
    };
    let offset = peer.fingers.get(finger).map_or(Stretch::default(), |finger| finger.offset.value());
    (place - offset.position, velocity - offset.velocity)
}

/// From the own copy of a body to that of a sample, by place and by turning.
fn apart(sample: &StatePacket, body: usize, own: &BodyState) -> Option<(Stretch, Stretch)> {
    let copy = samples::body(sample, body)?;
    let turning = |body: &BodyState| (body.pose.orientation, body.twist.angular);
    Some((
        Stretch::between(own.point(), copy.point()),
        Stretch::between_orientations(turning(own), turning(&copy)),
    ))
}

/// The forces that a sample says, in the order of fingers, N.
fn forces(sample: &StatePacket) -> impl Iterator<Item = DVec3> {
    sample.entries.iter().filter_map(|entry| match entry {
        Entry::Force { wrench, .. } => Some(wrench.force),
        _ => None,
    })
}

/// The body among these whose centre is nearest; the first of the scene where there are none.
fn nearest(moving: &[usize], states: &[BodyState], place: DVec3) -> usize {
    let distance = |&body: &usize| (states[body].pose.position - place).length_squared();
    moving.iter().copied().min_by(|one, other| distance(one).total_cmp(&distance(other))).unwrap_or(0)
}
