//! The way of a recording's items out of the haptic thread: a ring of bytes with one writer and one reader.
//!
//! Each item stands in the ring as its length (4 bytes, little-endian) and its postcard encoding, and appears to the
//! reader all at once. A full ring never makes the haptic thread wait: the item is counted as dropped, and as soon as
//! there is room again a [`Note::Dropped`] stands where the missing items would have stood.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cotouch_scene::names::HostIndex;

use crate::record::{Note, RecordItem, RecordKind};

/// Bytes that wait for the recorder at most, by default: several seconds of a host with a few fingers and bodies.
pub const RECORD_RING_BYTES: usize = 4 << 20;

/// Longest item, in bytes, and so most of what a producer keeps besides the ring: a host's whole state with 16 users
/// and the longest play-out fits.
const LONGEST_ITEM: usize = 2 << 20;

const LENGTH_BYTES: usize = size_of::<u32>();

/// Takes a recording's items in their order.
pub trait RecordSink {
    /// Takes one item. Losing one is the sink's to count; it cannot fail the one who records.
    fn record(&mut self, item: &RecordItem);
}

/// A sink that keeps nothing.
impl RecordSink for () {
    fn record(&mut self, _: &RecordItem) {}
}

/// Everything, kept in memory.
impl RecordSink for Vec<RecordItem> {
    fn record(&mut self, item: &RecordItem) {
        self.push(item.clone());
    }
}

impl<S: RecordSink + ?Sized> RecordSink for &mut S {
    fn record(&mut self, item: &RecordItem) {
        (**self).record(item);
    }
}

/// Both ends of a ring of `capacity_bytes` for the items of `host`.
///
/// The memory is touched here, so that the haptic thread meets no page fault.
#[must_use]
pub fn record_ring(host: HostIndex, capacity_bytes: usize) -> (RecordProducer, RecordConsumer) {
    let (mut producer, mut consumer) = rtrb::RingBuffer::new(capacity_bytes);
    while producer.push(1).is_ok() {}
    while consumer.pop().is_ok() {}
    let dropped = Arc::new(AtomicU64::new(0));
    let scratch = vec![1; LONGEST_ITEM.min(capacity_bytes)].into_boxed_slice();
    (
        RecordProducer { ring: producer, scratch, dropped: Arc::clone(&dropped), unnoted: 0 },
        RecordConsumer { ring: consumer, frame: Vec::new(), dropped, noted: 0, host, last_tick: 0 },
    )
}

/// The haptic thread's end.
#[derive(Debug)]
pub struct RecordProducer {
    ring: rtrb::Producer<u8>,
    scratch: Box<[u8]>,
    dropped: Arc<AtomicU64>,
    unnoted: u64,
}

impl RecordProducer {
    /// Items that found no room so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Pushes the items that come next, all of them or none.
    fn push(&mut self, items: &[&RecordItem]) -> bool {
        let mut end = 0;
        for item in items {
            match frame(item, &mut self.scratch[end..]) {
                Some(length) => end += length,
                None => return false,
            }
        }
        self.ring.push_entire_slice(&self.scratch[..end]).is_ok()
    }
}

