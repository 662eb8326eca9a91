//! Flags of `analyze`.

use clap::Subcommand;
use cotouch_analysis::{Sweep, SweepError};

use super::super::invocation::{Command, DEFAULT_SCENE};
use super::numbers::outage_s;

#[derive(Debug, Subcommand)]
pub(super) enum Analyze {
    /// Whether a scene is stable, contact mode by contact mode, and by how much
    #[command(after_help = "\
The spectral radius is the largest factor by which a disturbance grows in one period, rigid-body motion left out; below 1 \
the loop is stable, and at 1 but for rounding neutral, which counts as stable: a box that pivots about a finger. The exit status is 0 whatever the verdict.

A scene is called stable only where all that its users can touch, by script, by a device or by a hand taken on the page, was \
analysed and is stable, and where an adversary that opens and closes contacts found nothing that keeps moving, far enough from \
the line for that to mean something (switching, switching_distance, switching_found); unstable as soon as one analysed contact mode is; \
and not proven (null with --json) where something was left out, or where switching is unproven. left_out says what. Maps and \
margins are about the contacts that scripts make.

Contact modes are sets of contacts of fingers and walls with the copies of a body, by script, by a device or by a hand taken \
on the page; of sets that differ only in who is who one is listed. The worst is searched further: fingers elsewhere on the \
body, contacts that slide, hands held otherwise.

With --sweep the answer is a map, with its boundary; LO may be above HI. --out map.svg writes it as a picture, map.csv as a \
table, other endings as the answer itself. A spectral radius is per pattern of ticks and network steps, so that those \
of different rates cannot be compared.

--check is for whoever doubts a verdict, or quotes one: the map of the worst contact mode (of each, where there are few) is \
found again by three routes that share only the loop's description with the verdict: instant by instant; by the direct \
state-space method, all samples of a pattern at once; and by subsystem resampling, each part at its own rate (Fotoohi Ghiam \
2006, ch. 4), which needs rates that are multiples of each other. Differences of the size of rounding, 1e-9 and less, mean that \
the arithmetic is right. Whether the description fits what you have in your hands, they cannot tell.

Example:
  cotouch analyze stability grasp
  cotouch analyze stability single-axis --check
  cotouch analyze stability single-axis --set coupling.remote_hand_object.stiffness_n_per_m=4000
  cotouch analyze stability single-axis --sweep coupling.hand_object.stiffness_n_per_m=0..8000:200 \\
      --sweep coupling.remote_hand_object.stiffness_n_per_m=0..3000:200 --out map.svg")]
    Stability {
        /// A built-in scene or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
        /// Sweep a scene key; twice for a map, the first key to the right and the second one upwards
        #[arg(long = "sweep", value_name = "KEY=LO..HI:COUNT[:log]")]
        sweeps: Vec<String>,
        /// The spectral radius at every point of a sweep, not only the verdict
        #[arg(long, requires = "sweeps")]
        radius: bool,
        /// Find the maps behind the verdict by three other routes too, and say how they agree
        #[arg(long, conflicts_with = "sweeps")]
        check: bool,
    },
    /// How far every gain, the delay, the rates and the loss of packets are from instability
    #[command(after_help = "\
A factor of 1.7 says: this gain alone may grow 1.7-fold before the worst contact mode turns unstable. The delay is the \
largest one, in network periods, up to which the scene is stable, from its own delay upwards (beyond the next one it may \
be stable again); its fraction counts ticks, as link.impairment.latency_s does with link.play_out=on-arrival. The \
loss rate is the share of lost packets at which the mean square of the motion stops dying out; a table has it for longer \
delays too. A rate is the one at which, from the scene's downwards, the verdict first turns, to a thousandth; rates are looked at \
down to 1/64, each alone (the haptic rate no lower than the network rate) and both divided by the same factor. Each is looked \
for at some places, so that a window of instability that lies between two looks is missed: what is told of a value that one \
wants to use is checked by `cotouch analyze stability` with that value. Of an \
unstable scene it says which change of a single value makes it stable, the smallest first; each was analysed whole.

Stable in the mean square whatever is lost is not harmless: while nothing arrives, copies of an object may drift apart, and come \
together with a push. The table of outages (one network period, 0.05, 0.6 and 3 s, and those of --outage) tells what hands feel \
when packets arrive again, for each newton that every finger pushed with since the outage began, all having been at rest before: the \
largest force; what random pushes lead one to expect; how far things came apart; the energy that the return gives to hands; from \
which push on the governor's limit cuts the force. It counts how a session treats a silent host: samples are held, after \
session.peer_timeout_s its coupling fades out, and fades in again when it is heard; what came apart in more than \
session.rejoin_after_s is brought together within session.rejoin_s. `cotouch run` can be made to have such an \
outage: --impair outage_from_s=3 --impair outage_duration_s=0.6.

Example:
  cotouch analyze margin single-axis
  cotouch analyze margin single-axis --outage 1.5
  cotouch analyze margin grasp --set link.delay_periods=2")]
    Margin {
        /// A built-in scene or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
        /// Tell of an outage of so many seconds too; may be repeated
        #[arg(long = "outage", value_name = "S", allow_hyphen_values = true)]
        outages: Vec<String>,
    },
    /// The viscous damping that a user feels because data are held and late
    #[command(after_help = "\
One user moves the object and the others are absent; the force over the velocity at network instants, towards frequency 0. \
The simplified model leaves the hand and its couplings out.

Example:
  cotouch analyze damping single-axis --user 2 --set link.delay_periods=1")]
    Damping {
        /// A built-in scene or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
        /// Who moves the object: a name of the scene, or 1 for the first user
        #[arg(long, value_name = "N", default_value = "1")]
        user: String,
    },
    /// What users feel over frequency: velocity over force, and position over force against a wall or on a soft object
    #[command(after_help = "\
Example:
  cotouch analyze admittance single-axis --frequencies 0.1..400:200:log --out admittance.svg")]
    Admittance {
        /// A built-in scene or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
        /// rad/s
        #[arg(long, value_name = "LO..HI:COUNT[:log]")]
        frequencies: String,
    },
    /// What users feel at rest: force over displacement, the others absent
    #[command(after_help = "\
Example:
  cotouch analyze stiffness single-axis --set wall.stiffness_n_per_m=30000")]
    Stiffness {
        /// A built-in scene or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
    },
}

impl Analyze {
    pub(super) fn lift(self) -> Result<Command, String> {
        let in_words = |error: SweepError| error.to_string();
        Ok(match self {
            Self::Stability { scene, sweeps, radius, check } => {
                let sweeps: Vec<Sweep> =
                    sweeps.iter().map(|text| text.parse()).collect::<Result<_, _>>().map_err(in_words)?;
                if sweeps.len() > 2 {
                    return Err(format!(
                        "--sweep is given {} times; a map has one or two keys",
                        sweeps.len()
                    ));
                }
                if let [x, y] = &sweeps[..]
                    && x.key == y.key
                {
                    return Err(SweepError::Twice(x.key.clone()).to_string());
                }
                Command::Stability { scene, sweeps, with_radius: radius, with_check: check }
            }
            Self::Margin { scene, outages } => Command::Margin {
                scene,
                outages_s: outages.iter().map(|text| outage_s(text)).collect::<Result<_, _>>()?,
            },
            Self::Damping { scene, user } => Command::Damping { scene, user },
            Self::Admittance { scene, frequencies } => {
                Command::Admittance { scene, frequencies: frequencies.parse().map_err(in_words)? }
            }
            Self::Stiffness { scene } => Command::Stiffness { scene },
        })
    }
}
