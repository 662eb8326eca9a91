//! Writes a recording: an MCAP file that Foxglove, PlotJuggler and any other reader of MCAP shows without a plug-in.
//!
//! The file is written under its final name, in whole chunks, each handed to the operating system when half a second
//! of the session lies in it (and whenever [`Recorder::poll`] finds that half a second has passed): a process that is
//! killed loses what its last chunk had, and the file stays readable. Nothing in the file depends on anything but the
//! header, the items and when it was flushed: the same run in virtual time gives the same bytes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use cotouch_scene::time::{LocalTime, Rate};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use prost::Message;

use crate::exchange::RecordSink;
use crate::messages::{self, DESCRIPTORS, SESSION_SCHEMA, SESSION_TOPIC, Stream, types};
use crate::record::{Note, RecordItem, RecordKind};

/// Longest message in a recording, bytes.
pub const MAX_MESSAGE_BYTES: usize = 4 << 20;

/// The layout that this version writes and reads.
pub(crate) const FORMAT: &str = "4";
pub(crate) const HEADER_RECORD: &str = "cotouch.header";
pub(crate) const SUMMARY_RECORD: &str = "cotouch.summary";
pub(crate) const ENCODING: &str = "protobuf";
/// Before a fact's name in the metadata records, so that a fact cannot take another entry's place.
pub(crate) const FACT: &str = "fact.";

const FLUSH_PERIOD_NS: i64 = 500_000_000;

/// A chunk is closed at this many bytes at the latest.
const CHUNK_BYTES: u64 = 512 << 10;

/// What was recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingHeader {
    /// The version of cotouch that recorded.
    pub cotouch_version: String,
    /// The scene, as TOML.
    pub scene_toml: String,
    /// The haptic rate, 1/T_c: where a tick lies in time.
    pub control_hz: Rate,
    /// The instant of tick 0 in nanoseconds since 1970; 0 in virtual time. A message's log time is this plus its
    /// tick's nominal instant.
    pub epoch_unix_ns: u64,
    /// Whatever else a reader of the recording wants to know: architecture, seed, overrides, computer.
    pub facts: BTreeMap<String, String>,
}

/// How a recording ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingSummary {
    /// Items in the recording.
    pub items: u64,
    /// Items that are missing, because the recorder could not keep up.
    pub dropped: u64,
    /// What came of the session.
    pub facts: BTreeMap<String, String>,
}

