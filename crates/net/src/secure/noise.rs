//! The handshake: `Noise_IKpsk1_25519_ChaChaPoly_BLAKE2s` (Perrin 2018, *The Noise Protocol Framework*, revision 34).
//!
//! ```text
//! ← s                          the caller knows whom it calls
//! → e, es, s, ss, psk  {sent at, channel number}
//! ← e, ee, se          {channel number}
//! ```

use std::fmt;

use snow::params::{DHChoice, HashChoice, NoiseParams};
use snow::resolvers::{CryptoResolver, DefaultResolver};
use snow::types::{Cipher, Dh, Hash, Random};
use snow::{Builder, HandshakeState, StatelessTransportState};
use subtle::ConstantTimeEq as _;
use zerocopy::little_endian::{I64, U32};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use super::key::{KEY_BYTES, PublicKey};
use super::ticket::SECRET_BYTES;
use crate::wire::PROTOCOL_VERSION;
use cotouch_scene::time::LocalTime;

/// Bytes of an authentication tag of ChaCha20-Poly1305.
pub(super) const TAG_BYTES: usize = 16;
/// Bytes of a ticket holder's MAC over a first message.
pub(super) const STAMP_BYTES: usize = 16;
/// Bytes of the caller's message: e, s with a tag, and the payload with a tag.
pub(super) const FIRST_MESSAGE_BYTES: usize =
    KEY_BYTES + KEY_BYTES + TAG_BYTES + size_of::<RawCall>() + TAG_BYTES;
/// Bytes of the answer: e, and the payload with a tag.
pub(super) const SECOND_MESSAGE_BYTES: usize = KEY_BYTES + size_of::<U32>() + TAG_BYTES;

const PATTERN: &str = "Noise_IKpsk1_25519_ChaChaPoly_BLAKE2s";
const PSK_PLACE: u8 = 1;
const DERIVED_BYTES: usize = 32;
const FIXED: &str = "the pattern and the lengths of all keys are constants that fit each other";

/// What a caller says in its first message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Call {
    /// When the call was made on the caller's clock: later ones have later times.
    pub(super) sent: LocalTime,
    /// The number by which the caller knows the channel.
    pub(super) channel: u32,
}

#[derive(FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct RawCall {
    sent_ns: I64,
    channel: U32,
}

/// What comes of a ticket's secret: a MAC for first messages, and the handshake's pre-shared key.
pub(super) struct TicketKeys {
    hash: Box<dyn Hash>,
    stamp_key: [u8; DERIVED_BYTES],
    pre_shared: [u8; DERIVED_BYTES],
}

impl TicketKeys {
    pub(super) fn new(secret: &[u8; SECRET_BYTES]) -> Self {
        let mut hash = DefaultResolver.resolve_hash(&HashChoice::Blake2s).expect(FIXED);
        let mut derive = |label: &[u8]| {
            let mut key = [0; DERIVED_BYTES];
            hash.hmac(secret, label, &mut key);
            key
        };
        let (stamp_key, pre_shared) = (derive(b"cotouch stamp"), derive(b"cotouch handshake"));
        Self { hash, stamp_key, pre_shared }
    }

    /// HMAC-BLAKE2s, cut to [`STAMP_BYTES`].
    pub(super) fn stamp(&mut self, bytes: &[u8]) -> [u8; STAMP_BYTES] {
        let mut mac = [0; DERIVED_BYTES];
        self.hash.hmac(&self.stamp_key, bytes, &mut mac);
        let mut stamp = [0; STAMP_BYTES];
        stamp.copy_from_slice(&mac[..STAMP_BYTES]);
        stamp
    }

    pub(super) fn has_stamped(&mut self, bytes: &[u8], stamp: &[u8]) -> bool {
        self.stamp(bytes).ct_eq(stamp).into()
    }
}

/// A host's key pair.
pub(super) struct KeyPair {
    private: [u8; KEY_BYTES],
    pub(super) public: PublicKey,
}

impl KeyPair {
    /// The pair of a private key, which is random.
    pub(super) fn new(private: [u8; KEY_BYTES]) -> Self {
        let mut curve = DefaultResolver.resolve_dh(&DHChoice::Curve25519).expect(FIXED);
        curve.set(&private);
        let mut public = [0; KEY_BYTES];
        public.copy_from_slice(curve.pubkey());
        Self { private, public: PublicKey(public) }
    }
}

impl fmt::Debug for KeyPair {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("KeyPair").field("public", &self.public).finish_non_exhaustive()
    }
}

