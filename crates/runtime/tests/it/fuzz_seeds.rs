//! Fuzzing begins with `fuzz/seeds`: packets and recordings that must stay what this version reads, or the targets see
//! nothing. `cargo test -p cotouch-runtime --test it fuzz_seeds -- --ignored` makes them anew.

use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use cotouch_net::{
    Control, Entry, Join, MAX_DATAGRAM, PeerId, ProbeConfig, Prober, Roster, StatePacket, Text,
    decode_control, decode_state, encode_control, encode_state, reflect_probe,
};
use cotouch_runtime::{RecordingReader, replay, virtual_run};
use cotouch_scene::geometry::{Pose, Twist};
use cotouch_scene::load;
use cotouch_scene::names::HostIndex;
use cotouch_scene::time::{LocalTime, SessionTime};
use mcap::records::Record;
use mcap::write::NoSeek;

/// So many items of a recording show one of each stream.
const ITEMS: usize = 24;

fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target)
}

fn seeds(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let read = |entry: std::io::Result<fs::DirEntry>| {
        let path = entry.unwrap().path();
        let bytes = fs::read(&path).unwrap();
        (path, bytes)
    };
    let seeds: Vec<_> = fs::read_dir(folder(target)).unwrap().map(read).collect();
    assert!(!seeds.is_empty());
    seeds
}

fn is_datagram(bytes: &[u8]) -> bool {
    decode_state(bytes).is_ok() || decode_control(bytes).is_ok()
}

#[test]
fn every_datagram_is_read() {
    for (path, bytes) in seeds("wire") {
        assert!(is_datagram(&bytes), "{}", path.display());
    }
    for (path, bytes) in seeds("session") {
        let mut rest = &bytes[..];
        let mut datagrams = 0;
        while let [_, _, length, tail @ ..] = rest {
            let (piece, tail) = tail.split_at(usize::from(*length));
            assert!(piece.is_empty() || is_datagram(piece), "{}", path.display());
            datagrams += usize::from(!piece.is_empty());
            rest = tail;
        }
        assert!(datagrams > 0, "{}", path.display());
    }
    for (path, bytes) in seeds("probe") {
        assert!(reflect_probe(&bytes).is_some(), "{}", path.display());
    }
}

#[test]
fn every_recording_replays() {
    for (path, bytes) in seeds("recording") {
        let replayed = replay(RecordingReader::new(&bytes[..]).unwrap(), |_| {}).unwrap();
        assert!(replayed.comparison.identical() && replayed.comparison.ticks > 0, "{}", path.display());
        assert!(replayed.ended_abruptly);
    }
}

#[test]
#[ignore = "writes into fuzz/seeds"]
fn write_them_anew() {
    let write = |target: &str, name: &str, bytes: &[u8]| {
        fs::create_dir_all(folder(target)).unwrap();
        fs::write(folder(target).join(name), bytes).unwrap();
    };
    for (name, bytes) in datagrams() {
        write("wire", name, &bytes);
        write("session", name, &in_session(&bytes));
        write("secure", name, &through_a_channel(&bytes));
    }
    write("probe", "probe", &probe());
    for scene in ["single-axis", "single-axis-centralized", "grasp", "spring"] {
        write("recording", scene, &recording(scene));
    }
}

fn datagrams() -> Vec<(&'static str, Vec<u8>)> {
    let hand = Entry::Hand { point: 0, pose: Pose::default(), twist: Twist::default() };
    let object = Entry::Object { object: 0, pose: Pose::default(), twist: Twist::default() };
    let packet = StatePacket { step: 40, entries: [hand, object].into_iter().collect() };
    let mut state = [0; MAX_DATAGRAM];
    let length = encode_state(1, HostIndex(1), SessionTime(0), &packet, &mut state).unwrap();
    let join = Join {
        cookie: 0,
        scene_hash: 1,
        control_hz: "1024".parse().unwrap(),
        network_hz: "128".parse().unwrap(),
        name: None,
        padding: Default::default(),
    };
    let controls = [
        ("join", Control::Join(join)),
        ("roster", Control::Roster(Roster::default())),
        ("roster-received", Control::RosterReceived { revision: 1 }),
        ("ping", Control::Ping { id: PeerId(1), sent_ns: 0, ready: true }),
        ("leave", Control::Leave { id: PeerId(1), reason: Text::from("done").unwrap() }),
        ("scene-request", Control::SceneRequest { offset: 0, padding: [0; 64].into_iter().collect() }),
    ];
    let control = |(name, control): (_, Control)| {
        (name, encode_control(1, Some(HostIndex(1)), &control).unwrap().to_vec())
    };
    [("state", state[..length].to_vec())].into_iter().chain(controls.map(control)).collect()
}

/// Pieces of the target: three seconds in which the session begins, then the datagram with its peers' header to the
/// server and to the client.
fn in_session(datagram: &[u8]) -> Vec<u8> {
    const WAIT: [u8; 3] = [0b110, 250, 0];
    let length = datagram.len().try_into().unwrap();
    let mut bytes = WAIT.repeat(12);
    for what in [0b011, 0b101] {
        bytes.extend([what, 8, length]);
        bytes.extend(datagram);
    }
    bytes
}

/// Pieces of the target: the datagram from a stranger, through the channel, and over what comes through it, at its start and further on.
fn through_a_channel(datagram: &[u8]) -> Vec<u8> {
    let length = datagram.len().try_into().unwrap();
    let mut bytes = Vec::new();
    for what in [0b00, 0b10, 0b01, 14 << 2 | 0b01, 0b11] {
        bytes.extend([what, 8, length]);
        bytes.extend(datagram);
    }
    bytes
}

fn probe() -> Vec<u8> {
    let rate_hz = "100".parse().unwrap();
    let config = ProbeConfig { rate_hz, duration_s: 0.1, datagram_bytes: 64, linger_s: 1.0, id: 0 };
    let target: SocketAddr = "10.0.0.1:1".parse().unwrap();
    let mut prober = Prober::new(config, target.into(), LocalTime(0));
    prober.poll_transmit(LocalTime(0)).unwrap().bytes.to_vec()
}

/// The beginning of a run's recording, without checksums, which no fuzzer guesses, and without the schemas' content,
/// which no reader of ours looks at.
fn recording(scene: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    virtual_run::run(&load(scene, &[]).unwrap(), 0.02, Some(&path), |_| true).unwrap();
    let file = fs::read(&path).unwrap();
    let options = mcap::WriteOptions::new()
        .compression(None)
        .disable_seeking(true)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .emit_summary_records(false)
        .emit_summary_offsets(false)
        .emit_message_indexes(false);
    let mut writer = options.create(NoSeek::new(Vec::new())).unwrap();
    let mut items = 0;
    for record in mcap::read::ChunkFlattener::new(&file).unwrap() {
        match record.unwrap() {
            Record::Metadata(header) if header.name == "cotouch.header" => {
                writer.write_metadata(&header).unwrap();
            }
            Record::Schema { header, .. } => {
                writer.add_schema_with_id(header.id, &header.name, &header.encoding, &[]).unwrap();
            }
            Record::Channel(channel) if channel.topic != "/session/scene" => {
                let (id, schema) = (channel.id, channel.schema_id);
                let (topic, encoding) = (&channel.topic, &channel.message_encoding);
                writer.add_channel_with_id(id, schema, topic, encoding, &channel.metadata).unwrap();
            }
            Record::Message { header, data } if header.sequence > 0 && items < ITEMS => {
                items += 1;
                writer.write_to_known_channel(&header, &data).unwrap();
            }
            _ => {}
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}
