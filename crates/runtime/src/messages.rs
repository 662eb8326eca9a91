//! A recording's messages: protobuf, in streams, one message type a stream. `proto/cotouch.proto` defines them.

mod read;
mod stream;
pub(crate) mod types;
mod write;

pub(crate) use read::decode;
pub(crate) use stream::{Stream, parse_topic, topic};
pub(crate) use write::encode;

/// The definitions, compiled: a protobuf `FileDescriptorSet`, which every recording carries as its schema.
pub(crate) const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/cotouch.descriptors"));

/// The topic of the recording's first message, which says what was recorded.
pub(crate) const SESSION_TOPIC: &str = "/session/scene";

/// The message type on [`SESSION_TOPIC`].
pub(crate) const SESSION_SCHEMA: &str = "cotouch.Session";
