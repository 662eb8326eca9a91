//! The secured layer: every datagram authenticated and encrypted, every peer known by its key.
//!
//! It stands between a transport and an [`Endpoint`](crate::Endpoint) and is as pure as that: bytes in, bytes out, time and
//! randomness handed in. The design:
//!
//! 1. Every host draws an X25519 key pair when it starts. Its route, to the session above, is its public key
//!    (`key:BASE64`); where it is reached is this layer's affair alone: where its newest authenticated datagram came from.
//! 2. A server draws a secret too. Its ticket is `ADDRESS/KEY` with its public key and the secret ([`Ticket`]): who holds the
//!    ticket may join, and nobody else.
//! 3. Two hosts share a *channel* after a handshake `Noise_IKpsk1_25519_ChaChaPoly_BLAKE2s` (Perrin 2018, rev. 34), whose pre-shared
//!    key comes from the secret: one round trip, both sides' keys proven, forward secrecy by ephemeral keys.
//! 4. Members learn each other's public keys from the server's roster, over their channel to it, and then shake hands pair by
//!    pair: no member can act as another. Where the other is, the server's node says (*introduction*): to both, so that both
//!    call at once. The server is trusted to say which key is which user, and with nothing of what two others exchange.
//! 5. A sealed datagram names its channel and a counter, which is the nonce. A window of 1984 counters (RFC 6479) rejects what is repeated.
//! 6. A first message carries a MAC with a key from the secret: what strangers send costs one hash, no memory, and a short
//!    answer at a bounded rate. Ticket holders' first messages pass a list of those that came lately and a token bucket before any key
//!    exchange; the channel they make is in a small table until its first datagram shows that the caller has the keys.
//! 7. Lost first messages are repeated with new ephemeral keys, and eight of them may be answered, so that long round trips do no harm.
//! 8. A peer that is sent to and not heard for 1.5 s is called again: where the other forgot the channel, it gets a new one.
//! 9. What was rejected is counted ([`Rejections`]) and changes nothing else.
//! 10. Sealing and opening do not allocate. First messages do, at a bounded rate.
//!
//! Simulated links of sessions in virtual time are values inside one process and no network: nothing is sealed there.

mod channel;
mod frame;
mod key;
mod node;
mod noise;
mod peer;
mod recent;
mod rejections;
mod replay;
mod ticket;
mod token_bucket;

pub use frame::{MAX_SEALED, SealedTransmit, may_be_secured};
pub use key::PublicKey;
pub use node::{Entropy, SecureNode, Unwelcome};
pub use rejections::Rejections;
pub use ticket::{SessionKey, Ticket, TicketError};
