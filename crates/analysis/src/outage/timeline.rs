//! Who hears whom in an outage, tick by tick, as a running session notices it.
//!
//! In an outage packets that are sent do not arrive. A receiver goes on with the sample that it holds; after
//! `session.peer_timeout_s` without a sample it takes the sender for gone, and lets its coupling to it fade out within
//! `session.peer_fade_s`; it goes on sending to it, for [`MAX_SILENCE_S`]. Once samples arrive again, the
//! coupling fades in as slowly, from the first sample on that is used after it had faded out. A client of a centralized session that does not
//! hear its server has its force released by the governor, and back through a soft start.

use cotouch_scene::limits::{MAX_RETRY_S, MAX_SILENCE_S};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::SceneValues;
use cotouch_scene::time::Schedule;

use crate::compile::delay;
use crate::loop_spec::{first_step_from, tick_of_step};

/// A share of a tick within which an instant counts as that tick's.
const TICK_ACCURACY: f64 = 1e-6;

/// Whose packets do not arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Silent {
    Everybody,
    Only(HostIndex),
}

impl Silent {
    fn covers(self, host: HostIndex) -> bool {
        self == Self::Everybody || self == Self::Only(host)
    }
}

/// The network steps whose packets are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LostSteps {
    pub(super) first: i64,
    pub(super) count: i64,
}

/// An outage, in ticks.
#[derive(Clone, Debug)]
pub(super) struct Timeline {
    /// When it begins, and the first network step after it.
    pub(super) begins: i64,
    pub(super) ends: i64,
    /// From when on hosts that lost each other take each other for gone; none where nobody does.
    pub(super) lets_go: Option<i64>,
    /// From when on everything is as it was before.
    pub(super) is_over: i64,
    users: u8,
    /// From host `from` to host `to` at `to·users + from`.
    ways: Vec<Way>,
    fade_per_tick: f64,
    release_ticks: i64,
    soft_start_ticks: i64,
}

/// The way to one host from another.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Way {
    /// Samples that would be taken from the first of these ticks on and before the second never arrive.
    lost: Option<(i64, i64)>,
    gone: Option<Gone>,
    meets: Option<Meeting>,
}

/// When a receiver brings together what came apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Meeting {
    pub(super) tick: i64,
    /// Whether forces go on from what they were; else from nothing.
    pub(super) goes_on: bool,
}

/// When a receiver takes a sender for gone, hears it again, and when the first sample is taken and used with which its coupling
/// fades in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gone {
    from: i64,
    heard: i64,
    sampled: i64,
    rises: i64,
}

/// What the governor of a client makes of a force F, given the one F₀ that it let through last before its release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Governed {
    /// So much of F.
    Present(f64),
    /// So much of F₀.
    Former(f64),
}

/// How a session makes out that a host is gone.
struct Notice<'a> {
    scene: &'a SceneValues,
    schedule: Schedule,
    lost: LostSteps,
}

impl Timeline {
    /// Of an outage in which packets of these steps are lost. Where the loop does not know of fades, samples are held throughout.
    pub(super) fn new(scene: &SceneValues, silent: Silent, lost: LostSteps, fades: bool) -> Self {
        let schedule = scene.schedule();
        let period_s = schedule.control().period_s();
        let ticks = |seconds: f64| schedule.control().ticks_in(seconds) as i64;
        let (begins, ends) =
            (tick_of_step(&schedule, lost.first), tick_of_step(&schedule, lost.first + lost.count));
        let mut timeline = Self {
            begins,
            ends,
            lets_go: None,
            is_over: ends,
            users: scene.session.users,
            ways: vec![Way::default(); usize::from(scene.session.users).pow(2)],
            fade_per_tick: period_s / scene.session.peer_fade_s.max(period_s),
            release_ticks: ticks(scene.governor.release_s),
            soft_start_ticks: ticks(scene.governor.soft_start_s),
        };
        let notice = Notice { scene, schedule, lost };
        for to in scene.hosts() {
            for from in to.others(scene.session.users).filter(|&from| silent.covers(from)) {
                timeline.cut(&notice, to, from, silent, fades);
            }
        }
        if fades && scene.session.rejoin_s > 0.0 {
            timeline.meet_again(&notice);
        }
        timeline
    }

