//! `cotouch probe` between two processes on loopback, and the link file that it writes.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

/// A reflector that ends with the test.
struct Reflector {
    process: Child,
    address: String,
    ticket: String,
}

impl Reflector {
    fn start() -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_cotouch"))
            .args(["probe", "serve", "--listen", "127.0.0.1:0"])
            .stderr(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut told = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut told).unwrap();
        let ticket = told.split_whitespace().last().expect("a ticket").to_owned();
        let mut said = String::new();
        BufReader::new(process.stderr.take().unwrap()).read_line(&mut said).unwrap();
        let address = said.split_whitespace().find(|word| word.starts_with("127.")).expect("an address");
        let address = address.trim_end_matches(';').to_owned();
        Self { process, address, ticket }
    }
}

impl Drop for Reflector {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn a_link_is_measured_and_a_scene_can_include_it() {
    let folder = tempfile::tempdir().unwrap();
    let reflector = Reflector::start();
    let program = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
        command.current_dir(folder.path());
        command
    };
    let flags = ["--rate", "200", "--duration", "0.5", "--json", "--out", "lab.link.toml"];
    let output = program().args(["probe", &reflector.address]).args(flags).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((document["sent"].as_u64(), document["achievable_rate_hz"].is_null()), (Some(100), true));
    for key in ["received", "lost", "reordered", "rms_jitter_ms"] {
        assert!(document[key].is_number(), "{key}: {document}");
    }
    for key in ["mean", "p50", "p99", "max"] {
        assert!(document["round_trip_ms"][key].is_number(), "{key}: {document}");
    }
    let set = "link.include=lab.link.toml";
    let output = program().args(["scene", "show", "single-axis", "--json", "--set", set]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let scene: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(scene["link"]["impairment"]["latency_s"].as_f64().unwrap() > 0.0);
}

/// What `cotouch probe TICKET` says, and its exit status.
fn probe(ticket: &str) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cotouch"));
    let output = command.args(["probe", ticket, "--duration", "0.1"]).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&said).into_owned())
}

#[test]
fn a_ticket_is_all_that_is_needed_and_nothing_less_will_do() {
    let reflector = Reflector::start();
    let (address, key) = reflector.ticket.split_once('/').expect("an address and a key");
    assert_eq!(address, reflector.address);
    let (status, said) = probe(&reflector.ticket);
    assert_eq!(status, Some(0), "{said}");
    let other = Reflector::start();
    let (status, said) = probe(&format!("{}/{key}", other.address));
    assert!(status == Some(1) && said.contains("the ticket is not for this session"), "{said}");
    let (status, said) = probe(&format!("{address}/{}", &key[1..]));
    assert!(status == Some(2) && said.contains("incomplete or mistyped"), "{said}");
    let (status, said) = probe("192.0.2.1:7801");
    assert!(status == Some(2) && said.contains("lacks its key"), "{said}");
}

#[test]
fn nobody_there_is_said_in_a_sentence() {
    let free = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_cotouch"))
        .args(["probe", &free.to_string(), "--duration", "0.1"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("no `cotouch probe serve` of this account answered")
    );
}
