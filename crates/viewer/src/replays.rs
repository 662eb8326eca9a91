//! Recordings as pictures: read once, kept encoded, given out by session time.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cotouch_host::ContactRecord;
use cotouch_runtime::{
    FingerSnapshot, HostSnapshot, LinkSnapshot, Note, RecordItem, RecordKind, RecordingError,
    RecordingReader, Snapshot, SurfaceRecord, TickRecord,
};
use cotouch_scene::geometry::Wrench;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_world::Phase;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use crate::about::about;
use crate::picture::{encode_host, encode_merged};
use crate::skin::{Deformed, Skin};

/// Pictures a second at most.
const PICTURES_PER_S: f64 = 60.0;

/// Pictures of a host at most: a long recording has fewer a second.
const MAX_PICTURES: usize = 100_000;

/// Pictures of all hosts together take at most about so many bytes: surfaces are large.
const MAX_BYTES: usize = 256 << 20;

/// A page asks for no more at once.
pub(crate) const LONGEST_REQUEST_S: f64 = 30.0;

/// Why a recording cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ShownRecordingError {
    /// It cannot be read.
    #[error("{path}: {source}")]
    Recording {
        /// The file that was to be shown.
        path: PathBuf,
        /// What is wrong with it.
        source: RecordingError,
    },
    /// The scene in it does not read.
    #[error("{path}: the scene of the recording cannot be used: {reason}")]
    Scene {
        /// The file that was to be shown.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It has no tick.
    #[error("{path}: the recording has no tick that could be shown")]
    Empty {
        /// The file that was to be shown.
        path: PathBuf,
    },
}

/// A recording, ready to be shown.
pub(crate) struct ShownRecording {
    name: String,
    pub(crate) about: Value,
    /// Session time of each picture, s, rising; the picture's place in `bytes` ends there.
    pictures: Vec<(f64, usize)>,
    /// All pictures, each after its length.
    bytes: Vec<u8>,
}

impl ShownRecording {
    pub(crate) fn open(path: &Path) -> Result<Self, ShownRecordingError> {
        let failed = |source| ShownRecordingError::Recording { path: path.to_owned(), source };
        let recording = RecordingReader::open(path).map_err(failed)?;
        let text = &recording.header().scene_toml;
        let scene = cotouch_scene::parse(text, "its scene", None, &[]).map_err(|errors| {
            ShownRecordingError::Scene { path: path.to_owned(), reason: errors.to_string() }
        })?;
        let mut replay = Self::read(&scene, recording).map_err(failed)?;
        if replay.pictures.is_empty() {
            return Err(ShownRecordingError::Empty { path: path.to_owned() });
        }
        replay.name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(replay)
    }

    fn read<R: Read>(scene: &Scene, recording: RecordingReader<R>) -> Result<Self, RecordingError> {
        let skin = Skin::of(scene).map(Arc::new);
        let mut shots: Vec<Shots> =
            scene.hosts().map(|host| Shots::new(host, scene.session.users, skin.clone())).collect();
        for item in recording {
            let item = item?;
            // A host that the scene does not have is not shown.
            if let Some(shots) = shots.get_mut(item.host.index()) {
                shots.take(item);
            }
        }
        let (pictures, bytes) = merged(shots);
        Ok(Self { name: String::new(), about: about(scene), pictures, bytes })
    }

    /// `RecordingInfo` in `page/src/protocol.ts`.
    pub(crate) fn info(&self) -> Value {
        let (starts_s, ends_s) = match (self.pictures.first(), self.pictures.last()) {
            (Some(first), Some(last)) => (first.0, last.0),
            _ => (0.0, 0.0),
        };
        json!({ "name": self.name, "duration_s": ends_s - starts_s, "starts_s": starts_s, "about": self.about })
    }

    /// The pictures from one session time on to before another, each after its length.
    pub(crate) fn between(&self, from_s: f64, to_s: f64) -> &[u8] {
        let first = self.pictures.partition_point(|picture| picture.0 < from_s);
        let end = self.pictures.partition_point(|picture| picture.0 < to_s).max(first);
        let place = |index: usize| index.checked_sub(1).map_or(0, |before| self.pictures[before].1);
        &self.bytes[place(first)..place(end)]
    }
}

