//! What is recorded comes back bit for bit, and no file, however damaged, does harm.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::common::{any_item, bytes, header, record, session};
use cotouch_runtime::{
    MAX_MESSAGE_BYTES, Note, RecordError, RecordItem, RecordKind, RecordSink, Recorder, Recording,
    RecordingError, RecordingReader, record_ring,
};
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::LocalTime;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_items_come_back_bit_for_bit(items in prop::collection::vec(any_item(), 0..12)) {
        let recording = Recording::read(&record(&items)[..]).unwrap();
        prop_assert_eq!(bytes(&recording.items), bytes(&items));
        prop_assert_eq!(recording.header, header());
        prop_assert!(!recording.end.ended_abruptly);
        prop_assert_eq!(recording.end.summary.unwrap().items, items.len() as u64);
    }

    #[test]
    fn the_ring_changes_nothing(items in prop::collection::vec(any_item(), 0..30)) {
        let (mut producer, mut consumer) = record_ring(HostIndex(0), 1 << 20);
        items.iter().for_each(|item| producer.record(item));
        let mut out = Vec::new();
        consumer.drain(&mut out);
        prop_assert_eq!(bytes(&out), bytes(&items));
    }

    #[test]
    fn foreign_bytes_are_refused(foreign in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Recording::read(&foreign[..]).is_err());
        let with_magic = [mcap::MAGIC, &foreign].concat();
        prop_assert!(Recording::read(&with_magic[..]).is_err());
    }
}

#[test]
fn the_same_items_give_the_same_bytes() {
    assert_eq!(record(&session(1200)), record(&session(1200)));
}

#[test]
fn a_file_cut_off_anywhere_gives_its_whole_items() {
    let items = session(600);
    let whole = record(&items);
    let all = bytes(&items);
    let mut cuts: BTreeSet<usize> = (0..200).chain((0..whole.len()).step_by(997)).collect();
    cuts.extend(whole.len() - 200..whole.len());
    for (start, end) in chunks(&whole) {
        cuts.extend(start - 20..start + 60);
        cuts.extend(end - 20..end + 20);
    }
    let mut before = 0;
    for cut in cuts.into_iter().filter(|&cut| cut < whole.len()) {
        let Ok(recording) = Recording::read(&whole[..cut]) else {
            assert_eq!(before, 0, "after the header no cut is an error: {cut}");
            continue;
        };
        assert!(recording.end.ended_abruptly, "{cut}");
        assert_eq!(bytes(&recording.items), all[..recording.items.len()], "{cut}");
        assert!(recording.items.len() >= before, "{cut}");
        before = recording.items.len();
    }
    assert_eq!(before, items.len());
}

#[test]
fn a_flipped_bit_is_found_or_changes_nothing() {
    let items = session(40);
    let whole = record(&items);
    let all = bytes(&items);
    let mut found = 0;
    for place in (0..whole.len()).step_by(7) {
        let mut damaged = whole.clone();
        damaged[place] ^= 1 << (place % 8);
        match Recording::read(&damaged[..]) {
            Ok(recording) => assert_eq!(bytes(&recording.items), all[..recording.items.len()], "{place}"),
            Err(RecordingError::Malformed { at, .. }) => {
                assert!(at <= whole.len() as u64);
                found += 1;
            }
            Err(_) => found += 1,
        }
    }
    assert!(found > whole.len() / 14, "{found} of {}", whole.len());
}

/// Damage that the checksums vouch for: only a hostile writer makes it.
#[test]
fn hostile_lengths_cost_no_memory_and_name_their_place() {
    let whole = record(&session(2));
    // The first record in the file after the magic: claims to be almost endless.
    let mut endless = whole.clone();
    endless[9..17].copy_from_slice(&(u64::MAX - 3).to_le_bytes());
    let error = Recording::read(&endless[..]).unwrap_err().to_string();
    assert!(error.contains("damaged at byte 8"), "{error}");

    let header_at = whole.windows(14).position(|window| window == b"cotouch.header").unwrap();
    let mut long_text = whole.clone();
    long_text[header_at - 4..header_at].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = Recording::read(&long_text[..]).unwrap_err().to_string();
    assert!(error.contains("Metadata"), "{error}");
}

#[test]
fn missing_items_are_noticed() {
    let items = session(1100);
    let whole = record(&items);
    // Without the second chunk that holds items the numbers have a gap.
    let chunks = chunks(&whole);
    let (start, end) = chunks[2];
    let without = [&whole[..start], &whole[end..]].concat();
    let error = Recording::read(&without[..]).unwrap_err().to_string();
    assert!(error.contains("expected item") || error.contains("channel"), "{error}");
}

