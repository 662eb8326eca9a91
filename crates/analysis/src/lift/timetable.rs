//! What happens at each tick of a pattern.

use std::ops::Range;

use cotouch_scene::time::Schedule;

use crate::loop_spec::{Block, BlockId, Delay, Hold, LoopSpec, tick_of_step};
use crate::order::direct_blocks;

use super::layout::Layout;

/// How samples of one clock are used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Way {
    pub(super) clock: Schedule,
    pub(super) delay: Delay,
    pub(super) hold: Hold,
}

/// Something that happens at a tick, all that is held being what is held then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Event {
    /// A register takes the sample of a step.
    Sample { register: usize, step: i64 },
    /// A block puts out what follows from its state.
    Emit { block: usize, step: i64 },
    /// A block gathers its input.
    Gather { block: usize, weight: f64, is_first: bool },
    /// A block has all of its input: it adds what of its output depends on that, and steps.
    Step { block: usize, step: i64 },
}

/// All ticks of a pattern.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Timetable {
    pub(super) ticks: Vec<Tick>,
    /// Which way holds another sample, and of which step.
    pub(super) changes: Vec<(usize, i64)>,
    pub(super) events: Vec<Event>,
    /// For each way with a first-order hold, tick by tick: how far it is from the sample before to the one in use.
    pub(super) shares: Vec<Vec<f64>>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) changes: Range<usize>,
    pub(super) events: Range<usize>,
}

impl Timetable {
    pub(super) fn new(spec: &LoopSpec, layout: &Layout, ways: &[Way]) -> Self {
        let mut timetable = Self { shares: vec![Vec::new(); ways.len()], ..Self::default() };
        let agenda = Agenda::new(spec, layout);
        // The tick from which the next sample is used.
        let mut until = vec![i64::MIN; ways.len()];
        let mut held = vec![0; ways.len()];
        for tick in 0..spec.ticks_per_pattern() as i64 {
            let changes = timetable.changes.len();
            for (index, Way { clock, delay, hold }) in ways.iter().enumerate() {
                if until[index] <= tick {
                    held[index] = delay.step_held_at(clock, tick);
                    until[index] = delay.tick_of_use(clock, held[index] + 1);
                    timetable.changes.push((index, held[index]));
                }
                if *hold == Hold::First {
                    let from = delay.tick_of_use(clock, held[index]);
                    timetable.shares[index].push((tick - from) as f64 / (until[index] - from) as f64);
                }
            }
            let events = timetable.events.len();
            agenda.add_events(tick as u64, &mut timetable.events);
            timetable.ticks.push(Tick {
                changes: changes..timetable.changes.len(),
                events: events..timetable.events.len(),
            });
        }
        timetable
    }
}

/// The order of things at a tick: samples of motions; what blocks put out, whatever their inputs are; blocks whose outputs
/// follow their inputs; samples of forces; all other blocks.
struct Agenda<'a> {
    spec: &'a LoopSpec,
    /// Registers of motions, and of forces.
    motions: Vec<usize>,
    forces: Vec<usize>,
    direct: Vec<usize>,
    others: Vec<usize>,
}

impl<'a> Agenda<'a> {
    fn new(spec: &'a LoopSpec, layout: &Layout) -> Self {
        let carries_force = |&register: &usize| {
            let line = layout.registers[register].line;
            spec.lines[line.0].signal.force().is_some()
        };
        let (forces, motions) = (0..layout.registers.len()).partition(carries_force);
        let direct =
            direct_blocks(spec).unwrap_or_default().into_iter().map(|BlockId(block)| block).collect();
        let others = (0..spec.blocks.len()).filter(|&block| !spec.blocks[block].is_direct()).collect();
        Self { spec, motions, forces, direct, others }
    }

    fn add_events(&self, tick: u64, events: &mut Vec<Event>) {
        let network_step = self.spec.schedule.step_at(tick);
        let sample = |&register: &usize| Some(Event::Sample { register, step: network_step? as i64 });
        events.extend(self.motions.iter().filter_map(sample));
        let emit = |&block: &usize| {
            let step = self.spec.blocks[block].clock.step_at(tick)? as i64;
            Some(Event::Emit { block, step })
        };
        events.extend(self.others.iter().filter_map(emit));
        for block in &self.direct {
            events.extend(emit(block));
            self.add_gathering(*block, tick, events);
        }
        events.extend(self.forces.iter().filter_map(sample));
        self.others.iter().for_each(|&block| self.add_gathering(block, tick, events));
    }

    fn add_gathering(&self, block: usize, tick: u64, events: &mut Vec<Event>) {
        let Block { clock, .. } = &self.spec.blocks[block];
        let step = clock.last_step_at(tick) as i64;
        let weights = self.spec.blocks[block].weights_of_step(step);
        let place = (tick as i64 - tick_of_step(clock, step)) as usize;
        let Some(&weight) = weights.get(place) else { return };
        let is_last = place + 1 == weights.len();
        if weight != 0.0 || is_last {
            let is_first = weights[..place].iter().all(|&weight| weight == 0.0);
            events.push(Event::Gather { block, weight, is_first });
        }
        if is_last {
            events.push(Event::Step { block, step });
        }
    }
}
