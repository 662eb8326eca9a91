//! All instants of a diagram as whole numbers of one base tick.

use super::error::{DiagramError, Misfit};
use super::model::{Diagram, Element, Law, Sampled};
use super::time::Time;

/// More instants in a pattern than this are refused.
const MAX_INSTANTS: u64 = 1_000_000;

/// When everything happens.
#[derive(Clone, Debug)]
pub(crate) struct DiagramTimetable {
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
    weights: Vec<Vec<f64>>,
    /// From one sample of an input to the next; the period where one is all.
    pub(crate) spacing: i64,
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

    /// Which output is used at a tick, and right after it. Later outputs are not used earlier.
    pub(crate) fn used_at(&self, tick: i64) -> i64 {
        let count = self.offsets.len() as i64;
        let within = self.offsets.partition_point(|&offset| offset <= tick.rem_euclid(self.period));
        let newest = tick.div_euclid(self.period) * count + within as i64 - 1;
        let longest = self.delays.iter().copied().max().unwrap_or(0);
        let mut oldest = newest - (longest / self.period + 2) * count;
        let mut beyond = newest + 1;
        while beyond - oldest > 1 {
            let middle = oldest + (beyond - oldest) / 2;
            if self.use_of(middle) <= tick { oldest = middle } else { beyond = middle }
        }
        oldest
    }

    /// When the samples are taken of which the input of output `index` is the sum, and their weights.
    pub(crate) fn samples(&self, index: i64) -> impl Iterator<Item = (i64, f64)> {
        let list = &self.weights[index.rem_euclid(self.offsets.len() as i64) as usize];
        let first = self.of(index);
        list.iter().zip(0..).map(move |(&weight, place)| (first + place * self.spacing, weight))
    }

    /// Whether inputs are sums of several samples.
    pub(crate) fn gathers(&self) -> bool {
        self.weights.iter().any(|list| list.len() > 1)
    }

    /// How many outputs there are in a pattern.
    pub(crate) fn count(&self, frame: i64) -> i64 {
        frame / self.period * self.offsets.len() as i64
    }

    /// What is there besides one instant a period, at its start, and an output that is used whole periods later.
    pub(crate) fn misalignment(&self) -> Option<&'static str> {
        match (self.offsets.as_slice(), self.delays[0] % self.period) {
            ([0], 0) => None,
            ([0], _) => Some("is used a part of a period later"),
            ([_], _) => Some("has a phase"),
            _ => Some("has several instants a period"),
        }
    }
}

impl DiagramTimetable {
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
        if clocks.is_empty() {
            return Err(DiagramError::NoClock);
        }
        let too_long = || too_long(&clocks);
        let frame = common_period(&clocks).ok_or_else(too_long)?;
        let base = base(&clocks, frame)?;
        let mut blocks = Vec::new();
        let mut count = 0u64;
        for block in &diagram.blocks {
            let Element::Sampled(sampled) = &block.element else {
                blocks.push(None);
                continue;
            };
            let instants = instants(sampled, base).ok_or_else(|| no_unit(&block.name))?;
            let each = instants.weights.iter().map(|list| list.len() as u64).sum::<u64>();
            let periods = ticks(frame, base).unwrap_or(0) / instants.period;
            count = count.saturating_add(each.saturating_mul(periods.unsigned_abs()));
            blocks.push(Some(instants));
        }
        if count > MAX_INSTANTS {
            return Err(too_long());
        }
        let frame_ticks = ticks(frame, base).ok_or_else(too_long)?;
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

/// A time in base ticks, if there are not too many to count with.
fn ticks(time: Time, base: Time) -> Option<i64> {
    time.in_units_of(base).filter(|&ticks| ticks < i64::MAX / 1024)
}

fn instants(sampled: &Sampled, base: Time) -> Option<Instants> {
    let list = |times: &[Time]| times.iter().map(|&time| ticks(time, base)).collect::<Option<Vec<_>>>();
    Some(Instants {
        period: ticks(sampled.clock.period, base)?,
        offsets: list(&sampled.clock.offsets)?,
        delays: list(&sampled.delays)?,
        weights: sampled.weights.clone(),
        spacing: ticks(spacing(sampled), base)?,
    })
}

/// From one sample of an input to the next.
fn spacing(sampled: &Sampled) -> Time {
    let gathers = sampled.weights.iter().any(|list| list.len() > 1);
    if gathers { sampled.spacing } else { sampled.clock.period }
}

fn common_period(clocks: &[(&str, &Sampled)]) -> Option<Time> {
    let mut periods = clocks.iter().map(|(_, sampled)| sampled.clock.period);
    let first = periods.next()?;
    periods.try_fold(first, |common, period| {
        common.common_multiple(period).filter(|common| common.is_manageable())
    })
}

/// The longest time of which every instant is a whole multiple.
fn base(clocks: &[(&str, &Sampled)], frame: Time) -> Result<Time, DiagramError> {
    let mut base = frame;
    for (name, sampled) in clocks {
        let times = sampled.clock.offsets.iter().chain(&sampled.delays).copied().chain([spacing(sampled)]);
        for time in times {
            let finer = base.common_divisor(time).filter(|base| base.is_manageable());
            base = finer.filter(|&base| ticks(frame, base).is_some()).ok_or_else(|| no_unit(name))?;
        }
    }
    Ok(base)
}

fn no_unit(name: &str) -> DiagramError {
    let problem = "has instants or delays that are whole multiples of no common unit of time with those of the other \
                   blocks, or only of one that is too short to count with; use simpler fractions of the period"
        .to_owned();
    DiagramError::Clock { block: name.to_owned(), problem }
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
    let period = |clock: &(&str, &Sampled)| clock.1.clock.period;
    let instants = |one: &(&str, &Sampled), other: &(&str, &Sampled)| {
        let common = period(one).common_multiple(period(other)).map_or(f64::INFINITY, Time::seconds);
        common / period(one).seconds().min(period(other).seconds())
    };
    let worst = pairs.max_by(|a, b| instants(a.0, a.1).total_cmp(&instants(b.0, b.1)));
    let busy = |name: &str, within: Time| {
        let problem =
            format!("has more than {MAX_INSTANTS} instants within {within}; at most as many are allowed");
        DiagramError::Clock { block: name.to_owned(), problem }
    };
    let (slow, fast) = match worst {
        Some((one, other)) if period(one).seconds() >= period(other).seconds() => (one, other),
        Some((one, other)) => (other, one),
        None => return clocks.first().map_or(DiagramError::NoClock, |only| busy(only.0, period(only))),
    };
    if period(slow).in_units_of(period(fast)).is_some() {
        return busy(fast.0, period(slow));
    }
    let ratio = (period(slow).seconds() / period(fast).seconds()).round().clamp(1.0, MAX_INSTANTS as f64);
    DiagramError::TooLong(Box::new(Misfit {
        slow: slow.0.to_owned(),
        slow_period: period(slow),
        fast: fast.0.to_owned(),
        fast_period: period(fast),
        most: MAX_INSTANTS,
        suggestion: period(fast).times(ratio as u64),
    }))
}
