//! What a run says when it is over, in the shape of the JSON that `cotouch run --json` prints.
//!
//! A number that does not exist (a percentile of nothing, the round trip of a link that carried nothing) is `None`,
//! and so is one that is not finite: both become `null`.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use cotouch_net::Rejections;
use cotouch_scene::Value;
use cotouch_scene::scene::{Architecture, Scene};
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use crate::observer::{Divergence, RunVerdict};

/// What happened in a session, or in one host's part of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The name of the scene that ran.
    pub scene: String,
    /// Who computed the world.
    pub architecture: Architecture,
    /// Users of the session.
    pub users: u8,
    /// How long the session ran, s of session time.
    pub duration_s: f64,
    /// What the run was, from the end of its soft start to the beginning of its release.
    pub verdict: RunVerdict,
    /// Whether it was quiet.
    pub stable: bool,
    /// When and why it diverged first, if it did.
    pub diverged: Option<DivergedSummary>,
    /// Who shook, and when.
    pub shaking: Vec<ShakingSummary>,
    /// For how long the run was judged, s: since the end of the soft start.
    pub judged_s: f64,
    /// What the analysis says of the settings that ran last; `None` when it cannot say anything about the scene.
    pub predicted: Option<Predicted>,
    /// What the run was with each set of settings, and what the analysis says of each; one where none was changed.
    pub predictions: Vec<SettingsSummary>,
    /// Further settings that are not told of one by one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub predictions_left_out: u32,
    /// The haptic loops, summed over hosts.
    pub haptic: HapticSummary,
    /// The network, summed over hosts.
    pub network: NetworkSummary,
    /// Who was let go of for what they sent, or because their world had diverged.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub expelled: Vec<ExpelledSummary>,
    /// What came later than the prediction assumes.
    pub lateness: LatenessSummary,
    /// The slow simulations of a soft object, summed over hosts; none in a scene without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub soft: Option<SoftSummary>,
    /// Where the objects came to rest, or were when the run ended; the first host's copies.
    pub objects: Vec<ObjectSummary>,
    /// One entry a user.
    pub users_detail: Vec<UserSummary>,
    /// What failed in the session besides its loops, in words: a thread, the recording, the server. Empty where nothing did.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// The recording that was written to its end.
    pub recording: Option<String>,
    /// The picture that was written.
    pub picture: Option<String>,
    /// What others joined with, where they could; of no use after the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ticket: Option<String>,
    /// The sessions that this one followed, where settings were changed that need a new session; the first one first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub earlier: Vec<EarlierSession>,
}

/// A user whom a host has let go of for the rest of the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExpelledSummary {
    /// Who was let go of.
    pub user: String,
    /// The user of the host that did.
    pub by: String,
    /// Why.
    pub reason: String,
    /// When, s of session time; `None` before it began.
    pub at_s: Option<f64>,
}

/// A session that another one followed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EarlierSession {
    /// The name of the scene that ran.
    pub scene: String,
    /// How long it ran, s of session time.
    pub duration_s: f64,
    /// What it was.
    pub verdict: RunVerdict,
    /// Whether it was quiet.
    pub stable: bool,
    /// What failed in it besides its loops, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// The recording that was written to its end.
    pub recording: Option<String>,
    /// What it was with each set of settings.
    pub predictions: Vec<SettingsSummary>,
}

impl From<&Summary> for EarlierSession {
    fn from(summary: &Summary) -> Self {
        let Summary { scene, duration_s, verdict, stable, failures, recording, predictions, .. } =
            summary.clone();
        Self { scene, duration_s, verdict, stable, failures, recording, predictions }
    }
}

