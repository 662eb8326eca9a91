//! Probes over real UDP sockets: blocking, paced by absolute sleeps on the monotonic clock.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use cotouch_net::probe::{self, ProbeConfig, ProbeReport};
use cotouch_net::wire::MAX_DATAGRAM;
use cotouch_scene::time::{LocalTime, Rate};
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

use crate::progress::Stop;

/// A state packet of two points and an object is about as long.
const DATAGRAM_BYTES: usize = 128;
/// How long to wait for stragglers.
const LINGER_S: f64 = 0.5;
/// Between two looks at the flag that ends the work.
const LOOK: Duration = Duration::from_millis(50);
const NANOSECONDS_PER_S: i64 = 1_000_000_000;

/// The end that sends probes back.
pub(crate) struct Reflector(UdpSocket);

impl Reflector {
    /// Listens at `address`.
    pub(crate) fn bind(address: SocketAddr) -> anyhow::Result<Self> {
        let socket =
            UdpSocket::bind(address).with_context(|| format!("no UDP socket can be opened at {address}"))?;
        socket.set_read_timeout(Some(LOOK))?;
        Ok(Self(socket))
    }

    /// Where it listens.
    pub(crate) fn address(&self) -> SocketAddr {
        self.0.local_addr().unwrap_or_else(|_| SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)))
    }

    /// Sends probes back until `stop` is set, and says how many.
    pub(crate) fn run(&self, stop: &Stop) -> anyhow::Result<u64> {
        let mut buffer = [0; MAX_DATAGRAM + 1];
        let mut reflected = 0;
        while !stop.is_set() {
            let Some((length, from)) = receive(&self.0, &mut buffer)? else { continue };
            let Some(echo) = probe::reflect(&buffer[..length]) else { continue };
            // A full buffer or an unreachable asker is a loss like any other.
            reflected += u64::from(self.0.send_to(&echo, from).is_ok());
        }
        Ok(reflected)
    }
}

/// The end that measures.
pub(crate) struct Prober {
    socket: UdpSocket,
    server: SocketAddr,
}

impl Prober {
    /// Measures the link to `server`.
    pub(crate) fn connect(server: SocketAddr) -> anyhow::Result<Self> {
        let any = match server {
            SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
            SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
        };
        let socket = UdpSocket::bind(any).context("no UDP socket can be opened")?;
        socket.set_read_timeout(Some(LOOK))?;
        Ok(Self { socket, server })
    }

    /// Sends at `rate` for `duration_s` and listens; `show` hears the share that is done.
    pub(crate) fn measure(
        &mut self,
        rate: Rate,
        duration_s: f64,
        stop: &Stop,
        show: &mut dyn FnMut(f64),
    ) -> anyhow::Result<ProbeReport> {
        let start = now();
        let config = ProbeConfig {
            rate_hz: rate,
            duration_s,
            datagram_bytes: DATAGRAM_BYTES,
            linger_s: LINGER_S,
            id: start.0 as u64,
        };
        let core = Mutex::new(probe::Prober::new(config, self.server, start));
        let ended = Stop::default();
        std::thread::scope(|scope| {
            let listener = scope.spawn(|| listen(&self.socket, &core, &ended));
            let sent = send(&self.socket, &core, stop, &mut |elapsed_s| show(elapsed_s / duration_s));
            ended.set();
            let heard = listener.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            sent.and(heard)
        })?;
        Ok(lock(&core).report())
    }
}

/// Sends what is due, when it is due, then waits for stragglers.
fn send(
    socket: &UdpSocket,
    core: &Mutex<probe::Prober>,
    stop: &Stop,
    show: &mut dyn FnMut(f64),
) -> anyhow::Result<()> {
    let start = now();
    while !stop.is_set() {
        let transmit = lock(core).poll_transmit(now());
        if let Some(transmit) = transmit {
            match socket.send_to(&transmit.bytes, transmit.to) {
                // The other end is not there (yet): a loss like any other.
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {}
                result => drop(result.with_context(|| format!("nothing can be sent to {}", transmit.to))?),
            }
            continue;
        }
        let now = now();
        show(now.since(start) as f64 * 1e-9);
        let core = lock(core);
        let next = if core.is_finished(now) { None } else { core.poll_timeout() };
        drop(core);
        let Some(next) = next else { break };
        let look = now.plus_ns(LOOK.as_nanos() as i64);
        sleep_until(next.min(look));
    }
    Ok(())
}

/// Takes in what comes, until `ended`.
fn listen(socket: &UdpSocket, core: &Mutex<probe::Prober>, ended: &Stop) -> anyhow::Result<()> {
    let mut buffer = [0; MAX_DATAGRAM + 1];
    while !ended.is_set() {
        if let Some((length, from)) = receive(socket, &mut buffer)? {
            let now = now();
            lock(core).handle_datagram(now, from, &buffer[..length]);
        }
    }
    Ok(())
}

/// The next datagram, if one comes before the socket's time-out.
fn receive(socket: &UdpSocket, buffer: &mut [u8]) -> anyhow::Result<Option<(usize, SocketAddr)>> {
    use io::ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
    match socket.recv_from(buffer) {
        Ok(received) => Ok(Some(received)),
        Err(error) if matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused) => {
            Ok(None)
        }
        Err(error) => Err(error).context("the UDP socket cannot be read"),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn now() -> LocalTime {
    let now = clock_gettime(ClockId::Monotonic);
    LocalTime(now.tv_sec * NANOSECONDS_PER_S + now.tv_nsec)
}

fn sleep_until(time: LocalTime) {
    let deadline = Timespec { tv_sec: time.0 / NANOSECONDS_PER_S, tv_nsec: time.0 % NANOSECONDS_PER_S };
    // Woken early by a signal: the caller looks at the clock anyway.
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &deadline);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_come_back_over_loopback() {
        let reflector = Reflector::bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let (address, stop) = (reflector.address(), Stop::default());
        std::thread::scope(|scope| {
            let serving = scope.spawn(|| reflector.run(&stop));
            let mut prober = Prober::connect(address).unwrap();
            let report = prober.measure("500".parse().unwrap(), 0.2, &Stop::default(), &mut |_| {}).unwrap();
            stop.set();
            assert_eq!((report.sent, report.received, report.lost), (100, 100, 0));
            assert_eq!(serving.join().unwrap().unwrap(), 100);
        });
    }

    #[test]
    fn nobody_there_is_a_loss_and_no_failure() {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let mut prober = Prober::connect(free).unwrap();
        let report = prober.measure("100".parse().unwrap(), 0.05, &Stop::default(), &mut |_| {}).unwrap();
        assert_eq!((report.received, report.lost), (0, 5));
    }
}
