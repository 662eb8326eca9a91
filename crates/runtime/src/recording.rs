//! Reads a recording back, whole or cut off anywhere, item by item.
//!
//! What is in the file is taken for hostile: every answer is an item, the end, or an error that says where it lies and
//! what was expected. A file that just stops (a killed process, a full disk) is no error: all its whole items are read,
//! and [`RecordingEnd::ended_abruptly`] is set.

mod error;
mod fields;
mod framing;

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use cotouch_scene::names::HostIndex;
use mcap::records::op;

use crate::messages::{self, Stream};
use crate::record::RecordItem;
use crate::recorder::{
    ENCODING, FACT, FORMAT, HEADER_RECORD, MAX_MESSAGE_BYTES, RecordingHeader, RecordingSummary,
    SUMMARY_RECORD,
};
pub use error::RecordingError;
use fields::{Channel, Message, Metadata, Schema};
use framing::{Framing, RawRecord};

/// How a recording ends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingEnd {
    /// Whether the file stops without having been finished.
    pub ended_abruptly: bool,
    /// What the recorder said at the end; nothing when it did not come so far.
    pub summary: Option<RecordingSummary>,
}

/// A recording in memory: for short ones and for tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was recorded, as its first message says.
    pub header: RecordingHeader,
    /// Every item, in the order of recording.
    pub items: Vec<RecordItem>,
    /// How the recording ends.
    pub end: RecordingEnd,
}

impl Recording {
    /// Reads a file.
    ///
    /// # Errors
    /// When the file cannot be read, is no recording, or is damaged.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::collect(RecordingReader::open(path)?)
    }

    /// Reads from anything that can be read, such as a slice of bytes.
    ///
    /// # Errors
    /// As for [`Recording::open`].
    pub fn read(source: impl Read) -> Result<Self, RecordingError> {
        Self::collect(RecordingReader::new(source)?)
    }

    fn collect<R: Read>(mut reader: RecordingReader<R>) -> Result<Self, RecordingError> {
        let items = reader.by_ref().collect::<Result<_, _>>()?;
        let end = reader.end.unwrap_or_default();
        Ok(Self { header: reader.header, items, end })
    }
}

/// Reads a recording item by item. Memory does not grow with the file.
pub struct RecordingReader<R> {
    framing: Framing<R>,
    header: RecordingHeader,
    schemas: HashMap<u16, Option<Stream>>,
    channels: HashMap<u16, Option<(HostIndex, Stream)>>,
    items: u64,
    summary: Option<RecordingSummary>,
    end: Option<RecordingEnd>,
    failed: bool,
}

impl RecordingReader<BufReader<File>> {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// When the file cannot be read, is no recording, or is damaged before its first item.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let open = |source| RecordingError::Open { path: path.to_owned(), source };
        Self::new(BufReader::new(File::open(path).map_err(open)?))
    }
}

impl<R: Read> RecordingReader<R> {
    /// Reads the header of a recording.
    ///
    /// # Errors
    /// As for [`RecordingReader::open`].
    pub fn new(source: R) -> Result<Self, RecordingError> {
        let mut framing = Framing::new(source)?;
        let header = read_header(&mut framing)?;
        Ok(Self {
            framing,
            header,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            items: 0,
            summary: None,
            end: None,
            failed: false,
        })
    }

    /// What was recorded, as its first message says.
    #[must_use]
    pub fn header(&self) -> &RecordingHeader {
        &self.header
    }

    /// How the recording ends; known once every item was read.
    #[must_use]
    pub fn end(&self) -> Option<&RecordingEnd> {
        self.end.as_ref()
    }

    fn next_item(&mut self) -> Result<Option<RecordItem>, RecordingError> {
        while self.end.is_none() {
            let Some(record) = self.framing.next_record()? else {
                self.end = Some(self.make_end()?);
                break;
            };
            match record.opcode {
                op::SCHEMA => note_schema(&mut self.schemas, &record)?,
                op::CHANNEL => note_channel(&mut self.channels, &self.schemas, &record)?,
                op::METADATA => note_summary(&mut self.summary, &record)?,
                op::MESSAGE => {
                    if let Some(item) = read_item(&self.channels, self.items + 1, &record)? {
                        self.items += 1;
                        return Ok(Some(item));
                    }
                }
                _ => {}
            }
        }
        Ok(None)
    }

    fn make_end(&mut self) -> Result<RecordingEnd, RecordingError> {
        let summary = self.summary.take();
        if let Some(RecordingSummary { items, .. }) = summary
            && items != self.items
        {
            let found = format!("{} items", self.items);
            return Err(RecordingError::malformed(self.framing.position(), found, format!("{items} items")));
        }
        Ok(RecordingEnd { ended_abruptly: self.framing.ended_abruptly() || summary.is_none(), summary })
    }
}

impl<R: Read> Iterator for RecordingReader<R> {
    type Item = Result<RecordItem, RecordingError>;

    /// The next item; after an error, nothing more.
    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let item = self.next_item().transpose();
        self.failed = matches!(item, Some(Err(_)));
        item
    }
}

