//! A session that people watch, join and change while it runs: what a page's server works with.
//!
//! Behind it is one [`SessionHandle`] at a time. A change that the running loops can take is made in the running
//! session; any other ends it, smoothly, and begins the next one: the generation counts them.

mod restart;
mod shared;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use cotouch_device::guided_scene;
use cotouch_net::Ticket;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Impairment, Scene};
use cotouch_scene::time::LocalTime;

pub use self::shared::{ChangeError, Changed, Starter};
use self::shared::{Present, Shared};
use crate::clock;
use crate::guests::Guests;
use crate::options::RealTimeOptions;
use crate::own_limits::OwnLimits;
use crate::pointer::{HeldBy, PointerHandle, Seat, TakeError};
use crate::real_time;
use crate::session_handle::{LOOK_PERIOD, SessionHandle};
use crate::snapshot::{HostSnapshot, Snapshot};
use crate::start_error::StartError;
use crate::summary::Summary;

/// A session that follows another lasts at least so long, s: who has asked for it is to see it.
const SHORTEST_S: f64 = 2.0;

/// Whoever watches says so again within this time.
const WATCHED_NS: i64 = 1_000_000_000;

/// What a stopped session says.
const PAUSED: &str =
    "the session shook against its force limits for seconds and was stopped; change a setting or begin again";

/// A session that is watched, joined and changed.
pub struct LiveSession {
    shared: Arc<Shared>,
    guests: Guests,
    /// What this host allows, whatever a page asks for.
    limits: OwnLimits,
}

impl LiveSession {
    /// A session that cannot be changed: this process runs some of its hosts only.
    #[must_use]
    pub fn fixed(handle: SessionHandle) -> Self {
        Self::new(handle, None)
    }

    /// A session whose hosts all run in this process; `starter` starts the next one when a change needs that.
    #[must_use]
    pub fn changeable(handle: SessionHandle, starter: Starter) -> Self {
        Self::changeable_until(handle, starter, None)
    }

    fn changeable_until(handle: SessionHandle, starter: Starter, ends_at: Option<LocalTime>) -> Self {
        let live = Self::new(handle, Some(starter));
        restart::watch(&live.shared, ends_at);
        live
    }

    /// Starts all hosts of `scene` in this process, to be changed. The duration of `options` is that of all sessions
    /// together, and its impairment counts for the first one: later ones have the scene's.
    ///
    /// # Errors
    /// When a socket, a thread or the recording cannot be had.
    pub fn run_local(scene: &Scene, options: RealTimeOptions) -> Result<Self, StartError> {
        let began = clock::now();
        let handle = real_time::run_local(scene, &options)?;
        let limits = Some(handle.limits());
        let ends_at = options.duration_s.map(|duration_s| began.plus_ns((duration_s * 1e9) as i64));
        let first_name = scene.name.clone();
        let starter = move |scene: &Scene, generation: u32| {
            let recording_of =
                |first: &PathBuf| numbered_path(&renamed_path(first, &first_name, &scene.name), generation);
            let gone_s = clock::now().since(began) as f64 * 1e-9;
            let impairment = &scene.link.impairment;
            let options = RealTimeOptions {
                duration_s: options.duration_s.map(|duration_s| (duration_s - gone_s).max(SHORTEST_S)),
                recording: options.recording.as_ref().map(recording_of),
                impairment: (*impairment != Impairment::NONE).then(|| impairment.clone()),
                devices: options.devices.clone(),
                limits,
            };
            real_time::run_local(scene, &options)
        };
        Ok(Self::changeable_until(handle, Box::new(starter), ends_at))
    }

    fn new(handle: SessionHandle, starter: Option<Starter>) -> Self {
        let (scene, limits) = (handle.present_scene(), handle.limits());
        let present = Present {
            last: handle.snapshot(),
            handle: Some(handle),
            restarting: false,
            paused: false,
            scene: Arc::new(scene),
            generation: 1,
            summary: None,
            ended: Vec::new(),
            news: Vec::new(),
            failures: Vec::new(),
            begun_anew: 0,
            watched_until: LocalTime(i64::MIN),
            waits_until: LocalTime(i64::MIN),
        };
        let (changing, stopping) = (Mutex::new(()), AtomicBool::new(false));
        let shared = Shared { starter, changing, present: Mutex::new(present), stopping };
        Self { shared: Arc::new(shared), guests: Guests::default(), limits }
    }

