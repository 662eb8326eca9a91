//! Flags of what runs a host: `run`, `serve`, `join`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use cotouch_runtime::DeviceChoice;
use cotouch_scene::Override;

use super::super::invocation::{Command, DEFAULT_DURATION_S, DEFAULT_VIEWER, Host, Recording, Run};
use super::numbers::{duration, max_force};

#[derive(Args, Debug, Default, PartialEq)]
pub(super) struct RunFlags {
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
pub(super) struct HostFlags {
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
    /// [default: recordings/SCENE-TIME.mcap (of a joiner joined-TIME.mcap), TIME in UTC]
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
    /// The largest force that devices of this host render, N, whatever the scene asks for [default: the limit of the scene where that
    /// is yours, 20 where it comes from a server]
    #[arg(long, value_name = "N", value_parser = max_force)]
    max_force: Option<f64>,
    /// Impair the link: latency_s, jitter_s, loss_rate, loss_burst_packets, reorder_rate, duplicate_rate or
    /// rate_limit_bytes_per_s, one way; seeded by session.seed; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = impairment)]
    impair: Vec<Impair>,
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
    let set: Override = format!("link.impairment.{text}")
        .parse()
        .map_err(|_| format!("{text:?} is not KEY=VALUE, such as loss_rate=0.01"))?;
    Ok(Impair { written: text.to_owned(), set: set.written_as(&format!("--impair {text}")) })
}

/// Only of drivers that there are; whether the device is there is seen when it is opened.
fn device(text: &str) -> Result<DeviceChoice, String> {
    let Ok(choice) = text.parse::<DeviceChoice>();
    cotouch_device::driver(&choice.spec).map_err(|error| error.to_string())?;
    Ok(choice)
}

impl RunFlags {
    pub(super) fn lift(self, scene: String) -> Command {
        let no_page = self.headless || self.in_virtual_time;
        let duration_s = self.duration.or(Some(DEFAULT_DURATION_S));
        let while_watched = self.duration.is_none();
        let host = Host { while_watched, ..self.shared.lift(no_page, duration_s) };
        Command::Run(Run { scene, in_virtual_time: self.in_virtual_time, host })
    }
}

impl HostFlags {
    pub(super) fn lift(self) -> Host {
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
        let (devices, max_force_n) = (self.devices, self.max_force);
        Host { duration_s, while_watched: false, recording, viewer, impair, devices, max_force_n }
    }
}
