//! Tickets: what one must hold to join a session.

use std::fmt;
use std::str::FromStr;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use xxhash_rust::xxh3::xxh3_64;

use super::key::{KEY_BYTES, PublicKey};
use crate::route::Route;

/// Bytes of the secret in a ticket: nobody guesses 128 random bits.
pub(super) const SECRET_BYTES: usize = 16;
/// Bytes that tell a mistyped key from another session's.
const CHECK_BYTES: usize = 3;
const PROVEN_BYTES: usize = KEY_BYTES + SECRET_BYTES;

/// What a ticket proves: the server's public key, and a secret that only ticket holders know. As text it is 68 characters of
/// base64url, the last four of which are a check.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct SessionKey {
    pub(super) server: PublicKey,
    pub(super) secret: [u8; SECRET_BYTES],
}

/// Where a session is, and the key to it: `ADDRESS/KEY` as text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket {
    /// Where the server listens.
    pub address: Route,
    /// The key to its session.
    pub key: SessionKey,
}

/// Why a text is no session key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the key of the ticket is incomplete or mistyped; it is what `cotouch serve` prints after the slash, 68 letters, digits, '-' and '_'"
)]
pub struct TicketError;

impl SessionKey {
    /// Who the server is, to those who join it.
    #[must_use]
    pub fn server(self) -> Route {
        self.server.route()
    }

    fn proven_bytes(self) -> [u8; PROVEN_BYTES] {
        let mut bytes = [0; PROVEN_BYTES];
        bytes[..KEY_BYTES].copy_from_slice(&self.server.0);
        bytes[KEY_BYTES..].copy_from_slice(&self.secret);
        bytes
    }
}

fn check(proven: &[u8]) -> [u8; CHECK_BYTES] {
    let [a, b, c, ..] = xxh3_64(proven).to_le_bytes();
    [a, b, c]
}

impl fmt::Display for SessionKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let proven = self.proven_bytes();
        let mut bytes = [0; PROVEN_BYTES + CHECK_BYTES];
        bytes[..PROVEN_BYTES].copy_from_slice(&proven);
        bytes[PROVEN_BYTES..].copy_from_slice(&check(&proven));
        formatter.write_str(&URL_SAFE_NO_PAD.encode(bytes))
    }
}

/// Without the secret, so that no log has it.
impl fmt::Debug for SessionKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("SessionKey").field("server", &self.server).finish_non_exhaustive()
    }
}

impl FromStr for SessionKey {
    type Err = TicketError;

    fn from_str(text: &str) -> Result<Self, TicketError> {
        let mut bytes = [0; PROVEN_BYTES + CHECK_BYTES];
        let length = URL_SAFE_NO_PAD.decode_slice(text, &mut bytes).map_err(|_| TicketError)?;
        let (proven, found) = bytes.split_at(PROVEN_BYTES);
        if length != bytes.len() || found != check(proven) {
            return Err(TicketError);
        }
        let (mut server, mut secret) = ([0; KEY_BYTES], [0; SECRET_BYTES]);
        server.copy_from_slice(&proven[..KEY_BYTES]);
        secret.copy_from_slice(&proven[KEY_BYTES..]);
        Ok(Self { server: PublicKey(server), secret })
    }
}

impl fmt::Display for Ticket {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.address, self.key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_survives_its_text_and_a_slip_is_noticed() {
        let secret = [7; SECRET_BYTES];
        let key = SessionKey { server: PublicKey([0xfe; KEY_BYTES]), secret };
        let text = key.to_string();
        assert_eq!((text.len(), text.parse()), (68, Ok(key)));
        assert!(!format!("{key:?}").contains("secret"), "{key:?}");
        for place in 0..text.len() {
            let mut slip = text.clone().into_bytes();
            slip[place] = if slip[place] == b'A' { b'B' } else { b'A' };
            assert_eq!(String::from_utf8(slip).unwrap().parse::<SessionKey>(), Err(TicketError), "{place}");
            assert_eq!(text[..place].parse::<SessionKey>(), Err(TicketError));
        }
        assert_eq!(format!("{text}A").parse::<SessionKey>(), Err(TicketError));
    }
}