/// One host's part of a picture.
struct Shot {
    /// Which of 60 pictures a second.
    slot: i64,
    /// Session time of the picture, s.
    time_s: f64,
    /// The host's part of the picture, encoded.
    host: Vec<u8>,
    /// The soft object's surface in use, encoded; several pictures may show the same.
    surface: Option<Arc<[u8]>>,
}

impl Shot {
    fn size(&self) -> usize {
        self.host.len() + self.surface.as_ref().map_or(0, |surface| surface.len())
    }
}

/// One host's part of the pictures.
struct Shots {
    host: HostIndex,
    taken: Vec<Shot>,
    /// The surface of the scene's soft object.
    skin: Option<Arc<Skin>>,
    /// That surface as it was last shown, encoded.
    surface: Option<Arc<[u8]>>,
    /// What the pictures take where every one has its surface, and may take, bytes.
    bytes: usize,
    max_bytes: usize,
    /// As it was recorded since.
    newer_surface: Option<SurfaceRecord>,
    /// Every so many pictures of 60 a second are kept.
    stride: i64,
    ticks: u64,
    missed: u64,
    lateness_ns: i64,
    peers: Vec<Peer>,
}

/// What was heard of a peer.
#[derive(Clone, Default)]
struct Peer {
    present: bool,
    received: u64,
    /// The first and the last network step that was heard of.
    steps: Option<(u64, u64)>,
}

impl Shots {
    fn new(host: HostIndex, users: u8, skin: Option<Arc<Skin>>) -> Self {
        Self {
            host,
            taken: Vec::new(),
            skin,
            surface: None,
            bytes: 0,
            max_bytes: MAX_BYTES / usize::from(users.max(1)),
            newer_surface: None,
            stride: 1,
            ticks: 0,
            missed: 0,
            lateness_ns: 0,
            peers: vec![Peer::default(); usize::from(users)],
        }
    }

    fn take(&mut self, item: RecordItem) {
        match item.kind {
            RecordKind::Tick(tick) => self.take_tick(&tick),
            RecordKind::Received { from, packet } => {
                if let Some(peer) = self.peers.get_mut(from.index()) {
                    peer.hear(packet.step);
                }
            }
            RecordKind::Presence { peer, present } => {
                if let Some(peer) = self.peers.get_mut(peer.index()) {
                    peer.present = present;
                }
            }
            RecordKind::Surface(surface) => self.newer_surface = Some(surface),
            RecordKind::Note(Note::Skipped { ticks }) => self.missed = self.missed.saturating_add(ticks),
            _ => {}
        }
    }

    fn take_tick(&mut self, tick: &TickRecord) {
        self.ticks += 1;
        self.lateness_ns = self.lateness_ns.max(tick.lateness_ns);
        let time_s = tick.instant.as_secs_f64();
        let slot = (time_s * PICTURES_PER_S).floor() as i64;
        if slot % self.stride != 0 || self.taken.last().is_some_and(|last| slot <= last.slot) {
            return;
        }
        let mut host = Vec::new();
        encode_host(&self.snapshot(tick, time_s), &mut host);
        let surface = self.encoded_surface();
        let shot = Shot { slot, time_s, host, surface };
        self.bytes += shot.size();
        self.taken.push(shot);
        self.lateness_ns = 0;
        if self.taken.len() >= MAX_PICTURES || self.bytes > self.max_bytes {
            self.thin_out();
        }
    }

    /// Keeps every second picture, from here on too.
    fn thin_out(&mut self) {
        self.stride *= 2;
        self.taken.retain(|shot| shot.slot % self.stride == 0);
        self.bytes = self.taken.iter().map(Shot::size).sum();
    }

    /// The surface that was recorded last, if it is one of the scene's soft object.
    fn encoded_surface(&mut self) -> Option<Arc<[u8]>> {
        if let (Some(skin), Some(record)) = (&self.skin, self.newer_surface.take()) {
            let positions_m: Vec<DVec3> =
                record.positions_m.iter().map(|&node| Vec3::from_array(node).as_dvec3()).collect();
            let (stress_pa, ko_n_per_m) = (record.stress_pa.as_slice(), record.ko_n_per_m);
            let body = Deformed { positions_m: &positions_m, stress_pa, ko_n_per_m };
            let mut bytes = Vec::new();
            if skin.encode(self.host, body, &mut bytes) {
                self.surface = Some(bytes.into());
            }
        }
        self.surface.clone()
    }

