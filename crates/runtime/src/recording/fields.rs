//! The fields of the MCAP records that a recording needs (<https://mcap.dev/spec#records>).

use std::collections::BTreeMap;

/// What is left of a record.
pub(super) struct Fields<'a>(&'a [u8]);

/// The part of a schema that tells what it is.
pub(super) struct Schema<'a> {
    pub(super) id: u16,
    pub(super) name: &'a str,
    pub(super) encoding: &'a str,
}

/// A channel, without its metadata.
pub(super) struct Channel<'a> {
    pub(super) id: u16,
    pub(super) schema_id: u16,
    pub(super) topic: &'a str,
    pub(super) message_encoding: &'a str,
}

/// A message, without its times.
pub(super) struct Message<'a> {
    pub(super) channel_id: u16,
    pub(super) sequence: u32,
    pub(super) data: &'a [u8],
}

/// A record of names and values.
pub(super) struct Metadata<'a> {
    pub(super) name: &'a str,
    pub(super) entries: BTreeMap<&'a str, &'a str>,
}

/// Reads a record's body; nothing when it does not hold what such a record must.
pub(super) trait FromFields<'a>: Sized {
    /// What the record is called in the specification.
    const NAME: &'static str;

    fn from_fields(fields: &mut Fields<'a>) -> Option<Self>;

    fn parse(body: &'a [u8]) -> Option<Self> {
        Self::from_fields(&mut Fields(body))
    }
}

impl<'a> FromFields<'a> for Schema<'a> {
    const NAME: &'static str = "Schema";

    fn from_fields(fields: &mut Fields<'a>) -> Option<Self> {
        Some(Self { id: fields.u16()?, name: fields.text()?, encoding: fields.text()? })
    }
}

impl<'a> FromFields<'a> for Channel<'a> {
    const NAME: &'static str = "Channel";

    fn from_fields(fields: &mut Fields<'a>) -> Option<Self> {
        Some(Self {
            id: fields.u16()?,
            schema_id: fields.u16()?,
            topic: fields.text()?,
            message_encoding: fields.text()?,
        })
    }
}

impl<'a> FromFields<'a> for Message<'a> {
    const NAME: &'static str = "Message";

    fn from_fields(fields: &mut Fields<'a>) -> Option<Self> {
        let (channel_id, sequence) = (fields.u16()?, fields.u32()?);
        let _log_and_publish_time = fields.take(16)?;
        Some(Self { channel_id, sequence, data: fields.0 })
    }
}

impl<'a> FromFields<'a> for Metadata<'a> {
    const NAME: &'static str = "Metadata";

    fn from_fields(fields: &mut Fields<'a>) -> Option<Self> {
        let name = fields.text()?;
        let length = fields.u32()? as usize;
        let mut rest = Fields(fields.take(length)?);
        let mut entries = BTreeMap::new();
        while !rest.0.is_empty() {
            entries.insert(rest.text()?, rest.text()?);
        }
        Some(Self { name, entries })
    }
}

impl<'a> Fields<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.take(2)?.try_into().ok()?))
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }
}
