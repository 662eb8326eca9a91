//! What each command does, a file a command.

mod address;
mod analyze;
mod lateness;
mod local_model;
mod map;
mod margin;
mod prediction;
mod probe;
mod replay;
mod report;
mod reproduce;
mod run;
mod scene;
mod settings;
mod soft;
mod stretches;
mod transparency;

use crate::arguments::{Command, Invocation, LocalModel};
use crate::failure::{Failure, Verdict};

/// Does what was asked for.
pub(crate) fn execute(invocation: &Invocation) -> Result<Verdict, Failure> {
    let Invocation { command, overrides, output } = invocation;
    if !overrides.is_empty() && !takes_overrides(command) {
        tell!("note: --set has no effect here, because this command reads no scene from you");
    }
    match command {
        Command::Run(run) => run::run(run, overrides, output),
        Command::Serve { scene, listen, host } => run::serve(scene, *listen, host, overrides, output),
        Command::Join { server, user, host } => run::join(server, user.as_deref(), host, output),
        Command::ProbeServe { listen } => probe::serve(*listen, output),
        Command::Probe(probe) => probe::probe(probe, output),
        Command::Replay(replay) => replay::replay(replay, output),
        Command::Stability { scene, sweeps, with_radius, with_check } => match &sweeps[..] {
            [] => analyze::stability(scene, *with_check, overrides, output),
            [x, rest @ ..] => map::map(scene, x, rest.first(), *with_radius, overrides, output),
        },
        Command::Margin { scene, outages_s } => margin::margin(scene, outages_s, overrides, output),
        Command::Damping { scene, user } => transparency::damping(scene, user, overrides, output),
        Command::Admittance { scene, frequencies } => {
            transparency::admittance(scene, frequencies, overrides, output)
        }
        Command::Stiffness { scene } => transparency::stiffness(scene, overrides, output),
        Command::LocalModel(what) => local_model::local_model(what, overrides, output),
        Command::Soft(what) => soft::soft(what, overrides, output),
        Command::Reproduce { ids } => reproduce::reproduce(ids, output),
        Command::SceneList => scene::list(output),
        Command::SceneShow { scene } => scene::show(scene, overrides, output),
        Command::SceneCheck { scene } => scene::check(scene, overrides, output),
        Command::SceneSchema => scene::schema(output),
    }
}

fn takes_overrides(command: &Command) -> bool {
    use Command::{
        Admittance, Damping, Margin, Run, SceneCheck, SceneShow, Serve, Soft, Stability, Stiffness,
    };
    matches!(
        command,
        Run(_)
            | Serve { .. }
            | Stability { .. }
            | Margin { .. }
            | Damping { .. }
            | Admittance { .. }
            | Stiffness { .. }
            | SceneShow { .. }
            | SceneCheck { .. }
            | Soft(_)
            | Command::LocalModel(LocalModel::Compare { .. })
    )
}

/// What libraries have to say goes to stderr: warnings, or what `COTOUCH_LOG` asks for.
pub(crate) fn log_to_stderr() {
    let filter = tracing_subscriber::EnvFilter::try_from_env("COTOUCH_LOG")
        .unwrap_or_else(|_| tracing_subscriber::EnvFilter::new("warn"));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .without_time()
        .with_target(false)
        // It would be told where the line could not be.
        .log_internal_errors(false)
        .init();
}
