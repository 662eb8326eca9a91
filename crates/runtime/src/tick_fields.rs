//! Every number of a tick under a name with its unit: the one list behind comparing and exporting.

use std::fmt;

use cotouch_host::{ContactPoint, ContactRecord, ContactSurface};
use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::names::HostIndex;
use cotouch_world::Phase;
use glam::DVec3;

use crate::record::TickRecord;

/// The name of one number, such as `body1_position_x_m` or `step_in_use_host2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    part: &'static str,
    /// Which of several, counted from 1.
    number: Option<u8>,
    quantity: &'static str,
    axis: &'static str,
    unit: &'static str,
    host: Option<HostIndex>,
}

impl fmt::Display for Field {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.part)?;
        if let Some(number) = self.number {
            write!(formatter, "{number}")?;
        }
        for piece in [self.quantity, self.axis, self.unit] {
            if !piece.is_empty() {
                write!(formatter, "_{piece}")?;
            }
        }
        self.host.map_or(Ok(()), |host| write!(formatter, "_{host}"))
    }
}

/// One number of a tick. Equal means equal bit for bit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Value {
    /// A real number, bit for bit.
    Real(f64),
    /// A whole number of whatever size.
    Whole(i128),
    /// What is so, or is not.
    Flag(bool),
    /// No number: no sample is in use.
    Nothing,
}

impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Real(a), Self::Real(b)) => a.to_bits() == b.to_bits(),
            (Self::Whole(a), Self::Whole(b)) => a == b,
            (Self::Flag(a), Self::Flag(b)) => a == b,
            (Self::Nothing, Self::Nothing) => true,
            _ => false,
        }
    }
}

impl Eq for Value {}

/// The shortest text that reads back to the same number; empty for nothing, 0 and 1 for no and yes.
impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Real(number) => write!(formatter, "{number:?}"),
            Self::Whole(number) => write!(formatter, "{number}"),
            Self::Flag(flag) => write!(formatter, "{}", u8::from(*flag)),
            Self::Nothing => Ok(()),
        }
    }
}

const AXES: [&str; 4] = ["x", "y", "z", "w"];

/// Hands the numbers of a tick of `host` to `visit`, as many and in the same order for every tick: what was consumed, what
/// came of it, what the host's own fingers touch, and last the two measurements `lateness_ns` and `compute_ns`.
pub(crate) fn visit_fields(host: HostIndex, record: &TickRecord, mut visit: impl FnMut(Field, Value)) {
    visit_all_but_contacts(record, &mut visit);
    for finger in 0..record.readings.len() {
        visit_contact_of_finger(host, finger, record, &mut visit);
    }
    visit(plain("lateness_ns"), Value::Whole(record.lateness_ns.into()));
    visit(plain("compute_ns"), Value::Whole(record.compute_ns.into()));
}

/// Every number without the measurements, every contact included: what a replay must give again.
pub(crate) fn visit_results(record: &TickRecord, visit: &mut impl FnMut(Field, Value)) {
    visit_all_but_contacts(record, visit);
    for (number, contact) in (1..).zip(&record.contacts) {
        visit_contact(Field { number: Some(number), ..plain("contact") }, contact, visit);
    }
}

fn visit_all_but_contacts(record: &TickRecord, visit: &mut impl FnMut(Field, Value)) {
    // Every field is named, so that a new one cannot be forgotten here.
    let TickRecord {
        instant,
        readings,
        device_failed,
        steps_in_use,
        fades,
        bodies,
        wrenches,
        contacts: _,
        requested,
        commanded,
        governor_acted,
        governor_gain,
        energy_j,
        finger_energy_j,
        touches_wall,
        diverged,
        lateness_ns: _,
        compute_ns: _,
    } = record;
    visit(plain("instant_ns"), Value::Whole(instant.0.into()));
    for (field, reading) in numbered("finger").zip(readings) {
        visit_motion(field, &reading.pose, &reading.twist, visit);
    }
    visit(plain("device_failed"), Value::Flag(*device_failed));
    visit_hosts("step_in_use", steps_in_use.iter().map(|step| step.map_or(Value::Nothing, whole)), visit);
    visit_hosts("fade", fades.iter().map(|&fade| Value::Real(fade)), visit);
    for (field, body) in numbered("body").zip(bodies) {
        visit_motion(field, &body.pose, &body.twist, visit);
    }
    for (field, wrench) in numbered("body").zip(wrenches) {
        visit_wrench(field, ["force", "torque"], wrench, visit);
    }
    for (field, wrench) in numbered("finger").zip(requested) {
        visit_wrench(field, ["requested_force", "requested_torque"], wrench, visit);
    }
    for (field, wrench) in numbered("finger").zip(commanded) {
        visit_wrench(field, ["commanded_force", "commanded_torque"], wrench, visit);
    }
    for (field, &acted) in numbered("finger").zip(governor_acted) {
        visit(Field { quantity: "governor_acted", ..field }, Value::Whole(acted.into()));
    }
    for (field, &gain) in numbered("finger").zip(governor_gain) {
        visit(Field { quantity: "governor_gain", ..field }, Value::Real(gain));
    }
    visit(plain("energy_j"), Value::Real(*energy_j));
    for (field, &energy_j) in numbered("finger").zip(finger_energy_j) {
        visit(Field { quantity: "energy", unit: "j", ..field }, Value::Real(energy_j));
    }
    visit(plain("touches_wall"), Value::Flag(*touches_wall));
    visit(plain("diverged"), Value::Flag(*diverged));
}

