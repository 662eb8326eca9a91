//! All instants of a diagram as whole numbers of one base tick.

use super::error::DiagramError;
use super::time::Time;
use super::{Diagram, Element, Law, Sampled};

/// More instants in a pattern than this are refused.
const MOST_INSTANTS: u64 = 1_000_000;

/// When everything happens.
#[derive(Clone, Debug)]
pub(crate) struct Timetable {
    base: Time,
    /// The pattern, in ticks.
    pub(crate) frame: i64,
    /// For each block: its instants; `None` for plants.
    blocks: Vec<Option<Instants>>,
}

/// When a sampled block acts, in base ticks.
#[derive(Clone, Debug)]
pub(crate) struct Instants {
    /// After which its instants repeat.
    pub(crate) period: i64,
    offsets: Vec<i64>,
    delays: Vec<i64>,
    /// From one sample to the next of an average; the period for everything else.
    pub(crate) sampling: i64,
}

impl Instants {
    /// When output `index` is sampled; 0 is the first at or after time 0.
    pub(crate) fn of(&self, index: i64) -> i64 {
        let count = self.offsets.len() as i64;
        index.div_euclid(count) * self.period + self.offsets[index.rem_euclid(count) as usize]
    }

    /// From when output `index` is used.
    pub(crate) fn use_of(&self, index: i64) -> i64 {
        let count = self.offsets.len() as i64;
        self.of(index) + self.delays[index.rem_euclid(count) as usize]
    }

    /// Which output is used at a tick, and right after it.
    pub(crate) fn used_at(&self, tick: i64) -> i64 {
        let count = self.offsets.len() as i64;
        let within = self.offsets.partition_point(|&offset| offset <= tick.rem_euclid(self.period));
        let mut index = tick.div_euclid(self.period) * count + within as i64 - 1;
        // Delays of many periods are passed over at once.
        let slack = (self.use_of(index) - tick).max(0) / self.period - 1;
        index -= slack.max(0) * count;
        while self.use_of(index) > tick {
            index -= 1;
        }
        index
    }

    /// How many outputs there are in a pattern.
    pub(crate) fn count(&self, frame: i64) -> i64 {
        frame / self.period * self.offsets.len() as i64
    }

    /// Whether there is one instant a period, at its start, and the output is used whole periods later.
    pub(crate) fn is_aligned(&self) -> bool {
        self.offsets == [0] && self.delays[0] % self.period == 0
    }
}

impl Timetable {
    pub(crate) fn new(diagram: &Diagram) -> Result<Self, DiagramError> {
        let clocks: Vec<_> = diagram
            .blocks
            .iter()
            .filter_map(|block| match &block.element {
                Element::Sampled(sampled) => Some((block.name.as_str(), sampled)),
                Element::Plant(_) => None,
            })
            .collect();
        clocks.iter().try_for_each(|(name, sampled)| check_clock(name, sampled))?;
        let too_long = || too_long(&clocks);
        let frame = common(&clocks, Time::common_multiple).ok_or_else(too_long)?;
        let base = base(&clocks).ok_or_else(too_long)?;
        let ticks = |time: Time| time.in_units_of(base).filter(|&ticks| ticks < i64::MAX / 1024);
        let mut blocks = Vec::new();
        let mut count = 0u64;
        let frame_ticks = ticks(frame).ok_or_else(too_long)?;
        for block in &diagram.blocks {
            let Element::Sampled(sampled) = &block.element else {
                blocks.push(None);
                continue;
            };
            let instants = instants(sampled, ticks).ok_or_else(too_long)?;
            // No offset, no sampling: checked above.
            let each = instants.offsets.len() as u64 * (instants.period / instants.sampling) as u64;
            let all = ((frame_ticks / instants.period) as u64).saturating_mul(each);
            count = count.saturating_add(all);
            blocks.push(Some(instants));
        }
        if count > MOST_INSTANTS {
            return Err(too_long());
        }
        Ok(Self { base, frame: frame_ticks, blocks })
    }

    /// The instants of a sampled block; `None` for a plant.
    pub(crate) fn of(&self, block: usize) -> Option<&Instants> {
        self.blocks[block].as_ref()
    }

    /// Ticks in seconds.
    pub(crate) fn seconds(&self, ticks: i64) -> f64 {
        self.base.times(ticks.unsigned_abs()).seconds()
    }
}

fn instants(sampled: &Sampled, ticks: impl Fn(Time) -> Option<i64>) -> Option<Instants> {
    let list = |times: &[Time]| times.iter().map(|&time| ticks(time)).collect::<Option<Vec<_>>>();
    Some(Instants {
        period: ticks(sampled.clock.period)?,
        offsets: list(&sampled.clock.offsets)?,
        delays: list(&sampled.delays)?,
        sampling: ticks(sampling(sampled)?)?,
    })
}

