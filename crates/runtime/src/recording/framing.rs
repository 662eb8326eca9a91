//! MCAP's outer layer (<https://mcap.dev/spec>): records one after another, most of them in chunks.
//!
//! The `mcap` crate's readers neither say where in the file something is wrong nor give back what a cut-off chunk
//! holds, and (version 0.26) they trust some of the lengths in a file; so this layer is here.

use std::io::{self, Read};
use std::ops::Range;

use mcap::records::op;

use super::error::RecordingError;
use super::fields::FromFields;

/// Longest record, chunks included, bytes. A recorder's chunks hold half a megabyte and one item more.
const LONGEST_RECORD: u64 = 16 << 20;

/// Opcode and length before every record.
const HEAD_BYTES: usize = 9;

/// The fixed part of a chunk's header: start and end time, size, checksum, length of the name of the compression.
const CHUNK_HEADER_BYTES: usize = 32;

/// A record as it lies in the file.
pub(super) struct RawRecord<'a> {
    /// Its offset in the file.
    pub(super) at: u64,
    pub(super) opcode: u8,
    pub(super) body: &'a [u8],
}

impl<'a> RawRecord<'a> {
    /// The record's fields.
    pub(super) fn parse<F: FromFields<'a>>(&self) -> Result<F, RecordingError> {
        let malformed = || {
            let found = format!("a record of {} bytes with fields that do not fit", self.body.len());
            RecordingError::malformed(self.at, found, format!("the fields of an MCAP {} record", F::NAME))
        };
        F::parse(self.body).ok_or_else(malformed)
    }
}

/// Hands out the records of a file, those in chunks too.
pub(super) struct Framing<R> {
    source: R,
    position: u64,
    /// The outer record at hand.
    body: Vec<u8>,
    body_at: u64,
    /// What is left of the chunk at hand, as a part of `body`.
    chunk: Range<usize>,
    /// Of the file up to here; nothing after the data section.
    checksum: Option<crc32fast::Hasher>,
    /// Set at the end; whether the file stops short.
    end: Option<bool>,
}

impl<R: Read> Framing<R> {
    /// Reads the file's first bytes.
    pub(super) fn new(source: R) -> Result<Self, RecordingError> {
        let mut framing = Self {
            source,
            position: 0,
            body: Vec::new(),
            body_at: 0,
            chunk: 0..0,
            checksum: Some(crc32fast::Hasher::new()),
            end: None,
        };
        framing.read(mcap::MAGIC.len() as u64)?;
        if framing.body != mcap::MAGIC {
            return Err(RecordingError::foreign("another kind of file", "an MCAP file"));
        }
        framing.count_in_checksum(mcap::MAGIC);
        Ok(framing)
    }

    /// Bytes read so far.
    pub(super) fn position(&self) -> u64 {
        self.position
    }

    /// Whether the file stopped short of its end.
    pub(super) fn ended_abruptly(&self) -> bool {
        self.end == Some(true)
    }

