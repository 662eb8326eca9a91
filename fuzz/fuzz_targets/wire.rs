//! Datagrams from anywhere: decoding never panics, and what is accepted encodes to the same bytes.
#![no_main]

use cotouch_net::{MAX_DATAGRAM, decode_control, decode_state, encode_state};
use libfuzzer_sys::fuzz_target;
use xxhash_rust::xxh3::xxh3_64;

fuzz_target!(|data: &[u8]| {
    let _ = decode_control(data);
    let mut bytes = data.to_vec();
    // A fuzzer does not guess checksums.
    if bytes.len() > 8 {
        let sum = xxh3_64(&bytes[8..]) as u32;
        bytes[4..8].copy_from_slice(&sum.to_le_bytes());
    }
    let _ = decode_control(&bytes);
    if let Ok((header, sample_time, packet)) = decode_state(&bytes) {
        let Some(sender) = header.sender else { return };
        let mut again = [0; MAX_DATAGRAM];
        let length = encode_state(header.session, sender, sample_time, &packet, &mut again).unwrap();
        assert_eq!(&again[..length], &bytes[..]);
    }
});
