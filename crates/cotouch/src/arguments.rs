//! The command line: flags as clap reads them, lifted once to what commands take.

mod raw;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser as _;
use cotouch_analysis::local_model::{ReturnedForce, SurfaceHold};
use cotouch_analysis::sweep::{Grid, Sweep};
use cotouch_net::Route;
use cotouch_runtime::DeviceChoice;
use cotouch_scene::Override;
use cotouch_scene::time::Rate;
use glam::DVec3;

use crate::failure::Failure;
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
        /// Where the first host listens.
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
    },
    /// How far a scene is from instability.
    Margin {
        /// The scene.
        scene: String,
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
    /// Where `cotouch probe serve` listens.
    pub(crate) server: String,
    /// Packets a second.
    pub(crate) rate: Rate,
    /// s; of each rate of a sweep.
    pub(crate) duration_s: f64,
    /// Whether to look for the largest rate too.
    pub(crate) sweep: bool,
}

/// Reads the command line; help, version and bad usage are printed here and give an exit status.
pub(crate) fn parse() -> Result<Invocation, ExitCode> {
    let flags = raw::Flags::try_parse().map_err(|error| {
        let _ = error.print();
        ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
    })?;
    flags.lift().map_err(|reason| Failure::usage(reason).report())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &str) -> Result<Invocation, String> {
        let words = std::iter::once("cotouch").chain(words.split_whitespace());
        raw::Flags::try_parse_from(words).map_err(|error| error.to_string())?.lift()
    }

    #[test]
    fn nothing_is_a_run_of_the_default_scene() {
        let Command::Run(run) = read("").unwrap().command else { panic!("not a run") };
        assert_eq!((run.scene.as_str(), run.host.duration_s), (DEFAULT_SCENE, Some(DEFAULT_DURATION_S)));
        assert!(run.host.while_watched);
        assert_eq!(run.host.recording, Recording::Named);
        assert_eq!(run.host.viewer, Some(DEFAULT_VIEWER.parse().unwrap()));
    }

    #[test]
    fn flags_of_run_need_no_run() {
        for words in ["--virtual --duration 3 --no-record", "run --virtual --duration 3 --no-record"] {
            let Command::Run(run) = read(words).unwrap().command else { panic!("{words} is not a run") };
            assert!(run.in_virtual_time && run.host.viewer.is_none(), "{words}");
            assert_eq!((run.host.duration_s, run.host.recording), (Some(3.0), Recording::Off));
        }
        assert!(read("--virtual probe 127.0.0.1:1").unwrap_err().contains("after `run`"));
    }

    #[test]
    fn common_flags_stand_anywhere() {
        for words in [
            "--set hand.mass_kg=0.2 --json scene show single-axis",
            "scene show --json single-axis --set hand.mass_kg=0.2",
        ] {
            let invocation = read(words).unwrap();
            assert_eq!((invocation.overrides.len(), invocation.output.json), (1, true), "{words}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for words in [
            "run --duration 0",
            "run --duration nan",
            "run --set mass",
            "run --record a.mcap --no-record",
            "run --virtual --serve 127.0.0.1:1",
            "run --serve nowhere",
            "run --device anna=nothing",
            "join 127.0.0.1:1 --device nothing",
            "replay",
            "replay a.mcap b.mcap",
            "probe",
            "probe 127.0.0.1:1 --rate 0",
            "probe serve",
            "analyze stability --sweep hand.mass_kg=0..1",
            "analyze stability --sweep a=0..1:2 --sweep b=0..1:2 --sweep c=0..1:2",
            "analyze stability --sweep a=0..1:2 --sweep a=0..2:2",
            "analyze stability --radius",
            "analyze admittance",
            "analyze admittance --frequencies 0..10:5:log",
            "local-model check --kh 1 --int 0 --ko 1 --ratio 0 --returned-force mean",
            "local-model check --kh 1 --int 0 --ko 1 --ratio 5 --returned-force second",
            "local-model check --kh -1 --int 0 --ko 1 --ratio 5 --returned-force mean",
            "local-model check --kh 1 --int 0 --ko 0 --ratio 5 --returned-force mean",
            "local-model step --kh 1 --ko 1",
            "local-model choose --ko 1000 --ko-error 1",
            "local-model choose --ko 1000 --contacts 2 --correlation 1.5",
            "local-model compare",
            "soft compliance soft-block",
            "soft compliance soft-block --at 1,2",
            "soft deflect soft-block --at 1,2,nan",
            "export x",
        ] {
            assert!(read(words).is_err(), "{words}");
        }
    }
}
