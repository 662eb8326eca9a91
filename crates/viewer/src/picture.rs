//! A picture: the newest snapshot as one binary message, little-endian, every number at a multiple of its size but for
//! the session time.
//!
//! ```text
//! picture   u8 1 · u8 flags · u8 hosts · u8 surfaces · u32 generation · f64 time_s · f32 fast_force_n · host… · surface…
//!   flags   1 ended · 6 verdict of the run · 24 verdict now;  a verdict: 0 unknown, 1 quiet, 2 shaking, 3 diverging
//!   fast_force_n  the force above 8 Hz at the worst finger, N rms
//! host      u8 index · u8 flags · u8 fingers · u8 bodies · u32 links · u32 ticks · u32 missed · f32 lateness_us
//!           · f32 energy_j · finger… · body… · link…
//!   flags   1 touches a wall · 2 diverged
//! finger    3 f32 position_m · 3 f32 force_n · 3 f32 proxy_m · 3 f32 target_m · f32 governor gain · f32 energy_j
//!           · u16 governor's limits that acted · u16 phase       (what there is none of is NaN)
//!   phase   0 free · 1 moment cancellation · 2 pre-slide · 3 slide
//! body      3 f32 position_m · 4 f32 orientation x, y, z, w
//! link      u16 peer · u16 present · f32 round_trip_ms · f32 jitter_ms · u32 received · u32 lost
//! surface   u16 host · u16 0 · u32 vertices · f32 K_o, N/m · f32 step_m · f32 step_pa · vertex…   (of the soft object)
//! vertex    3 i16 way from where it rests, in steps of step_m · u16 von Mises stress, in steps of step_pa
//! ```
//!
//! The page's side is `page/src/picture.ts`.

use cotouch_runtime::{FingerSnapshot, HostSnapshot, LinkSnapshot, RunVerdict, Snapshot};
use cotouch_scene::geometry::Pose;
use glam::DVec3;

use crate::skin::{Deformed, Skin};

const KIND: u8 = 1;

/// Where the count of surfaces is.
const SURFACES_AT: usize = 3;

/// Writes `snapshot` of session number `generation` in place of what `out` held; with the surfaces that fit `skin`, that of
/// the scene's soft object.
pub fn encode(snapshot: &Snapshot, generation: u32, skin: Option<&Skin>, out: &mut Vec<u8>) {
    out.clear();
    put_header(out, snapshot, generation, snapshot.hosts.len());
    snapshot.hosts.iter().for_each(|host| encode_host(host, out));
    let Some(skin) = skin else { return };
    for host in &snapshot.hosts {
        let Some(shown) = &host.soft else { continue };
        out[SURFACES_AT] += u8::from(skin.encode(host.host, Deformed::from(&*shown.0), out));
    }
}

/// As [`encode`], of the first session, with hosts that [`encode_host`] wrote, and surfaces that [`Skin::encode`] did.
pub(crate) fn encode_merged(snapshot: &Snapshot, hosts: &[&[u8]], surfaces: &[&[u8]], out: &mut Vec<u8>) {
    out.clear();
    put_header(out, snapshot, 1, hosts.len());
    out[SURFACES_AT] = surfaces.len() as u8;
    hosts.iter().chain(surfaces).for_each(|part| out.extend_from_slice(part));
}

fn put_header(out: &mut Vec<u8>, snapshot: &Snapshot, generation: u32, hosts: usize) {
    let flags =
        u8::from(snapshot.ended) | verdict(snapshot.verdict) << 1 | verdict(snapshot.now.verdict) << 3;
    out.extend([KIND, flags, hosts as u8, 0]);
    out.extend(generation.to_le_bytes());
    out.extend(snapshot.time_s.to_le_bytes());
    put(out, snapshot.now.fast_force_n);
}

fn verdict(verdict: Option<RunVerdict>) -> u8 {
    match verdict {
        None => 0,
        Some(RunVerdict::Quiet) => 1,
        Some(RunVerdict::Shaking) => 2,
        Some(RunVerdict::Diverging) => 3,
    }
}

/// Writes one host after what `out` holds.
pub(crate) fn encode_host(host: &HostSnapshot, out: &mut Vec<u8>) {
    let flags = u8::from(host.touches_wall) | u8::from(host.diverged) << 1;
    out.extend([host.host.0, flags, host.fingers.len() as u8, host.bodies.len() as u8]);
    out.extend((host.links.len() as u32).to_le_bytes());
    out.extend((host.ticks as u32).to_le_bytes());
    out.extend((host.missed as u32).to_le_bytes());
    put(out, host.lateness_us);
    put(out, host.energy_j);
    host.fingers.iter().for_each(|finger| put_finger(out, finger));
    host.bodies.iter().for_each(|pose| put_pose(out, pose));
    host.links.iter().for_each(|link| put_link(out, link));
}

fn put_finger(out: &mut Vec<u8>, finger: &FingerSnapshot) {
    let none = DVec3::NAN;
    let phase: u16 = match finger.contact {
        cotouch_world::Phase::Free => 0,
        cotouch_world::Phase::MomentCancellation { .. } => 1,
        cotouch_world::Phase::PreSlide => 2,
        cotouch_world::Phase::Slide => 3,
    };
    put_vector(out, finger.reading.pose.position);
    put_vector(out, finger.commanded.force);
    put_vector(out, finger.proxy.unwrap_or(none));
    put_vector(out, finger.target.unwrap_or(none));
    put(out, finger.governor_gain);
    put(out, finger.energy_j);
    out.extend((finger.governor_acted as u16).to_le_bytes());
    out.extend(phase.to_le_bytes());
}

fn put_pose(out: &mut Vec<u8>, pose: &Pose) {
    put_vector(out, pose.position);
    pose.orientation.to_array().into_iter().for_each(|part| put(out, part));
}

fn put_link(out: &mut Vec<u8>, link: &LinkSnapshot) {
    out.extend(u16::from(link.peer.0).to_le_bytes());
    out.extend(u16::from(link.present).to_le_bytes());
    put(out, link.round_trip_ms);
    put(out, link.rms_jitter_ms);
    out.extend((link.received as u32).to_le_bytes());
    out.extend((link.lost as u32).to_le_bytes());
}

fn put_vector(out: &mut Vec<u8>, vector: DVec3) {
    vector.to_array().into_iter().for_each(|part| put(out, part));
}

fn put(out: &mut Vec<u8>, number: f64) {
    out.extend((number as f32).to_le_bytes());
}