/// From one sample to the next.
fn sampling(sampled: &Sampled) -> Option<Time> {
    match &sampled.law {
        Law::Average { weights, .. } => sampled.clock.period.divided_by(weights.len() as u128),
        Law::Linear(_) | Law::FirstOrderHold { .. } => Some(sampled.clock.period),
    }
}

fn common(clocks: &[(&str, &Sampled)], of: fn(Time, Time) -> Option<Time>) -> Option<Time> {
    let mut periods = clocks.iter().map(|(_, sampled)| sampled.clock.period);
    let first = periods.next()?;
    periods.try_fold(first, of).filter(|time| time.is_manageable())
}

/// The longest time of which every instant is a whole multiple.
fn base(clocks: &[(&str, &Sampled)]) -> Option<Time> {
    let mut base = Time::ZERO;
    for (_, sampled) in clocks {
        for &time in sampled.clock.offsets.iter().chain(&sampled.delays).chain(&sampling(sampled)) {
            base = base.common_divisor(time)?;
        }
        base = base.common_divisor(sampled.clock.period)?;
    }
    base.is_manageable().then_some(base)
}

fn check_clock(name: &str, sampled: &Sampled) -> Result<(), DiagramError> {
    let error = |problem: String| Err(DiagramError::Clock { block: name.to_owned(), problem });
    let clock = &sampled.clock;
    if clock.period.is_zero() {
        return error("has a period of 0 s; it must be above 0".to_owned());
    }
    let times = clock.offsets.iter().chain(&sampled.delays).chain([&clock.period]);
    if let Some(time) = times.into_iter().find(|time| !time.is_manageable()) {
        return error(format!("needs times whose numerator and denominator are at most 1e18; found {time}"));
    }
    let single = !matches!(sampled.law, Law::Linear(_));
    if clock.offsets.is_empty() || single && clock.offsets.len() > 1 {
        let needed = if single { "one offset" } else { "at least one offset" };
        return error(format!("needs {needed}; found {}", clock.offsets.len()));
    }
    if sampled.delays.len() != clock.offsets.len() {
        let (found, needed) = (sampled.delays.len(), clock.offsets.len());
        return error(format!("needs a delay for each of {needed} offsets; found {found}"));
    }
    let is_before = |one: Time, other: Time| {
        // One has terms of at most 1e18, so the cross products fit.
        one.common_divisor(other)
            .and_then(|unit| Some((one.in_units_of(unit)?, other.in_units_of(unit)?)))
            .map_or(one.seconds() < other.seconds(), |(one, other)| one < other)
    };
    let bounds = clock.offsets.iter().copied().chain([clock.period]);
    match clock.offsets.iter().zip(bounds.skip(1)).find(|&(&one, next)| !is_before(one, next)) {
        Some((one, next)) => error(format!(
            "needs rising offsets below its period of {}; found {one}, then {next}",
            clock.period
        )),
        None => Ok(()),
    }
}

/// Names the two clocks that fit each other worst.
fn too_long(clocks: &[(&str, &Sampled)]) -> DiagramError {
    let pairs =
        clocks.iter().enumerate().flat_map(|(i, one)| clocks[..i].iter().map(move |other| (one, other)));
    let misfit = |(one, other): (Time, Time)| {
        let common = one.common_multiple(other).map_or(f64::INFINITY, Time::seconds);
        common / one.seconds().max(other.seconds())
    };
    let periods =
        |(one, other): &(&(&str, &Sampled), &(&str, &Sampled))| (one.1.clock.period, other.1.clock.period);
    let worst = pairs.max_by(|one, other| misfit(periods(one)).total_cmp(&misfit(periods(other))));
    let Some((one, other)) = worst else {
        return DiagramError::NoClock;
    };
    let slower = one.1.clock.period.seconds() >= other.1.clock.period.seconds();
    let (slow, fast) = if slower { (one, other) } else { (other, one) };
    let (slow_period, fast_period) = (slow.1.clock.period, fast.1.clock.period);
    let ratio = (slow_period.seconds() / fast_period.seconds()).round().max(1.0);
    DiagramError::TooLong {
        slow: slow.0.to_owned(),
        slow_period: slow_period.to_string(),
        fast: fast.0.to_owned(),
        fast_period: fast_period.to_string(),
        most: MOST_INSTANTS,
        suggestion: fast_period.times(ratio as u64).to_string(),
    }
}
