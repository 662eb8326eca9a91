//! What the page and its server say to each other on `/live`, besides pictures ([`crate::picture`]): JSON, one object a
//! message. The page's side, where every field is explained, is `page/src/protocol.ts`.

use std::collections::BTreeMap;

use cotouch_scene::names::HostIndex;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::controls::Control;

/// Values of controls, by key: numbers or choices.
pub type Settings = BTreeMap<String, Setting>;

/// What a control is set to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// Of a number or a whole number.
    Number(f64),
    /// Of a choice.
    Choice(String),
}

/// From the page. Anything else is refused.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum PageMessage {
    Take { user: HostIndex },
    Leave,
    Point { targets_m: Vec<[f64; 3]> },
    Rate { hz: f64 },
    Set { settings: Settings },
    Again,
    Predict { id: u32, settings: Settings, margin: bool, map: Option<MapAxes> },
}

/// The plane of a map.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapAxes {
    /// Along a row.
    pub x: MapAxis,
    /// From row to row.
    pub y: MapAxis,
}

/// Values of one key.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapAxis {
    /// A scene key.
    pub key: String,
    /// The first value.
    pub from: f64,
    /// The last value.
    pub to: f64,
    /// How many.
    pub count: usize,
    /// Whether neighbours have equal ratios.
    pub log: bool,
}

/// To the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case")]
pub(crate) enum ServerMessage {
    Session(Box<SessionMessage>),
    Seats {
        seats: Vec<SeatInfo>,
    },
    Taken {
        user: Option<HostIndex>,
        stiffness_n_per_m: f64,
        damping_n_s_per_m: f64,
    },
    Refused {
        what: &'static str,
        why: String,
    },
    News {
        text: String,
    },
    Settings {
        settings: Settings,
        note: String,
    },
    Verdict {
        id: u32,
        #[serde(flatten)]
        verdict: Value,
    },
    Margin {
        id: u32,
        #[serde(flatten)]
        margin: Value,
    },
    Map {
        id: u32,
        #[serde(flatten)]
        map: Value,
    },
    Failed {
        id: u32,
        what: &'static str,
        why: String,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct SessionMessage {
    pub(crate) version: String,
    pub(crate) generation: u32,
    pub(crate) mode: &'static str,
    pub(crate) about: Value,
    pub(crate) controls: Vec<Control>,
    pub(crate) may_change: bool,
    pub(crate) recordings: Vec<Value>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct SeatInfo {
    pub(crate) user: HostIndex,
    pub(crate) name: String,
    pub(crate) by: &'static str,
}
