//! The network between hosts.

use serde::{Deserialize, Serialize};

use crate::names::HostIndex;
use crate::value::choice;

/// `[link]`: the network between hosts.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Link {
    /// n: network periods between sampling and use; one way when distributed, round trip when centralized. 0 to 64.
    pub delay_periods: u32,
    /// The part of `delay_periods` that lies on the force's way back from the server (centralized). Default 0.
    pub return_delay_periods: u32,
    /// When a received sample is used.
    pub play_out: PlayOut,
    /// What a simulated link does to packets, in every direction that `ways` does not name.
    pub impairment: Impairment,
    /// Directions with an impairment of their own.
    pub ways: Vec<Way>,
}

/// When a received sample is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlayOut {
    /// At sample time + n·T_t; a late one at the next network step.
    Scheduled,
    /// At the first haptic tick at or after its arrival.
    OnArrival,
}

choice!(PlayOut { "scheduled" => Scheduled, "on-arrival" => OnArrival });

/// `[[link.way]]`: one direction with an impairment of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Way {
    /// The host that sends.
    pub from: HostIndex,
    /// The host that receives.
    pub to: HostIndex,
    /// What happens on the way.
    pub impairment: Impairment,
}

/// What a simulated link does to packets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impairment {
    /// Transit time of every packet, one way.
    pub latency_s: f64,
    /// Extra transit time: the mean of an exponential distribution. Without `reorder_rate`, order is kept.
    pub jitter_s: f64,
    /// Share of packets lost in the long run, 0 to 0.99.
    pub loss_rate: f64,
    /// Mean length of a run of lost packets, in packets, 1 or more (Gilbert–Elliott; 1/(1 − loss_rate) is independent loss).
    pub loss_burst_packets: f64,
    /// Share of packets that overtake: they skip the jitter and the queue's order.
    pub reorder_rate: f64,
    /// Share of packets that arrive twice.
    pub duplicate_rate: f64,
    /// Bytes a second that pass; 0 means no limit.
    pub rate_limit_bytes_per_s: f64,
    /// From this session time on no packet that is sent arrives, s.
    pub outage_from_s: f64,
    /// For so long, s; 0 means that there is no outage.
    pub outage_duration_s: f64,
}

impl Impairment {
    /// A perfect link: every packet arrives at once.
    pub const NONE: Self = Self {
        latency_s: 0.0,
        jitter_s: 0.0,
        loss_rate: 0.0,
        loss_burst_packets: 1.0,
        reorder_rate: 0.0,
        duplicate_rate: 0.0,
        rate_limit_bytes_per_s: 0.0,
        outage_from_s: 0.0,
        outage_duration_s: 0.0,
    };
}