impl Summary {
    /// The summary of a session of `scene` in which nothing has happened yet.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let user = |user: &cotouch_scene::scene::User| UserSummary {
            name: user.name.clone(),
            ..UserSummary::default()
        };
        Self {
            scene: scene.name.clone(),
            architecture: scene.session.architecture,
            users: scene.session.users,
            duration_s: 0.0,
            verdict: RunVerdict::Quiet,
            stable: true,
            diverged: None,
            shaking: Vec::new(),
            judged_s: 0.0,
            predicted: None,
            predictions: Vec::new(),
            predictions_left_out: 0,
            haptic: HapticSummary::default(),
            network: NetworkSummary::default(),
            expelled: Vec::new(),
            lateness: LatenessSummary::default(),
            soft: None,
            objects: Vec::new(),
            users_detail: scene.users.iter().map(user).collect(),
            failures: Vec::new(),
            recording: None,
            picture: None,
            ticket: None,
            earlier: Vec::new(),
        }
    }

    /// The same with the sessions before this one, the worst of which its verdict is about too.
    #[must_use]
    pub(crate) fn after(self, earlier: Vec<EarlierSession>) -> Self {
        let verdict = earlier.iter().map(|session| session.verdict).fold(self.verdict, RunVerdict::max);
        Self { verdict, stable: verdict == RunVerdict::Quiet, earlier, ..self }
    }

    /// All that failed, in the sessions before this one too.
    pub fn all_failures(&self) -> impl Iterator<Item = &str> {
        let earlier = self.earlier.iter().flat_map(|session| &session.failures);
        earlier.chain(&self.failures).map(String::as_str)
    }

    /// Whether prediction and outcome disagree; `None` where there was no prediction.
    #[must_use]
    pub fn disagrees(&self) -> Option<bool> {
        self.predicted?.stable.map(|stable| stable != self.stable)
    }
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// A stretch of a run in which settings stayed the same. Settings that were changed again before half a second of them could
/// be judged are left out, but for the first and the last ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingsSummary {
    /// When it began, s of session time.
    pub from_s: f64,
    /// When it was over, or the run was, s of session time.
    pub to_s: f64,
    /// By scene key, what differs from what the session began with.
    pub settings: BTreeMap<String, SettingValue>,
    /// Whether the analysis calls these settings stable; `None` where that is not proven, or nothing was predicted.
    pub stable: Option<bool>,
    /// The largest spectral radius of a contact mode; `None` where nothing was predicted.
    pub spectral_radius: Option<f64>,
    /// What the run was from a second after the change on; `None` where that was too short to say.
    pub verdict: Option<RunVerdict>,
    /// How often fingers shook then.
    pub shaking: u32,
    /// For how long it was judged, s.
    pub judged_s: f64,
    /// What ran.
    #[serde(skip)]
    pub scene: Option<Arc<Scene>>,
}

impl SettingsSummary {
    /// The keys in which `scene` differs from `from`, with its values.
    #[must_use]
    pub fn differences(scene: &Scene, from: &Scene) -> BTreeMap<String, SettingValue> {
        scene.differences(from).into_iter().map(|(key, value)| (key, value.into())).collect()
    }
}

/// The value of a scene key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SettingValue {
    /// A number, in the unit of its key; a rate that is no decimal number is a fraction, as text.
    Number(f64),
    /// Whether something is so.
    Flag(bool),
    /// A text, or one of several words.
    Text(String),
    /// A vector in the world frame.
    Vector([f64; 3]),
}

impl From<Value> for SettingValue {
    fn from(value: Value) -> Self {
        match value {
            Value::Number(number) => Self::Number(number),
            Value::Count(count) => Self::Number(count as f64),
            Value::Rate(rate) if rate.denominator() == 1 => Self::Number(rate.hz()),
            Value::Rate(rate) => Self::Text(rate.to_string()),
            Value::Text(text) => Self::Text(text),
            Value::Flag(flag) => Self::Flag(flag),
            Value::Vector(vector) => Self::Vector(vector.to_array()),
        }
    }
}