    fn snapshot(&self, tick: &TickRecord, time_s: f64) -> HostSnapshot {
        let fingers = tick.readings.len();
        let finger = |nth: usize| finger(tick, self.host, nth);
        let links = self.peers.iter().enumerate().filter(|(index, _)| *index != self.host.index());
        HostSnapshot {
            host: self.host,
            time_s,
            fingers: (0..fingers).map(finger).collect(),
            bodies: tick.bodies.iter().map(|body| body.pose).collect(),
            touches_wall: tick.touches_wall,
            diverged: tick.diverged,
            ticks: self.ticks,
            missed: self.missed,
            lateness_us: self.lateness_ns as f64 * 1e-3,
            energy_j: tick.energy_j,
            links: links.map(|(index, peer)| peer.snapshot(HostIndex(index as u8))).collect(),
            ..HostSnapshot::default()
        }
    }
}

impl Peer {
    fn hear(&mut self, step: u64) {
        self.present = true;
        self.received += 1;
        let (first, last) = self.steps.unwrap_or((step, step));
        self.steps = Some((first.min(step), last.max(step)));
    }

    /// A recording has no round trips.
    fn snapshot(&self, peer: HostIndex) -> LinkSnapshot {
        let sent = self.steps.map_or(0, |(first, last)| (last - first).saturating_add(1));
        LinkSnapshot {
            peer,
            present: self.present,
            round_trip_ms: f64::NAN,
            rms_jitter_ms: f64::NAN,
            received: self.received,
            lost: sent.saturating_sub(self.received),
        }
    }
}

/// A recording knows no pointer.
fn finger(tick: &TickRecord, host: HostIndex, nth: usize) -> FingerSnapshot {
    let contact: Option<&ContactRecord> = tick.contact_of(host, nth);
    FingerSnapshot {
        reading: tick.readings[nth],
        commanded: tick.commanded.get(nth).copied().unwrap_or_else(Wrench::default),
        contact: contact.map_or(Phase::Free, |contact| contact.phase),
        proxy: contact.and_then(|contact| on_the_surface(tick, contact, nth)),
        target: None,
        governor_acted: tick.governor_acted.get(nth).copied().unwrap_or(0),
        governor_gain: tick.governor_gain.get(nth).copied().unwrap_or(1.0),
        energy_j: tick.finger_energy_j.get(nth).copied().unwrap_or(f64::NAN),
    }
}

/// Out of the body along the force, by as much as the finger is inside.
fn on_the_surface(tick: &TickRecord, contact: &ContactRecord, finger: usize) -> Option<DVec3> {
    let out = contact.force.try_normalize()?;
    Some(tick.readings[finger].pose.position + out * contact.depth_m)
}

/// The hosts' parts put together, picture by picture. A host that has none in between shows its last one.
fn merged(mut hosts: Vec<Shots>) -> (Vec<(f64, usize)>, Vec<u8>) {
    let stride = hosts.iter().map(|shots| shots.stride).max().unwrap_or(1);
    hosts.iter_mut().for_each(|shots| shots.taken.retain(|shot| shot.slot % stride == 0));
    let mut slots: Vec<i64> =
        hosts.iter().flat_map(|shots| shots.taken.iter().map(|shot| shot.slot)).collect();
    slots.sort_unstable();
    slots.dedup();
    let (mut pictures, mut bytes) = (Vec::with_capacity(slots.len()), Vec::new());
    let mut next = vec![0; hosts.len()];
    let mut picture = Vec::new();
    for slot in slots {
        for (next, shots) in next.iter_mut().zip(&hosts) {
            *next += usize::from(shots.taken.get(*next).is_some_and(|shot| shot.slot == slot));
        }
        let shown: Vec<&Shot> = next
            .iter()
            .zip(&hosts)
            .filter_map(|(next, shots)| shots.taken.get(next.checked_sub(1)?))
            .collect();
        let time_s = shown.iter().map(|shot| shot.time_s).fold(f64::NEG_INFINITY, f64::max);
        let parts: Vec<&[u8]> = shown.iter().map(|shot| shot.host.as_slice()).collect();
        let surfaces: Vec<&[u8]> = shown.iter().filter_map(|shot| shot.surface.as_deref()).collect();
        let header = Snapshot { time_s, ..Snapshot::default() };
        encode_merged(&header, &parts, &surfaces, &mut picture);
        bytes.extend((picture.len() as u32).to_le_bytes());
        bytes.extend(&picture);
        pictures.push((time_s, bytes.len()));
    }
    (pictures, bytes)
}
