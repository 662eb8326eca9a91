//! Any reader of MCAP and protobuf can show a recording: this one knows nothing but what stands in the file.

use std::collections::BTreeSet;

use crate::common::{record, session, tick_record};
use cotouch_scene::time::Rate;
use prost_reflect::{DescriptorPool, DynamicMessage, Value};

fn decode(message: &mcap::Message<'_>) -> DynamicMessage {
    let schema = message.channel.schema.as_ref().unwrap();
    assert_eq!(
        (schema.encoding.as_str(), message.channel.message_encoding.as_str()),
        ("protobuf", "protobuf")
    );
    let pool = DescriptorPool::decode(&schema.data[..]).unwrap();
    let descriptor = pool.get_message_by_name(&schema.name).unwrap();
    DynamicMessage::decode(descriptor, &message.data[..]).unwrap()
}

fn number(message: &DynamicMessage, path: &str) -> f64 {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let value = message.get_field_by_name(first).unwrap();
    match (value.as_ref(), rest.split_once('.')) {
        (Value::List(elements), Some((index, rest))) => {
            number(elements[index.parse::<usize>().unwrap()].as_message().unwrap(), rest)
        }
        (Value::Message(inner), _) => number(inner, rest),
        (Value::U32(whole), _) => f64::from(*whole),
        (value, _) => value.as_f64().unwrap(),
    }
}

#[test]
fn a_generic_reader_reads_everything() {
    let file = record(&session(20));
    let mut topics = BTreeSet::new();
    let mut ticks = 0;
    for message in mcap::MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        topics.insert(message.channel.topic.clone());
        let decoded = decode(&message);
        if message.channel.topic == "/host2/tick" {
            let expected = tick_record(ticks);
            let number = |path| number(&decoded, path);
            assert_eq!(number("fingers.0.pose.position_m.x"), expected.readings[0].pose.position.x);
            assert_eq!(number("bodies.0.twist.linear_m_per_s.x"), expected.bodies[0].twist.linear.x);
            assert_eq!(number("body_wrenches.0.force_n.x"), -1.5);
            assert_eq!(number("contacts.0.host"), 8.0);
            assert_eq!(message.log_time, Rate::new(1024, 1).unwrap().instant(ticks).0 as u64);
            ticks += 1;
        }
    }
    assert_eq!(ticks, 20);
    let hosts = ["host1", "host2"];
    let streams = ["events", "received", "sent", "state", "tick"];
    let mut expected: BTreeSet<_> =
        hosts.iter().flat_map(|host| streams.map(|stream| format!("/{host}/{stream}"))).collect();
    expected.insert("/session/scene".to_owned());
    assert_eq!(topics, expected);
}

#[test]
fn the_index_and_the_metadata_are_there() {
    let file = record(&session(2000));
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let statistics = summary.stats.unwrap();
    assert_eq!(statistics.metadata_count, 2);
    assert!(statistics.chunk_count >= 4);
    assert_eq!(summary.chunk_indexes.len(), statistics.chunk_count as usize);
    let names: Vec<_> = summary.metadata_indexes.iter().map(|index| index.name.as_str()).collect();
    assert_eq!(names, ["cotouch.header", "cotouch.summary"]);
}
