//! How many of a session's packets a host loses while strangers send 50,000 datagrams a second to its port: rubbish, made-up sealed
//! datagrams, made-up first messages, and repetitions of what the other member sends, each a quarter. Linux.
//!
//! `cargo run --release -p cotouch-runtime --example flood`

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use cotouch_net::{Route, Ticket};
use cotouch_runtime::real_time::{join, serve};
use cotouch_runtime::{RealTimeOptions, Summary, clock};
use cotouch_scene::{load, with_override};

const FLOOD_HZ: i64 = 50_000;
const DURATION_S: f64 = 10.0;
/// Datagrams that are sent between two looks at the clock.
const BURST: i64 = 50;

type Tape = Mutex<Vec<Vec<u8>>>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    tell("without", &session(false)?.0);
    let (summary, sent) = session(true)?;
    tell("with", &summary);
    println!("{sent} datagrams sent by strangers, {:.0} a second", sent as f64 / DURATION_S);
    Ok(())
}

fn tell(which: &str, summary: &Summary) {
    let network = &summary.network;
    let due = network.received + network.lost;
    println!(
        "{which} a flood: {} of {due} packets lost, {:.3} %; receive buffer {} KiB; {:?}",
        network.lost,
        100.0 * network.lost as f64 / due as f64,
        network.receive_buffer_bytes.unwrap_or_default() / 1024,
        network.rejected
    );
}

/// The summary of a server whose other member comes through a relay, and how many datagrams strangers have sent it.
fn session(is_flooded: bool) -> Result<(Summary, u64), Box<dyn std::error::Error>> {
    let scene = with_override(&load("single-axis", &[])?, "rates.network_hz", 1024.0)?;
    let options = |duration_s| RealTimeOptions { duration_s, ..RealTimeOptions::default() };
    let any: SocketAddr = "127.0.0.1:0".parse()?;
    let served = serve(&scene, any, &options(None))?;
    let ticket = served.ticket().ok_or("a server has a ticket")?;
    let server = ticket.address.socket_address().ok_or("the server has an address")?;
    let (stop, tape) = (Arc::new(AtomicBool::new(false)), Arc::new(Tape::default()));
    let relay = relay(server, &tape, &stop)?;
    let (_, joined) =
        join(Ticket { address: Route::from(relay), ..ticket }, None, &options(Some(DURATION_S)), &|| true)?;
    let sent = Arc::new(AtomicU64::new(0));
    if is_flooded {
        let (stop, tape, sent) = (Arc::clone(&stop), Arc::clone(&tape), Arc::clone(&sent));
        thread::spawn(move || flood(server, &tape, &stop, &sent));
    }
    drop(joined.finish());
    stop.store(true, Ordering::Relaxed);
    served.stop();
    Ok((served.finish(), sent.load(Ordering::Relaxed)))
}

/// Passes datagrams on between the server and one other, whom it hears first, and keeps some of what goes to the server.
fn relay(server: SocketAddr, tape: &Arc<Tape>, stop: &Arc<AtomicBool>) -> std::io::Result<SocketAddr> {
    let (near, far) = (UdpSocket::bind("127.0.0.1:0")?, UdpSocket::bind("127.0.0.1:0")?);
    let address = near.local_addr()?;
    for socket in [&near, &far] {
        socket.set_read_timeout(Some(Duration::from_millis(50)))?;
    }
    let member = Arc::new(Mutex::new(None::<SocketAddr>));
    let (near_back, far_back, member_back) = (near.try_clone()?, far.try_clone()?, Arc::clone(&member));
    let (stop_back, stop, tape) = (Arc::clone(stop), Arc::clone(stop), Arc::clone(tape));
    thread::spawn(move || {
        let mut buffer = [0; 2048];
        while !stop.load(Ordering::Relaxed) {
            let Ok((length, from)) = near.recv_from(&mut buffer) else { continue };
            *member.lock().unwrap_or_else(PoisonError::into_inner) = Some(from);
            let mut tape = tape.lock().unwrap_or_else(PoisonError::into_inner);
            if tape.len() < 1000 {
                tape.push(buffer[..length].to_vec());
            }
            drop(tape);
            let _ = far.send_to(&buffer[..length], server);
        }
    });
    thread::spawn(move || {
        let mut buffer = [0; 2048];
        while !stop_back.load(Ordering::Relaxed) {
            let Ok((length, _)) = far_back.recv_from(&mut buffer) else { continue };
            let member = *member_back.lock().unwrap_or_else(PoisonError::into_inner);
            let _ = member.map(|member| near_back.send_to(&buffer[..length], member));
        }
    });
    Ok(address)
}

fn flood(server: SocketAddr, tape: &Tape, stop: &AtomicBool, sent: &AtomicU64) {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a socket for strangers");
    let began = clock::now();
    while !stop.load(Ordering::Relaxed) {
        let repeated = tape.lock().unwrap_or_else(PoisonError::into_inner).last().cloned();
        for _ in 0..BURST {
            let number = sent.fetch_add(1, Ordering::Relaxed);
            let mut made_up = [0; 160];
            for (index, byte) in (0_u64..).zip(&mut made_up) {
                *byte =
                    (number.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(index as u32 % 64) >> 7) as u8;
            }
            match number % 4 {
                0 => {}
                1 => made_up[..2].copy_from_slice(b"cs"),
                2 => made_up[..2].copy_from_slice(b"co"),
                _ => {
                    let _ = repeated.as_ref().map(|bytes| socket.send_to(bytes, server));
                    continue;
                }
            }
            let _ = socket.send_to(&made_up, server);
        }
        let due_ns = sent.load(Ordering::Relaxed) as i64 * (1_000_000_000 / FLOOD_HZ);
        while clock::now().since(began) < due_ns {
            thread::sleep(Duration::from_micros(200));
        }
    }
}
