//! What people are told on the way.

/// Writes a line to stderr, as `eprintln!` does. Whoever read there may have gone, which ends neither a session of hands nor the
/// report of what failed.
macro_rules! tell {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}
