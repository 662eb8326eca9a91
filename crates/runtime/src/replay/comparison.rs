//! Comparing what came of a recorded tick with what comes of it now, bit for bit.

use std::fmt;

use cotouch_scene::names::HostIndex;

use crate::record::TickRecord;
use crate::tick_fields::{Field, Value, visit_results};

/// What came of comparing a recording with its replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Comparison {
    /// How many ticks were compared.
    pub ticks: u64,
    /// The first number that differs, if one does.
    pub first_difference: Option<TickDifference>,
}

impl Comparison {
    /// Whether everything compared so far was the same, bit for bit.
    #[must_use]
    pub fn identical(&self) -> bool {
        self.first_difference.is_none()
    }

    /// Compares one more tick of `host`.
    pub fn compare(&mut self, host: HostIndex, tick: u64, recorded: &TickRecord, replayed: &TickRecord) {
        self.ticks += 1;
        if self.first_difference.is_none() {
            let difference = compare_tick(recorded, replayed);
            self.first_difference = difference.map(|difference| TickDifference { host, tick, difference });
        }
    }
}

/// Where a replay first differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TickDifference {
    /// The host whose tick differs.
    pub host: HostIndex,
    /// The index of that tick.
    pub tick: u64,
    /// The number that differs.
    pub difference: Difference,
}

impl fmt::Display for TickDifference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} tick {}: {}", self.host, self.tick, self.difference)
    }
}

/// A number that is not the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its name with its unit, as in the CSV export.
    pub field: String,
    /// As recorded; empty when the recording has no such number.
    pub recorded: String,
    /// As replayed; empty when the replay has no such number.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |text: &str| if text.is_empty() { "nothing".to_owned() } else { text.to_owned() };
        write!(formatter, "{} was {} and is {}", self.field, shown(&self.recorded), shown(&self.replayed))
    }
}

/// The first number of a tick that differs, in the order of the tables of exported ticks; real numbers are compared bit for
/// bit. `lateness_ns` and `compute_ns` are measurements and may differ.
#[must_use]
pub(crate) fn compare_tick(recorded: &TickRecord, replayed: &TickRecord) -> Option<Difference> {
    let (left, right) = (fields(recorded), fields(replayed));
    let pairs = left.iter().zip(&right);
    if let Some((a, b)) = pairs.clone().find(|(a, b)| a != b) {
        // Where one has a host more than the other, the names themselves part: the longer list is the odd one.
        return Some(match (a.0 == b.0, left.len() >= right.len()) {
            (true, _) => difference(a.0, Some(a.1), Some(b.1)),
            (false, true) => difference(a.0, Some(a.1), None),
            (false, false) => difference(b.0, None, Some(b.1)),
        });
    }
    let longer = |list: &[(Field, Value)], other: usize| list.get(other).copied();
    let extra = longer(&left, right.len()).map(|(field, value)| difference(field, Some(value), None));
    extra.or_else(|| longer(&right, left.len()).map(|(field, value)| difference(field, None, Some(value))))
}

fn difference(field: Field, recorded: Option<Value>, replayed: Option<Value>) -> Difference {
    let text = |value: Option<Value>| value.map(exact_text).unwrap_or_default();
    Difference { field: field.to_string(), recorded: text(recorded), replayed: text(replayed) }
}

/// Two numbers that are not the same must not look the same: not-a-number has many bit patterns.
fn exact_text(value: Value) -> String {
    match value {
        Value::Real(number) if number.is_nan() => format!("NaN (bits {:#018x})", number.to_bits()),
        value => value.to_string(),
    }
}

fn fields(record: &TickRecord) -> Vec<(Field, Value)> {
    let mut fields = Vec::with_capacity(64);
    visit_results(record, &mut |field, value| fields.push((field, value)));
    fields
}

#[cfg(test)]
mod tests {
    use cotouch_host::{ContactPoint, ContactRecord, ContactSurface};
    use cotouch_scene::geometry::{Reading, Wrench};
    use cotouch_world::BodyState;
    use cotouch_world::Phase;
    use glam::DVec3;

    use super::*;

    type Change = fn(&mut TickRecord);

    fn contact() -> ContactRecord {
        ContactRecord {
            point: ContactPoint::Finger { host: HostIndex(0), finger: 0 },
            surface: ContactSurface::Body(0),
            phase: Phase::PreSlide,
            force: DVec3::X,
            depth_m: 1e-3,
        }
    }

    #[test]
    fn every_result_counts_and_no_measurement_does() {
        let mut base = TickRecord::default();
        base.steps_in_use.push(Some(3));
        base.fades.push(1.0);
        base.bodies.push(BodyState::default());
        base.readings.push(Reading::default());
        base.commanded.push(Wrench::default());
        base.governor_acted.push(0);
        base.contacts.push(contact());
        let changes: [(&str, Change); 14] = [
            ("body1_position_x_m", |tick| tick.bodies[0].pose.position.x = -0.0),
            ("body1_velocity_z_m_per_s", |tick| tick.bodies[0].twist.linear.z = f64::NAN),
            ("finger1_orientation_w", |tick| tick.readings[0].pose.orientation.w = 0.5),
            ("step_in_use_host1", |tick| tick.steps_in_use[0] = None),
            ("step_in_use_host2", |tick| tick.steps_in_use.push(None)),
            ("fade_host1", |tick| tick.fades.clear()),
            ("finger1_commanded_force_y_n", |tick| tick.commanded[0].force.y = f64::MIN_POSITIVE / 4.0),
            ("finger1_governor_acted", |tick| tick.governor_acted[0] = 8),
            ("contact1_phase", |tick| tick.contacts[0].phase = Phase::Slide),
            ("contact1_finger", |tick| {
                tick.contacts[0].point = ContactPoint::Finger { host: HostIndex(0), finger: 1 };
            }),
            ("contact1_on_body", |tick| tick.contacts[0].surface = ContactSurface::Wall(0)),
            ("contact1_depth_m", |tick| tick.contacts[0].depth_m = 2e-3),
            ("contact2_host", |tick| tick.contacts.push(contact())),
            ("diverged", |tick| tick.diverged = true),
        ];
        for (field, change) in changes {
            let mut changed = base.clone();
            change(&mut changed);
            assert_eq!(compare_tick(&base, &changed).unwrap().field, field);
            assert_eq!(compare_tick(&changed, &base).unwrap().field, field);
            assert_eq!(compare_tick(&changed, &changed.clone()), None, "{field}");
        }
        let measured = TickRecord { lateness_ns: 5, compute_ns: 7, ..base.clone() };
        assert_eq!(compare_tick(&base, &measured), None);
    }

    #[test]
    fn the_first_difference_is_kept() {
        let base = TickRecord::default();
        let other = TickRecord { energy_j: -0.0, ..TickRecord::default() };
        let mut comparison = Comparison::default();
        comparison.compare(HostIndex(0), 0, &base, &base);
        assert!(comparison.identical());
        comparison.compare(HostIndex(1), 1, &base, &other);
        comparison.compare(HostIndex(0), 2, &other, &base);
        assert!(!comparison.identical() && comparison.ticks == 3);
        let text = comparison.first_difference.unwrap().to_string();
        assert_eq!(text, "host2 tick 1: energy_j was 0.0 and is -0.0");
    }
}