/// What a finger touches most deeply: the phase (0 free, 1 moment cancellation, 2 pre-slide, 3 slide), the body, counted
/// from 1, and the force on the finger.
fn visit_contact_of_finger(
    host: HostIndex,
    finger: usize,
    record: &TickRecord,
    visit: &mut impl FnMut(Field, Value),
) {
    let field = Field { number: Some(finger as u8 + 1), ..plain("finger") };
    let contact = record.contact_of(host, finger);
    let phase = contact.map_or(0, |contact| phase_number(contact.phase));
    visit(Field { quantity: "contact_phase", ..field }, Value::Whole(phase));
    let body = contact.map_or(Value::Nothing, |contact| match contact.surface {
        ContactSurface::Body(index) | ContactSurface::Wall(index) => Value::Whole(i128::from(index) + 1),
        ContactSurface::Soft => Value::Nothing,
    });
    visit(Field { quantity: "contact_body", ..field }, body);
    let (force, depth_m) = contact.map_or_else(Default::default, |contact| (contact.force, contact.depth_m));
    visit_vector(Field { quantity: "contact_force", unit: "n", ..field }, force, visit);
    visit(Field { quantity: "contact_depth", unit: "m", ..field }, Value::Real(depth_m));
}

fn visit_contact(field: Field, contact: &ContactRecord, visit: &mut impl FnMut(Field, Value)) {
    let point = match contact.point {
        ContactPoint::Finger { host, finger } => [("host", host.0), ("finger", finger)],
        ContactPoint::Corner { body, corner } => [("body", body), ("corner", corner)],
    };
    for (quantity, index) in point {
        visit(Field { quantity, ..field }, Value::Whole(i128::from(index) + 1));
    }
    let number = |index: u8| Value::Whole(i128::from(index) + 1);
    let (body, wall) = match contact.surface {
        ContactSurface::Body(index) => (number(index), Value::Nothing),
        ContactSurface::Wall(index) => (Value::Nothing, number(index)),
        ContactSurface::Soft => (Value::Nothing, Value::Nothing),
    };
    visit(Field { quantity: "on_body", ..field }, body);
    visit(Field { quantity: "on_wall", ..field }, wall);
    visit(Field { quantity: "phase", ..field }, Value::Whole(phase_number(contact.phase)));
    let pulses = match contact.phase {
        Phase::MomentCancellation { pulses_left } => Value::Whole(pulses_left.into()),
        Phase::Free | Phase::PreSlide | Phase::Slide => Value::Nothing,
    };
    visit(Field { quantity: "pulses_left", ..field }, pulses);
    visit_vector(Field { quantity: "force", unit: "n", ..field }, contact.force, visit);
    visit(Field { quantity: "depth", unit: "m", ..field }, Value::Real(contact.depth_m));
}

fn phase_number(phase: Phase) -> i128 {
    match phase {
        Phase::Free => 0,
        Phase::MomentCancellation { .. } => 1,
        Phase::PreSlide => 2,
        Phase::Slide => 3,
    }
}

/// `part1`, `part2`, …
fn numbered(part: &'static str) -> impl Iterator<Item = Field> {
    (1..).map(move |number| Field { number: Some(number), ..plain(part) })
}

const fn plain(name: &'static str) -> Field {
    Field { part: name, number: None, quantity: "", axis: "", unit: "", host: None }
}

fn whole(number: u64) -> Value {
    Value::Whole(number.into())
}

fn visit_hosts(
    name: &'static str,
    values: impl Iterator<Item = Value>,
    visit: &mut impl FnMut(Field, Value),
) {
    for (host, value) in (0..).map(HostIndex).zip(values) {
        visit(Field { host: Some(host), ..plain(name) }, value);
    }
}

fn visit_motion(field: Field, pose: &Pose, twist: &Twist, visit: &mut impl FnMut(Field, Value)) {
    visit_vector(Field { quantity: "position", unit: "m", ..field }, pose.position, visit);
    for (axis, number) in AXES.into_iter().zip(pose.orientation.to_array()) {
        visit(Field { quantity: "orientation", axis, ..field }, Value::Real(number));
    }
    visit_vector(Field { quantity: "velocity", unit: "m_per_s", ..field }, twist.linear, visit);
    visit_vector(Field { quantity: "angular_velocity", unit: "rad_per_s", ..field }, twist.angular, visit);
}

fn visit_wrench(
    field: Field,
    [force, torque]: [&'static str; 2],
    wrench: &Wrench,
    visit: &mut impl FnMut(Field, Value),
) {
    visit_vector(Field { quantity: force, unit: "n", ..field }, wrench.force, visit);
    visit_vector(Field { quantity: torque, unit: "n_m", ..field }, wrench.torque, visit);
}

fn visit_vector(field: Field, vector: DVec3, visit: &mut impl FnMut(Field, Value)) {
    for (axis, number) in AXES.into_iter().zip(vector.to_array()) {
        visit(Field { axis, ..field }, Value::Real(number));
    }
}
