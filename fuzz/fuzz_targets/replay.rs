//! Any bytes as a recording that is replayed: what came of it or an error, never a panic, whatever scene, states and
//! packets they hold.
#![no_main]

use cotouch_runtime::{RecordingReader, replay};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(recording) = RecordingReader::new(bytes) {
        let _ = replay(recording, |_| {});
    }
});
