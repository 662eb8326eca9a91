//! Probes over real transports: blocking, paced by the monotonic clock.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::Context as _;
use cotouch_net::{MAX_DATAGRAM, ProbeConfig, ProbeReport, Prober, Route, Ticket, reflect_probe};
use cotouch_runtime::clock;
use cotouch_runtime::transport::{self, Arrival, Secured, Transport as _, Unreached};
use cotouch_scene::time::Rate;

use crate::progress::Stop;

/// A state packet of two points and an object is about as long.
const DATAGRAM_BYTES: usize = 128;
/// How long to wait for stragglers.
const LINGER_S: f64 = 0.5;
/// How long to wait for the first answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Between two looks at the flag that ends the work.
const LOOK: Duration = Duration::from_millis(50);

/// The end that sends probes back.
pub(crate) struct Reflector {
    end: Secured,
    ticket: Ticket,
}

impl Reflector {
    /// Listens at `route`.
    pub(crate) fn listen(route: Route) -> anyhow::Result<Self> {
        let end = Secured::serve(transport::listen(route)?);
        let ticket = end.ticket()?;
        Ok(Self { end, ticket })
    }

    /// What one measures with; the address in it is where it listens.
    pub(crate) const fn ticket(&self) -> Ticket {
        self.ticket
    }

    /// Sends probes back until `stop` is set, and says how many.
    pub(crate) fn run(&self, stop: &Stop) -> anyhow::Result<u64> {
        let mut buffer = [0; MAX_DATAGRAM + 1];
        let mut reflected = 0;
        while !stop.is_set() {
            let Some(Arrival { at, from, length }) = receive(&self.end, &mut buffer)? else { continue };
            let Some(echo) = reflect_probe(&buffer[..length]) else { continue };
            // A full buffer or an unreachable asker is a loss like any other.
            reflected += u64::from(self.end.send(at, from, &echo).is_ok());
        }
        Ok(reflected)
    }
}

/// The end that measures.
pub(crate) struct LinkProbe {
    end: Secured,
    server: Route,
}

impl LinkProbe {
    /// Measures the link to the server of `ticket`, which is reached first.
    pub(crate) fn connect(ticket: Ticket, stop: &Stop) -> anyhow::Result<Self> {
        let address = ticket.address;
        let end = Secured::join(transport::connect(address)?, ticket, clock::now());
        end.reach_server(PATIENCE, &|| !stop.is_set()).map_err(|unreached| match unreached {
            Unreached::Silent => anyhow::anyhow!(
                "nothing came back from {address}; is `cotouch probe serve` running there, and do datagrams get through?"
            ),
            other => anyhow::anyhow!("the link to {address} was not measured: {other}"),
        })?;
        Ok(Self { end, server: ticket.key.server() })
    }

    /// Sends at `rate` for `duration_s` and listens; `show` hears the share that is done.
    pub(crate) fn measure(
        &mut self,
        rate: Rate,
        duration_s: f64,
        stop: &Stop,
        show: &mut dyn FnMut(f64),
    ) -> anyhow::Result<ProbeReport> {
        let start = clock::now();
        let config = ProbeConfig {
            rate_hz: rate,
            duration_s,
            datagram_bytes: DATAGRAM_BYTES,
            linger_s: LINGER_S,
            id: start.0 as u64,
        };
        let core = Mutex::new(Prober::new(config, self.server, start));
        let ended = Stop::default();
        std::thread::scope(|scope| {
            let listener = scope.spawn(|| listen(&self.end, &core, &ended));
            let sent = send(&self.end, &core, stop, &mut |elapsed_s| show(elapsed_s / duration_s));
            ended.set();
            let heard = listener.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            sent.and(heard)
        })?;
        Ok(lock(&core).report())
    }
}

/// Sends what is due, when it is due, then waits for stragglers.
fn send(end: &Secured, core: &Mutex<Prober>, stop: &Stop, show: &mut dyn FnMut(f64)) -> anyhow::Result<()> {
    let start = clock::now();
    while !stop.is_set() {
        let now = clock::now();
        let transmit = lock(core).poll_transmit(now);
        if let Some(transmit) = transmit {
            end.send(now, transmit.to, &transmit.bytes)
                .with_context(|| format!("nothing can be sent to {}", transmit.to))?;
            continue;
        }
        show(now.since(start) as f64 * 1e-9);
        let core = lock(core);
        let next = if core.is_finished(now) { None } else { core.poll_timeout() };
        drop(core);
        let Some(next) = next else { break };
        let look = now.plus_ns(LOOK.as_nanos() as i64);
        clock::sleep_towards(next.min(look));
    }
    Ok(())
}

/// Takes in what comes, until `ended`.
fn listen(end: &Secured, core: &Mutex<Prober>, ended: &Stop) -> anyhow::Result<()> {
    let mut buffer = [0; MAX_DATAGRAM + 1];
    while !ended.is_set() {
        if let Some(Arrival { at, from, length }) = receive(end, &mut buffer)? {
            lock(core).handle_datagram(at, from, &buffer[..length]);
        }
    }
    Ok(())
}

/// The next datagram, if one comes before the transport's time-out.
fn receive(end: &Secured, buffer: &mut [u8]) -> anyhow::Result<Option<Arrival>> {
    end.receive(clock::now(), buffer).context("nothing can be received")
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loopback() -> Route {
        transport::parse("127.0.0.1:0").unwrap()
    }

    #[test]
    fn probes_come_back_over_loopback() {
        let reflector = Reflector::listen(loopback()).unwrap();
        let (ticket, stop) = (reflector.ticket(), Stop::default());
        std::thread::scope(|scope| {
            let serving = scope.spawn(|| reflector.run(&stop));
            let mut prober = LinkProbe::connect(ticket, &Stop::default()).unwrap();
            let report = prober.measure("500".parse().unwrap(), 0.2, &Stop::default(), &mut |_| {}).unwrap();
            stop.set();
            assert_eq!((report.sent, report.received, report.lost), (100, 100, 0));
            assert_eq!(serving.join().unwrap().unwrap(), 100);
        });
    }

    #[test]
    fn nobody_there_and_another_ticket_are_told_apart() {
        let reflector = Reflector::listen(loopback()).unwrap();
        let Ticket { address, key } = reflector.ticket();
        let other = Reflector::listen(loopback()).unwrap().ticket();
        let why =
            |ticket| LinkProbe::connect(ticket, &Stop::default()).err().expect("not reached").to_string();
        assert!(why(Ticket { address: other.address, key }).starts_with("nothing came back"));
        let stop = Stop::default();
        std::thread::scope(|scope| {
            scope.spawn(|| reflector.run(&stop));
            let why = why(Ticket { address, ..other });
            stop.set();
            assert!(why.contains("the ticket is not for this session"), "{why}");
        });
    }
}
