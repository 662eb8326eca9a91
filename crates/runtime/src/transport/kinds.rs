//! The transports that sessions in real time can use, and how their ends are opened.

use std::io;
use std::net::{AddrParseError, SocketAddr};

use cotouch_net::{MAX_TEXT_BYTES, Route, Text};

use super::interface::{DynTransport, TransportKind};
use super::udp;

/// All transports that can be asked for; the first kind without a scheme is asked for by addresses.
pub const KINDS: &[TransportKind] = &[udp::KIND];

/// Why no end of a transport could be opened.
#[derive(Debug, thiserror::Error)]
#[error("no {end} can be opened at {route}: {source}")]
pub struct OpenError {
    end: &'static str,
    route: Route,
    source: io::Error,
}

/// Why a text is no route.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RouteError {
    /// Neither an address nor of a known scheme.
    #[error(transparent)]
    Address(#[from] AddrParseError),
    /// A name that does not fit into a datagram with those of all others.
    #[error("a route has at most {MAX_TEXT_BYTES} bytes")]
    Length,
}

/// The route that a text stands for: an IP address and a port, or what begins with the scheme of one of [`KINDS`].
///
/// # Errors
/// When it is neither, or too long.
pub fn parse(text: &str) -> Result<Route, RouteError> {
    if with_scheme(scheme(text)).is_none() {
        return Ok(text.parse::<SocketAddr>()?.into());
    }
    Text::from(text).map(Route::Named).map_err(|_| RouteError::Length)
}

/// Opens an end that others reach at `route`.
///
/// # Errors
/// When the system does not let this process have it, or no transport has such routes.
pub fn listen(route: Route) -> Result<Box<DynTransport>, OpenError> {
    open(route, |kind| kind.listen)
}

/// Opens an end from which `route` can be reached.
///
/// # Errors
/// When the system does not let this process have one, or no transport has such routes.
pub fn connect(route: Route) -> Result<Box<DynTransport>, OpenError> {
    open(route, |kind| kind.connect)
}

/// Whether datagrams to `route` do not leave this computer.
#[must_use]
pub fn is_local(route: Route) -> bool {
    kind(route).is_some_and(|kind| (kind.is_local)(route))
}

type Open = fn(Route) -> io::Result<Box<DynTransport>>;

fn open(route: Route, which: impl Fn(&TransportKind) -> Open) -> Result<Box<DynTransport>, OpenError> {
    let kind = kind(route);
    let end = kind.map_or("transport", |kind| kind.end);
    let opened = kind.map_or_else(|| Err(io::ErrorKind::Unsupported.into()), |kind| which(kind)(route));
    opened.map_err(|source| OpenError { end, route, source })
}

fn kind(route: Route) -> Option<&'static TransportKind> {
    match route {
        Route::V4(_) | Route::V6(_) => KINDS.iter().find(|kind| kind.scheme.is_none()),
        Route::Named(name) => with_scheme(scheme(&name)),
    }
}

fn with_scheme(scheme: &str) -> Option<&'static TransportKind> {
    KINDS.iter().find(|kind| kind.scheme == Some(scheme))
}

fn scheme(text: &str) -> &str {
    text.split_once(':').map_or("", |(scheme, _)| scheme)
}
