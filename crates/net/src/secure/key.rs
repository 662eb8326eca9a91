//! Public keys, and the routes that stand for them.

use std::fmt;

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;

use crate::route::Route;
use crate::text::Text;

/// Bytes of an X25519 key, private or public.
pub(super) const KEY_BYTES: usize = 32;
/// What the route of a key begins with.
const SCHEME: &str = "key:";

/// The X25519 public key of one life of a host: who it is, wherever it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PublicKey(pub(super) [u8; KEY_BYTES]);

impl PublicKey {
    /// The route that stands for it: `key:` and the key in base64url.
    #[must_use]
    pub fn route(self) -> Route {
        let text = Text::from(&self.to_string()).expect("47 characters fit a text of 64");
        Route::Named(text)
    }

    /// The key that `route` stands for; `None` for routes of transports.
    #[must_use]
    pub fn of(route: Route) -> Option<Self> {
        let Route::Named(name) = route else { return None };
        let mut key = [0; KEY_BYTES];
        let length = URL_SAFE_NO_PAD.decode_slice(name.strip_prefix(SCHEME)?, &mut key).ok()?;
        (length == KEY_BYTES).then_some(Self(key))
    }
}

impl fmt::Display for PublicKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{SCHEME}{}", URL_SAFE_NO_PAD.encode(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_a_route_and_no_other_route_is_a_key() {
        let key = PublicKey([0xa5; KEY_BYTES]);
        assert_eq!(PublicKey::of(key.route()), Some(key));
        let address: std::net::SocketAddr = "127.0.0.1:7800".parse().unwrap();
        assert_eq!(PublicKey::of(address.into()), None);
        for text in
            ["key:", "key:AAAA", "unix:/run/a", "key:paWlpaWlpaWlpaWlpaWlpaWlpaWlpaWlpaWlpaWlpaWlpaWl"]
        {
            assert_eq!(PublicKey::of(Route::Named(Text::from(text).unwrap())), None, "{text}");
        }
    }
}
