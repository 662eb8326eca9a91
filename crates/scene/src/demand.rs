//! What the scripts of a session ask of its devices: a word that those who run scripts and those who judge them share.

/// The largest forces that scripts were found to ask devices for, in a session whose limits are lifted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScriptedDemand {
    /// The largest force.
    pub force: AskedForce,
    /// The largest change of force from one haptic tick to the next.
    pub change: AskedForce,
    /// How much of the scripts this is about.
    pub extent: DemandExtent,
}

/// A force at a finger, or its change within a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AskedForce {
    /// Its magnitude, N; 0 where nothing was asked for.
    pub newtons: f64,
    /// At which user's device; empty where nothing was asked for.
    pub user: String,
    /// At which of that user's fingers, from 0.
    pub finger: usize,
    /// When, s of session time.
    pub at_s: f64,
}

/// How much of what scripts do was looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum DemandExtent {
    /// Every script from its beginning to its end, repeated ones several times, and until nothing changed any more.
    #[default]
    Whole,
    /// Not what comes later.
    Until {
        /// s of session time.
        at_s: f64,
    },
    /// Until the world left all bounds.
    Diverged {
        /// s of session time.
        at_s: f64,
    },
    /// Nothing.
    NotRun {
        /// As a sentence without its full stop.
        why: String,
    },
}
