//! What the page and its server say to each other on `/live`, besides pictures ([`crate::picture`]): JSON, one object a
//! message. The page's side, where every field is explained, is `page/src/protocol.ts`.

use cotouch_scene::names::HostIndex;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::control::Control;
use crate::setting::{Settings, shortened};

/// From the page. Anything else is refused.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum PageMessage {
    Take { user: HostIndex },
    // With braces: of a variant without them unknown fields would pass.
    Leave {},
    Point { targets_m: Vec<[f64; 3]> },
    Rate { hz: f64 },
    Set { settings: Settings },
    Again {},
    Predict { id: u32, settings: Settings, whole: bool, margin: bool, map: Option<MapAxes> },
}

impl PageMessage {
    /// Reads a message; or says in words why it is none of the page's.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| shortened(&error.to_string(), 200))
    }
}

/// Whether `text` is something that the page says.
///
/// # Errors
/// Why not, in words.
pub fn check_page_message(text: &str) -> Result<(), String> {
    PageMessage::read(text).map(|_| ())
}

/// The plane of a map.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapAxes {
    /// The values along a row.
    pub x: MapAxis,
    /// From row to row.
    pub y: MapAxis,
}

/// Values of one key.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapAxis {
    /// The scene key that changes.
    pub key: String,
    /// The value at which the axis begins.
    pub from: f64,
    /// The value at which the axis ends.
    pub to: f64,
    /// How many values there are, both ends included.
    pub count: usize,
    /// Whether neighbours have equal ratios.
    pub log: bool,
}

/// What the server says to a page.
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
        paused: &'static str,
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::setting::Setting;

    #[test]
    fn what_the_page_says_is_read() {
        let message =
            r#"{"type":"predict","id":3,"settings":{"a":1,"b":"x"},"whole":true,"margin":true,"map":null}"#;
        let settings = Settings::from([
            ("a".to_owned(), Setting::Number(1.0)),
            ("b".to_owned(), Setting::Choice("x".to_owned())),
        ]);
        assert_eq!(
            PageMessage::read(message),
            Ok(PageMessage::Predict { id: 3, settings, whole: true, margin: true, map: None })
        );
        let message = r#"{"type":"point","targets_m":[[0,0.5,-1e-3]]}"#;
        assert_eq!(PageMessage::read(message), Ok(PageMessage::Point { targets_m: vec![[0.0, 0.5, -1e-3]] }));
        assert_eq!(PageMessage::read(r#"{"type":"leave"}"#), Ok(PageMessage::Leave {}));
    }

    proptest! {
        #[test]
        fn no_text_is_a_panic_and_no_refusal_is_long(text in "\\PC*|[\\[\\]{}\",:0-9a-z]{0,200}") {
            if let Err(why) = check_page_message(&text) {
                prop_assert!(!why.is_empty() && why.chars().count() <= 200);
            }
        }

        #[test]
        fn numbers_that_are_read_are_finite(number in "-?[0-9]{1,3}(\\.[0-9]{1,3})?(e-?[0-9]{1,4})?") {
            let text = format!(r#"{{"type":"rate","hz":{number}}}"#);
            if let Ok(PageMessage::Rate { hz }) = PageMessage::read(&text) {
                prop_assert!(hz.is_finite());
            }
        }
    }
}
