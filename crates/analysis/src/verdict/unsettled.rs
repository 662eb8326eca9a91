//! A motion that does not settle although each contact mode is stable.

use serde::Serialize;

/// Trajectories that an adversary keeps moving by letting contacts open and close.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnsettledMotion {
    /// Whose finger feels it most.
    pub user: String,
    /// Which of the user's fingers, from 1.
    pub finger: usize,
    /// The contacts that can open and close in it.
    pub contacts: Vec<String>,
    /// What hands did before they pushed constantly.
    pub policy: HandPolicy,
    /// The force above 8 Hz at that finger over the last seconds, N rms; none where it grows out of all bounds.
    pub rms_n: Option<f64>,
    /// Its frequency, Hz.
    pub hz: f64,
    /// Trajectories that keep moving, of so many that were tried.
    pub moving: usize,
    /// All that were tried.
    pub tried: usize,
}

/// What hands do before they push constantly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandPolicy {
    /// Hands and bodies are thrown at each other.
    Throw,
    /// Hands touch and let go in a rhythm: that of a contact mode that dies out slowly, or another one.
    Rhythm,
    /// Hands push to and fro in time with the motion that dies out most slowly, so as to feed it.
    Pump,
    /// Hands slide along what they press on.
    Slide,
}

impl HandPolicy {
    /// As in "hands … and then push constantly".
    #[must_use]
    pub const fn told(self) -> &'static str {
        match self {
            Self::Throw => "are thrown at it",
            Self::Rhythm => "touch and let go in a rhythm",
            Self::Pump => "push in time with its slowest motion",
            Self::Slide => "slide along it",
        }
    }
}

impl UnsettledMotion {
    /// In a sentence: who feels it, how strong it is and after what.
    #[must_use]
    pub fn told(&self) -> String {
        let strength = match self.rms_n {
            Some(rms_n) => format!("{rms_n:.2} N rms at {:.0} Hz", self.hz),
            None => "without bounds".to_owned(),
        };
        format!(
            "an adversary that switches contacts keeps it moving: {strength} at finger {} of {} after hands {} and then push \
             constantly ({} of {} trajectories)",
            self.finger,
            self.user,
            self.policy.told(),
            self.moving,
            self.tried
        )
    }
}