/// Why a recording could not be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be made.
    #[error("cannot create the recording {}: {source}", path.display())]
    Create {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file cannot be written on; what was flushed before stays readable.
    #[error("cannot write on the recording {}: {source}", path.display())]
    Write {
        /// Its path.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// An item is longer than any may be.
    #[error("an item at tick {tick} takes {bytes} bytes; at most {MAX_MESSAGE_BYTES} are allowed")]
    TooLong {
        /// Its tick.
        tick: u64,
        /// Its length.
        bytes: usize,
    },
}

impl RecordError {
    fn write(path: &Path, error: McapError) -> Self {
        let source = match error {
            McapError::Io(source) => source,
            other => io::Error::other(other),
        };
        Self::Write { path: path.to_owned(), source }
    }
}

/// Writes one recording to a file, item by item.
pub struct Recorder {
    path: PathBuf,
    writer: Writer<NoSeek<BufWriter<File>>>,
    control_hz: Rate,
    epoch_unix_ns: u64,
    schemas: [u16; Stream::ALL.len()],
    /// Of every host that has said something, in the order of [`Stream::ALL`].
    channels: Vec<[Option<u16>; Stream::ALL.len()]>,
    message: Vec<u8>,
    items: u64,
    dropped: u64,
    /// Session time since tick 0, ns, at which the chunk is due.
    flush_at_ns: i64,
    flushed_at: Option<LocalTime>,
    failure: Option<RecordError>,
}

impl Recorder {
    /// Makes the file (an older one of that name is replaced) and writes down what is to be recorded.
    ///
    /// # Errors
    /// When the file cannot be made or written.
    pub fn create(path: &Path, header: &RecordingHeader) -> Result<Self, RecordError> {
        let path = path.to_owned();
        let file = match File::create(&path) {
            Ok(file) => file,
            Err(source) => return Err(RecordError::Create { path, source }),
        };
        match Self::begin(path.clone(), file, header) {
            Ok(recorder) => Ok(recorder),
            Err(error) => Err(RecordError::write(&path, error)),
        }
    }

    fn begin(path: PathBuf, file: File, header: &RecordingHeader) -> Result<Self, McapError> {
        // Chunks are made in memory and written whole: a file that ends abruptly has no half-made chunk header.
        let options = WriteOptions::new()
            .library(format!("cotouch/{} {}", header.cotouch_version, mcap::LIBRARY_IDENTIFIER))
            .compression(None)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true);
        let mut writer = options.create(NoSeek::new(BufWriter::new(file)))?;
        writer.write_metadata(&header_record(header))?;
        write_session(&mut writer, header)?;
        let mut schemas = [0; Stream::ALL.len()];
        for (id, stream) in schemas.iter_mut().zip(Stream::ALL) {
            *id = writer.add_schema(stream.schema(), ENCODING, DESCRIPTORS)?;
        }
        writer.flush()?;
        Ok(Self {
            path,
            writer,
            control_hz: header.control_hz,
            epoch_unix_ns: header.epoch_unix_ns,
            schemas,
            channels: Vec::new(),
            message: Vec::new(),
            items: 0,
            dropped: 0,
            flush_at_ns: FLUSH_PERIOD_NS,
            flushed_at: None,
            failure: None,
        })
    }

    /// Writes one item; flushes when half a second of the session lies in the chunk.
    ///
    /// # Errors
    /// When the file cannot be written on, or the item is longer than [`MAX_MESSAGE_BYTES`].
    pub fn write(&mut self, item: &RecordItem) -> Result<(), RecordError> {
        self.message.clear();
        let stream = messages::encode(item, &mut self.message);
        if self.message.len() > MAX_MESSAGE_BYTES {
            return Err(RecordError::TooLong { tick: item.tick, bytes: self.message.len() });
        }
        let instant_ns = self.control_hz.instant(item.tick).0;
        if instant_ns >= self.flush_at_ns {
            self.flush()?;
            self.flush_at_ns = instant_ns.saturating_add(FLUSH_PERIOD_NS);
        }
        self.append(item, stream, instant_ns).map_err(|error| RecordError::write(&self.path, error))?;
        self.items += 1;
        if let RecordKind::Note(Note::Dropped { items }) = item.kind {
            self.dropped = self.dropped.saturating_add(items);
        }
        Ok(())
    }

    fn append(&mut self, item: &RecordItem, stream: Stream, instant_ns: i64) -> Result<(), McapError> {
        let channel_id = self.channel(item, stream)?;
        let log_time = self.epoch_unix_ns.saturating_add_signed(instant_ns);
        // The items of a recording are numbered from 1, over all streams, so that a reader sees when one is missing.
        let sequence = (self.items as u32).wrapping_add(1);
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, &self.message)
    }

    fn channel(&mut self, item: &RecordItem, stream: Stream) -> Result<u16, McapError> {
        let host = item.host.index();
        if host >= self.channels.len() {
            self.channels.resize(host + 1, [None; Stream::ALL.len()]);
        }
        if let Some(known) = self.channels[host][stream as usize] {
            return Ok(known);
        }
        let topic = messages::topic(item.host, stream);
        let made =
            self.writer.add_channel(self.schemas[stream as usize], &topic, ENCODING, &BTreeMap::new())?;
        self.channels[host][stream as usize] = Some(made);
        Ok(made)
    }

    /// Hands everything written so far to the operating system: from here on, killing this process cannot lose it.
    ///
    /// # Errors
    /// When the file cannot be written on.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush().map_err(|error| RecordError::write(&self.path, error))
    }

    /// Flushes when half a second has passed on this computer's clock since it last did so. A recorder thread calls
    /// this between its drains; virtual time has no need of it.
    ///
    /// # Errors
    /// When the file cannot be written on, now or in an earlier [`RecordSink::record`].
    pub fn poll(&mut self, now: LocalTime) -> Result<(), RecordError> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        let flushed_at = *self.flushed_at.get_or_insert(now);
        if now.since(flushed_at) >= FLUSH_PERIOD_NS {
            self.flushed_at = Some(now);
            self.flush()?;
        }
        Ok(())
    }

    /// Ends the recording, with `facts` about what came of the session.
    ///
    /// # Errors
    /// When the file cannot be written on, now or in an earlier [`RecordSink::record`].
    pub fn finish(mut self, facts: BTreeMap<String, String>) -> Result<RecordingSummary, RecordError> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        let summary = RecordingSummary { items: self.items, dropped: self.dropped, facts };
        match end(self.writer, &summary) {
            Ok(()) => Ok(summary),
            Err(error) => Err(RecordError::write(&self.path, error)),
        }
    }
}

