//! The command line: flags as clap reads them, lifted once to what commands take.

mod invocation;
mod raw;

use std::process::ExitCode;

use clap::Parser as _;

use crate::failure::Failure;

pub(crate) use invocation::{
    Command, DEFAULT_SCENE, Host, Invocation, LocalModel, LocalModelCheck, LocalModelChoose, LocalModelStep,
    Probe, Recording, Replay, Run, Soft,
};

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
    use super::invocation::{DEFAULT_DURATION_S, DEFAULT_VIEWER};
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
            "replay a.mcap --out a.mcap",
            "replay a.mcap --out ./a.mcap",
            "replay a.mcap b.mcap --serve 127.0.0.1:1 --out b.mcap",
            "run --record a.mcap --out ./a.mcap",
            "probe",
            "probe 127.0.0.1:1 --rate 0",
            "probe serve",
            "analyze stability --sweep hand.mass_kg=0..1",
            "analyze stability --sweep a=0..1:2 --sweep b=0..1:2 --sweep c=0..1:2",
            "analyze stability --sweep a=0..1:2 --sweep a=0..2:2",
            "analyze stability --radius",
            "analyze stability --check --sweep hand.mass_kg=0.1..1:2",
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
