//! The thread of a host's slow simulation in real time.
//!
//! It has the system's normal priority, below the haptic thread. Waking it would be a system call in a tick, so it looks
//! for work by itself.

use std::io;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use cotouch_host::{SlowInput, SlowLoop};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;

use crate::clock;
use crate::failures::{Failures, spawn_essential};
use crate::slow::{SlowPort, SlowResult};

/// How long the thread sleeps when there is nothing to do.
const LOOK_PERIOD: Duration = Duration::from_micros(500);

/// Results that wait for ticks at most.
const RESULTS: usize = 16;

/// Starts the simulation's thread for `host`; it ends when the port is dropped. `failures` is told when it panics, and that the
/// session is to end.
///
/// # Errors
/// When no thread can be had.
pub fn start_slow_thread(
    scene: &Scene,
    host: HostIndex,
    simulation: SlowLoop,
    failures: &Failures,
) -> io::Result<(SlowPort, JoinHandle<()>)> {
    // One period waits while another is simulated: more would only make results older.
    let (ask, asked) = rtrb::RingBuffer::new(1);
    let (answer, answers) = rtrb::RingBuffer::new(RESULTS);
    let port = SlowPort::threaded(scene, simulation.rest_frame(), ask, answers);
    let what = format!("soft body of {host}");
    let thread = thread::Builder::new().name(what.clone());
    let body = move || simulate(simulation, asked, answer);
    let thread = spawn_essential(thread, format!("the simulation of the {what}"), failures.clone(), body)?;
    Ok((port, thread))
}

fn simulate(
    mut simulation: SlowLoop,
    mut asked: rtrb::Consumer<SlowInput>,
    mut answer: rtrb::Producer<SlowResult>,
) {
    while !asked.is_abandoned() {
        // While ticks take no results, nothing is gained by making more.
        let input = if answer.is_full() { None } else { asked.pop().ok() };
        let Some(input) = input else {
            thread::sleep(LOOK_PERIOD);
            continue;
        };
        let began = clock::now();
        let frame = simulation.step(&input);
        let compute_ns = clock::now().since(began);
        // There is room, as was asked above.
        let _: Result<(), _> = answer.push(SlowResult { frame, compute_ns });
    }
}
