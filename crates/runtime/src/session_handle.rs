//! A running session, as the rest of the program sees it.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use cotouch_net::{LinkStatistics, Presence, Rejections, Ticket};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Impairment, Link, Scene};

use crate::change::HostChange;
use crate::clock;
use crate::control::Control;
use crate::haptic_host::HapticHost;
use crate::mailbox;
use crate::network_threads::NetworkThreads;
use crate::own_limits::OwnLimits;
use crate::pointer::{GuidedHand, HeldBy, PointerHandle, Seat, TakeError};
use crate::recording_thread::RecordingThread;
use crate::snapshot::{HostSnapshot, LinkSnapshot, Snapshot};
use crate::summary::Summary;
use crate::summary_of_run::{HostRun, summarise};

/// A host of this process, as seen from outside its haptic thread.
pub(crate) struct Local {
    pub(crate) host: HostIndex,
    pub(crate) network: NetworkThreads,
    pub(crate) snapshot: triple_buffer::Output<HostSnapshot>,
    /// The thread of the soft object's simulation, where there is one.
    pub(crate) soft: Option<JoinHandle<()>>,
    /// What a person is to know of its device, in words.
    pub(crate) device_note: Option<String>,
    /// Failures of its device that were told as news already.
    pub(crate) told_faults: u64,
}

/// So long is waited for a change to be made.
const LONGEST_WAIT_NS: i64 = 200_000_000;

/// How settings are changed.
struct Changing {
    /// The scene that runs.
    scene: Scene,
    sender: mailbox::Sender,
}

/// A session that runs in the background. Dropping it without [`SessionHandle::finish`] stops it.
pub struct SessionHandle {
    scene: Scene,
    changing: Mutex<Changing>,
    control: Arc<Control>,
    locals: Mutex<Vec<Local>>,
    haptic: Option<JoinHandle<Vec<HapticHost>>>,
    recording: Option<RecordingThread>,
    /// Hands that pointers may take.
    places: Vec<GuidedHand>,
    /// What others join with, if they can.
    ticket: Option<Ticket>,
    told: Told,
    /// What this host allows, whatever a changed scene asks for.
    limits: OwnLimits,
    /// What the scene asked for and did not get, in words.
    refusal: Option<String>,
}

/// What was told already.
#[derive(Default)]
struct Told {
    /// Of the failures.
    failures: AtomicUsize,
    /// Times at which the haptic thread stood still.
    stood_still: AtomicU64,
}

impl SessionHandle {
    pub(crate) fn new(
        scene: Scene,
        impairment: Impairment,
        sender: mailbox::Sender,
        control: Arc<Control>,
        locals: Vec<Local>,
        haptic: JoinHandle<Vec<HapticHost>>,
        recording: Option<RecordingThread>,
    ) -> Self {
        let meet = |link: &mut Link| {
            link.ways.clear();
            link.impairment = impairment;
        };
        let present =
            scene.edit(|present| meet(&mut present.link)).expect("an impairment is checked with its scene");
        let limits = OwnLimits::of(&scene);
        let changing = Mutex::new(Changing { scene: present, sender });
        Self {
            scene,
            changing,
            control,
            locals: Mutex::new(locals),
            haptic: Some(haptic),
            recording,
            places: Vec::new(),
            ticket: None,
            told: Told::default(),
            limits,
            refusal: None,
        }
    }

    /// The same session, with hands that pointers may take.
    pub(crate) fn with_places(mut self, places: Vec<GuidedHand>) -> Self {
        self.places = places;
        self
    }

    /// The same session, which others join with `ticket`.
    pub(crate) fn with_ticket(mut self, ticket: Ticket) -> Self {
        self.ticket = Some(ticket);
        self
    }

    /// The same session, whose scene may not ask for more than `limits`, and what it asked for in vain, in words.
    pub(crate) fn with_limits(mut self, limits: OwnLimits, refusal: Option<String>) -> Self {
        (self.limits, self.refusal) = (limits, refusal);
        self
    }

