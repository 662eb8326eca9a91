//! Every number of a tick under a name with its unit: the one list behind comparing and exporting.

use std::fmt;

use cotouch_scene::geometry::{Pose, Twist, Wrench};
use cotouch_scene::names::HostIndex;
use glam::{DQuat, DVec3};

use crate::record::TickRecord;

/// The name of one number, such as `object_position_x_m` or `step_in_use_host2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    part: &'static str,
    quantity: &'static str,
    axis: &'static str,
    unit: &'static str,
    host: Option<HostIndex>,
}

impl fmt::Display for Field {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.part)?;
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
    /// A real number.
    Real(f64),
    /// A whole number.
    Whole(i128),
    /// Yes or no.
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

/// Hands every number of `record` to `visit`, always in the same order: what was consumed, what came of it, and last
/// the two measurements `lateness_ns` and `compute_ns`.
pub(crate) fn visit_fields(record: &TickRecord, mut visit: impl FnMut(Field, Value)) {
    visit_results(record, &mut visit);
    visit(plain("lateness_ns"), Value::Whole(record.lateness_ns.into()));
    visit(plain("compute_ns"), Value::Whole(record.compute_ns.into()));
}

/// As [`visit_fields`], without the measurements: what a replay must give again.
pub(crate) fn visit_results(record: &TickRecord, visit: &mut impl FnMut(Field, Value)) {
    // Every field is named, so that a new one cannot be forgotten here.
    let TickRecord {
        instant,
        reading,
        device_failed,
        steps_in_use,
        fades,
        object,
        object_force,
        requested,
        commanded,
        governor_acted,
        governor_gain,
        energy_j,
        touches_wall,
        diverged,
        lateness_ns: _,
        compute_ns: _,
    } = record;
    visit(plain("instant_ns"), Value::Whole(instant.0.into()));
    visit_motion("hand", &reading.pose, &reading.twist, visit);
    visit(plain("device_failed"), Value::Flag(*device_failed));
    visit_hosts("step_in_use", steps_in_use.iter().map(|step| step.map_or(Value::Nothing, whole)), visit);
    visit_hosts("fade", fades.iter().map(|&fade| Value::Real(fade)), visit);
    visit_motion("object", &object.pose, &object.twist, visit);
    visit_vector("object", "force", "n", *object_force, visit);
    visit_wrench("requested", requested, visit);
    visit_wrench("commanded", commanded, visit);
    visit(plain("governor_acted"), Value::Whole((*governor_acted).into()));
    visit(plain("governor_gain"), Value::Real(*governor_gain));
    visit(plain("energy_j"), Value::Real(*energy_j));
    visit(plain("touches_wall"), Value::Flag(*touches_wall));
    visit(plain("diverged"), Value::Flag(*diverged));
}

const fn plain(name: &'static str) -> Field {
    Field { part: name, quantity: "", axis: "", unit: "", host: None }
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

fn visit_motion(part: &'static str, pose: &Pose, twist: &Twist, visit: &mut impl FnMut(Field, Value)) {
    visit_vector(part, "position", "m", pose.position, visit);
    visit_quaternion(part, pose.orientation, visit);
    visit_vector(part, "velocity", "m_per_s", twist.linear, visit);
    visit_vector(part, "angular_velocity", "rad_per_s", twist.angular, visit);
}

fn visit_wrench(part: &'static str, wrench: &Wrench, visit: &mut impl FnMut(Field, Value)) {
    visit_vector(part, "force", "n", wrench.force, visit);
    visit_vector(part, "torque", "n_m", wrench.torque, visit);
}

fn visit_vector(
    part: &'static str,
    quantity: &'static str,
    unit: &'static str,
    vector: DVec3,
    visit: &mut impl FnMut(Field, Value),
) {
    for (axis, number) in AXES.into_iter().zip(vector.to_array()) {
        visit(Field { part, quantity, axis, unit, host: None }, Value::Real(number));
    }
}

fn visit_quaternion(part: &'static str, quaternion: DQuat, visit: &mut impl FnMut(Field, Value)) {
    for (axis, number) in AXES.into_iter().zip(quaternion.to_array()) {
        visit(Field { part, quantity: "orientation", axis, unit: "", host: None }, Value::Real(number));
    }
}
