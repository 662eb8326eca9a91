//! Flags as clap reads them, and their help.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use cotouch_analysis::{Sweep, SweepError};
use cotouch_net::Route;
use cotouch_runtime::{DeviceChoice, transport};
use cotouch_scene::Override;
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Rate;

use super::invocation::{
    Command, DEFAULT_DURATION_S, DEFAULT_SCENE, DEFAULT_VIEWER, Host, Invocation, LocalModel,
    LocalModelCheck, LocalModelChoose, LocalModelStep, Probe, Recording, Replay, Run, Soft,
};
use crate::output::Output;

const LONGEST_DURATION_S: f64 = 7.0 * 86_400.0;

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
Packets are neither encrypted nor authenticated yet: listen beyond loopback only where you trust the network.

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
        /// Where the session is, HOST:PORT
        #[arg(value_name = "ADDR")]
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

  there:  cotouch probe serve --listen 192.168.1.5:7801
  here:   cotouch probe 192.168.1.5:7801 --rate 128 --duration 30 --out lab.link.toml
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

#[derive(Args, Debug, Default, PartialEq)]
struct RunFlags {
    /// No page, unless --serve asks for one
    #[arg(long)]
    headless: bool,
    /// Simulated time: one thread, simulated links, the same bytes every time; no page
    #[arg(long = "virtual", conflicts_with = "serve")]
    in_virtual_time: bool,
    /// How long, s of session time [default: 20]; when not given, longer while a browser watches; Ctrl-C ends it earlier
    #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
    duration: Option<f64>,
    #[command(flatten)]
    shared: SharedFlags,
}

#[derive(Args, Debug)]
struct HostFlags {
    /// No page, unless --serve asks for one
    #[arg(long)]
    headless: bool,
    /// How long, s of session time [default: until Ctrl-C or the end of the session]
    #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
    duration: Option<f64>,
    #[command(flatten)]
    shared: SharedFlags,
}

#[derive(Args, Debug, Default, PartialEq)]
struct SharedFlags {
    /// Where the recording goes; its picture stands beside it as .svg
    /// [default: recordings/SCENE-TIME.mcap, TIME in UTC]
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "no_record")]
    record: Option<PathBuf>,
    /// No recording and no picture
    #[arg(long)]
    no_record: bool,
    /// Where the page is served [default: 127.0.0.1:7700]; others than this computer only where you trust the network
    #[arg(long, value_name = "ADDR")]
    serve: Option<SocketAddr>,
    /// The device in a user's hand, NAME or NAME:PARAMETERS; `run` takes one for each user. `hand` is the simulated hand
    /// of the scene, which is there when nothing is said
    #[arg(long = "device", value_name = "[USER=]SPEC", value_parser = device)]
    devices: Vec<DeviceChoice>,
    /// Impair the link: latency_s, jitter_s, loss_rate, loss_burst_packets, reorder_rate, duplicate_rate or
    /// rate_limit_bytes_per_s, one way; seeded by session.seed; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = impairment)]
    impair: Vec<Impair>,
}

#[derive(Args, Debug)]
struct ProbeFlags {
    /// Where `cotouch probe serve` listens, HOST:PORT
    #[arg(value_name = "ADDR")]
    server: String,
    /// Packets a second, Hz
    #[arg(long, value_name = "HZ", default_value = "128")]
    rate: Rate,
    /// How long, s; with --sweep, for each rate
    #[arg(long, value_name = "S", default_value = "10", value_parser = duration, allow_negative_numbers = true)]
    duration: f64,
    /// Also look for the largest rate with less than 0.1 % lost, from --rate upwards
    #[arg(long)]
    sweep: bool,
}

#[derive(Debug, Subcommand)]
enum ProbeServe {
    /// Send probes back, until Ctrl-C
    Serve {
        /// Where to listen, an IP address and a UDP port
        #[arg(long, value_name = "ADDR", value_parser = transport::parse)]
        listen: Route,
    },
}