/// As in `--set KEY=VALUE`.
impl fmt::Display for SettingValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(formatter, "{number}"),
            Self::Flag(flag) => write!(formatter, "{flag}"),
            Self::Text(text) => formatter.write_str(text),
            Self::Vector([x, y, z]) => write!(formatter, "[{x}, {y}, {z}]"),
        }
    }
}

/// When and why a run diverged first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DivergedSummary {
    /// The first cause.
    pub cause: Divergence,
    /// Whose finger; `None` where the world left its bounds.
    pub user: Option<String>,
    /// Which of the user's fingers, from 1.
    pub finger: Option<u8>,
    /// When, s of session time.
    pub at_s: f64,
}

/// A stretch of time in which a finger shook.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShakingSummary {
    /// Whose finger.
    pub user: String,
    /// Which of the user's fingers, from 1.
    pub finger: u8,
    /// When it began, s of session time.
    pub from_s: f64,
    /// When it was over, or the run was, s of session time.
    pub to_s: f64,
    /// The force above 8 Hz, N.
    pub rms_n: f64,
    /// How fast, Hz: the frequency of a sinusoid with the same rms force and the same rms change from tick to tick.
    pub hz: f64,
}

/// What the analysis says about the whole scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Predicted {
    /// Whether the scene is stable; `None` where each analysed mode is and the analysis leaves open whether all is.
    pub stable: Option<bool>,
    /// The largest spectral radius of a mode per analysed period, without the rigid-body poles.
    pub spectral_radius: f64,
    /// What the analysis leaves open where it does not say whether the scene is stable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub open: Option<Unproven>,
}

/// Why an analysis in which each mode is stable does not call a scene stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unproven {
    /// Something that users can do was not analysed.
    Coverage,
    /// All that users can do was analysed mode by mode, and switching between the modes is unproven.
    Switching,
}

impl Unproven {
    /// The reason in words, after "no prediction: ".
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Coverage => {
                "each analysed contact mode is stable, but not all that can happen was analysed"
            }
            Self::Switching => "each contact mode is stable, but switching between them is unproven",
        }
    }
}

/// The haptic loops; `ticks + missed = due`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HapticSummary {
    /// Hosts that the numbers are about.
    pub hosts: u32,
    /// Ticks that were due, over all hosts.
    pub due: u64,
    /// Ticks that were done.
    pub ticks: u64,
    /// Ticks that were skipped because the host was late.
    pub missed: u64,
    /// How often ticks did not come for so long that the watchdog switched all forces off.
    #[serde(default)]
    pub stood_still: u64,
    /// How long ticks took.
    pub compute_us: Percentiles,
    /// How late ticks began.
    pub lateness_us: Percentiles,
}

/// Percentiles of a duration in µs; all `None` when nothing was measured, as in virtual time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// The median, µs.
    pub p50: Option<f64>,
    /// The 99th percentile, µs.
    pub p99: Option<f64>,
    /// The 99.9th percentile, µs.
    pub p999: Option<f64>,
    /// The largest value, µs.
    pub max: Option<f64>,
}

impl Percentiles {
    /// Of a histogram of nanoseconds.
    #[must_use]
    pub fn of_nanoseconds(histogram: &Histogram<u64>) -> Self {
        if histogram.is_empty() {
            return Self::default();
        }
        let at = |quantile: f64| Some(histogram.value_at_quantile(quantile) as f64 * 1e-3);
        Self { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: at(1.0) }
    }
}

/// The network, summed over hosts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NetworkSummary {
    /// State packets that were sent.
    pub sent: u64,
    /// State packets received, each counted once.
    pub received: u64,
    /// State packets that were sent to a host and never came.
    pub lost: u64,
    /// Datagrams that were rejected before the session saw them, by reason.
    #[serde(default)]
    pub rejected: Rejections,
    /// How many bytes of datagrams the system keeps until a host receives them; the smallest of all hosts'. `None` in virtual time.
    #[serde(default)]
    pub receive_buffer_bytes: Option<usize>,
    /// State packets that were not used because they were older than the peer time-out.
    #[serde(default)]
    pub stale: u64,
    /// State packets that were not used because they cannot be what they say.
    #[serde(default)]
    pub implausible: u64,
    /// Round trips of all links together, ms.
    pub round_trip_ms: RoundTripSummary,
}

