//! Hands that pointers take, and the way of a pointer's targets to the haptic thread: the newest only, without locks.

use std::fmt;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};

use cotouch_device::guided::{self, Guide, REACH_M, Targets};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Scene, SpringDamper};
use glam::DVec3;

use crate::guests::Guest;
use crate::haptic_loop::Control;

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
    /// Whose.
    pub user: HostIndex,
    /// The user's name.
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
        /// From 0.
        user: u8,
        /// How many there are.
        users: u8,
    },
    /// Somebody else moves it.
    #[error("somebody else moves {name}'s hand")]
    Taken {
        /// Whose hand.
        name: String,
    },
    /// The session is over.
    #[error("the session is over")]
    Ended,
    /// A free place could not be had.
    #[error("{name}'s place cannot be had: {why}")]
    NotLetIn {
        /// Whose place.
        name: String,
        /// Why.
        why: String,
    },
}

/// A hand that a pointer moves. Dropping it lets go, smoothly.
pub struct Hand {
    /// Whose.
    pub user: HostIndex,
    /// From the pointer to each finger.
    pub spring: SpringDamper,
    reins: Option<Reins>,
    shelf: Arc<Shelf>,
    session: Arc<Control>,
    /// For a hand at a place that was free: whoever took it leaves the session with it.
    guest: Option<Guest>,
}

/// The writing end of the exchange: what the pointer says; `None` when there is no pointer.
type Reins = triple_buffer::Input<Option<Targets>>;

/// Where the reins lie while nobody has them.
type Shelf = Mutex<Option<Reins>>;

impl Hand {
    /// Draws the fingers to `targets` (m, world), at most 10 m from the origin on every axis. Never waits. False, and
    /// nothing done, when a target is not finite or the session is over.
    pub fn point(&mut self, targets: &Targets) -> bool {
        let Some(reins) = &mut self.reins else { return false };
        if self.session.is_over() || !targets.iter().all(|target| target.is_finite()) {
            return false;
        }
        let reach = DVec3::splat(REACH_M);
        reins.write(Some(targets.iter().map(|target| target.clamp(-reach, reach)).collect()));
        true
    }

    /// The same hand, with which its user leaves the session when it is dropped.
    pub(crate) fn of_guest(mut self, guest: Guest) -> Self {
        self.guest = Some(guest);
        self
    }
}

impl fmt::Debug for Hand {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Hand")
            .field("user", &self.user)
            .field("spring", &self.spring)
            .finish_non_exhaustive()
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        if let Some(mut reins) = self.reins.take() {
            reins.write(None);
            *self.shelf.lock().unwrap_or_else(PoisonError::into_inner) = Some(reins);
        }
    }
}

/// A hand of this process that pointers may take, one at a time.
pub(crate) struct Place {
    pub(crate) user: HostIndex,
    spring: SpringDamper,
    shelf: Arc<Shelf>,
}

impl Place {
    /// The place of the user at `host` of a scene, and the haptic thread's end of the way to it.
    pub(crate) fn new(scene: &Scene, host: HostIndex) -> (Self, GuideSlot) {
        let (reins, said) = triple_buffer::triple_buffer(&None);
        let shelf = Arc::new(Mutex::new(Some(reins)));
        (Self { user: host, spring: guided::spring(scene, host), shelf }, GuideSlot { said })
    }

    /// The hand, whose fingers stay where they are until it is told more; `None` while somebody has it.
    pub(crate) fn take(&self, session: &Arc<Control>) -> Option<Hand> {
        let mut reins = self.shelf.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        reins.write(Some(Targets::new()));
        Some(Hand {
            user: self.user,
            spring: self.spring,
            reins: Some(reins),
            shelf: Arc::clone(&self.shelf),
            session: Arc::clone(session),
            guest: None,
        })
    }

    /// Whether a pointer has it.
    pub(crate) fn is_taken(&self) -> bool {
        self.shelf.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }
}

/// The haptic thread's end.
#[derive(Debug)]
pub(crate) struct GuideSlot {
    said: triple_buffer::Output<Option<Targets>>,
}

impl Guide for GuideSlot {
    fn targets(&mut self) -> Option<Targets> {
        self.said.read().clone()
    }
}

impl Control {
    /// Whether the session has ended or is about to.
    pub(crate) fn is_over(&self) -> bool {
        self.ended.load(Ordering::Acquire) || self.stop.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> (Place, GuideSlot, Arc<Control>) {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let (place, slot) = Place::new(&scene, HostIndex::FIRST);
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