#[derive(Debug, Subcommand)]
enum Analyze {
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
down to 1/64, each alone (the haptic rate no lower than the network rate) and both divided by the same factor. Of an \
unstable scene it says which change of a single value makes it stable, the smallest first; each was analysed whole.

Stable in the mean square whatever is lost is not harmless: while nothing arrives, copies of an object may drift apart, and come \
together with a push. The table of outages (one network period, 0.05, 0.6 and 3 s, and those of --outage) tells what hands feel \
when packets arrive again, for each newton that every finger pushed with since the outage began, all having been at rest before: the \
largest force; what random pushes lead one to expect; how far things came apart; the energy that the return gives to hands; from \
which push on the governor's limit cuts the force. It counts how a session treats a silent host: samples are held, after \
session.peer_timeout_s its coupling fades out, and fades in again when it is heard. `cotouch run` can be made to have such an \
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

#[derive(Debug, Subcommand)]
enum LocalModelCommand {
    /// Whether the loop of a local model and the simulation is stable; exit status 1 when not
    #[command(after_help = "\
Example:
  cotouch local-model check --kh 500 --int 300 --ko 1000 --ratio 50 --returned-force mean")]
    Check {
        /// Proportional gain K_h, N/m
        #[arg(long, value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        kh: f64,
        /// Integral gain over one slow period, N·T·I, N/m
        #[arg(long = "int", value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        int: f64,
        /// Stiffness of the object K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// Haptic ticks in one period of the simulation, N
        #[arg(long, value_name = "N", value_parser = ratio())]
        ratio: u32,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum)]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
        /// A hand of this mass holds the device, kg; without it the hand is held still
        #[arg(long, value_name = "KG", value_parser = positive, allow_negative_numbers = true)]
        hand_mass: Option<f64>,
        /// Damping of that hand, N·s/m
        #[arg(long, value_name = "N·S/M", default_value = "5", value_parser = not_negative, requires = "hand_mass")]
        hand_damping: f64,
        /// Stiffness of that hand, N/m
        #[arg(long, value_name = "N/M", default_value = "0", value_parser = not_negative, requires = "hand_mass")]
        hand_stiffness: f64,
        /// Haptic rate; counts only with a hand, Hz
        #[arg(long, value_name = "HZ", default_value = "1000")]
        fast_hz: Rate,
    },
    /// How surface and force answer when the hand steps into the object
    #[command(after_help = "\
Example:
  cotouch local-model step --kh 190 --ko 200 --input 0.025 --out step.svg")]
    Step {
        /// Proportional gain K_h, N/m
        #[arg(long, value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        kh: f64,
        /// Integral gain over one slow period, N·T·I, N/m
        #[arg(long = "int", value_name = "N/M", default_value = "0", value_parser = not_negative, allow_negative_numbers = true)]
        int: f64,
        /// Stiffness of the object K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// How far the hand steps into the object, m
        #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
        input: f64,
        /// Rate of the simulation, Hz
        #[arg(long, value_name = "HZ", default_value = "20")]
        slow_hz: Rate,
        /// Rate of the haptic loop, Hz; a whole multiple of the slow rate
        #[arg(long, value_name = "HZ", default_value = "1000")]
        fast_hz: Rate,
        /// The local model pushes and never pulls
        #[arg(long)]
        unilateral: bool,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum, default_value = "first")]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
        /// How long to look, s [default: until it has settled, 1 to 20 s]
        #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
        duration: Option<f64>,
    },
    /// Gains for an object whose stiffness is known to some accuracy
    #[command(after_help = "\
The gains are those whose slowest transient, over all stiffnesses within the error and all ways in which the contacts \
can move together, dies out fastest.

Example:
  cotouch local-model choose --ko 800 --ko-error 0.3 --contacts 4 --correlation 0.5")]
    Choose {
        /// Stiffness of the object at one contact K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// Share by which K_o may be wrong, either way: 0 to below 1
        #[arg(long, value_name = "FRACTION", default_value = "0", value_parser = below_one, allow_negative_numbers = true)]
        ko_error: f64,
        /// How many contacts there are on the object
        #[arg(long, value_name = "N", default_value = "1", value_parser = ratio())]
        contacts: u32,
        /// How much one contact moves the surface under another: 0 not at all, below 1
        #[arg(long, value_name = "R", default_value = "0", value_parser = below_one, allow_negative_numbers = true)]
        correlation: f64,
        /// Haptic ticks in one period of the simulation, N
        #[arg(long, value_name = "N", default_value = "50", value_parser = ratio())]
        ratio: u32,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum, default_value = "mean")]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
    },
    /// Which local model renders a soft object how well, and how stiff an object each can take
    #[command(after_help = "\
Open loop: every finger presses and slides along a given path, and each model's forces stand beside those of the same scene \
simulated at the haptic rate, with the contact's spring four times as stiff as the object. force_error is the root mean square \
of the difference over that of the reference; peak_error the largest difference over the largest force of the reference; \
max_jump_n the largest change of a force from one tick to the next. The scene's own model has the scene's gains; hold, p and \
pi otherwise those that the analysis chooses for an object of that K_o, compliance the reference's spring; these are halved \
until the analysis calls the scene stable.

Closed loop: the scene's own simulated hands, with Young's modulus from 500 Pa to 1 MPa, doubling; a model counts as stable \
where its run is quiet (`cotouch help run`).

Example:
  cotouch local-model compare soft-block")]
    Compare {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// How long each closed loop runs, s of simulated time
        #[arg(long, value_name = "S", default_value = "8", value_parser = duration, allow_negative_numbers = true)]
        duration: f64,
    },
}

