//! A recording's messages: protobuf, in streams, one message type a stream. `proto/cotouch.proto` defines them.

mod read;
mod write;

use cotouch_scene::names::HostIndex;

pub(crate) use read::decode;
pub(crate) use write::encode;

/// The message types, as prost makes them of the definitions.
pub(crate) mod types {
    #![allow(missing_docs, unreachable_pub, clippy::all, clippy::pedantic)]
    include!(concat!(env!("OUT_DIR"), "/cotouch.rs"));
}

/// The definitions, compiled: a protobuf `FileDescriptorSet`, which every recording carries as its schema.
pub(crate) const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/cotouch.descriptors"));

/// The topic of the recording's first message, which says what was recorded.
pub(crate) const SESSION_TOPIC: &str = "/session/scene";

/// The message type on [`SESSION_TOPIC`].
pub(crate) const SESSION_SCHEMA: &str = "cotouch.Session";

/// One kind of message of one host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    Tick,
    Received,
    Sent,
    Events,
    State,
    Surface,
}

impl Stream {
    pub(crate) const ALL: [Self; 6] =
        [Self::Tick, Self::Received, Self::Sent, Self::Events, Self::State, Self::Surface];

    /// As in its topic.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Tick => "tick",
            Self::Received => "received",
            Self::Sent => "sent",
            Self::Events => "events",
            Self::State => "state",
            Self::Surface => "surface",
        }
    }

    /// Its message type.
    pub(crate) const fn schema(self) -> &'static str {
        match self {
            Self::Tick => "cotouch.Tick",
            Self::Received => "cotouch.Received",
            Self::Sent => "cotouch.Sent",
            Self::Events => "cotouch.Event",
            Self::State => "cotouch.State",
            Self::Surface => "cotouch.Surface",
        }
    }
}

/// `/host1/tick` and so on.
pub(crate) fn topic(host: HostIndex, stream: Stream) -> String {
    format!("/{host}/{}", stream.name())
}

/// The host and the stream of a topic that [`topic`] made.
pub(crate) fn parse_topic(text: &str) -> Option<(HostIndex, Stream)> {
    let (host, name) = text.strip_prefix("/host")?.split_once('/')?;
    let number: u16 = host.parse().ok()?;
    let host = HostIndex(u8::try_from(number.checked_sub(1)?).ok()?);
    let stream = Stream::ALL.into_iter().find(|stream| stream.name() == name)?;
    (topic(host, stream) == text).then_some((host, stream))
}
