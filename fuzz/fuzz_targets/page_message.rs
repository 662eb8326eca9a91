//! What a page says, with arbitrary bytes: no panic, and a refusal in few words.
#![no_main]

use cotouch_viewer::check_page_message;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data)
        && let Err(why) = check_page_message(text)
    {
        assert!(why.chars().count() <= 200);
    }
});
