//! The slow simulation of a soft object as a host's ticks see it: where inputs go, and from where frames come.
//!
//! Period p of the simulation begins at tick k_p. Its frame is due at tick k_(p+1+d), d =
//! `local_model.result_delay_periods`; one that comes later is taken at the first tick at which it is there. Frames come,
//! and are taken, in the order of their periods.

use std::collections::VecDeque;
use std::sync::Arc;

use cotouch_host::{SlowFrame, SlowInput, SlowLoop};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Scene};
use cotouch_scene::time::Schedule;
use cotouch_soft::SoftError;
use hdrhistogram::Histogram;

/// Frames, or inputs in a replay, that wait at most; beyond that the oldest go.
const MAX_WAITING: usize = 256;

/// A host's way to its slow simulation.
pub struct SlowPort {
    schedule: Schedule,
    result_delay_periods: u64,
    rest: Arc<SlowFrame>,
    way: Way,
    /// Frames that are not in use yet.
    waiting: VecDeque<Arc<SlowFrame>>,
    counts: SlowCounts,
}

/// Who steps the simulation, and when.
enum Way {
    /// Virtual time: here and at once.
    Inline(Box<SlowLoop>),
    /// A replay: here, when the recording says that the result came into use.
    Replayed { simulation: Box<SlowLoop>, inputs: VecDeque<SlowInput> },
    /// Real time: a thread of its own.
    Thread { inputs: rtrb::Producer<SlowInput>, results: rtrb::Consumer<SlowResult> },
}

/// What a simulation's thread hands back.
pub(crate) struct SlowResult {
    pub(crate) frame: Arc<SlowFrame>,
    pub(crate) compute_ns: i64,
}

/// How a host's slow simulation did.
#[derive(Clone, Debug)]
pub(crate) struct SlowCounts {
    /// Frames that came into use.
    pub(crate) steps: u64,
    /// Those of them that came after the tick at which they were due.
    pub(crate) late: u64,
    /// Periods whose input found the simulation busy, and were not simulated.
    pub(crate) missed: u64,
    /// How long steps took, in real time.
    pub(crate) compute_ns: Histogram<u64>,
}

impl SlowCounts {
    fn new() -> Self {
        // From 1 ns to 100 s with three digits; nothing is allocated after this.
        let compute_ns =
            Histogram::new_with_bounds(1, 100_000_000_000, 3).expect("constant bounds are sound");
        Self { steps: 0, late: 0, missed: 0, compute_ns }
    }
}

/// The simulation of a scene's soft object; `None` where it has none.
///
/// # Errors
/// When the technique cannot work with mesh or material.
pub fn slow_simulation(scene: &Scene) -> Result<Option<SlowLoop>, SoftError> {
    scene.soft.exists().then(|| SlowLoop::new(scene)).transpose()
}

/// Whether `host` simulates the soft object of `scene`.
#[must_use]
pub(crate) fn is_simulated_at(scene: &Scene, host: HostIndex) -> bool {
    let has_world = scene.session.architecture == Architecture::Distributed || host == HostIndex::FIRST;
    scene.soft.exists() && has_world
}

impl SlowPort {
    /// For virtual time: the simulation steps when it is asked.
    #[must_use]
    pub fn inline(scene: &Scene, simulation: SlowLoop) -> Self {
        let rest = simulation.rest_frame();
        Self::new(scene, rest, Way::Inline(Box::new(simulation)))
    }

    /// For a replay: results come into use when [`take_as_recorded`](Self::take_as_recorded) says so.
    pub(crate) fn replayed(scene: &Scene, simulation: SlowLoop) -> Self {
        let rest = simulation.rest_frame();
        Self::new(scene, rest, Way::Replayed { simulation: Box::new(simulation), inputs: VecDeque::new() })
    }

    /// For real time: a thread takes inputs and hands results back.
    pub(crate) fn threaded(
        scene: &Scene,
        rest: Arc<SlowFrame>,
        inputs: rtrb::Producer<SlowInput>,
        results: rtrb::Consumer<SlowResult>,
    ) -> Self {
        Self::new(scene, rest, Way::Thread { inputs, results })
    }

    fn new(scene: &Scene, rest: Arc<SlowFrame>, way: Way) -> Self {
        Self {
            schedule: scene.slow_schedule(),
            result_delay_periods: scene.local_model.result_delay_periods.into(),
            rest,
            way,
            waiting: VecDeque::with_capacity(MAX_WAITING),
            counts: SlowCounts::new(),
        }
    }

