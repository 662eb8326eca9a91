//! How stiff the body is where it is touched: the joint compliance of all contacts, and K_o.
//!
//! K_o of a contact, about rest, is its stiffness in its softest direction; several soften each other
//! ([`cotouch_soft::contact_stiffnesses`]).

use arrayvec::ArrayVec;
use cotouch_scene::limits::{MAX_FINGERS, MAX_SOFT_CONTACTS};
use cotouch_scene::scene::{Finger, Scene, StiffnessFrom};
use cotouch_soft::{MaterialPoint, SoftBody, contact_stiffnesses};
use cotouch_world::MeshSurface;
use cotouch_world::local::local_law;
use glam::DVec3;

use super::estimate::ComplianceEstimate;
use super::frame::SlowFrame;
use super::input::{SlowContact, SlowInput};

/// Fingers within so many radii of the surface are near.
const NEAR_RADII: f64 = 3.0;

/// Fingers within so far (m) are near, however small they are.
const NEAR_M: f64 = 0.01;

/// A contact that moved by less than this part of what is near is where it was, while it moves: for K_o, and where forces are
/// computed with the compliance itself. When it comes to rest, it is looked at once more.
const SAME_FOR_KO: f64 = 0.2;
const SAME_FOR_COMPLIANCE: f64 = 0.02;

/// Where a finger touches, or would.
type ContactPlaces = ArrayVec<(u8, MaterialPoint), MAX_SOFT_CONTACTS>;

/// The joint compliance that is known last, and K_o.
#[derive(Clone)]
pub(super) struct ContactStiffness {
    near_m: f64,
    places: ContactPlaces,
    /// Where fingers were after the last step.
    last_places: ContactPlaces,
    /// Of these, m/N, row-major; empty where the body does not tell.
    compliance: Vec<f64>,
    /// K_o of every slot, N/m; of fingers that are far, as it was last.
    slot_ko_n_per_m: [f64; MAX_SOFT_CONTACTS],
    /// The least of those in `places`.
    least_ko_n_per_m: f64,
    estimate: Option<ComplianceEstimate>,
    needs_compliance: bool,
}

impl ContactStiffness {
    /// Before the session: of all fingers, each where it is nearest to.
    pub(super) fn new(scene: &Scene, body: &dyn SoftBody, surface: &MeshSurface) -> Self {
        let starts = scene.users.iter().flat_map(|user| user.fingers.iter().take(MAX_FINGERS));
        let place = |(slot, finger): (u8, &Finger)| Some((slot, nearest(surface, finger.position_m)?.0));
        let places: ContactPlaces = (0..).zip(starts).filter_map(place).take(MAX_SOFT_CONTACTS).collect();
        let mut stiffness = Self {
            near_m: (NEAR_RADII * scene.hand.finger_radius_m).max(NEAR_M),
            places: ContactPlaces::new(),
            last_places: ContactPlaces::new(),
            compliance: Vec::new(),
            slot_ko_n_per_m: [0.0; MAX_SOFT_CONTACTS],
            least_ko_n_per_m: 0.0,
            estimate: None,
            needs_compliance: local_law(scene.local_model.kind).needs().joint_compliance,
        };
        let estimates = scene.local_model.stiffness_from == StiffnessFrom::Estimate;
        if !estimates || stiffness.needs_compliance {
            stiffness.ask(body, places.clone());
        }
        if estimates || stiffness.compliance.is_empty() {
            let estimate = ComplianceEstimate::probed(body, surface, &places);
            stiffness.all_have(estimate.ko_n_per_m(places.iter().map(|place| place.0)));
            stiffness.estimate = Some(estimate);
        }
        stiffness
    }

    /// K_o of every slot, N/m.
    pub(super) fn slot_ko_n_per_m(&self) -> &[f64; MAX_SOFT_CONTACTS] {
        &self.slot_ko_n_per_m
    }

    /// The least of those that touch or are near, N/m.
    pub(super) fn least_ko_n_per_m(&self) -> f64 {
        self.least_ko_n_per_m
    }