    /// What this host allows at most, whatever a changed scene asks for.
    #[must_use]
    pub fn limits(&self) -> OwnLimits {
        self.limits
    }

    /// What others join with, if they can. The address in it is where the server listens.
    #[must_use]
    pub const fn ticket(&self) -> Option<Ticket> {
        self.ticket
    }

    /// The scene that this session began with.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene that runs. Its impairment is what every way out of this process does to packets, besides what the network
    /// does.
    #[must_use]
    pub fn present_scene(&self) -> Scene {
        self.changing.lock().unwrap_or_else(PoisonError::into_inner).scene.clone()
    }

    /// Runs `scene` from the next tick on, if all hosts are in this process and [`HostChange::is_possible`]; whether so.
    /// Its impairment holds for every way from now on. Blocks until the change is
    /// made, a few ticks as a rule; before the first tick, it is made with that.
    #[must_use]
    pub fn change(&self, scene: &Scene) -> bool {
        let scene = &self.limits.apply(scene);
        let mut changing = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        if changing.scene == *scene {
            return true;
        }
        let hosts = self.hosts();
        if hosts.len() != usize::from(scene.session.users) || !HostChange::is_possible(&changing.scene, scene)
        {
            return false;
        }
        let changes = hosts.iter().map(|&host| HostChange::new(scene, host)).collect();
        if !changing.sender.send(changes) {
            return false;
        }
        for local in self.lock().iter() {
            local.network.impair(&scene.link.impairment, scene.session.seed, local.host);
        }
        // What is not made by then, because no tick is due, is made with the next one.
        let patience = clock::now().plus_ns(LONGEST_WAIT_NS);
        while self.has_started() && !changing.sender.was_taken() && clock::now() < patience {
            thread::sleep(Duration::from_millis(1));
        }
        changing.scene = scene.clone();
        true
    }

    /// Asks the session to end: forces fade out, peers are told, the recording is closed.
    pub fn stop(&self) {
        self.control.stop.store(true, Ordering::Relaxed);
    }

    /// Lets the session run for at least so long from now on, whatever its duration.
    pub fn go_on_for(&self, seconds: f64) {
        let until_ns = self.control.elapsed_ns.load(Ordering::Relaxed) + (seconds * 1e9) as u64;
        self.control.go_on_ns.fetch_max(until_ns, Ordering::Relaxed);
    }

    /// Whether ticks have begun.
    #[must_use]
    pub fn has_started(&self) -> bool {
        self.control.started.load(Ordering::Acquire)
    }