    /// The body at rest, in use from the start.
    #[must_use]
    pub fn rest_frame(&self) -> Arc<SlowFrame> {
        Arc::clone(&self.rest)
    }

    /// Hands over what a period is to be simulated with. In real time a period that finds the simulation busy with
    /// the two before it is left out; there is no allocation, lock or system call.
    pub(crate) fn ask(&mut self, input: &SlowInput) {
        match &mut self.way {
            Way::Inline(simulation) => {
                let frame = simulation.step(input);
                self.wait(frame);
            }
            Way::Replayed { inputs, .. } => {
                if inputs.len() >= MAX_WAITING {
                    inputs.pop_front();
                }
                inputs.push_back(input.clone());
            }
            Way::Thread { inputs, .. } => {
                self.counts.missed += u64::from(inputs.push(input.clone()).is_err());
            }
        }
    }

    /// The next frame that is due at `tick`, if it is there; asked until there is none. No allocation, no lock.
    pub(crate) fn due(&mut self, tick: u64) -> Option<Arc<SlowFrame>> {
        self.collect();
        let period = self.waiting.front()?.period;
        let due = period.map_or(0, |period| self.due_at(period));
        // A replay lets frames wait only when they are to be taken.
        if due > tick && !matches!(self.way, Way::Replayed { .. }) {
            return None;
        }
        self.counts.steps += 1;
        self.counts.late += u64::from(due < tick);
        self.waiting.pop_front()
    }

    /// In a replay: the frame of `period` comes into use at the next tick. Periods before it that have not been taken
    /// were not simulated.
    pub(crate) fn take_as_recorded(&mut self, period: u64) {
        let Way::Replayed { simulation, inputs } = &mut self.way else { return };
        while let Some(input) = inputs.pop_front() {
            if input.period == period {
                let frame = simulation.step(&input);
                return self.wait(frame);
            }
            if input.period > period {
                return inputs.push_front(input);
            }
        }
    }

    fn due_at(&self, period: u64) -> u64 {
        self.schedule.tick_of_step(period.saturating_add(1 + self.result_delay_periods))
    }

    /// Takes in what the simulation's thread has handed back.
    fn collect(&mut self) {
        let Way::Thread { results, .. } = &mut self.way else { return };
        while self.waiting.len() < MAX_WAITING
            && let Ok(SlowResult { frame, compute_ns }) = results.pop()
        {
            self.counts.compute_ns.saturating_record(compute_ns.max(1) as u64);
            self.waiting.push_back(frame);
        }
    }

    fn wait(&mut self, frame: Arc<SlowFrame>) {
        if self.waiting.len() >= MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(frame);
    }

    /// The simulation; `None` where it is in another thread.
    #[must_use]
    pub fn simulation(&self) -> Option<&SlowLoop> {
        match &self.way {
            Way::Inline(simulation) | Way::Replayed { simulation, .. } => Some(simulation),
            Way::Thread { .. } => None,
        }
    }

    /// The simulation, to change its state; `None` where it is in another thread.
    #[cfg(feature = "testing")]
    pub fn simulation_mut(&mut self) -> Option<&mut SlowLoop> {
        match &mut self.way {
            Way::Inline(simulation) | Way::Replayed { simulation, .. } => Some(simulation),
            Way::Thread { .. } => None,
        }
    }

    /// Frames that are not in use yet, the next one first.
    #[must_use]
    pub fn waiting(&self) -> &VecDeque<Arc<SlowFrame>> {
        &self.waiting
    }

    /// The same, to put others in their places.
    #[cfg(feature = "testing")]
    pub fn waiting_mut(&mut self) -> &mut VecDeque<Arc<SlowFrame>> {
        &mut self.waiting
    }

    pub(crate) fn counts(&self) -> &SlowCounts {
        &self.counts
    }

    /// An independent copy; `None` of one whose simulation is in another thread.
    #[cfg(feature = "testing")]
    pub(crate) fn fork(&self) -> Option<Self> {
        let way = match &self.way {
            Way::Inline(simulation) => Way::Inline(simulation.clone()),
            Way::Replayed { simulation, inputs } => {
                Way::Replayed { simulation: simulation.clone(), inputs: inputs.clone() }
            }
            Way::Thread { .. } => return None,
        };
        let mut waiting = VecDeque::with_capacity(MAX_WAITING);
        waiting.extend(self.waiting.iter().cloned());
        Some(Self {
            schedule: self.schedule,
            result_delay_periods: self.result_delay_periods,
            rest: Arc::clone(&self.rest),
            way,
            waiting,
            counts: self.counts.clone(),
        })
    }
}
