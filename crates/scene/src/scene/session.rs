//! Who takes part, how hosts share the world, and at which rates.

use serde::{Deserialize, Serialize};

use crate::time::Rate;
use crate::value::choice;

/// `[session]`: who takes part.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Session {
    /// Who computes the world.
    pub architecture: Architecture,
    /// 2 to 16; 1 with a soft object.
    pub users: u8,
    /// How copies of the object are kept together (distributed).
    pub coordination: Coordination,
    /// How bodies are stepped.
    pub integrator: Integrator,
    /// Seed of everything random.
    pub seed: u64,
    /// A peer that is silent for so long has left; its coupling is released smoothly.
    pub peer_timeout_s: f64,
    /// Time in which the coupling to a peer fades in when it comes and out when it goes.
    pub peer_fade_s: f64,
    /// After so long a time without a sample of a peer, what came apart is brought together slowly.
    pub rejoin_after_s: f64,
    /// Time in which it is; 0 leaves it to the couplings.
    pub rejoin_s: f64,
}

/// Who computes the world (Fotoohi Ghiam 2006, §4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Host 1 is the server: it keeps the one object and sends forces back.
    Centralized,
    /// Every host keeps a copy of the object; copies are coupled.
    Distributed,
}

choice!(Architecture { "centralized" => Centralized, "distributed" => Distributed });

/// How copies of the object are kept together: a scheme of `cotouch_world::coordination`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coordination {
    /// Every copy is coupled to every other with k_o, b_o.
    Pairwise,
    /// Every copy is coupled with k_o, b_o to the average of all copies (its own undelayed).
    Average,
}

impl Coordination {
    /// Whether the scheme adds vectors to samples: in a state packet that is an entry for every peer and every body that
    /// moves. `cotouch_world::coordination` has the schemes, and a test there holds them to this.
    #[must_use]
    pub const fn sends(self) -> bool {
        match self {
            Self::Pairwise | Self::Average => false,
        }
    }
}

choice!(Coordination { "pairwise" => Pairwise, "average" => Average });

/// How a body of mass m is advanced by T under a held force f.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// x += T·v + T²·f/(2m), v += T·f/m: exact for a force that is held over the period.
    ExactHold,
    /// v += T·f/m, x += T·v with the new v.
    SemiImplicitEuler,
}

choice!(Integrator { "exact-hold" => ExactHold, "semi-implicit-euler" => SemiImplicitEuler });

/// `[rates]`: how often each loop runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Rates {
    /// Haptic rate, 1/T_c.
    pub control_hz: Rate,
    /// Network rate, 1/T_t; not above the haptic rate.
    pub network_hz: Rate,
    /// Rate of the slow simulation of a soft object; not above the haptic rate.
    pub simulation_hz: Rate,
}