#[derive(Debug, Subcommand)]
enum SoftCommand {
    /// The joint static compliance of points of a soft object, m/N
    #[command(after_help = "\
Points are in the scene's frame: inside a tetrahedron the point of the material that is there, otherwise the nearest point \
of the surface within a millionth of the object's size. Row and column 3·i + axis belong to the i-th point: the displacement \
of the row's point for a force of 1 N at the column's.

Example:
  cotouch soft compliance soft-block --at 0.35,0.05,0.0375 --at 0.175,0.05,0.075")]
    Compliance {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// A point, m; may be repeated
        #[arg(long, value_name = "X,Y,Z", value_parser = point, required = true, allow_hyphen_values = true)]
        at: Vec<glam::DVec3>,
    },
    /// Where a soft object comes to rest under gravity
    #[command(after_help = "\
Example, a block of jelly that sags:
  cotouch soft deflect soft-block --set gravity_m_per_s2=[0,0,-9.81] --at 0.35,0.05,0.0375")]
    Deflect {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// A point whose displacement is wanted, m; may be repeated
        #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
        at: Vec<glam::DVec3>,
    },
}

impl SoftCommand {
    fn lift(self) -> Soft {
        match self {
            Self::Compliance { scene, at } => Soft::Compliance { scene, at },
            Self::Deflect { scene, at } => Soft::Deflect { scene, at },
        }
    }
}

/// Three numbers with commas between them.
fn point(text: &str) -> Result<glam::DVec3, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(glam::DVec3::new(x, y, z)),
        _ => {
            Err("it must be three numbers with commas between them, such as 0.35,0.05,0.0375 (m)".to_owned())
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RawReturnedForce {
    /// Of its first tick
    First,
    /// The mean of all its ticks
    Mean,
    /// Of its last tick
    Last,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RawHold {
    /// It jumps
    Zero,
    /// It moves linearly, one period late
    First,
}

impl RawReturnedForce {
    fn lift(self) -> ReturnedForce {
        match self {
            Self::First => ReturnedForce::First,
            Self::Mean => ReturnedForce::Mean,
            Self::Last => ReturnedForce::Last,
        }
    }
}

impl RawHold {
    fn lift(self) -> SurfaceHold {
        match self {
            Self::Zero => SurfaceHold::Zero,
            Self::First => SurfaceHold::First,
        }
    }
}

/// Ticks in a slow period, or contacts.
fn ratio() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=10_000)
}

fn number(text: &str, is_allowed: impl Fn(f64) -> bool, allowed: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|&number: &f64| number.is_finite() && is_allowed(number));
    number.ok_or_else(|| format!("it must be {allowed}"))
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0, "a number above 0")
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |number| number >= 0.0, "a number, 0 or more")
}

fn below_one(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..1.0).contains(&number), "a number from 0 to below 1")
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

/// `--impair KEY=VALUE` as an override of the scene's link.
#[derive(Clone, Debug)]
struct Impair {
    written: String,
    set: Override,
}

impl PartialEq for Impair {
    fn eq(&self, other: &Self) -> bool {
        self.written == other.written
    }
}

fn impairment(text: &str) -> Result<Impair, String> {
    let set = format!("link.impairment.{text}")
        .parse()
        .map_err(|_| format!("{text:?} is not KEY=VALUE, such as loss_rate=0.01"))?;
    Ok(Impair { written: text.to_owned(), set })
}

/// Only of drivers that there are; whether the device is there is seen when it is opened.
fn device(text: &str) -> Result<DeviceChoice, String> {
    let Ok(choice) = text.parse::<DeviceChoice>();
    cotouch_device::driver(&choice.spec).map_err(|error| error.to_string())?;
    Ok(choice)
}

fn duration(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "a number of seconds is needed".to_owned())?;
    if seconds > 0.0 && seconds <= LONGEST_DURATION_S {
        Ok(seconds)
    } else {
        Err(format!("it must be above 0 and at most {LONGEST_DURATION_S} s (a week)"))
    }
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

/// Only some commands draw or make tables.
fn check_ending(command: &Command, output: &Output) -> Result<(), String> {
    let Some(file) = &output.file else { return Ok(()) };
    let ending = file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let makes = match command {
        Command::Stability { sweeps, .. } if !sweeps.is_empty() => &["svg", "csv"][..],
        Command::LocalModel(LocalModel::Step(_)) => &["svg", "csv"],
        Command::Admittance { .. } => &["svg"],
        _ => &[],
    };
    if ["svg", "csv", "png", "pdf"].contains(&ending) && !makes.contains(&ending) {
        let file = file.display();
        let possible: Vec<String> =
            makes.iter().chain(&["txt", "json"]).map(|ending| format!(".{ending}")).collect();
        let possible = possible.join(", ");
        return Err(format!("--out {file}: this command makes no .{ending}; possible are {possible}"));
    }
    Ok(())
}

