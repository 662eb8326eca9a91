//! Datagrams over UDP.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

use cotouch_net::Route;
use cotouch_scene::time::LocalTime;
use rustix::io::Errno;
use rustix::net::sockopt::{set_socket_recv_buffer_size, socket_recv_buffer_size};
use rustix::net::{SendFlags, sendto};

use super::interface::{Arrival, DynTransport, MAX_WAIT, Transport, TransportKind};
use crate::clock;

/// What a flood of 50,000 small datagrams a second fills in a tenth of a second, each taking up about 800 bytes of the system's memory:
/// the receiving thread may stand still for so long.
const RECEIVE_BUFFER_BYTES: usize = 4 << 20;

/// The kind whose routes are addresses.
pub(super) const KIND: TransportKind = TransportKind {
    scheme: None,
    end: "UDP socket",
    listen: |route| open(address(route)?),
    connect: |server| open(any_address(address(server)?)),
    is_local: |route| address(route).is_ok_and(|address| address.ip().is_loopback()),
};

fn open(address: SocketAddr) -> io::Result<Box<DynTransport>> {
    Ok(Box::new(Udp::bind(address)?))
}

/// A UDP socket.
pub struct Udp(UdpSocket);

impl Udp {
    /// Opens a socket at `address`.
    ///
    /// # Errors
    /// When the system does not let this process have it.
    pub fn bind(address: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_read_timeout(Some(MAX_WAIT))?;
        enlarge_receive_buffer(&socket);
        Ok(Self(socket))
    }
}

impl Transport for Udp {
    fn route(&self) -> io::Result<Route> {
        Ok(self.0.local_addr()?.into())
    }

    fn receive_buffer_bytes(&self) -> Option<usize> {
        socket_recv_buffer_size(&self.0).ok()
    }

    fn send(&self, _now: LocalTime, to: Route, bytes: &[u8]) -> io::Result<()> {
        // The haptic session would rather lose a datagram than wait for room in the system's queue.
        match sendto(&self.0, bytes, SendFlags::DONTWAIT, &address(to)?).map_err(io::Error::from) {
            // Somebody else was not there a moment ago.
            Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => Ok(()),
            sent => sent.map(|_| ()),
        }
    }

    fn receive(&self, _now: LocalTime, buffer: &mut [u8]) -> io::Result<Option<Arrival>> {
        use io::ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
        match self.0.recv_from(buffer) {
            Ok((length, from)) => Ok(Some(Arrival { at: clock::now(), from: from.into(), length })),
            // Nothing came, or a peer is gone, which is the protocol's to notice.
            Err(error) if matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused) => {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

/// Asks for [`RECEIVE_BUFFER_BYTES`]. Without the right to exceed it, the system grants what its own limit allows
/// (`net.core.rmem_max` on Linux); less is no failure.
fn enlarge_receive_buffer(socket: &UdpSocket) {
    #[cfg(target_os = "linux")]
    if rustix::net::sockopt::set_socket_recv_buffer_size_force(socket, RECEIVE_BUFFER_BYTES).is_ok() {
        return;
    }
    let _: Result<(), Errno> = set_socket_recv_buffer_size(socket, RECEIVE_BUFFER_BYTES);
}

fn address(route: Route) -> io::Result<SocketAddr> {
    route.socket_address().ok_or_else(|| io::ErrorKind::Unsupported.into())
}

/// Any port of any address of the family that reaches `server`.
fn any_address(server: SocketAddr) -> SocketAddr {
    match server {
        SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
        SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
    }
}