    /// Whether the last tick is done, or no more are waited for.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.control.has_ended()
    }

    /// Session time since the first tick, s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        self.control.elapsed_ns.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// What the system did not allow the haptic thread, if anything; known once ticks have begun.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        self.control.warning.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Which hosts run in this process.
    #[must_use]
    pub fn hosts(&self) -> Vec<HostIndex> {
        self.lock().iter().map(|local| local.host).collect()
    }

    /// What has happened since the last call that a person wants to know (who came, who went), in words.
    #[must_use]
    pub fn take_news(&self) -> Vec<String> {
        self.lock().iter().flat_map(|local| local.network.take_news()).collect()
    }

    /// What a person is to know of the devices of this process as the session begins, in words: fingers that they lack, and forces that
    /// the scene asks for and this host does not allow.
    #[must_use]
    pub fn device_notes(&self) -> Vec<String> {
        let fingers = self.lock().iter().filter_map(|local| local.device_note.clone()).collect::<Vec<_>>();
        self.refusal.iter().cloned().chain(fingers).collect()
    }

    /// How devices of this process have begun to fail since the last call, in words.
    #[must_use]
    pub fn take_device_faults(&self) -> Vec<String> {
        let mut locals = self.lock();
        let new = locals.iter_mut().filter_map(|local| {
            let HostSnapshot { device_fault_stretches: all, device_fault: text, .. } = local.snapshot.read();
            let is_new = std::mem::replace(&mut local.told_faults, *all) < *all;
            let user = &self.scene.users[local.host.index()].name;
            is_new.then(|| format!("{user}'s device fails: {text}"))
        });
        new.collect()
    }

    /// What has failed besides loops and devices since the last call, in words; with a thread without which the session cannot go
    /// on, it ends by itself.
    #[must_use]
    pub fn take_failures(&self) -> Vec<String> {
        let all = self.control.failures.all();
        let told = self.told.failures.swap(all.len(), Ordering::Relaxed);
        all.into_iter().skip(told).collect()
    }

    /// How many of its failures were told.
    pub(crate) fn failures_told(&self) -> usize {
        self.told.failures.load(Ordering::Relaxed)
    }

    /// That ticks did not come and forces were switched off since the last call, in words: the first time, the second, the fourth,
    /// and so on.
    #[must_use]
    pub fn take_standstill(&self) -> Option<String> {
        let times = self.control.heartbeat.times();
        let told = self.told.stood_still.load(Ordering::Relaxed);
        if times < (2 * told).max(1) {
            return None;
        }
        self.told.stood_still.store(times, Ordering::Relaxed);
        let often = if times > 1 { format!("; {times} times so far") } else { String::new() };
        Some(format!(
            "haptic ticks did not come in time: all forces were switched off, and come back softly when ticks do{often}"
        ))
    }

    /// Lets the session go, because of `why`, which its summary has.
    pub fn fail(&self, why: &str) {
        self.control.failures.tell_and_end(why.to_owned());
    }

    /// Whether this process has joined a session whose first host, which keeps its clock, is not there any more.
    #[must_use]
    pub fn has_lost_the_server(&self) -> bool {
        self.lock().iter().any(|local| {
            local.host != HostIndex::FIRST
                && local.network.with_endpoint(|endpoint| {
                    endpoint
                        .peers()
                        .any(|peer| peer.host == HostIndex::FIRST && peer.presence != Presence::Present)
                })
        })
    }

    /// Which other hosts take part right now, as the first host of this process sees it.
    #[must_use]
    pub fn present_peers(&self) -> Vec<String> {
        let locals = self.lock();
        let Some(local) = locals.first() else { return Vec::new() };
        local.network.with_endpoint(|endpoint| {
            let present = endpoint.peers().filter(|peer| peer.presence == Presence::Present);
            present.map(|peer| peer.name).collect()
        })
    }

    /// Who moves which hand, one seat a user.
    #[must_use]
    pub fn seats(&self) -> Vec<Seat> {
        let present = self.present_peers();
        let seat = |user: HostIndex| {
            let name = self.scene.users[user.index()].name.clone();
            let by = match self.places.iter().find(|place| place.user == user) {
                Some(place) if place.is_taken() => HeldBy::Pointer,
                Some(_) => HeldBy::Script,
                None if present.contains(&name) || self.hosts().contains(&user) => HeldBy::Elsewhere,
                None => HeldBy::Nobody,
            };
            Seat { user, name, by }
        };
        self.scene.hosts().map(seat).collect()
    }

    /// Takes the hand of a user of this process from its script.
    ///
    /// # Errors
    /// When somebody else has it, it is not in this process, there is no such user, or the session is over.
    pub fn take(&self, user: HostIndex) -> Result<PointerHandle, TakeError> {
        let users = self.scene.session.users;
        let Some(of_scene) = self.scene.users.get(user.index()).filter(|_| user.0 < users) else {
            return Err(TakeError::NoSuchUser { user: user.0, users });
        };
        if self.control.is_over() {
            return Err(TakeError::Ended);
        }
        let name = of_scene.name.clone();
        match self.places.iter().find(|place| place.user == user) {
            Some(place) => place.take(&self.control).ok_or(TakeError::Taken { name }),
            None if self.hosts().contains(&user) || self.present_peers().contains(&name) => {
                Err(TakeError::Taken { name })
            }
            None => {
                let why = "this session lets nobody in".to_owned();
                Err(TakeError::NotLetIn { name, why })
            }
        }
    }

    /// The newest picture of this process's hosts; never holds up a haptic loop.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        let mut locals = self.lock();
        let users = self.scene.session.users;
        let hosts = locals.iter_mut().map(|local| {
            let mut host = local.snapshot.read().clone();
            host.host = local.host;
            host.links = local.network.with_endpoint(|endpoint| {
                let links = local.host.others(users).filter_map(|peer| {
                    let statistics = endpoint.statistics(peer)?;
                    let is_present =
                        endpoint.peers().any(|info| info.host == peer && info.presence == Presence::Present);
                    Some(link_snapshot(peer, is_present, &statistics))
                });
                links.collect()
            });
            host
        });
        let hosts: Vec<HostSnapshot> = hosts.collect();
        let time_s = hosts.iter().map(|host| host.time_s).fold(0.0, f64::max);
        let (verdict, now) = (self.control.verdict.load(), self.control.now());
        Snapshot { time_s, verdict, now, ended: self.has_ended(), hosts }
    }

    /// Waits for the end of the session and says what happened. Ends when the duration is over, or after a
    /// [`SessionHandle::stop`], or when something failed without which it cannot go on.
    pub fn finish(mut self) -> Summary {
        let mut hosts = self.join_haptic_thread().into_iter();
        let Control { failures, heartbeat, .. } = &*self.control;
        let reason = if failures.ends_session() { "it could not go on" } else { "ended on purpose" };
        let locals = std::mem::take(&mut *self.lock());
        let rejected: Rejections = locals.iter().map(|local| local.network.rejections()).sum();
        let receive_buffer_bytes =
            locals.iter().filter_map(|local| local.network.receive_buffer_bytes()).min();
        let mut runs = Vec::new();
        for local in locals {
            // Said whatever became of the haptic thread.
            let endpoint = local.network.leave(reason);
            let Some(HapticHost { station, timing, .. }) = hosts.next() else { continue };
            // The station holds the recording's writing end: it is dropped here, and the recorder sees the end.
            runs.push(HostRun::new(&station, timing).with_network(&endpoint));
            // With the station went what the simulation is asked by: its thread ends. A panic was caught and told by itself.
            drop(station);
            let _: Option<thread::Result<()>> = local.soft.map(JoinHandle::join);
        }
        let mut summary = summarise(&self.scene, self.elapsed_s(), &runs);
        summary.network.rejected = rejected;
        summary.network.receive_buffer_bytes = receive_buffer_bytes;
        summary.haptic.stood_still = heartbeat.times();
        summary.recording = self.recording.take().and_then(|recording| recording.finish(&summary, failures));
        summary.failures = failures.all();
        summary
    }

    /// The hosts, after the last tick; none where the haptic thread does not answer.
    fn join_haptic_thread(&mut self) -> Vec<HapticHost> {
        while !self.has_ended() {
            thread::sleep(LOOK_PERIOD / 10);
        }
        let is_lost = !self.control.ended.load(Ordering::Acquire);
        let haptic = self.haptic.take().filter(|_| !is_lost);
        haptic.map(JoinHandle::join).and_then(Result::ok).unwrap_or_default()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Local>> {
        self.locals.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for SessionHandle {
    fn drop(&mut self) {
        self.stop();
        if self.haptic.is_some() {
            drop(self.join_haptic_thread());
        }
    }
}

/// How long a caller that waits for the session sleeps between two looks.
pub const LOOK_PERIOD: Duration = Duration::from_millis(50);

fn link_snapshot(peer: HostIndex, present: bool, statistics: &LinkStatistics) -> LinkSnapshot {
    LinkSnapshot {
        peer,
        present,
        round_trip_ms: if statistics.round_trip.count == 0 {
            f64::NAN
        } else {
            statistics.round_trip.mean_s * 1e3
        },
        rms_jitter_ms: statistics.round_trip.rms_jitter_s * 1e3,
        received: statistics.sequence.received,
        lost: statistics.sequence.lost,
    }
}
