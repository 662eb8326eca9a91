//! What commands take, as plain values.

use std::net::SocketAddr;
use std::path::PathBuf;

use cotouch_analysis::{Grid, Sweep};
use cotouch_net::Route;
use cotouch_runtime::DeviceChoice;
use cotouch_scene::Override;
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Rate;
use glam::DVec3;

use crate::output::Output;

/// The scene of `cotouch` alone.
pub(crate) const DEFAULT_SCENE: &str = "grasp";
/// How long a run takes when nothing is said, s.
pub(crate) const DEFAULT_DURATION_S: f64 = 20.0;
/// Where the page is when nothing is said.
pub(crate) const DEFAULT_VIEWER: &str = "127.0.0.1:7700";

/// What was asked for.
#[derive(Debug)]
pub(crate) struct Invocation {
    /// The work.
    pub(crate) command: Command,
    /// `--set`, in order.
    pub(crate) overrides: Vec<Override>,
    /// `--json`, `--out`.
    pub(crate) output: Output,
}

/// The work that was asked for.
#[derive(Debug)]
pub(crate) enum Command {
    /// All hosts in this process.
    Run(Run),
    /// The first host, open to others.
    Serve {
        /// What it is about.
        scene: String,
        /// Where to listen.
        listen: Route,
        /// How it runs.
        host: Host,
    },
    /// Another host.
    Join {
        /// The ticket that the first host prints, or where it listens.
        server: String,
        /// Whom to be; anyone who is free when nothing is said.
        user: Option<String>,
        /// How it runs.
        host: Host,
    },
    /// Send probes back.
    ProbeServe {
        /// Where to listen.
        listen: Route,
    },
    /// Measure a link.
    Probe(Probe),
    /// Re-simulate a recording.
    Replay(Replay),
    /// The verdict of the analysis on a scene, or on a scene whose keys are swept.
    Stability {
        /// The scene.
        scene: String,
        /// Up to two.
        sweeps: Vec<Sweep>,
        /// Whether the radius is wanted at every point of a sweep.
        with_radius: bool,
        /// Whether the maps behind the verdict are found by other routes too.
        with_check: bool,
    },
    /// How far a scene is from instability.
    Margin {
        /// The scene.
        scene: String,
        /// Outages that are told of besides the usual ones, s.
        outages_s: Vec<f64>,
    },
    /// What held data add to the damping that a user feels.
    Damping {
        /// The scene.
        scene: String,
        /// A number from 1 or a name.
        user: String,
    },
    /// What users feel over frequency.
    Admittance {
        /// The scene.
        scene: String,
        /// rad/s.
        frequencies: Grid,
    },
    /// What users feel at rest.
    Stiffness {
        /// The scene.
        scene: String,
    },
    /// Local models on a slow elastic object.
    LocalModel(LocalModel),
    /// Soft objects at rest.
    Soft(Soft),
    /// The seeds' figures and tables.
    Reproduce {
        /// Which; all where none is named.
        ids: Vec<String>,
    },
    /// Names of the built-in scenes.
    SceneList,
    /// A scene with every key.
    SceneShow {
        /// The scene.
        scene: String,
    },
    /// Whether a scene is valid.
    SceneCheck {
        /// The scene.
        scene: String,
    },
    /// The JSON Schema of scenes.
    SceneSchema,
}

/// What to do with a local model.
#[derive(Debug)]
pub(crate) enum LocalModel {
    /// Its stability.
    Check(LocalModelCheck),
    /// Its response to a step of the hand.
    Step(LocalModelStep),
    /// Gains for an object.
    Choose(LocalModelChoose),
    /// All of them on one scene.
    Compare {
        /// The scene.
        scene: String,
        /// Of every closed loop, s.
        duration_s: f64,
    },
}

/// What to say of a soft object.
#[derive(Debug)]
pub(crate) enum Soft {
    /// How it gives way.
    Compliance {
        /// The scene.
        scene: String,
        /// m.
        at: Vec<DVec3>,
    },
    /// How it sags.
    Deflect {
        /// The scene.
        scene: String,
        /// m.
        at: Vec<DVec3>,
    },
}

