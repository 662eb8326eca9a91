//! Where a peer is reached.

use std::fmt;
use std::net::{SocketAddr, SocketAddrV4, SocketAddrV6};

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::text::{MAX_TEXT_BYTES, Text};

/// Where a peer is reached, as the transport knows it.
///
/// To the protocol a route is opaque: it comes with a datagram, is compared, told to other hosts, and handed back to what
/// carries datagrams. A transport without socket addresses names its routes `SCHEME:REST`, such as
/// `unix:/run/user/1000/cotouch`; to a session over a network they are `key:` and the peer's public key, which the secured layer
/// ([`SecureNode`](crate::SecureNode)) proves and maps to where the peer is.
///
/// On the wire a route is what `SocketAddr` is in postcard, with one more variant: 0, four bytes and a port; 1, sixteen
/// bytes and a port; or 2 and a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Route {
    /// A UDP socket at an IPv4 address.
    V4(SocketAddrV4),
    /// A UDP socket at an IPv6 address.
    V6(SocketAddrV6),
    /// What another transport calls it: `SCHEME:REST`.
    Named(Text),
}

impl Route {
    /// The address of the UDP socket; `None` on other transports.
    #[must_use]
    pub const fn socket_address(self) -> Option<SocketAddr> {
        match self {
            Self::V4(address) => Some(SocketAddr::V4(address)),
            Self::V6(address) => Some(SocketAddr::V6(address)),
            Self::Named(_) => None,
        }
    }

    /// The same peer for a host that reaches the server at `server`, who saw the peer at this route. A peer that the server
    /// saw over its own loopback runs on the server's computer.
    pub(crate) fn relayed_by(self, server: Self) -> Self {
        match (self.socket_address(), server.socket_address()) {
            (Some(seen), Some(server)) if seen.ip().is_loopback() && !server.ip().is_loopback() => {
                SocketAddr::new(server.ip(), seen.port()).into()
            }
            _ => self,
        }
    }

    /// Bytes that differ from route to route: for a socket its address, mapped to IPv6, and its port.
    pub(crate) fn distinguishing_bytes(self) -> ArrayVec<u8, MAX_TEXT_BYTES> {
        let (ip, port) = match self {
            Self::V4(address) => (address.ip().to_ipv6_mapped(), address.port()),
            Self::V6(address) => (*address.ip(), address.port()),
            Self::Named(name) => return name.bytes().collect(),
        };
        ip.octets().into_iter().chain(port.to_le_bytes()).collect()
    }
}

impl From<SocketAddr> for Route {
    fn from(address: SocketAddr) -> Self {
        match address {
            SocketAddr::V4(address) => Self::V4(address),
            SocketAddr::V6(address) => Self::V6(address),
        }
    }
}

impl fmt::Display for Route {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::V4(address) => address.fmt(formatter),
            Self::V6(address) => address.fmt(formatter),
            Self::Named(name) => name.fmt(formatter),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn socket(text: &str) -> Route {
        text.parse::<SocketAddr>().unwrap().into()
    }

    #[test]
    fn sockets_are_on_the_wire_as_socket_addresses() {
        for text in ["192.0.2.1:7801", "[2001:db8::1]:65535"] {
            let address: SocketAddr = text.parse().unwrap();
            let bytes = postcard::to_allocvec(&address).unwrap();
            let route = postcard::to_allocvec(&Route::from(address)).unwrap();
            assert_eq!(route, bytes);
            assert_eq!(postcard::from_bytes::<Route>(&bytes).unwrap(), socket(text));
            assert_eq!(socket(text).to_string(), text);
        }
        let named = Route::Named(Text::from("unix:/run/a").unwrap());
        let bytes = postcard::to_allocvec(&named).unwrap();
        assert_eq!((bytes[0], postcard::from_bytes(&bytes)), (2, Ok(named)));
    }

    #[test]
    fn a_peer_on_the_servers_loopback_is_reached_at_the_server() {
        let (here, there) = (socket("127.0.0.1:5"), socket("192.0.2.1:7801"));
        assert_eq!(here.relayed_by(there), socket("192.0.2.1:5"));
        assert_eq!(here.relayed_by(socket("127.0.0.1:7801")), here);
        let far = socket("192.0.2.7:5");
        assert_eq!(far.relayed_by(there), far);
        let named = Route::Named(Text::from("unix:/run/a").unwrap());
        assert_eq!((named.relayed_by(there), here.relayed_by(named)), (named, here));
    }
}
