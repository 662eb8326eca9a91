//! What an observer is told, and what it says.

use cotouch_device::Acted;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// What a run was, or is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunVerdict {
    /// Neither of the others.
    #[default]
    Quiet,
    /// The force above 8 Hz at a finger stayed above 0.05 N rms for half a second or longer.
    Shaking,
    /// A limit of the governor acted for over 20 ms on end, the world left its bounds, or the force above 8 Hz kept growing.
    Diverging,
}

impl RunVerdict {
    /// Of two hosts; nobody can say that it is quiet before both can.
    pub(crate) fn worse(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        let is_known = one.is_some() && other.is_some();
        one.max(other).filter(|&verdict| is_known || verdict != Self::Quiet)
    }

    /// In a word.
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Shaking => "shaking",
            Self::Diverging => "diverging",
        }
    }
}

/// Why a run diverged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Divergence {
    /// A limit of the governor acted for over 20 ms on end.
    GovernorLimit,
    /// The force above 8 Hz at a finger grew by a fifth or more from one quarter of a second to the next, four times on end.
    Growth,
    /// The world left all bounds.
    OutOfBounds,
}

impl Divergence {
    /// In words, to follow "diverging: ".
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::GovernorLimit => "a force limit acted for more than 20 ms on end",
            Self::Growth => "the force above 8 Hz kept growing",
            Self::OutOfBounds => "the object left all bounds",
        }
    }
}

/// When and why a run diverged first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diverged {
    /// The first cause.
    pub cause: Divergence,
    /// At which tick.
    pub tick: u64,
    /// At which of the host's fingers; the world is everybody's.
    pub finger: Option<u8>,
}

/// A stretch of time in which a finger shook.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaking {
    /// Which of the host's fingers.
    pub finger: u8,
    /// The first tick.
    pub from: u64,
    /// The last tick so far.
    pub to: u64,
    /// Of the force above 8 Hz, N.
    pub rms_n: f64,
    /// The frequency of a sinusoid with the same rms force and the same rms change from tick to tick, Hz.
    pub hz: f64,
}

/// What a host's run was with one set of settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsVerdict {
    /// The first tick with these settings.
    pub from: u64,
    /// The tick after the last one so far.
    pub to: u64,
    /// What it was; `None` where the time was too short to say.
    pub verdict: Option<RunVerdict>,
    /// How often fingers shook; where that was very often, the last times are one.
    pub shaking: u32,
    /// Ticks that were judged: those since a second after the change, or since the end of the soft start.
    pub judged_ticks: u64,
}

/// What goes on at a host now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LiveVerdict {
    /// Of the last second; `None` before there is one.
    pub verdict: Option<RunVerdict>,
    /// The largest force above 8 Hz at a finger over the last sixteenth of a second, N rms.
    pub fast_force_n: f64,
}

/// What an observer is told of a finger at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rendered {
    /// What went to the device, N.
    pub force_n: DVec3,
    /// What the governor did.
    pub acted: Acted,
}

impl LiveVerdict {
    /// Of several hosts: what goes on at the worst, and nothing before all can say that they are quiet.
    #[must_use]
    pub fn combine(hosts: impl Iterator<Item = Self>) -> Self {
        let worse = |one: Self, other: Self| Self {
            verdict: RunVerdict::worse(one.verdict, other.verdict),
            fast_force_n: one.fast_force_n.max(other.fast_force_n),
        };
        hosts.reduce(worse).unwrap_or_default()
    }
}
