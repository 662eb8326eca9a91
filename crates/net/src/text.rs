//! Short texts on the wire: names of users, reasons, routes.

use arrayvec::ArrayString;

/// Longest text in a message, bytes.
pub const MAX_TEXT_BYTES: usize = 64;

/// A name, a short reason or a route on the wire.
pub type Text = ArrayString<MAX_TEXT_BYTES>;

/// As much of `text` as there is room for, cut between two characters.
pub(crate) fn shortened(text: &str) -> Text {
    let cut = &text[..text.floor_char_boundary(MAX_TEXT_BYTES)];
    Text::from(cut).expect("it was cut to what there is room for")
}
