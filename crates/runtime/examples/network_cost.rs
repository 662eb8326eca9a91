//! CPU time per packet sent and received: the network threads with the whole protocol, beside bare UDP sockets
//! that send and receive as many datagrams of the same size at the same rate in the same way. Linux only.
//!
//! `cargo run --release -p cotouch-runtime --example network_cost`

use std::net::UdpSocket;
use std::thread;
use std::time::Duration;

use cotouch_net::{Entry, StatePacket};
use cotouch_runtime::transport::{self, Secured, Transport as _};
use cotouch_runtime::{Failures, HapticPort, NetworkThreads, clock, full_session_endpoint};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::load;
use cotouch_scene::names::HostIndex;
use rustix::time::{ClockId, clock_gettime};

const PACKETS: u64 = 4000;
const PERIOD_NS: i64 = 1_000_000;
const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut ratios = Vec::new();
    for _ in 0..ROUNDS {
        let bare = bare_udp()?;
        let cotouch = transport()?;
        println!("bare UDP {bare:6.2} µs, cotouch {cotouch:6.2} µs of CPU per packet sent and received");
        ratios.push(cotouch / bare);
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "median ratio {:.2} of {ROUNDS} rounds, {PACKETS} packets each way at 1 kHz",
        ratios[ROUNDS / 2]
    );
    Ok(())
}

/// CPU time of this process, s.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// Two sockets, a thread each to receive, one thread to send: µs per packet.
fn bare_udp() -> Result<f64, Box<dyn std::error::Error>> {
    let sockets = [UdpSocket::bind("127.0.0.1:0")?, UdpSocket::bind("127.0.0.1:0")?];
    let addresses = [sockets[0].local_addr()?, sockets[1].local_addr()?];
    let receivers = sockets.iter().map(|socket| {
        let socket = socket.try_clone()?;
        socket.set_read_timeout(Some(Duration::from_millis(100)))?;
        Ok(thread::spawn(move || {
            let mut buffer = [0; 2048];
            let mut received = 0;
            while received < PACKETS && socket.recv_from(&mut buffer).is_ok() {
                received += 1;
            }
        }))
    });
    let receivers = receivers.collect::<Result<Vec<_>, std::io::Error>>()?;
    let before = cpu_s();
    let payload = [7; 256];
    paced(|_| {
        sockets[0].send_to(&payload, addresses[1])?;
        sockets[1].send_to(&payload, addresses[0])?;
        Ok(())
    })?;
    receivers.into_iter().for_each(|receiver| receiver.join().expect("it does not panic"));
    Ok((cpu_s() - before) * 1e6 / (2 * PACKETS) as f64)
}

/// Two hosts' transports: µs per packet.
fn transport() -> Result<f64, Box<dyn std::error::Error>> {
    let scene = load("single-axis", &["rates.network_hz=1000".parse()?, "rates.control_hz=1000".parse()?])?;
    let any = transport::parse("127.0.0.1:0")?;
    let server = Secured::serve(transport::listen(any)?);
    let (route, ticket) = (server.route()?, server.ticket()?);
    let joiner = Secured::join(transport::connect(ticket.address)?, ticket, clock::now());
    let mut ends: Vec<(NetworkThreads, HapticPort)> = Vec::new();
    for (host, socket) in (0u8..).map(HostIndex).zip([server, joiner]) {
        let endpoint = full_session_endpoint(&scene, host, route, clock::now());
        ends.push(NetworkThreads::start(socket, endpoint, &host.to_string(), &Failures::default())?);
    }
    // The session begins when the clocks of both ends are known, and nobody tells of it.
    while ends.iter_mut().any(|(_, port)| port.clock().is_none()) {
        thread::sleep(Duration::from_millis(10));
    }
    let map = ends[0].1.clock().expect("it was there a moment ago");
    while map.session(clock::now()).0 < 0 {
        thread::sleep(Duration::from_millis(10));
    }
    let before = cpu_s();
    let mut received = 0u64;
    paced(|_| {
        let step = scene.rates.network_hz.last_tick_at(map.session(clock::now()));
        for (_, port) in &mut ends {
            while port.take_inbound().is_some() {
                received += 1;
            }
            port.leave(None, packet(step));
            port.wake_sender();
        }
        Ok(())
    })?;
    let cpu = cpu_s() - before;
    assert!(received > PACKETS, "most packets arrive on loopback; {received} did");
    Ok(cpu * 1e6 / (2 * PACKETS) as f64)
}

fn packet(step: u64) -> StatePacket {
    let (pose, twist) = (Pose::default(), Twist::default());
    let entries = [Entry::Hand { point: 0, pose, twist }, Entry::Object { object: 0, pose, twist }];
    StatePacket { step, entries: entries.into_iter().collect() }
}

fn paced(mut act: impl FnMut(u64) -> std::io::Result<()>) -> std::io::Result<()> {
    let start = clock::now();
    for packet in 0..PACKETS {
        let due = start.plus_ns(packet as i64 * PERIOD_NS);
        while clock::sleep_towards(due) < due {}
        act(packet)?;
    }
    Ok(())
}
