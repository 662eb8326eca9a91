//! Guests: hands at places that are free, each with a host of its own in this process.
//!
//! A guest joins the session over loopback as any other process would, so to everybody else it is a user like any other.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;

use crate::hand::{Hand, HeldBy, Seat, TakeError};
use crate::real_time::{self, RealTimeOptions, StartError};
use crate::session_handle::{LOOK_PERIOD, SessionHandle};
use crate::snapshot::Snapshot;

/// How others come into a session.
#[derive(Clone, Debug)]
pub(crate) struct Entrance {
    /// Of the first host.
    pub(crate) server: SocketAddr,
    /// Of every way out of this process.
    pub(crate) impairment: Option<Impairment>,
}

impl Entrance {
    /// Where this process reaches the server: at a loopback address where the server listens at all.
    fn address(&self) -> SocketAddr {
        let ip = match self.server.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        };
        SocketAddr::new(ip, self.server.port())
    }
}

/// The guests of a session.
#[derive(Default)]
pub(crate) struct Guests {
    list: Mutex<Vec<Weak<SessionHandle>>>,
}

impl Guests {
    /// Takes a hand of `host_session`, or lets a guest in at a place that is free. Blocks for as long as joining takes.
    pub(crate) fn take(&self, host_session: &SessionHandle, user: HostIndex) -> Result<Hand, TakeError> {
        let seats = self.seats(host_session);
        let is_free = |seat: &&Seat| seat.user == user && seat.by == HeldBy::Nobody;
        let (Some(seat), Some(entrance), false) =
            (seats.iter().find(is_free), host_session.entrance(), host_session.has_ended())
        else {
            return host_session.take(user);
        };
        self.let_in(entrance, user, &seat.name)
    }

    fn let_in(&self, entrance: &Entrance, user: HostIndex, name: &str) -> Result<Hand, TakeError> {
        let not_let_in = |error: StartError| TakeError::NotLetIn { name: name.to_owned(), why: error.to_string() };
        let options = RealTimeOptions { impairment: entrance.impairment.clone(), ..RealTimeOptions::default() };
        let (_, session) = real_time::join(entrance.address(), Some(name), &options).map_err(not_let_in)?;
        let session = Arc::new(session);
        let hand = session.take(user)?;
        self.present().push(Arc::downgrade(&session));
        Ok(hand.of_guest(Guest { session }))
    }

    /// Who moves which hand of `host_session`, guests included.
    pub(crate) fn seats(&self, host_session: &SessionHandle) -> Vec<Seat> {
        let mut seats = host_session.seats();
        for guest in self.sessions() {
            let of_guest = guest.seats().into_iter().filter(|seat| seat.by == HeldBy::Pointer);
            for seat in of_guest.filter(|_| !guest.has_ended()) {
                seats.iter_mut().filter(|other| other.user == seat.user).for_each(|other| other.by = seat.by);
            }
        }
        seats
    }

    /// Adds the guests' hosts to a picture of the session.
    pub(crate) fn add_to(&self, snapshot: &mut Snapshot) {
        for guest in self.sessions() {
            let hosts = guest.snapshot().hosts.into_iter().filter(|host| host.ticks > 0);
            for host in hosts {
                if !snapshot.hosts.iter().any(|other| other.host == host.host) {
                    snapshot.hosts.push(host);
                }
            }
        }
        snapshot.hosts.sort_by_key(|host| host.host.index());
    }

    /// Asks all guests to leave; for the end of the session.
    pub(crate) fn stop(&self) {
        self.sessions().iter().for_each(|guest| guest.stop());
    }

    fn sessions(&self) -> Vec<Arc<SessionHandle>> {
        let mut list = self.present();
        list.retain(|guest| guest.strong_count() > 0);
        list.iter().filter_map(Weak::upgrade).collect()
    }

    fn present(&self) -> MutexGuard<'_, Vec<Weak<SessionHandle>>> {
        self.list.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Guests {
    fn drop(&mut self) {
        self.stop();
    }
}

/// A user who takes part with a session handle of its own. Dropping it says goodbye, in the background.
pub(crate) struct Guest {
    session: Arc<SessionHandle>,
}

impl Drop for Guest {
    fn drop(&mut self) {
        let session = Arc::clone(&self.session);
        session.stop();
        // Where no thread can be had, the peers notice that nothing is heard any more.
        let _ = thread::Builder::new().name("guest leaves".to_owned()).spawn(move || say_goodbye(session));
    }
}

/// Waits until the force has faded out and nobody looks at the session any more, and leaves it.
fn say_goodbye(mut session: Arc<SessionHandle>) {
    loop {
        session = match Arc::try_unwrap(session) {
            // It is not recorded: there is nothing that can fail.
            Ok(session) => return drop(session.finish()),
            Err(shared) => shared,
        };
        thread::sleep(LOOK_PERIOD);
    }
}
