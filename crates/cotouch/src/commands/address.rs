//! Addresses as people type them.

use std::net::{SocketAddr, ToSocketAddrs as _};

use crate::failure::Failure;

/// The address that `text` (HOST:PORT) stands for.
pub(super) fn resolve(text: &str) -> Result<SocketAddr, Failure> {
    let reason = match text.to_socket_addrs().map(|mut addresses| addresses.next()) {
        Ok(Some(address)) => return Ok(address),
        Ok(None) => "it stands for no address".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(Failure::usage(format!(
        "{text:?} is not an address ({reason}); it must be HOST:PORT, such as 127.0.0.1:7800"
    )))
}
