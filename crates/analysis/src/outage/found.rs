//! What is told of outages.

use serde::Serialize;

/// What hands feel after no packet arrived for a while: the worst over the network steps at which that may begin.
///
/// All is at rest before. With the outage every finger begins to push with a constant force of at most 1 N in any direction, and
/// goes on pushing: figures are per newton of that.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outage {
    /// How long it lasts, s.
    pub duration_s: f64,
    /// Whose packets do not arrive.
    pub direction: OutageDirection,
    /// Network steps whose packets are lost: as many as may fall into that time.
    pub lost_steps: u32,
    /// When hosts first take a silent one for gone and let their coupling to it fade out, s after the last packet before the outage
    /// could have been followed; none where packets arrive again before that.
    pub lets_go_after_s: Option<f64>,
    /// When everything is as before, s after the end of the outage, at the latest.
    pub whole_again_after_s: f64,
    /// The largest force at a finger from the end of the outage on, N per N: no pushes that are each at most 1 N make a larger one.
    pub peak_force_n_per_n: f64,
    /// The largest root mean square of the force at a finger at any tick from then on, where all fingers push in random directions,
    /// independently, with a root mean square of 1 N each: N per N.
    pub expected_force_n_per_n: f64,
    /// The largest force at a finger that such pushes make without an outage, N per N.
    pub undisturbed_force_n_per_n: f64,
    /// The largest distance between the copies of a body at two hosts; where there is one body only, between a finger and what
    /// another host knows of it: m per N.
    pub excursion_m_per_n: f64,
    /// The most energy that rendered forces have given to all hands together at any time since the end of the outage, under the pushes
    /// that make the largest force: J per N².
    pub energy_j_per_n2: f64,
    /// How hard each finger may push before the governor's largest force cuts that force, N.
    pub limited_from_n: Option<f64>,
    /// Where the largest force is felt, and what makes it.
    pub worst: WorstReturn,
}

/// Whose packets do not arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutageDirection {
    /// Anybody's.
    Both,
    /// Those of one host, the worst one.
    OneWay,
}

/// The largest force after an outage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstReturn {
    /// Who feels it.
    pub user: String,
    /// At which finger, from 1.
    pub finger: u8,
    /// Along which axis most: "x", "y" or "z".
    pub axis: &'static str,
    /// When, s after the end of the outage.
    pub after_s: f64,
    /// Whose packets did not arrive; none where nobody's did.
    pub silent: Option<String>,
    /// What makes it.
    pub pushes: Vec<FingerPush>,
}

/// A constant push of one finger.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FingerPush {
    /// Whose finger.
    pub user: String,
    /// Which, from 1.
    pub finger: u8,
    /// x, y, z, N.
    pub force_n: [f64; 3],
}

/// What outages of a scene do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outages {
    /// For each duration: in both directions, and in the worst one.
    pub rows: Vec<Outage>,
    /// What to know about them, in plain sentences.
    pub notes: Vec<String>,
}