    /// The next record; nothing at the end of the file.
    pub(super) fn next_record(&mut self) -> Result<Option<RawRecord<'_>>, RecordingError> {
        loop {
            if !self.chunk.is_empty() {
                return self.next_in_chunk();
            }
            if self.end.is_some() {
                return Ok(None);
            }
            if let Some(opcode) = self.next_outer()? {
                return Ok(Some(RawRecord { at: self.body_at, opcode, body: &self.body }));
            }
        }
    }

    /// Reads one outer record into `body`: its opcode, or nothing when this layer itself takes it.
    fn next_outer(&mut self) -> Result<Option<u8>, RecordingError> {
        self.body_at = self.position;
        self.read(HEAD_BYTES as u64)?;
        let Some((&opcode, length)) = self.body.split_first().filter(|_| self.body.len() == HEAD_BYTES)
        else {
            self.end = Some(true);
            return Ok(None);
        };
        let length = little_endian(length);
        if length > LONGEST_RECORD || opcode == 0 {
            let found = format!("a record with opcode {opcode:#04x} of {length} bytes");
            let expected = format!("an MCAP record of at most {LONGEST_RECORD} bytes");
            return Err(RecordingError::malformed(self.body_at, found, expected));
        }
        if opcode == op::DATA_END {
            return self.end_data(length).map(|()| None);
        }
        let head = [&[opcode], length.to_le_bytes().as_slice()].concat();
        self.count_in_checksum(&head);
        self.read(length)?;
        let is_whole = self.body.len() as u64 == length;
        self.count_body_in_checksum();
        match opcode {
            op::CHUNK => self.open_chunk(is_whole).map(|()| None),
            op::FOOTER => self.end_file(is_whole).map(|()| None),
            _ if !is_whole => {
                self.end = Some(true);
                Ok(None)
            }
            // What follows the data section repeats it.
            _ => Ok(self.checksum.is_some().then_some(opcode)),
        }
    }

    fn end_data(&mut self, length: u64) -> Result<(), RecordingError> {
        let calculated = self.checksum.take().map(crc32fast::Hasher::finalize);
        self.read(length)?;
        if (self.body.len() as u64) < length {
            self.end = Some(true);
            return Ok(());
        }
        let Some(saved) = self.body.first_chunk().map(|bytes| u32::from_le_bytes(*bytes)) else {
            return Err(RecordingError::malformed(self.body_at, "no checksum", "the data section's"));
        };
        match calculated {
            Some(calculated) if saved != 0 && saved != calculated => {
                let found = format!("a data section with checksum {calculated:08x}");
                Err(RecordingError::malformed(self.body_at, found, format!("{saved:08x}")))
            }
            _ => Ok(()),
        }
    }

    fn end_file(&mut self, footer_is_whole: bool) -> Result<(), RecordingError> {
        let at = self.position;
        self.read(mcap::MAGIC.len() as u64 + 1)?;
        if footer_is_whole && self.body.len() >= mcap::MAGIC.len() && self.body != mcap::MAGIC {
            let found = format!("{:02x?} after the footer", self.body);
            return Err(RecordingError::malformed(at, found, "MCAP's closing bytes and the end"));
        }
        self.end = Some(self.body != mcap::MAGIC);
        Ok(())
    }

    /// Makes the records of the chunk in `body` the next ones. Of a chunk that the end of the file cuts off, those
    /// that are there: no checksum vouches for them.
    fn open_chunk(&mut self, is_whole: bool) -> Result<(), RecordingError> {
        if !is_whole {
            self.end = Some(true);
        }
        let malformed =
            |found: String, expected: &str| RecordingError::malformed(self.body_at, found, expected);
        let Some(header) = ChunkHeader::read(&self.body) else {
            let found = format!("a chunk of {} bytes", self.body.len());
            return if is_whole { Err(malformed(found, "one with a whole header")) } else { Ok(()) };
        };
        if header.is_compressed {
            return Err(malformed("a compressed chunk".to_owned(), "uncompressed chunks"));
        }
        let records = self.body.len() - header.length;
        let Some(end) = usize::try_from(header.size).ok().filter(|&size| size <= records) else {
            if is_whole {
                let found = format!("a chunk that announces {} bytes and has {records}", header.size);
                return Err(malformed(found, "as many as announced"));
            }
            self.chunk = header.length..self.body.len();
            return Ok(());
        };
        let chunk = header.length..header.length + end;
        let calculated = crc32fast::hash(&self.body[chunk.clone()]);
        if header.checksum != 0 && header.checksum != calculated {
            let found = format!("a chunk with checksum {calculated:08x}");
            return Err(malformed(found, &format!("{:08x}", header.checksum)));
        }
        self.chunk = chunk;
        Ok(())
    }

    fn next_in_chunk(&mut self) -> Result<Option<RawRecord<'_>>, RecordingError> {
        let at = self.body_at + (HEAD_BYTES + self.chunk.start) as u64;
        let rest = &self.body[self.chunk.clone()];
        let head = rest.split_at_checked(HEAD_BYTES);
        let length = head.and_then(|(head, _)| usize::try_from(little_endian(&head[1..])).ok());
        let body = head.zip(length).and_then(|((_, rest), length)| rest.get(..length));
        let (Some(&opcode), Some(body)) = (rest.first(), body) else {
            self.chunk = 0..0;
            if self.end == Some(true) {
                return Ok(None);
            }
            return Err(RecordingError::malformed(
                at,
                "a record that reaches beyond its chunk",
                "a whole one",
            ));
        };
        self.chunk.start += HEAD_BYTES + body.len();
        Ok(Some(RawRecord { at, opcode, body }))
    }

    /// Reads `length` bytes into `body`, or as many as there are. Memory grows with what is there only.
    fn read(&mut self, length: u64) -> Result<(), RecordingError> {
        self.body.clear();
        let read: io::Result<usize> = self.source.by_ref().take(length).read_to_end(&mut self.body);
        self.position += self.body.len() as u64;
        read.map(drop).map_err(|source| RecordingError::Read { at: self.position, source })
    }

    fn count_in_checksum(&mut self, bytes: &[u8]) {
        if let Some(checksum) = &mut self.checksum {
            checksum.update(bytes);
        }
    }

    fn count_body_in_checksum(&mut self) {
        if let Some(checksum) = &mut self.checksum {
            checksum.update(&self.body);
        }
    }
}

struct ChunkHeader {
    checksum: u32,
    is_compressed: bool,
    /// Of the records, bytes.
    size: u64,
    /// Of this header, bytes.
    length: usize,
}

impl ChunkHeader {
    fn read(body: &[u8]) -> Option<Self> {
        let fixed = body.get(..CHUNK_HEADER_BYTES)?;
        let checksum = little_endian(&fixed[24..28]) as u32;
        let name = little_endian(&fixed[28..32]) as usize;
        let size_at = CHUNK_HEADER_BYTES.checked_add(name)?;
        let length = size_at.checked_add(size_of::<u64>())?;
        let size = little_endian(body.get(size_at..length)?);
        Some(Self { checksum, is_compressed: name > 0, size, length })
    }
}

/// Of at most eight bytes.
fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}