/// An answer must not take the place of the recording that it is about.
fn check_no_recording_is_lost(command: &Command, output: &Output) -> Result<(), String> {
    let Some(file) = &output.file else { return Ok(()) };
    let recordings = match command {
        Command::Replay(Replay { file, beside, .. }) => std::iter::once(file).chain(beside).collect(),
        Command::Run(Run { host, .. }) | Command::Serve { host, .. } | Command::Join { host, .. } => {
            match &host.recording {
                Recording::To(recording) => vec![recording],
                Recording::Off | Recording::Named => Vec::new(),
            }
        }
        _ => Vec::new(),
    };
    match recordings.into_iter().find(|recording| is_same_file(recording, file)) {
        Some(recording) => Err(format!(
            "--out {}: this is the recording {}, which the answer would replace; name another file",
            file.display(),
            recording.display()
        )),
        None => Ok(()),
    }
}

/// Whether two paths lead to one file, which may not be there yet.
fn is_same_file(one: &Path, other: &Path) -> bool {
    let found = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    one == other || found(one).is_some_and(|one| found(other) == Some(one))
}

impl Analyze {
    fn lift(self) -> Result<Command, String> {
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

/// The longest outage that can be asked about, s.
const MAX_OUTAGE_S: f64 = 60.0;

fn outage_s(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|&seconds: &f64| seconds > 0.0 && seconds <= MAX_OUTAGE_S);
    seconds.ok_or_else(|| format!("--outage {text} is no duration above 0 and up to {MAX_OUTAGE_S} seconds"))
}

impl LocalModelCommand {
    fn lift(self) -> LocalModel {
        match self {
            Self::Check {
                kh,
                int,
                ko,
                ratio,
                returned_force,
                hold,
                hand_mass,
                hand_damping,
                hand_stiffness,
                fast_hz,
            } => LocalModel::Check(LocalModelCheck {
                kh,
                int,
                ko,
                ratio,
                returned_force: returned_force.lift(),
                hold: hold.lift(),
                hand: hand_mass.map(|mass_kg| [mass_kg, hand_damping, hand_stiffness]),
                fast_hz,
            }),
            Self::Step {
                kh,
                int,
                ko,
                input,
                slow_hz,
                fast_hz,
                unilateral,
                returned_force,
                hold,
                duration,
            } => LocalModel::Step(LocalModelStep {
                kh,
                int,
                ko,
                input_m: input,
                slow_hz,
                fast_hz,
                unilateral,
                returned_force: returned_force.lift(),
                hold: hold.lift(),
                duration_s: duration,
            }),
            Self::Compare { scene, duration: duration_s } => LocalModel::Compare { scene, duration_s },
            Self::Choose { ko, ko_error, contacts, correlation, ratio, returned_force, hold } => {
                LocalModel::Choose(LocalModelChoose {
                    ko,
                    ko_error,
                    contacts,
                    correlation,
                    ratio,
                    returned_force: returned_force.lift(),
                    hold: hold.lift(),
                })
            }
        }
    }
}

fn lift_probe(flags: Option<ProbeFlags>) -> Result<Command, String> {
    let flags = flags.ok_or("`cotouch probe` needs the ADDR where `cotouch probe serve` listens")?;
    let ProbeFlags { server, rate, duration: duration_s, sweep } = flags;
    Ok(Command::Probe(Probe { server, rate, duration_s, sweep }))
}

impl RunFlags {
    fn lift(self, scene: String) -> Command {
        let no_page = self.headless || self.in_virtual_time;
        let duration_s = self.duration.or(Some(DEFAULT_DURATION_S));
        let while_watched = self.duration.is_none();
        let host = Host { while_watched, ..self.shared.lift(no_page, duration_s) };
        Command::Run(Run { scene, in_virtual_time: self.in_virtual_time, host })
    }
}

impl HostFlags {
    fn lift(self) -> Host {
        self.shared.lift(self.headless, self.duration)
    }
}

impl SharedFlags {
    fn lift(self, no_page: bool, duration_s: Option<f64>) -> Host {
        let recording = match self.record {
            Some(file) => Recording::To(file),
            None if self.no_record => Recording::Off,
            None => Recording::Named,
        };
        let usual = || DEFAULT_VIEWER.parse().expect("an address and a port");
        let viewer = self.serve.or_else(|| (!no_page).then(usual));
        let impair = self.impair.into_iter().map(|impair| impair.set).collect();
        Host { duration_s, while_watched: false, recording, viewer, impair, devices: self.devices }
    }
}
