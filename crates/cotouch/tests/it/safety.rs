//! The program from outside when something fails, and when it is interrupted: that it ends, how, and what it says.

#![cfg(target_os = "linux")]

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use crate::program::{cotouch, folder, json, stderr};

/// A session of one process, without page and recording.
const RUN: [&str; 6] = ["run", "single-axis", "--headless", "--no-record", "--duration", "100"];

fn run_with(device: &str) -> Vec<String> {
    let words = RUN.map(str::to_owned);
    [&words[..], &["--device".to_owned(), format!("anna={device}")]].concat()
}

/// Starts the program, and gives it with its standard error after a line that has `sign` in it.
fn started(words: &[String], sign: &str) -> (Child, BufReader<std::process::ChildStderr>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
    let mut process =
        command.args(words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut said = BufReader::new(process.stderr.take().expect("it is piped"));
    let mut line = String::new();
    while !line.contains(sign) {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it ended without saying {sign:?}");
    }
    (process, said)
}

fn signal(process: &Child, name: &str) {
    let id = process.id().to_string();
    assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
}

#[test]
fn a_panic_in_the_haptic_thread_is_exit_status_1_and_one_sentence() {
    let folder = folder();
    let words = [&run_with("faulty:panic@0.5")[..], &["--json".to_owned()]].concat();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let output = cotouch(folder.path(), &words);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let failures = json(&output)["failures"].clone();
    assert_eq!(failures, serde_json::json!(["the haptic thread failed: the device panics on purpose"]));
    let said = stderr(&output);
    let of_failure = |line: &&str| line.contains("the haptic thread failed");
    assert_eq!(said.lines().filter(of_failure).count(), 1, "{said}");
    let has_kind = |line: &str| ["error: ", "warning: ", "note: "].iter().any(|kind| line.starts_with(kind));
    assert!(said.lines().filter(|line| line.contains("panic") || of_failure(line)).all(has_kind), "{said}");
}

#[test]
fn a_session_goes_on_when_nobody_reads_what_it_says() {
    let folder = folder();
    let run = |words: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
        let command = command.args(words).current_dir(folder.path()).stdout(Stdio::null());
        let mut process = command.stderr(Stdio::piped()).spawn().expect("the program starts");
        drop(process.stderr.take());
        process.wait().unwrap().code()
    };
    let recorded = ["run", "single-axis", "--headless", "--duration", "1", "--json", "--record", "here.mcap"];
    assert_eq!(run(&recorded), Some(0));
    assert_eq!(run(&["replay", "here.mcap"]), Some(0));
    // Nor is what failed less orderly for it.
    let words = run_with("faulty:panic@0.5");
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--json"]).collect();
    assert_eq!(run(&words), Some(1));
    assert_eq!(run(&["run", "nowhere.toml"]), Some(2));
}

#[test]
fn a_device_that_never_answers_does_not_keep_a_run_beyond_its_duration() {
    let folder = folder();
    let words = ["run", "single-axis", "--headless", "--no-record", "--duration", "0.5"];
    let output = cotouch(folder.path(), &[&words[..], &["--device", "anna=faulty:block@0.1"]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("the haptic thread has not ticked"), "{}", stderr(&output));
}

#[test]
fn a_termination_is_heard_while_a_device_blocks() {
    for name in ["-TERM", "-HUP", "-INT"] {
        let (mut process, _said) = started(&run_with("faulty:block@0.5"), "forces were switched off");
        signal(&process, name);
        assert_eq!(process.wait().unwrap().code(), Some(1), "{name}");
    }
}

#[test]
fn a_second_interrupt_ends_the_program_at_once() {
    let (mut process, mut said) = started(&run_with("faulty:block@0.5"), "forces were switched off");
    signal(&process, "-INT");
    // Longer than the two signals of a pair are apart.
    std::thread::sleep(std::time::Duration::from_millis(400));
    signal(&process, "-INT");
    assert_eq!(process.wait().unwrap().code(), Some(1));
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut said, &mut rest).unwrap();
    assert!(rest.contains("interrupted twice: all forces are off"), "{rest}");
}

#[test]
fn a_limit_on_the_command_line_holds_and_is_told() {
    let folder = folder();
    let words =
        ["run", "grasp", "--virtual", "--no-record", "--duration", "3", "--json", "--max-force", "0.5"];
    let output = cotouch(folder.path(), &words);
    assert!(
        stderr(&output).contains("the scene asks for 20 N (governor.max_force_n), this host allows 0.5 N")
    );
    let document = json(&output);
    for user in document["users_detail"].as_array().unwrap() {
        let peak_force_n = user["peak_force_n"].as_f64().unwrap();
        assert!(peak_force_n > 0.3 && peak_force_n <= 0.5, "{user}");
    }
    // The prediction is of what is applied: a limit that acts is named as left out, and so there is none.
    assert!(document["predicted"]["stable"].is_null(), "{}", document["predicted"]);
    let wrong = cotouch(folder.path(), &["run", "--virtual", "--max-force", "2000"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(stderr(&wrong).contains("from 0.1 to 1000 N"), "{}", stderr(&wrong));
}
