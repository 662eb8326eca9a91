//! The command line of cotouch: cooperative haptics whose stability is proven before anyone touches it.

// They panic where nobody reads any more, which must not end a session: see `tell!`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
mod tell;

mod arguments;
mod commands;
mod experiments;
mod failure;
mod figure;
mod output;
mod predictor;
mod probing;
mod progress;
mod session;
mod tickets;
mod trace;
mod whole_verdict;

use std::process::ExitCode;

fn main() -> ExitCode {
    let invocation = match arguments::parse() {
        Ok(invocation) => invocation,
        Err(code) => return code,
    };
    commands::log_to_stderr();
    failure::tell_panics_in_one_sentence();
    match commands::execute(&invocation) {
        Ok(verdict) => verdict.into(),
        Err(failure) => failure.report(),
    }
}