/// Starts a handshake with the host of this key; `ephemeral` is random and used for nothing else.
pub(super) fn call(
    own: &KeyPair,
    ticket: &TicketKeys,
    other: PublicKey,
    ephemeral: [u8; KEY_BYTES],
    call: Call,
) -> (HandshakeState, [u8; FIRST_MESSAGE_BYTES]) {
    let builder = builder(own, ticket, ephemeral).remote_public_key(&other.0).expect(FIXED);
    let mut handshake = builder.build_initiator().expect(FIXED);
    let raw = RawCall { sent_ns: call.sent.0.into(), channel: call.channel.into() };
    let mut message = [0; FIRST_MESSAGE_BYTES];
    let length = handshake.write_message(raw.as_bytes(), &mut message).expect(FIXED);
    debug_assert_eq!(length, FIRST_MESSAGE_BYTES);
    (handshake, message)
}

/// A call that was taken.
pub(super) struct Taken {
    pub(super) caller: PublicKey,
    pub(super) call: Call,
    pub(super) cipher: StatelessTransportState,
    pub(super) answer: [u8; SECOND_MESSAGE_BYTES],
}

/// Takes a first message, and answers with the `channel` number here; `None` when it was not made with the keys that it needs.
pub(super) fn take_call(
    own: &KeyPair,
    ticket: &TicketKeys,
    ephemeral: [u8; KEY_BYTES],
    message: &[u8],
    channel: u32,
) -> Option<Taken> {
    let mut handshake = builder(own, ticket, ephemeral).build_responder().expect(FIXED);
    let mut payload = [0; size_of::<RawCall>()];
    handshake.read_message(message, &mut payload).ok()?;
    let raw = RawCall::read_from_bytes(&payload).ok()?;
    let call = Call { sent: LocalTime(raw.sent_ns.get()), channel: raw.channel.get() };
    let caller = PublicKey(handshake.get_remote_static()?.try_into().ok()?);
    let mut answer = [0; SECOND_MESSAGE_BYTES];
    handshake.write_message(&channel.to_le_bytes(), &mut answer).ok()?;
    let cipher = handshake.into_stateless_transport_mode().ok()?;
    Some(Taken { caller, call, cipher, answer })
}

/// Takes the answer to a call; the channel's number there, or `None` when the answer is no answer to it, which then goes on waiting.
pub(super) fn take_answer(handshake: &mut HandshakeState, answer: &[u8]) -> Option<u32> {
    let mut payload = [0; size_of::<U32>()];
    if answer.len() != SECOND_MESSAGE_BYTES {
        return None;
    }
    handshake.read_message(answer, &mut payload).ok()?;
    Some(u32::from_le_bytes(payload))
}

fn builder<'a>(own: &'a KeyPair, ticket: &'a TicketKeys, ephemeral: [u8; KEY_BYTES]) -> Builder<'a> {
    const PROLOGUE: [u8; 9] = {
        let [low, high] = PROTOCOL_VERSION.to_le_bytes();
        [b'c', b'o', b't', b'o', b'u', b'c', b'h', low, high]
    };
    let params: NoiseParams = PATTERN.parse().expect(FIXED);
    Builder::with_resolver(params, Box::new(OneKey(ephemeral)))
        .prologue(&PROLOGUE)
        .and_then(|builder| builder.local_private_key(&own.private))
        .and_then(|builder| builder.psk(PSK_PLACE, &ticket.pre_shared))
        .expect(FIXED)
}

/// snow's own cryptography with randomness from outside: enough for the one key that a handshake draws.
struct OneKey([u8; KEY_BYTES]);

impl CryptoResolver for OneKey {
    fn resolve_rng(&self) -> Option<Box<dyn Random>> {
        Some(Box::new(OneDraw(Some(self.0))))
    }

    fn resolve_dh(&self, choice: &DHChoice) -> Option<Box<dyn Dh>> {
        DefaultResolver.resolve_dh(choice)
    }

    fn resolve_hash(&self, choice: &HashChoice) -> Option<Box<dyn Hash>> {
        DefaultResolver.resolve_hash(choice)
    }

    fn resolve_cipher(&self, choice: &snow::params::CipherChoice) -> Option<Box<dyn Cipher>> {
        DefaultResolver.resolve_cipher(choice)
    }
}

struct OneDraw(Option<[u8; KEY_BYTES]>);

impl Random for OneDraw {
    fn try_fill_bytes(&mut self, out: &mut [u8]) -> Result<(), snow::Error> {
        // A second draw would repeat the first: it is an error, which the handshake reports.
        let drawn = self.0.take().filter(|drawn| drawn.len() == out.len()).ok_or(snow::Error::Rng)?;
        out.copy_from_slice(&drawn);
        Ok(())
    }
}