/// Directly into the file, as virtual time does. The first failure is kept, ends the recording, and is told by
/// [`Recorder::poll`] or [`Recorder::finish`].
impl RecordSink for Recorder {
    fn record(&mut self, item: &RecordItem) {
        if self.failure.is_none() {
            self.failure = self.write(item).err();
        }
    }
}

fn end(mut writer: Writer<NoSeek<BufWriter<File>>>, summary: &RecordingSummary) -> Result<(), McapError> {
    writer.write_metadata(&summary_record(summary))?;
    writer.finish()?;
    writer.into_inner().into_inner().flush()?;
    Ok(())
}

fn write_session<W: Write + io::Seek>(
    writer: &mut Writer<W>,
    header: &RecordingHeader,
) -> Result<(), McapError> {
    let schema = writer.add_schema(SESSION_SCHEMA, ENCODING, DESCRIPTORS)?;
    let channel_id = writer.add_channel(schema, SESSION_TOPIC, ENCODING, &BTreeMap::new())?;
    let fact = |(name, value): (&String, &String)| types::Fact { name: name.clone(), value: value.clone() };
    let session = types::Session {
        cotouch_version: header.cotouch_version.clone(),
        scene_toml: header.scene_toml.clone(),
        control_hz: header.control_hz.to_string(),
        epoch_unix_ns: header.epoch_unix_ns,
        facts: header.facts.iter().map(fact).collect(),
    };
    let log_time = header.epoch_unix_ns;
    let place = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
    writer.write_to_known_channel(&place, &session.encode_to_vec())
}

fn header_record(header: &RecordingHeader) -> Metadata {
    let mut metadata = facts(&header.facts);
    metadata.extend([
        ("format".to_owned(), FORMAT.to_owned()),
        ("cotouch_version".to_owned(), header.cotouch_version.clone()),
        ("scene_toml".to_owned(), header.scene_toml.clone()),
        ("control_hz".to_owned(), header.control_hz.to_string()),
        ("epoch_unix_ns".to_owned(), header.epoch_unix_ns.to_string()),
    ]);
    Metadata { name: HEADER_RECORD.to_owned(), metadata }
}

fn summary_record(summary: &RecordingSummary) -> Metadata {
    let mut metadata = facts(&summary.facts);
    metadata.extend([
        ("items".to_owned(), summary.items.to_string()),
        ("dropped".to_owned(), summary.dropped.to_string()),
    ]);
    Metadata { name: SUMMARY_RECORD.to_owned(), metadata }
}

fn facts(facts: &BTreeMap<String, String>) -> BTreeMap<String, String> {
    facts.iter().map(|(name, value)| (format!("{FACT}{name}"), value.clone())).collect()
}
