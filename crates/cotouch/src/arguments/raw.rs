//! Flags as clap reads them, and their help.

mod analyze;
mod answer;
mod host;
mod local_model;
mod numbers;
mod probe;
mod soft;

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use cotouch_net::Route;
use cotouch_runtime::transport;
use cotouch_scene::Override;

use super::invocation::{Command, DEFAULT_SCENE, Invocation, Replay};
use crate::output::Output;
use analyze::Analyze;
use answer::{check_ending, check_no_recording_is_lost};
use host::{HostFlags, RunFlags};
use local_model::LocalModelCommand;
use probe::{ProbeFlags, ProbeServe, lift_probe};
use soft::SoftCommand;

/// Cooperative haptics whose stability is proven before anyone touches it.
///
/// Several people, each with a force-feedback device on a computer of their own, move the same virtual object. cotouch
/// says beforehand whether a scene's loops are stable, runs the session, and says afterwards what happened.
#[derive(Debug, Parser)]
#[command(name = "cotouch", version, max_term_width = 100, after_help = EXAMPLES, subcommand_negates_reqs = true)]
pub(super) struct Flags {
    #[command(subcommand)]
    command: Option<Subcommands>,
    #[command(flatten)]
    run: RunFlags,
    #[command(flatten)]
    common: Common,
}

const EXAMPLES: &str = "\
Examples:
  cotouch                           run `grasp` for 20 s; watch it on http://127.0.0.1:7700
  cotouch run --virtual             the same in simulated time: deterministic and quick
  cotouch analyze stability         only say whether it is stable
  cotouch analyze margin single-axis
                                    how far every gain, delay and loss is from instability
  cotouch run grasp-centralized     the same box, kept by one host: a loop that the analysis calls unstable
  cotouch scene show single-axis > mine.toml
                                    a scene to change; then: cotouch run mine.toml

Exit status: 0 done; 1 a negative verdict, or a failure while running; 2 bad usage or an invalid scene.
Units are SI and stand in the names of keys: stiffness_n_per_m is in N/m.";

#[derive(Args, Debug)]
struct Common {
    /// Give a scene key another value; may be repeated. `cotouch scene show` lists the keys
    #[arg(long = "set", value_name = "KEY=VALUE", global = true, help_heading = "Common options")]
    overrides: Vec<Override>,
    /// Answer with one JSON document on stdout; everything else goes to stderr
    #[arg(long, global = true, help_heading = "Common options")]
    json: bool,
    /// Write the answer to this file too (`probe`: the link file)
    #[arg(long, value_name = "PATH", global = true, help_heading = "Common options")]
    out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Subcommands {
    /// Run a session: all hosts in this process, joined over UDP on loopback (default)
    #[command(after_help = "\
A page shows the session; there, a mouse or a finger on a touch screen can take any user's hand, and settings can be \
changed while the session runs, with the prediction for exactly these settings beside it.

Before the session, cotouch says what the analysis predicts; after it, what happened, from the end of the soft start to the \
beginning of the release. A run is quiet; or it is shaking: the force above 8 Hz at a finger stayed above 0.05 N rms for half a \
second; or diverging: that force kept growing, a force limit acted for more than 20 ms on end, or the object left all bounds. \
What scripts ask for (tremor, sinusoids) does not count. The exit status is 1 unless it was quiet.

Examples:
  cotouch run single-axis-centralized --duration 30
  cotouch run single-axis --virtual --set link.delay_periods=3 --json
  cotouch run --impair loss_rate=0.02 --impair latency_s=0.004")]
    Run {
        /// A built-in scene (`cotouch scene list`) or a TOML file
        #[arg(default_value = DEFAULT_SCENE)]
        scene: String,
        #[command(flatten)]
        flags: RunFlags,
    },
    /// Run the first host of a session that others join from other processes or machines
    #[command(after_help = "\
It prints a ticket: its address and a key, new for each session. Who has the ticket may join and nobody else, so pass it on as you
would a password; give another address in front of the slash where others reach this computer by another one. All packets are
encrypted and authenticated. On this computer and account the address alone will do.

Example, in two terminals:
  cotouch serve single-axis --listen 127.0.0.1:7800
  cotouch join 127.0.0.1:7800 --duration 20")]
    Serve {
        /// A built-in scene or a TOML file; hosts that join get it from here
        scene: String,
        /// Where to listen, an IP address and a UDP port
        #[arg(long, value_name = "ADDR", value_parser = transport::parse)]
        listen: Route,
        #[command(flatten)]
        host: HostFlags,
    },
    /// Join a session that `cotouch serve` runs
    #[command(after_help = "Example:\n  cotouch join 127.0.0.1:7800 --user ben --duration 20")]
    Join {
        /// The ticket that `cotouch serve` prints, HOST:PORT/KEY; on the same computer and account HOST:PORT will do
        #[arg(value_name = "TICKET")]
        server: String,
        /// Whom to be, a user name of the scene [default: anyone who is free]
        #[arg(long, value_name = "NAME")]
        user: Option<String>,
        #[command(flatten)]
        host: HostFlags,
    },
    /// Measure a link: round trip, jitter, loss, and the packet rate that it carries
    #[command(
        args_conflicts_with_subcommands = true,
        subcommand_negates_reqs = true,
        after_help = "\
With --out, the measured impairment is written as a link file that a scene can include:

  there:  cotouch probe serve --listen 192.168.1.5:7801, which prints a ticket
  here:   cotouch probe TICKET --rate 128 --duration 30 --out lab.link.toml
  then:   cotouch run --virtual --set link.include=lab.link.toml

Jitter is the standard deviation of the round trip. The link file takes both ways as alike."
    )]
    Probe {
        #[command(subcommand)]
        serve: Option<ProbeServe>,
        #[command(flatten)]
        flags: Option<ProbeFlags>,
    },
    /// Re-simulate a recording and compare the states byte for byte
    #[command(after_help = "\