    /// The scene that runs, with the impairment that it runs with, and its number, from 1.
    #[must_use]
    pub fn scene(&self) -> (Arc<Scene>, u32) {
        let present = self.shared.present();
        (Arc::clone(&present.scene), present.generation)
    }

    /// Whether the session can be changed at all.
    #[must_use]
    pub fn may_change(&self) -> bool {
        self.shared.starter.is_some()
    }

    /// Runs `scene`, as a real network can play it, from now on. Blocks for as long as a restart takes; a newer call
    /// waits for an older one.
    ///
    /// # Errors
    /// When the session is shared, over, or the next one does not start.
    pub fn change(&self, scene: Scene) -> Result<Changed, ChangeError> {
        self.shared.change(self.limits.apply(&realisable(&scene).0))
    }

    /// Begins anew with the same scene.
    ///
    /// # Errors
    /// As for [`LiveSession::change`].
    pub fn again(&self) -> Result<(), ChangeError> {
        self.shared.again()
    }

    /// `scene` as this session would run it, for a prediction: as a real network can play it, with this session's impairment,
    /// and with the hands tracked that pointers move. With a sentence where that differs from what was asked for.
    #[must_use]
    pub fn as_it_would_run(&self, scene: &Scene) -> (Scene, Option<String>) {
        let (scene, note) = realisable(scene);
        let mut scene = self.limits.apply(&scene);
        if !self.may_change() {
            let impairment = self.shared.present().scene.link.impairment.clone();
            scene = scene
                .edit(|scene| scene.link.impairment = impairment)
                .expect("it was checked with its scene");
        }
        let is_guided = |seat: &Seat| seat.by == HeldBy::Pointer && seat.user.0 < scene.session.users;
        let mut guided: Vec<HostIndex> =
            self.seats().iter().filter(|seat| is_guided(seat)).map(|seat| seat.user).collect();
        // A hand that was let go of is held on by the same spring.
        let is_drawn = |host: &&HostSnapshot| host.fingers.iter().any(|finger| finger.target.is_some());
        let snapshot = self.snapshot().0;
        let drawn = snapshot.hosts.iter().filter(is_drawn).map(|host| host.host);
        guided.extend(drawn.filter(|host| host.0 < scene.session.users));
        (guided_scene(&scene, &guided), note)
    }

    /// The newest picture, and the number of the session that it is of; never holds up a haptic loop.
    #[must_use]
    pub fn snapshot(&self) -> (Snapshot, u32) {
        let present = self.shared.present();
        let mut snapshot =
            present.handle.as_ref().map_or_else(|| present.last.clone(), SessionHandle::snapshot);
        snapshot.ended = present.has_ended();
        self.guests.add_to(&mut snapshot);
        (snapshot, present.generation)
    }

    /// Who moves which hand.
    #[must_use]
    pub fn seats(&self) -> Vec<Seat> {
        let present = self.shared.present();
        present.handle.as_ref().map(|handle| self.guests.seats(handle)).unwrap_or_default()
    }

    /// Takes a user's hand from its script, or a free place. Blocks for as long as a restart or joining takes.
    ///
    /// # Errors
    /// When somebody else has it, or a free place cannot be had.
    pub fn take(&self, user: HostIndex) -> Result<PointerHandle, TakeError> {
        let free_place = {
            let _no_change_is_under_way = self.shared.begin_change();
            let present = self.shared.present();
            let handle = present.handle.as_ref().ok_or(TakeError::Ended)?;
            match self.guests.free_place(handle, user) {
                Some(place) => place,
                None => return handle.take(user),
            }
        };
        self.guests.let_in(free_place)
    }

    /// What a person is to know of the devices of this process, in words; nothing between two sessions.
    #[must_use]
    pub fn device_notes(&self) -> Vec<String> {
        self.shared.present().handle.as_ref().map(SessionHandle::device_notes).unwrap_or_default()
    }

    /// News in words since the last call. That the hosts of one process find each other is none.
    #[must_use]
    pub fn take_news(&self) -> Vec<String> {
        let mut present = self.shared.present();
        let mut news = std::mem::take(&mut present.news);
        if let Some(handle) = &present.handle {
            news.extend(handle.take_device_faults());
            news.extend(handle.take_standstill());
            if !self.may_change() {
                news.extend(handle.take_news());
            }
        }
        news
    }

    /// What has failed since the last call besides loops and devices, in words, for whoever waits for the session and for its pages.
    #[must_use]
    pub fn take_failures(&self) -> Vec<String> {
        let mut present = self.shared.present();
        let mut failures = std::mem::take(&mut present.failures);
        failures.extend(present.handle.iter().flat_map(SessionHandle::take_failures));
        failures
    }

