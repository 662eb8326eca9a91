//! Reflector and prober with arbitrary bytes: no panic, and no echo is longer than its probe.
#![no_main]

use cotouch_net::{ProbeConfig, Prober, Route, reflect_probe};
use cotouch_scene::time::LocalTime;
use libfuzzer_sys::fuzz_target;
use xxhash_rust::xxh3::xxh3_64;

fuzz_target!(|data: &[u8]| {
    let target = Route::V4("10.0.0.1:1".parse().unwrap());
    let rate_hz = "100".parse().unwrap();
    let config = ProbeConfig { rate_hz, duration_s: 0.1, datagram_bytes: 64, linger_s: 1.0, id: 0 };
    let mut prober = Prober::new(config, target, LocalTime(0));
    let _ = prober.poll_transmit(LocalTime(0));
    let mut bytes = data.to_vec();
    if bytes.len() > 8 {
        let sum = xxh3_64(&bytes[8..]) as u32;
        bytes[4..8].copy_from_slice(&sum.to_le_bytes());
    }
    if let Some(echo) = reflect_probe(&bytes) {
        assert_eq!(echo.len(), bytes.len());
        prober.handle_datagram(LocalTime(1), target, &echo);
    }
    prober.handle_datagram(LocalTime(2), target, &bytes);
    assert!(prober.report().received <= 1);
    let _ = prober.report().impairment();
});
