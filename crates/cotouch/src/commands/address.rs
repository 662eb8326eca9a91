//! Addresses as people type them.

use std::net::ToSocketAddrs as _;

use cotouch_net::Route;
use cotouch_runtime::transport::{self, RouteError};

use crate::failure::Failure;

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