    /// Nothing is lost: the same ticks without an outage.
    pub(super) fn without_outage(scene: &SceneValues, first: i64) -> Self {
        Self::new(scene, Silent::Everybody, LostSteps { first, count: 0 }, false)
    }

    fn cut(&mut self, notice: &Notice<'_>, to: HostIndex, from: HostIndex, silent: Silent, fades: bool) {
        let gone = if fades { notice.gone(to, from, silent, self.fade_ticks()) } else { None };
        let until = gone.map_or(self.ends, |gone| gone.sampled);
        *self.way_mut(to, from) = Way { lost: Some((self.begins, until)), gone, meets: None };
        let Some(gone) = gone else { return };
        self.lets_go = Some(self.lets_go.map_or(gone.from, |first| first.min(gone.from)));
        let soft_start = (gone.from + self.release_ticks.max(1)).max(gone.heard) + self.soft_start_ticks;
        self.is_over = self.is_over.max(gone.rises + self.fade_ticks()).max(soft_start);
    }

    /// Sets when hosts bring together what came apart: as a coupling begins to fade in, or with the first sample after a gap.
    fn meet_again(&mut self, notice: &Notice<'_>) {
        let scene = notice.scene;
        let rejoining =
            (scene.session.rejoin_s * scene.rates.control_hz.hz()).ceil() as i64 + self.fade_ticks();
        for to in scene.hosts() {
            for from in to.others(scene.session.users) {
                let Way { lost, gone, .. } = self.way(to, from);
                let meets = match (gone, lost) {
                    (Some(gone), _) => Some(Meeting { tick: gone.rises, goes_on: false }),
                    (None, Some(lost)) => notice.after_gap(to, from, lost),
                    (None, None) => None,
                };
                self.way_mut(to, from).meets = meets;
                self.is_over = self.is_over.max(meets.map_or(0, |meets| meets.tick + rejoining));
            }
        }
    }

    /// When `to` brings together what came apart from what `from` says, if it does.
    pub(super) fn meets(&self, to: HostIndex, from: HostIndex) -> Option<Meeting> {
        self.way(to, from).meets
    }

    /// The first tick at which a host does so.
    pub(super) fn first_meeting(&self) -> Option<i64> {
        self.ways.iter().filter_map(|way| Some(way.meets?.tick)).min()
    }

    /// Ticks in which a coupling fades out.
    fn fade_ticks(&self) -> i64 {
        (self.fade_per_tick.recip() - TICK_ACCURACY).ceil() as i64
    }

    fn way(&self, to: HostIndex, from: HostIndex) -> Way {
        self.ways[to.index() * usize::from(self.users) + from.index()]
    }

    fn way_mut(&mut self, to: HostIndex, from: HostIndex) -> &mut Way {
        &mut self.ways[to.index() * usize::from(self.users) + from.index()]
    }

    /// Whether a sample that is taken at this tick never arrives.
    pub(super) fn loses(&self, to: HostIndex, from: HostIndex, tick: i64) -> bool {
        self.way(to, from).lost.is_some_and(|(first, end)| (first..end).contains(&tick))
    }

    /// How far a host's coupling to another has faded in at a tick, 0 to 1.
    pub(super) fn fade(&self, to: HostIndex, from: HostIndex, tick: i64) -> f64 {
        let Some(gone) = self.way(to, from).gone else { return 1.0 };
        let share = |since: i64| ((tick - since + 1) as f64 * self.fade_per_tick).clamp(0.0, 1.0);
        if tick >= gone.rises { share(gone.rises) } else { 1.0 - share(gone.from) }
    }

    pub(super) const fn users(&self) -> u8 {
        self.users
    }

