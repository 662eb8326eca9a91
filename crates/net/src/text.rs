//! Short texts on the wire: names of users, reasons, routes.

use arrayvec::ArrayString;

/// Longest text in a message, bytes.
pub const MAX_TEXT_BYTES: usize = 64;

/// A name, a short reason or a route on the wire.
pub type Text = ArrayString<MAX_TEXT_BYTES>;

/// What a stranger said, to be shown to a person: characters that a terminal or a page would obey instead of showing them (control
/// characters, line breaks, those that turn the direction of text) are escaped as in Rust, `\u{1b}`.
#[must_use]
pub fn printable(text: &str) -> String {
    let is_obeyed = |c: char| {
        c.is_control()
            || matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    let escaped = |c: char| if is_obeyed(c) { c.escape_unicode().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect()
}

/// As much of `text` as there is room for, cut between two characters.
pub(crate) fn shortened(text: &str) -> Text {
    let cut = &text[..text.floor_char_boundary(MAX_TEXT_BYTES)];
    Text::from(cut).expect("it was cut to what there is room for")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown_instead() {
        assert_eq!(printable("\u{1b}]0;owned\u{7}\u{1b}[2J"), "\\u{1b}]0;owned\\u{7}\\u{1b}[2J");
        assert_eq!(printable("one\r\ntwo\u{9b}1m"), "one\\u{d}\\u{a}two\\u{9b}1m");
        assert_eq!(printable("a\u{202e}b\u{2066}c"), "a\\u{202e}b\\u{2066}c");
        assert_eq!(printable("Zoë's \"left\" hand – 左手"), "Zoë's \"left\" hand – 左手");
    }
}