/// A PI local model on an elastic object, and who holds it.
#[derive(Debug)]
pub(crate) struct LocalModelCheck {
    /// N/m.
    pub(crate) kh: f64,
    /// N·T·I, N/m.
    pub(crate) int: f64,
    /// N/m.
    pub(crate) ko: f64,
    /// N: ticks in a slow period.
    pub(crate) ratio: u32,
    /// What goes to the simulation.
    pub(crate) returned_force: ReturnedForce,
    /// How the surface moves in between.
    pub(crate) hold: SurfaceHold,
    /// A hand that is free to move; held still when nothing is said. kg, N·s/m, N/m.
    pub(crate) hand: Option<[f64; 3]>,
    /// 1/T; only counts with a hand.
    pub(crate) fast_hz: Rate,
}

/// A step of the hand.
#[derive(Debug)]
pub(crate) struct LocalModelStep {
    /// N/m.
    pub(crate) kh: f64,
    /// N·T·I, N/m.
    pub(crate) int: f64,
    /// N/m.
    pub(crate) ko: f64,
    /// How far the hand moves, m.
    pub(crate) input_m: f64,
    /// 1/(N·T).
    pub(crate) slow_hz: Rate,
    /// 1/T.
    pub(crate) fast_hz: Rate,
    /// Contact pushes only.
    pub(crate) unilateral: bool,
    /// What goes to the simulation.
    pub(crate) returned_force: ReturnedForce,
    /// How the surface moves in between.
    pub(crate) hold: SurfaceHold,
    /// s.
    pub(crate) duration_s: Option<f64>,
}

/// An object for which gains are wanted.
#[derive(Debug)]
pub(crate) struct LocalModelChoose {
    /// N/m.
    pub(crate) ko: f64,
    /// Share by which K_o may be wrong, either way.
    pub(crate) ko_error: f64,
    /// Contacts on the object.
    pub(crate) contacts: u32,
    /// Compliance between two contacts over compliance of one.
    pub(crate) correlation: f64,
    /// N: ticks in a slow period.
    pub(crate) ratio: u32,
    /// What goes to the simulation.
    pub(crate) returned_force: ReturnedForce,
    /// How the surface moves in between.
    pub(crate) hold: SurfaceHold,
}

/// How to run a session in this process.
#[derive(Debug)]
pub(crate) struct Run {
    /// The scene.
    pub(crate) scene: String,
    /// Simulated time instead of real time.
    pub(crate) in_virtual_time: bool,
    /// How the hosts run; its duration is always given.
    pub(crate) host: Host,
}

/// How one host, or all hosts of one process, run.
#[derive(Debug)]
pub(crate) struct Host {
    /// s; until Ctrl-C when nothing is said.
    pub(crate) duration_s: Option<f64>,
    /// Whether it goes on after that for as long as a browser watches.
    pub(crate) while_watched: bool,
    /// What to write.
    pub(crate) recording: Recording,
    /// Where the page is to be.
    pub(crate) viewer: Option<SocketAddr>,
    /// Impairments of a real link, or overrides of the simulated one.
    pub(crate) impair: Vec<Override>,
    /// What users have in their hands, besides the simulated hand.
    pub(crate) devices: Vec<DeviceChoice>,
    /// What this host allows at most, N, if that was said.
    pub(crate) max_force_n: Option<f64>,
}

/// How to replay.
#[derive(Debug)]
pub(crate) struct Replay {
    /// The recording.
    pub(crate) file: PathBuf,
    /// Another one, shown beside it.
    pub(crate) beside: Option<PathBuf>,
    /// The folder that gets one CSV file a host.
    pub(crate) csv: Option<PathBuf>,
    /// Where the page is served.
    pub(crate) viewer: Option<SocketAddr>,
}

/// What to record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Recording {
    /// Nothing.
    Off,
    /// Under `recordings/`, named by scene and time.
    Named,
    /// To this file.
    To(PathBuf),
}

/// How to measure a link.
#[derive(Debug)]
pub(crate) struct Probe {
    /// The ticket that `cotouch probe serve` prints, or where it listens.
    pub(crate) server: String,
    /// Packets a second.
    pub(crate) rate: Rate,
    /// s; of each rate of a sweep.
    pub(crate) duration_s: f64,
    /// Whether to look for the largest rate too.
    pub(crate) sweep: bool,
}