    /// How many peers are there for a host, those that fade by their share.
    pub(super) fn present_peers(&self, to: HostIndex, tick: i64) -> f64 {
        to.others(self.users).map(|from| self.fade(to, from, tick)).sum()
    }

    /// What the governor of a client makes of its force at a tick.
    pub(super) fn governed(&self, client: HostIndex, tick: i64) -> Governed {
        let Some(gone) = self.way(client, HostIndex::FIRST).gone else { return Governed::Present(1.0) };
        let smooth_step = |ticks: i64, all: i64| {
            let share = ticks as f64 / all as f64;
            share * share * (3.0 - 2.0 * share)
        };
        let released = gone.from + self.release_ticks.max(1);
        let soft_start = released.max(gone.heard);
        match tick {
            _ if tick < gone.from => Governed::Present(1.0),
            _ if tick + 1 < released => {
                Governed::Former(1.0 - smooth_step(tick - gone.from + 1, self.release_ticks))
            }
            _ if tick < soft_start => Governed::Present(0.0),
            _ if tick < soft_start + self.soft_start_ticks => {
                Governed::Present(smooth_step(tick - soft_start, self.soft_start_ticks))
            }
            _ => Governed::Present(1.0),
        }
    }
}

impl Notice<'_> {
    fn instant_s(&self, step: i64) -> f64 {
        tick_of_step(&self.schedule, step) as f64 * self.schedule.control().period_s()
    }

    fn tick_at(&self, instant_s: f64) -> i64 {
        (instant_s * self.schedule.control().hz() - TICK_ACCURACY).ceil() as i64
    }

    fn latency_s(&self, to: HostIndex, from: HostIndex) -> f64 {
        self.scene.impairment(from, to).latency_s
    }

    /// When `to` uses the first sample of `from` after those of these ticks are lost, if that comes after a gap.
    fn after_gap(&self, to: HostIndex, from: HostIndex, (first, end): (i64, i64)) -> Option<Meeting> {
        let gap_steps = self.scene.rejoin_gap_steps() as i64;
        let last_before = first_step_from(&self.schedule, first) - 1;
        let first_after = first_step_from(&self.schedule, end);
        let used = delay(self.scene, from, to).tick_of_use(&self.schedule, first_after);
        (first_after - last_before > gap_steps).then_some(Meeting { tick: used, goes_on: true })
    }

    /// When `to` takes `from` for gone, if it does, and hears it again at the latest.
    fn gone(&self, to: HostIndex, from: HostIndex, silent: Silent, fade_ticks: i64) -> Option<Gone> {
        let LostSteps { first, count } = self.lost;
        let timeout_s = self.scene.session.peer_timeout_s;
        let (before_s, after_s) = (self.instant_s(first - 1), self.instant_s(first + count));
        if count == 0 || after_s - before_s < timeout_s {
            return None;
        }
        let (latency_s, back_s) = (self.latency_s(to, from), self.latency_s(from, to));
        let from_tick = self.tick_at(before_s + latency_s + timeout_s);
        // A host goes on sending to one that it does not hear; after long silence, the first ping that gets through tells one of both,
        // and its answer the other.
        let is_long = silent == Silent::Everybody && after_s - before_s >= MAX_SILENCE_S;
        let retry_s = if is_long { MAX_RETRY_S + back_s } else { 0.0 };
        let (sends, heard) = (self.tick_at(after_s + retry_s), self.tick_at(after_s + retry_s + latency_s));
        let (transit, faded_out) = (self.tick_at(latency_s), from_tick + fade_ticks - 1);
        let mut step = first + count;
        let sampled = |step| tick_of_step(&self.schedule, step);
        while sampled(step) < sends || sampled(step) + transit <= faded_out {
            step += 1;
        }
        let used = delay(self.scene, from, to).tick_of_use(&self.schedule, step);
        Some(Gone { from: from_tick, heard, sampled: sampled(step), rises: used.max(heard) })
    }
}
