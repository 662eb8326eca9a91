//! Hands that pointers take from their scripts, and the way of a pointer's targets to the haptic thread: the newest only, without locks.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use cotouch_device::{Guide, POINTER_REACH_M, Targets, pointer_spring};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SpringDamper};
use glam::DVec3;

use crate::control::Control;

/// Who moves a user's hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldBy {
    /// The scene's script, in this process.
    Script,
    /// A pointer, in this process.
    Pointer,
    /// Somebody in another process, or with a device of their own.
    Elsewhere,
    /// Nobody: a place that is still free.
    Nobody,
}

/// A user's place in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seat {
    /// The user whose place or hand it is.
    pub user: HostIndex,
    /// The name that the scene gives the user.
    pub name: String,
    /// Who moves the hand.
    pub by: HeldBy,
}

/// Why a hand cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TakeError {
    /// There is no such user.
    #[error("this session has users 1 to {users}; there is no user {}", .user + 1)]
    NoSuchUser {
        /// The user whose place or hand it is.
        user: u8,
        /// How many there are.
        users: u8,
    },
    /// Somebody else moves it.
    #[error("somebody else moves {name}'s hand")]
    Taken {
        /// The name that the scene gives the user.
        name: String,
    },
    /// The session is over.
    #[error("the session is over")]
    Ended,
    /// A free place could not be had.
    #[error("{name}'s place cannot be had: {why}")]
    NotLetIn {
        /// The name that the scene gives the user.
        name: String,
        /// The reason, in words.
        why: String,
    },
}

/// A hand that a pointer moves. Dropping it lets go, smoothly.
pub struct PointerHandle {
    /// The user whose place or hand it is.
    pub user: HostIndex,
    /// From the pointer to each finger.
    pub spring: SpringDamper,
    writer: Option<TargetWriter>,
    free: Arc<FreeWriter>,
    session: Arc<Control>,
    /// What ends with the hand: the taking part of a guest at a place that was free.
    ends_with_it: Option<Box<dyn Send>>,
}

/// The writing end of the exchange: what the pointer says; `None` when there is no pointer.
type TargetWriter = triple_buffer::Input<Option<Targets>>;

/// Where the writing end is while nobody has it.
type FreeWriter = Mutex<Option<TargetWriter>>;

impl PointerHandle {
    /// Draws the fingers to `targets` (m, world), at most 10 m from the origin on every axis. Never waits. False, and
    /// nothing done, when a target is not finite or the session is over.
    pub fn point(&mut self, targets: &Targets) -> bool {
        let Some(writer) = &mut self.writer else { return false };
        if self.session.is_over() || !targets.iter().all(|target| target.is_finite()) {
            return false;
        }
        let reach = DVec3::splat(POINTER_REACH_M);
        writer.write(Some(targets.iter().map(|target| target.clamp(-reach, reach)).collect()));
        true
    }

    /// The same hand; `other` is dropped after it.
    pub(crate) fn ending(mut self, other: impl Send + 'static) -> Self {
        self.ends_with_it = Some(Box::new(other));
        self
    }
}

impl fmt::Debug for PointerHandle {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("PointerHandle")
            .field("user", &self.user)
            .field("spring", &self.spring)
            .finish_non_exhaustive()
    }
}

impl Drop for PointerHandle {
    fn drop(&mut self) {
        if let Some(mut writer) = self.writer.take() {
            writer.write(None);
            *self.free.lock().unwrap_or_else(PoisonError::into_inner) = Some(writer);
        }
    }
}

/// A hand of this process that pointers may take, one at a time.
pub(crate) struct GuidedHand {
    pub(crate) user: HostIndex,
    spring: SpringDamper,
    free: Arc<FreeWriter>,
}

impl GuidedHand {
    /// The place of the user at `host` of a scene, and the haptic thread's end of the way to it.
    pub(crate) fn new(scene: &Scene, host: HostIndex) -> (Self, PointerGuide) {
        let (writer, said) = triple_buffer::triple_buffer(&None);
        let free = Arc::new(Mutex::new(Some(writer)));
        (Self { user: host, spring: pointer_spring(scene, host), free }, PointerGuide { said })
    }

    /// The hand, whose fingers stay where they are until it is told more; `None` while somebody has it.
    pub(crate) fn take(&self, session: &Arc<Control>) -> Option<PointerHandle> {
        let mut writer = self.free.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        writer.write(Some(Targets::new()));
        Some(PointerHandle {
            user: self.user,
            spring: self.spring,
            writer: Some(writer),
            free: Arc::clone(&self.free),
            session: Arc::clone(session),
            ends_with_it: None,
        })
    }

    /// Whether a pointer has it.
    pub(crate) fn is_taken(&self) -> bool {
        self.free.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }
}

/// The haptic thread's end.
#[derive(Debug)]
pub(crate) struct PointerGuide {
    said: triple_buffer::Output<Option<Targets>>,
}

impl Guide for PointerGuide {
    fn targets(&mut self) -> Option<Targets> {
        self.said.read().clone()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    fn place() -> (GuidedHand, PointerGuide, Arc<Control>) {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let (place, slot) = GuidedHand::new(&scene, HostIndex::FIRST);
        (place, slot, Arc::new(Control::default()))
    }

    #[test]
    fn the_newest_word_arrives_and_leaving_is_one() {
        let (place, mut slot, session) = place();
        assert_eq!(slot.targets(), None);
        let mut hand = place.take(&session).unwrap();
        assert_eq!(slot.targets(), Some(Targets::new()));
        let at = |x: f64| -> Targets { [DVec3::X * x].into_iter().collect() };
        assert!(hand.point(&at(1.0)) && hand.point(&at(2.0)));
        assert_eq!(slot.targets(), Some(at(2.0)));
        assert_eq!(slot.targets(), Some(at(2.0)), "until something else is said");
        assert!(hand.point(&at(-1e300)));
        assert_eq!(slot.targets(), Some(at(-10.0)));
        drop(hand);
        assert_eq!(slot.targets(), None);
    }

    #[test]
    fn one_pointer_has_it_at_a_time() {
        let (place, _slot, session) = place();
        let hand = place.take(&session).unwrap();
        assert!(place.is_taken() && place.take(&session).is_none());
        drop(hand);
        assert!(!place.is_taken() && place.take(&session).is_some());
    }

    #[test]
    fn what_is_not_finite_and_what_comes_too_late_is_refused() {
        let (place, mut slot, session) = place();
        let mut hand = place.take(&session).unwrap();
        for bad in [f64::NAN, f64::INFINITY] {
            let targets: Targets = [DVec3::ZERO, DVec3::new(0.0, bad, 0.0)].into_iter().collect();
            assert!(!hand.point(&targets));
        }
        assert_eq!(slot.targets(), Some(Targets::new()));
        session.ended.store(true, Ordering::Release);
        assert!(!hand.point(&Targets::new()));
    }
}
