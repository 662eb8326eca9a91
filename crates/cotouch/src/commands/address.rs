//! Addresses and tickets as people type them.

use std::net::ToSocketAddrs as _;
use std::time::Duration;

use cotouch_net::{Route, SessionKey, Ticket, TicketError};
use cotouch_runtime::transport::{self, RouteError};

use crate::failure::{Failure, in_one_sentence};
use crate::progress::Stop;
use crate::tickets::{self, PostedTicket};

/// The ticket that `text` (ADDRESS/KEY, or ADDRESS where this account serves on this computer) stands for. A server here that has yet
/// to come is waited for, for at most `patience`.
pub(super) fn ticket(text: &str, serving: &str, patience: Duration, stop: &Stop) -> Result<Ticket, Failure> {
    let parts = text.rsplit_once('/').map(|(address, key)| (address, key.parse::<SessionKey>()));
    let address = match parts {
        Some((address, Ok(key))) => return Ok(Ticket { address: resolve(address)?, key }),
        // A route may have slashes of its own.
        Some((_, Err(mistyped))) if transport::parse(text).is_err() => return Err(refused(text, mistyped)),
        _ => resolve(text)?,
    };
    if !tickets::is_here(address) {
        return Err(Failure::usage(format!(
            "{text:?} lacks its key: {address} is another computer, and its session needs the whole ticket ADDRESS/KEY that `{serving}` prints there"
        )));
    }
    let found = tickets::wait_for(patience, || !stop.is_set(), || tickets::posted(address));
    let key = found.ok_or_else(|| {
        let reason = if stop.is_set() {
            format!("interrupted before the session at {address} answered")
        } else {
            format!("no `{serving}` of this account answered at {address} on this computer; one of another account or in another container needs the whole ticket ADDRESS/KEY that it prints")
        };
        Failure::Running(anyhow::anyhow!(reason))
    })?;
    Ok(Ticket { address, key })
}

fn refused(text: &str, reason: TicketError) -> Failure {
    Failure::usage(format!("{text:?}: {reason}"))
}

/// The route that `text` (HOST:PORT, or what begins with the scheme of a transport) stands for.
pub(super) fn resolve(text: &str) -> Result<Route, Failure> {
    match transport::parse(text) {
        Ok(route) => return Ok(route),
        Err(too_long @ RouteError::Length) => return Err(Failure::usage(format!("{text:?}: {too_long}"))),
        // A name, perhaps, that stands for an address.
        Err(_) => {}
    }
    let reason = match text.to_socket_addrs().map(|mut addresses| addresses.next()) {
        Ok(Some(address)) => return Ok(address.into()),
        Ok(None) => "it stands for no address".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(Failure::usage(format!(
        "{text:?} is not an address ({reason}); it must be HOST:PORT, such as 127.0.0.1:7800"
    )))
}

/// Leaves a server's ticket for others of this account on this computer; where that is not possible, they need the whole ticket too,
/// and it is told why.
pub(super) fn post(ticket: Ticket) -> Option<PostedTicket> {
    PostedTicket::post(ticket)
        .inspect_err(|error| {
            tell!("note: on this computer too, others need the whole ticket: {}", in_one_sentence(error));
        })
        .ok()
}
