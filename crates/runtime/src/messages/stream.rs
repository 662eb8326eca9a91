//! The streams of a recording, and what they are called.

use cotouch_scene::names::HostIndex;

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