Exit status 1 when the re-simulated states differ from the recorded ones.

Example:
  cotouch replay recordings/single-axis-20261122T101500Z.mcap --csv out/
  cotouch replay monday.mcap tuesday.mcap --serve 127.0.0.1:7700")]
    Replay {
        /// A recording that a run wrote
        #[arg(value_name = "FILE.mcap")]
        file: PathBuf,
        /// Another one, shown beside it on the page
        #[arg(value_name = "OTHER.mcap", requires = "serve")]
        beside: Option<PathBuf>,
        /// Show it on a page with a time line, until Ctrl-C
        #[arg(long, value_name = "ADDR")]
        serve: Option<SocketAddr>,
        /// Write the ticks of every host to this folder too, one CSV file a host
        #[arg(long, value_name = "DIR")]
        csv: Option<PathBuf>,
    },
    /// Say what a scene will do without running it
    Analyze {
        #[command(subcommand)]
        what: Analyze,
    },
    /// Local models: what keeps a fast haptic loop on a slowly simulated object stable
    LocalModel {
        #[command(subcommand)]
        what: LocalModelCommand,
    },
    /// Soft objects at rest: how they give way, how they sag
    Soft {
        #[command(subcommand)]
        what: SoftCommand,
    },
    /// Repeat the figures and tables of the two works that cotouch is built on
    #[command(after_help = "\
Writes one page (index.html), figures (SVG) and their numbers (CSV) to a folder, by default reproduced/; --out names \
another. Printed values stand beside those that come out here, with the reason where they differ. Exit status 1 when \
something that the text claims does not hold.

Ids, of Fotoohi Ghiam 2006: table1.1, fig5.1 to fig5.4, fig6.2, fig6.4, fig6.5, table6.2, eq6.3, eq6.4, eqB.10, eqB.11, \
fig8.1, fig8.3, fig8.4; of Barbagli et al. 2003: pfig7 to pfig11, peq4, peq5, peq9

Example:
  cotouch reproduce fig5.1 fig6.2 pfig10 --out figures")]
    Reproduce {
        /// What to repeat [default: all]
        #[arg(value_name = "ID")]
        ids: Vec<String>,
    },
    /// List, show and check scenes
    Scene {
        #[command(subcommand)]
        what: SceneCommand,
    },
}

#[derive(Debug, Subcommand)]
enum SceneCommand {
    /// Names of the built-in scenes, a sentence about each
    List,
    /// A scene as TOML, ready to be changed; with --set or --json, every key with its value
    Show {
        /// A built-in scene or a TOML file
        #[arg(value_name = "NAME")]
        scene: String,
    },
    /// Say everything that is wrong with a scene; exit status 2 when something is
    Check {
        /// A built-in scene or a TOML file
        #[arg(value_name = "FILE")]
        scene: String,
    },
    /// The JSON Schema of scene files, for editors
    Schema,
}

impl Flags {
    /// What commands take.
    pub(super) fn lift(self) -> Result<Invocation, String> {
        if self.command.is_some() && self.run != RunFlags::default() {
            return Err("flags of `run` must stand after `run`; before a command only --set, --json and --out may stand".into());
        }
        let command = match self.command {
            None => self.run.lift(DEFAULT_SCENE.to_owned()),
            Some(Subcommands::Run { scene, flags }) => flags.lift(scene),
            Some(Subcommands::Serve { scene, listen, host }) => {
                Command::Serve { scene, listen, host: host.lift() }
            }
            Some(Subcommands::Join { server, user, host }) => {
                Command::Join { server, user, host: host.lift() }
            }
            Some(Subcommands::Probe { serve: Some(ProbeServe::Serve { listen }), .. }) => {
                Command::ProbeServe { listen }
            }
            Some(Subcommands::Probe { serve: None, flags }) => lift_probe(flags)?,
            Some(Subcommands::Replay { file, beside, serve, csv }) => {
                Command::Replay(Replay { file, beside, csv, viewer: serve })
            }
            Some(Subcommands::Analyze { what }) => what.lift()?,
            Some(Subcommands::LocalModel { what }) => Command::LocalModel(what.lift()),
            Some(Subcommands::Soft { what }) => Command::Soft(what.lift()),
            Some(Subcommands::Reproduce { ids }) => Command::Reproduce { ids },
            Some(Subcommands::Scene { what: SceneCommand::List }) => Command::SceneList,
            Some(Subcommands::Scene { what: SceneCommand::Show { scene } }) => Command::SceneShow { scene },
            Some(Subcommands::Scene { what: SceneCommand::Check { scene } }) => Command::SceneCheck { scene },
            Some(Subcommands::Scene { what: SceneCommand::Schema }) => Command::SceneSchema,
        };
        let output = Output { json: self.common.json, file: self.common.out };
        check_ending(&command, &output)?;
        check_no_recording_is_lost(&command, &output)?;
        Ok(Invocation { command, overrides: self.common.overrides, output })
    }
}