impl RecordSink for RecordProducer {
    /// No allocation, no lock, no system call; two copies of the item's bytes.
    fn record(&mut self, item: &RecordItem) {
        // Behind a gap nothing may follow without a note, or the gap would seem to lie elsewhere; and a note without
        // the item behind it would fill the ring with notes.
        let note = RecordKind::Note(Note::Dropped { items: self.unnoted });
        let note = RecordItem { host: item.host, tick: item.tick, kind: note };
        let pushed = if self.unnoted > 0 { self.push(&[&note, item]) } else { self.push(&[item]) };
        if pushed {
            self.unnoted = 0;
        } else {
            self.unnoted += 1;
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Writes an item's length and encoding at the start of `out`, and says how many bytes that took.
fn frame(item: &RecordItem, out: &mut [u8]) -> Option<usize> {
    let (prefix, body) = out.split_at_mut_checked(LENGTH_BYTES)?;
    let body = postcard::to_slice(item, body).ok()?;
    prefix.copy_from_slice(&u32::try_from(body.len()).ok()?.to_le_bytes());
    Some(LENGTH_BYTES + body.len())
}

/// The recorder thread's end.
#[derive(Debug)]
pub struct RecordConsumer {
    ring: rtrb::Consumer<u8>,
    frame: Vec<u8>,
    dropped: Arc<AtomicU64>,
    noted: u64,
    host: HostIndex,
    last_tick: u64,
}

impl RecordConsumer {
    /// Items that found no room in the ring so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Whether the producer is gone: what can still be drained is all that there is.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }

    /// Hands everything that waits to `sink`, in order; how many items. Once the producer is gone, a gap at the very
    /// end is noted too.
    pub fn drain(&mut self, sink: &mut impl RecordSink) -> usize {
        let was_abandoned = self.is_abandoned();
        let mut items = 0;
        while let Some(item) = self.pop() {
            self.remember(&item);
            sink.record(&item);
            items += 1;
        }
        if was_abandoned && self.dropped() > self.noted {
            let item = self.note_of_the_last_gap();
            self.remember(&item);
            sink.record(&item);
            items += 1;
        }
        items
    }

    fn remember(&mut self, item: &RecordItem) {
        self.last_tick = item.tick;
        if let RecordKind::Note(Note::Dropped { items }) = item.kind {
            self.noted = self.noted.saturating_add(items);
        }
    }

    fn note_of_the_last_gap(&self) -> RecordItem {
        let kind = RecordKind::Note(Note::Dropped { items: self.dropped().saturating_sub(self.noted) });
        RecordItem { host: self.host, tick: self.last_tick, kind }
    }

    fn pop(&mut self) -> Option<RecordItem> {
        let mut prefix = [0; LENGTH_BYTES];
        self.ring.pop_entire_slice(&mut prefix).ok()?;
        self.frame.resize(u32::from_le_bytes(prefix) as usize, 0);
        // The producer puts a frame into the ring all at once, and only frames that it encoded itself.
        self.ring.pop_entire_slice(&mut self.frame).expect("a frame is in the ring as a whole");
        Some(postcard::from_bytes(&self.frame).expect("what was encoded decodes"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::TickRecord;

    fn tick(tick: u64) -> RecordItem {
        RecordItem { host: HostIndex(1), tick, kind: RecordKind::Tick(TickRecord::default()) }
    }

    #[test]
    fn items_come_out_in_order_around_the_ring() {
        let (mut producer, mut consumer) = record_ring(HostIndex(1), 2000);
        let mut out = Vec::new();
        for index in 0..1000 {
            producer.record(&tick(index));
            if index % 3 == 2 {
                consumer.drain(&mut out);
            }
        }
        consumer.drain(&mut out);
        assert_eq!(out, (0..1000).map(tick).collect::<Vec<_>>());
        assert_eq!((producer.dropped(), consumer.dropped()), (0, 0));
    }

    #[test]
    fn a_gap_is_noted_where_it_is_and_counted() {
        let (mut producer, mut consumer) = record_ring(HostIndex(1), 1500);
        (0..100).for_each(|index| producer.record(&tick(index)));
        let mut out = Vec::new();
        consumer.drain(&mut out);
        let before = out.len() as u64;
        assert!(before > 0 && producer.dropped() == 100 - before);
        producer.record(&tick(100));
        (101..200).for_each(|index| producer.record(&tick(index)));
        consumer.drain(&mut out);
        let note = |tick, items| RecordItem {
            host: HostIndex(1),
            tick,
            kind: RecordKind::Note(Note::Dropped { items }),
        };
        assert_eq!(out[before as usize], note(100, 100 - before));
        assert_eq!(out[before as usize + 1], tick(100));

        let last = out.last().unwrap().tick;
        drop(producer);
        consumer.drain(&mut out);
        assert_eq!(*out.last().unwrap(), note(last, 199 - last));
        let length = out.len();
        consumer.drain(&mut out);
        assert_eq!(out.len(), length);
    }

    #[test]
    fn an_item_that_never_fits_is_a_gap_and_no_more() {
        let (mut producer, mut consumer) = record_ring(HostIndex(1), 3000);
        producer.record(&RecordItem { host: HostIndex(1), tick: 4, kind: RecordKind::State(vec![7; 5000]) });
        producer.record(&tick(5));
        let mut out = Vec::new();
        consumer.drain(&mut out);
        assert!(matches!(out[0].kind, RecordKind::Note(Note::Dropped { items: 1 })));
        assert_eq!(out[1], tick(5));
        let (mut tiny, _consumer) = record_ring(HostIndex(1), 0);
        tiny.record(&tick(0));
        assert_eq!(tiny.dropped(), 1);
    }
}
