//! Guests: hands at places that are free, each with a host of its own in this process.
//!
//! A guest joins the session over loopback as any other process would, so to everybody else it is a user like any other.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;

use cotouch_net::Ticket;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Impairment;

use crate::options::RealTimeOptions;
use crate::pointer::{HeldBy, PointerHandle, Seat, TakeError};
use crate::real_time;
use crate::session_handle::{LOOK_PERIOD, SessionHandle};
use crate::snapshot::Snapshot;

/// A place that nobody has.
pub(crate) struct FreePlace {
    user: HostIndex,
    name: String,
    ticket: Ticket,
    impairment: Impairment,
}

/// The guests of a session.
#[derive(Default)]
pub(crate) struct Guests {
    list: Mutex<Vec<Weak<SessionHandle>>>,
}

impl Guests {
    /// The place of `user` in a session, if it is free and others can join.
    pub(crate) fn free_place(&self, session: &SessionHandle, user: HostIndex) -> Option<FreePlace> {
        let ticket = session.ticket().filter(|_| !session.has_ended())?;
        let is_free = |seat: &Seat| seat.user == user && seat.by == HeldBy::Nobody;
        let Seat { name, .. } = self.seats(session).into_iter().find(is_free)?;
        Some(FreePlace { user, name, ticket, impairment: session.present_scene().link.impairment.clone() })
    }

    /// Lets a guest in. Blocks for as long as joining takes.
    pub(crate) fn let_in(&self, place: FreePlace) -> Result<PointerHandle, TakeError> {
        let FreePlace { user, name, ticket, impairment } = place;
        let impairment = (impairment != Impairment::NONE).then_some(impairment);
        let options = RealTimeOptions { impairment, ..RealTimeOptions::default() };
        let joined = real_time::join(from_here(ticket), Some(&name), &options, &|| true);
        let (_, session) = joined.map_err(|error| TakeError::NotLetIn { name, why: error.to_string() })?;
        let session = Arc::new(session);
        let hand = session.take(user)?;
        self.present().push(Arc::downgrade(&session));
        Ok(hand.ending(Guest { session }))
    }

    /// Who moves which hand of a session, guests included.
    pub(crate) fn seats(&self, session: &SessionHandle) -> Vec<Seat> {
        let mut seats = session.seats();
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

/// The ticket with the address at which this process reaches the server.
fn from_here(ticket: Ticket) -> Ticket {
    let Some(address) = ticket.address.socket_address() else { return ticket };
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
        ip => ip,
    };
    Ticket { address: SocketAddr::new(ip, address.port()).into(), ..ticket }
}

/// Waits until the force has faded out and nobody looks at the session any more, and leaves it.
fn say_goodbye(mut session: Arc<SessionHandle>) {
    loop {
        session = match Arc::try_unwrap(session) {
            Ok(session) => return drop(session.finish()),
            Err(shared) => shared,
        };
        thread::sleep(LOOK_PERIOD);
    }
}
