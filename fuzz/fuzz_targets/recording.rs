//! Any bytes as a recording: items, an end or an error, never a panic and never more memory than bytes.
#![no_main]

use cotouch_runtime::RecordingReader;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    for start in [&[][..], mcap::MAGIC] {
        let file = [start, bytes].concat();
        if let Ok(reader) = RecordingReader::new(&file[..]) {
            reader.for_each(drop);
        }
    }
});