fn read_header<R: Read>(framing: &mut Framing<R>) -> Result<RecordingHeader, RecordingError> {
    let expected = format!("an MCAP metadata record named {HEADER_RECORD} before all messages");
    while let Some(record) = framing.next_record()? {
        match record.opcode {
            op::METADATA => {
                let Metadata { name, entries } = record.parse()?;
                if name == HEADER_RECORD {
                    return parse_header(&entries);
                }
            }
            op::MESSAGE => break,
            _ => {}
        }
    }
    Err(RecordingError::foreign("none", expected))
}

fn parse_header(entries: &BTreeMap<&str, &str>) -> Result<RecordingHeader, RecordingError> {
    let find = |key: &str| {
        let missing = || RecordingError::foreign(format!("no {key} in its header"), "one");
        entries.get(key).copied().ok_or_else(missing)
    };
    let format = find("format")?;
    if format != FORMAT {
        return Err(RecordingError::foreign(format!("layout {format:?}"), format!("layout {FORMAT:?}")));
    }
    let epoch = find("epoch_unix_ns")?;
    let rate = find("control_hz")?;
    Ok(RecordingHeader {
        cotouch_version: find("cotouch_version")?.to_owned(),
        scene_toml: find("scene_toml")?.to_owned(),
        control_hz: rate
            .parse()
            .map_err(|_| RecordingError::foreign(format!("control_hz = {rate:?}"), "a rate in hertz"))?,
        epoch_unix_ns: epoch.parse().map_err(|_| {
            RecordingError::foreign(format!("epoch_unix_ns = {epoch:?}"), "nanoseconds since 1970")
        })?,
        facts: facts(entries),
    })
}

fn facts(entries: &BTreeMap<&str, &str>) -> BTreeMap<String, String> {
    let fact =
        |(name, value): (&&str, &&str)| Some((name.strip_prefix(FACT)?.to_owned(), (*value).to_owned()));
    entries.iter().filter_map(fact).collect()
}

fn note_summary(
    summary: &mut Option<RecordingSummary>,
    record: &RawRecord<'_>,
) -> Result<(), RecordingError> {
    let Metadata { name, entries } = record.parse()?;
    if name == SUMMARY_RECORD {
        let count = |key: &str| {
            let text = entries.get(key).copied().unwrap_or_default();
            let error = |_| RecordingError::malformed(record.at, format!("{key} = {text:?}"), "a count");
            text.parse::<u64>().map_err(error)
        };
        let (items, dropped) = (count("items")?, count("dropped")?);
        *summary = Some(RecordingSummary { items, dropped, facts: facts(&entries) });
    }
    Ok(())
}

fn note_schema(
    schemas: &mut HashMap<u16, Option<Stream>>,
    record: &RawRecord<'_>,
) -> Result<(), RecordingError> {
    let Schema { id, name, encoding } = record.parse()?;
    let known = Stream::ALL.into_iter().find(|stream| stream.schema() == name);
    schemas.insert(id, known.filter(|_| encoding == ENCODING));
    Ok(())
}

fn note_channel(
    channels: &mut HashMap<u16, Option<(HostIndex, Stream)>>,
    schemas: &HashMap<u16, Option<Stream>>,
    record: &RawRecord<'_>,
) -> Result<(), RecordingError> {
    let channel: Channel<'_> = record.parse()?;
    let ours = messages::parse_topic(channel.topic);
    if let Some((_, stream)) = ours {
        let schema = schemas.get(&channel.schema_id).copied().flatten();
        if schema != Some(stream) || channel.message_encoding != ENCODING {
            let found = format!("{} with another schema or encoding", channel.topic);
            return Err(RecordingError::malformed(record.at, found, stream.schema()));
        }
    }
    if channels.insert(channel.id, ours).is_some_and(|before| before != ours) {
        let found = format!("channel {} twice, with two topics", channel.id);
        return Err(RecordingError::malformed(record.at, found, "one topic a channel"));
    }
    Ok(())
}

/// The item in a message; nothing when it is on a topic that is not a host's.
fn read_item(
    channels: &HashMap<u16, Option<(HostIndex, Stream)>>,
    number: u64,
    record: &RawRecord<'_>,
) -> Result<Option<RecordItem>, RecordingError> {
    let Message { channel_id, sequence, data } = record.parse()?;
    let Some(&channel) = channels.get(&channel_id) else {
        let found = format!("a message on channel {channel_id}");
        return Err(RecordingError::malformed(record.at, found, "a channel that was announced before"));
    };
    let Some((host, stream)) = channel else { return Ok(None) };
    if sequence != number as u32 {
        let found = format!("item {sequence}");
        return Err(RecordingError::malformed(record.at, found, format!("item {}", number as u32)));
    }
    if data.len() > MAX_MESSAGE_BYTES {
        let found = format!("a message of {} bytes", data.len());
        return Err(RecordingError::malformed(record.at, found, format!("at most {MAX_MESSAGE_BYTES}")));
    }
    let expected = format!("item {number}, a message on {}", messages::topic(host, stream));
    let malformed = |error| RecordingError::malformed(record.at, error, expected);
    messages::decode(host, stream, data).map(Some).map_err(malformed)
}