/// What came later than the prediction assumes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatenessSummary {
    /// Ticks that were skipped because the host was late.
    pub missed_ticks: u64,
    /// Ticks that began more than a haptic period late.
    pub late_ticks: u64,
    /// How late the latest tick began, ms; `None` in virtual time.
    pub worst_tick_ms: Option<f64>,
    /// State packets that came after the network step at which they were due.
    pub late_packets: u64,
    /// By how many network periods the data in use were older than intended, in at least one of a hundred network steps. Lost
    /// packets make data older too.
    pub data_excess_periods: u32,
    /// What the analysis says of a delay that is longer by as much; `None` where nothing was late or predicted.
    pub predicted_for: Option<PredictedForDelay>,
}

impl LatenessSummary {
    /// Whether anything was late.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.missed_ticks > 0 || self.late_ticks > 0 || self.late_packets > 0
    }
}

/// What the analysis says of another delay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictedForDelay {
    /// The delay, network periods, as `link.delay_periods`.
    pub delay_periods: u32,
    /// Whether the scene would be stable; `None` where that is not proven.
    pub stable: Option<bool>,
    /// The largest spectral radius of a mode.
    pub spectral_radius: f64,
}

/// Mean and scatter of the round trip, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RoundTripSummary {
    /// The mean round trip, ms.
    pub mean: Option<f64>,
    /// The standard deviation of the round trip, ms.
    pub rms_jitter: Option<f64>,
}

/// The slow simulations of a soft object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SoftSummary {
    /// Steps whose results came into use.
    pub steps: u64,
    /// Those of them that came too late for the tick at which they were due.
    pub late: u64,
    /// Periods that were not simulated, because the simulation was still busy with earlier ones.
    pub missed: u64,
    /// How long steps took.
    pub compute_us: Percentiles,
}

/// One object at the end of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectSummary {
    /// The name that the scene gives it.
    pub name: String,
    /// Where it is, m, in the world frame; of a soft object, the mean of its surface's nodes.
    pub position_m: [f64; 3],
    /// How it is turned: a unit quaternion, scalar first; not turned where the object is soft.
    pub orientation_wxyz: [f64; 4],
    /// Of a soft object: how far the node that is farthest from where it rests is from there, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_displacement_m: Option<f64>,
}

/// One user of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UserSummary {
    /// The name that the scene gives it.
    pub name: String,
    /// Largest magnitude of the force that reached a finger, N.
    pub peak_force_n: Option<f64>,
    /// Energy that the user put into the session, J; negative when the session gave more than it took.
    pub energy_j: Option<f64>,
    /// What the passivity observers at the fingers saw.
    #[serde(default)]
    pub passivity: Option<PassivitySummary>,
    /// How the user's device failed; none where it did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_faults: Option<DeviceFaultSummary>,
}

/// How a user's device failed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeviceFaultSummary {
    /// Ticks at which it was not read or not written.
    pub ticks: u64,
    /// The device and its reason, as said the last time.
    pub last: String,
}

/// Time-domain passivity (Hannaford & Ryu 2002) at a user's fingers. Each is observed alone: energy that another user put
/// in and that comes out here counts as given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PassivitySummary {
    /// The least energy that a finger had put in at any time, J; 0 when every finger's port was passive, less when not.
    pub least_energy_j: f64,
    /// The most that the session gave to a finger on balance between two instants, J, stored energy included.
    pub energy_given_j: f64,
    /// For how long the passivity controller braked a finger, s; 0 where it is off.
    pub braked_s: f64,
}