    /// An estimate is of all together.
    fn all_have(&mut self, ko_n_per_m: f64) {
        self.slot_ko_n_per_m = [ko_n_per_m; MAX_SOFT_CONTACTS];
        self.least_ko_n_per_m = ko_n_per_m;
    }

    /// After a step under `input`.
    pub(super) fn follow(&mut self, body: &dyn SoftBody, surface: &MeshSurface, input: &SlowInput) {
        let places = self.touched_or_near(surface, input);
        if let Some(mut estimate) = self.estimate.take() {
            estimate.observe(&body.state().positions_m, input);
            if !places.is_empty() {
                self.all_have(estimate.ko_n_per_m(places.iter().map(|place| place.0)));
            }
            self.estimate = Some(estimate);
        }
        let asks = self.estimate.is_none() || self.needs_compliance;
        let rests = places == self.last_places && places != self.places;
        if asks && !places.is_empty() && (rests || !self.are_known(body, &places)) {
            self.ask(body, places.clone());
        }
        self.last_places = places;
    }

    /// Fills in what a frame has of this.
    pub(super) fn tell(&self, frame: &mut SlowFrame, input: &SlowInput) {
        frame.compliance.clone_from(&self.compliance);
        frame.slots.clear();
        frame.forces_n.clear();
        if self.compliance.is_empty() {
            return;
        }
        let force = |slot: u8| {
            input.contacts.iter().find(|contact| contact.slot == slot).map(|contact| contact.force_n)
        };
        for (slot, _) in &self.places {
            frame.slots.push(*slot);
            frame.forces_n.push(force(*slot).unwrap_or_default());
        }
    }

    fn touched_or_near(&self, surface: &MeshSurface, input: &SlowInput) -> ContactPlaces {
        let place = |contact: &SlowContact| {
            let near = || {
                let is_near = surface.distance_at_least(contact.centre_m) <= self.near_m;
                let (point, distance_m) = is_near.then(|| nearest(surface, contact.centre_m)).flatten()?;
                (distance_m <= self.near_m).then_some(point)
            };
            Some((contact.slot, contact.anchor.or_else(near)?))
        };
        input.contacts.iter().filter_map(place).collect()
    }

    /// Whether the compliance of `places` is known, near enough.
    fn are_known(&self, body: &dyn SoftBody, places: &ContactPlaces) -> bool {
        let part = if self.needs_compliance { SAME_FOR_COMPLIANCE } else { SAME_FOR_KO };
        let (rest, most) = (body.rest_m(), part * self.near_m);
        let same = |((slot, point), (known_slot, known)): (&(u8, MaterialPoint), &(u8, MaterialPoint))| {
            slot == known_slot && (point == known || point.at(rest).distance(known.at(rest)) <= most)
        };
        places.len() == self.places.len() && places.iter().zip(&self.places).all(same)
    }

    fn ask(&mut self, body: &dyn SoftBody, places: ContactPlaces) {
        let points: Vec<MaterialPoint> = places.iter().map(|place| place.1).collect();
        let Some(compliance) = body.compliance(&points).filter(|_| !points.is_empty()) else { return };
        let Some(ko_n_per_m) = contact_stiffnesses(&compliance) else { return };
        if self.estimate.is_none() {
            self.least_ko_n_per_m = ko_n_per_m.iter().copied().fold(f64::INFINITY, f64::min);
            for ((slot, _), ko_n_per_m) in places.iter().zip(ko_n_per_m) {
                self.slot_ko_n_per_m[usize::from(*slot)] = ko_n_per_m;
            }
        }
        self.compliance.clear();
        self.compliance.extend(compliance.transpose().iter());
        self.places = places;
    }
}

/// The surface's point nearest to `centre`, and how far (m) it is.
fn nearest(surface: &MeshSurface, centre: DVec3) -> Option<(MaterialPoint, f64)> {
    let found = surface.nearest_point(centre)?;
    Some((MaterialPoint::on_triangle(found.vertices, found.weights), found.point.distance(centre)))
}
