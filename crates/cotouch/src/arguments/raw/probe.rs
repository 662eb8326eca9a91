//! Flags of `probe`.

use clap::{Args, Subcommand};
use cotouch_net::Route;
use cotouch_runtime::transport;
use cotouch_scene::time::Rate;

use super::super::invocation::{Command, Probe};
use super::numbers::duration;

#[derive(Args, Debug)]
pub(super) struct ProbeFlags {
    /// The ticket that `cotouch probe serve` prints; on the same computer and account its HOST:PORT will do
    #[arg(value_name = "TICKET")]
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
pub(super) enum ProbeServe {
    /// Send probes back, until Ctrl-C
    Serve {
        /// Where to listen, an IP address and a UDP port
        #[arg(long, value_name = "ADDR", value_parser = transport::parse)]
        listen: Route,
    },
}

pub(super) fn lift_probe(flags: Option<ProbeFlags>) -> Result<Command, String> {
    let flags = flags.ok_or("`cotouch probe` needs the TICKET that `cotouch probe serve` prints")?;
    let ProbeFlags { server, rate, duration: duration_s, sweep } = flags;
    Ok(Command::Probe(Probe { server, rate, duration_s, sweep }))
}