    /// As [`SessionHandle::fail`].
    pub fn fail(&self, why: &str) {
        self.shared.present().handle.iter().for_each(|handle| handle.fail(why));
    }

    /// Which hosts run in this process; none between two sessions.
    #[must_use]
    pub fn hosts(&self) -> Vec<HostIndex> {
        self.shared.present().handle.as_ref().map(SessionHandle::hosts).unwrap_or_default()
    }

    /// What the system did not allow the haptic thread, if anything.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        self.shared.present().handle.as_ref().and_then(SessionHandle::warning)
    }

    /// What others join with, where the session's first host is in this process and lets others in.
    #[must_use]
    pub fn ticket(&self) -> Option<Ticket> {
        let present = self.shared.present();
        present.handle.as_ref().filter(|handle| handle.hosts().contains(&HostIndex::FIRST))?.ticket()
    }

    /// As [`SessionHandle::has_lost_the_server`].
    #[must_use]
    pub fn has_lost_the_server(&self) -> bool {
        self.shared.present().handle.as_ref().is_some_and(SessionHandle::has_lost_the_server)
    }

    /// Session time of the present session since its first tick, s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        self.shared.present().handle.as_ref().map_or(0.0, SessionHandle::elapsed_s)
    }

    /// Says that somebody watches right now, so that a session whose objects leave all bounds, or whose scripts are over, begins
    /// anew, one that shakes against its force limits is stopped, and that the session goes on for at least so many seconds,
    /// whatever its duration.
    pub fn is_watched(&self, go_on_s: f64) {
        let mut present = self.shared.present();
        present.watched_until = clock::now().plus_ns(WATCHED_NS);
        present.waits_until = clock::now().plus_ns((go_on_s * 1e9) as i64);
        present.handle.iter().for_each(|handle| handle.go_on_for(go_on_s));
    }

    /// Why the session is stopped and waits for somebody to change its settings or to begin it anew, in words.
    #[must_use]
    pub fn paused(&self) -> Option<&'static str> {
        self.shared.present().paused.then_some(PAUSED)
    }

    /// Asks the session to end.
    pub fn stop(&self) {
        self.shared.stopping.store(true, Ordering::SeqCst);
        self.guests.stop();
        let mut present = self.shared.present();
        present.paused = false;
        if let Some(handle) = &present.handle {
            handle.stop();
        }
    }

    /// Whether it has ended, for good.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.shared.present().has_ended()
    }

    /// Waits for the end and says what happened in the last session; the verdict is about all of them.
    pub fn finish(self) -> Summary {
        while !self.has_ended() {
            thread::sleep(LOOK_PERIOD);
        }
        let _no_change_is_under_way = self.shared.begin_change();
        let (handle, summary, mut ended) = {
            let mut present = self.shared.present();
            (present.handle.take(), present.summary.take(), std::mem::take(&mut present.ended))
        };
        if handle.is_none() {
            // The last one has ended already, and is told of in full.
            ended.pop();
        }
        let last = handle
            .map(SessionHandle::finish)
            .or(summary)
            .expect("a session has run, and its end is asked for once");
        last.after(ended)
    }
}

/// The scene as a session on real sockets plays it, and a sentence when that differs from what was asked for: all ways
/// of a process are impaired alike.
fn realisable(scene: &Scene) -> (Scene, Option<String>) {
    let (scene, note) = real_time::realisable(scene);
    (scene.edit(|scene| scene.link.ways.clear()).expect("a scene needs no ways"), note)
}

/// A scene's name as a part of a file's name: it may hold anything printable, and a file's must not leave its folder.
#[must_use]
pub fn plain_name(scene: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    scene.chars().map(|c| if is_plain(c) { c } else { '-' }).collect()
}

/// `path` with the name of another scene where its file's name begins with `from`'s.
fn renamed_path(path: &Path, from: &str, to: &str) -> PathBuf {
    let name = path.file_name().and_then(|name| name.to_str());
    let rest = name.and_then(|name| name.strip_prefix(&plain_name(from)));
    let rest = rest.filter(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric()));
    rest.map_or_else(|| path.to_owned(), |rest| path.with_file_name(plain_name(to) + rest))
}

/// Where the recording of a session goes: the first one to `path`, later ones to `NAME-2.mcap` and so on beside it.
#[must_use]
pub fn numbered_path(path: &Path, generation: u32) -> PathBuf {
    if generation <= 1 {
        return path.to_owned();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{generation}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
