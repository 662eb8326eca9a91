//! No bytes make the scene reader panic, and what it reads survives being written and read again.
#![no_main]

use cotouch_scene::{Override, parse, parse_bytes, scene_hash, to_toml};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // The first line, where it is one, is an override.
    let split = bytes.iter().position(|&byte| byte == b'\n').unwrap_or(0);
    let overrides: Vec<Override> =
        std::str::from_utf8(&bytes[..split]).ok().and_then(|line| line.parse().ok()).into_iter().collect();
    // An override may include a file; the fuzzer has no business with those.
    let names_a_file = |key: &str| key.starts_with("link") || key.ends_with("mesh");
    if overrides.iter().any(|set| names_a_file(set.key())) {
        return;
    }
    if let Ok(scene) = parse_bytes(&bytes[split..], "fuzz", None, &overrides) {
        let again = parse(&to_toml(&scene), "fuzz", None, &[]).expect("a written scene can be read");
        assert_eq!(again, scene);
        assert_eq!(scene_hash(&again), scene_hash(&scene));
    }
});