/// Where the chunks of an undamaged file lie.
fn chunks(file: &[u8]) -> Vec<(usize, usize)> {
    let mut at = mcap::MAGIC.len();
    let mut chunks = Vec::new();
    while at + 9 <= file.len() {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        if file[at] == mcap::records::op::CHUNK {
            chunks.push((at, at + 9 + length));
        }
        at += 9 + length;
    }
    chunks
}

#[test]
fn half_a_second_of_the_session_is_on_disk_without_an_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.mcap");
    let mut recorder = Recorder::create(&path, &header()).unwrap();
    let items = session(3000);
    for item in &items {
        recorder.write(item).unwrap();
        if item.tick.is_multiple_of(100) {
            let recording = Recording::open(&path).unwrap();
            assert!(recording.end.ended_abruptly && recording.end.summary.is_none());
            let last = recording.items.last().map_or(0, |item| item.tick);
            assert!(item.tick - last <= 513, "{last} at {}", item.tick);
        }
    }
    drop(recorder);
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.items, items);
    assert!(recording.end.ended_abruptly, "nobody finished it");
}

#[test]
fn the_clock_flushes_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("slow.mcap");
    let mut recorder = Recorder::create(&path, &header()).unwrap();
    recorder.poll(LocalTime(77)).unwrap();
    recorder.write(&session(1)[0]).unwrap();
    recorder.poll(LocalTime(400_000_000)).unwrap();
    assert_eq!(Recording::open(&path).unwrap().items.len(), 0);
    recorder.poll(LocalTime(500_000_077)).unwrap();
    assert_eq!(Recording::open(&path).unwrap().items.len(), 1);
}

#[test]
fn what_was_dropped_is_counted_in_the_summary() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gaps.mcap");
    let mut recorder = Recorder::create(&path, &header()).unwrap();
    let (mut producer, mut consumer) = record_ring(HostIndex(0), 2000);
    session(20).iter().for_each(|item| producer.record(item));
    drop(producer);
    consumer.drain(&mut recorder);
    let summary = recorder.finish(BTreeMap::new()).unwrap();
    assert!(summary.dropped > 0 && summary.dropped == consumer.dropped());
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.end.summary, Some(summary.clone()));
    let gaps = recording.items.iter().map(|item| match item.kind {
        RecordKind::Note(Note::Dropped { items }) => items,
        _ => 0,
    });
    assert_eq!(gaps.sum::<u64>(), summary.dropped);
}

#[test]
fn what_cannot_be_written_is_said_in_words() {
    let missing = Path::new("/nowhere/at/all.mcap");
    let error = Recorder::create(missing, &header()).err().unwrap();
    assert!(matches!(error, RecordError::Create { .. }));
    let text = error.to_string();
    assert!(text.starts_with("cannot create the recording /nowhere/at/all.mcap: No such file"), "{text}");
    assert!(matches!(Recording::open(missing), Err(RecordingError::Open { .. })));

    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(&folder.path().join("x.mcap"), &header()).unwrap();
    let kind = RecordKind::State(vec![0; MAX_MESSAGE_BYTES + 1]);
    recorder.record(&RecordItem { host: HostIndex(0), tick: 9, kind });
    let error = recorder.finish(BTreeMap::new()).unwrap_err();
    assert!(matches!(error, RecordError::TooLong { tick: 9, .. }));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_in_words() {
    let error = Recorder::create(Path::new("/dev/full"), &header()).err().unwrap().to_string();
    assert!(error.starts_with("cannot write on the recording /dev/full: "), "{error}");
    assert!(error.contains("No space left"), "{error}");
}

#[test]
fn other_layouts_are_named() {
    let mut other = record(&session(1));
    let key = b"\x06\0\0\0format\x01\0\0\0";
    let at = other.windows(key.len()).position(|window| window == key).unwrap();
    other[at + key.len()] = b'9';
    let error = Recording::read(&other[..]).unwrap_err().to_string();
    assert!(error.contains("found layout \"9\", expected layout \"4\""), "{error}");
}

#[test]
fn a_reader_streams() {
    let whole = record(&session(10));
    let mut reader = RecordingReader::new(&whole[..]).unwrap();
    assert_eq!(reader.header().facts["seed"], "7");
    assert!(reader.end().is_none());
    assert!(reader.by_ref().all(|item| item.is_ok()));
    assert_eq!(reader.end().unwrap().summary.as_ref().unwrap().facts["stable"], "true");
}
