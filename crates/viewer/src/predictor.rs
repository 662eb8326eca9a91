//! What the analysis says about the session that runs, or would run: asked of whoever can answer.

use cotouch_scene::scene::Scene;
use serde_json::Value;

use crate::protocol::MapAxes;

/// A question about one scene.
#[derive(Clone, Debug)]
pub struct Question {
    /// The scene as it would run: with the network that it would meet, and with hands that browsers move tracked.
    pub scene: Scene,
    /// Whether all that users can touch is to be judged, which may take seconds, and not only what is found quickly.
    pub whole: bool,
    /// Whether the margins are wanted.
    pub margin: bool,
    /// The plane of the map that is wanted.
    pub map: Option<MapAxes>,
}

/// A part of the answer: fields as in `page/src/protocol.ts`, without `type` and `id`.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// `stable` (null where it is left open)`, whole` (false where a longer look may say more)`, spectral_radius, period_s, modes,
    /// warnings`.
    Verdict(Value),
    /// `delay_periods, loss_rate, gains, notes`.
    Margin(Value),
    /// `x, y, stable, boundary, complete`; rough ones may come before the complete one.
    Map(Value),
    /// What there is no answer for, "verdict", "margin" or "map", and why.
    Failed(&'static str, String),
}

/// Answers questions: verdict, map and margin, in this order.
pub trait Predictor: Send + Sync {
    /// Hands over the parts of the answer as they are ready; gives up soon after `wanted` says no. Called on a thread of
    /// its own; may take long.
    fn predict(&self, question: &Question, wanted: &(dyn Fn() -> bool + Sync), tell: &mut dyn FnMut(Answer));
}
