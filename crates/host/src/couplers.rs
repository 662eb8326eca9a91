//! The couplers between fingers and the centres of bodies that have no surface: Fotoohi Ghiam 2006, (4.25)–(4.29).

use cotouch_scene::scene::{Coupling, SpringDamper};
use cotouch_world::BodyState;
use cotouch_world::coupler::{Stretch, force};
use glam::DVec3;

use crate::bodies::Bodies;
use crate::output::TickOutput;
use crate::touching::Touching;

/// The couplers of all fingers that a host knows of.
#[derive(Clone, Debug)]
pub(crate) struct PointCouplers {
    /// Bodies without a surface that move, by their index.
    points: Vec<usize>,
    /// To own fingers.
    own: SpringDamper,
    /// To held fingers of others.
    held: SpringDamper,
}

impl PointCouplers {
    pub(crate) fn new(coupling: &Coupling, bodies: &Bodies) -> Self {
        let has_no_surface = |&body: &usize| !bodies.models()[body].surface.exists();
        Self {
            points: bodies.moving().iter().copied().filter(has_no_surface).collect(),
            own: coupling.hand_object,
            held: coupling.remote_hand_object,
        }
    }

    fn spring(&self, finger: &Touching<'_>) -> SpringDamper {
        if finger.is_held { self.held } else { self.own }
    }

    /// Couples a finger to the bodies, which get the opposite. The force on the finger, N.
    pub(crate) fn pull(&self, bodies: &[BodyState], output: &mut TickOutput, finger: &Touching<'_>) -> DVec3 {
        let mut on_finger = DVec3::ZERO;
        let spring = self.spring(finger);
        for &body in &self.points {
            let Some(hand) = finger.place_at(body, &bodies[body]) else { return on_finger };
            let stretch = Stretch::between(bodies[body].point(), hand);
            let from_hand = finger.fade * force(spring, stretch);
            output.wrenches[body].force += from_hand;
            on_finger -= from_hand;
        }
        on_finger
    }

    /// The force (N) that [`pull`](Self::pull) would find for this finger.
    pub(crate) fn force(&self, bodies: &[BodyState], finger: &Touching<'_>) -> DVec3 {
        let on_finger = |&body: &usize| {
            let hand = finger.place_at(body, &bodies[body])?;
            let stretch = Stretch::between(hand, bodies[body].point());
            Some(finger.fade * force(self.spring(finger), stretch))
        };
        self.points.iter().filter_map(on_finger).sum()
    }
}
