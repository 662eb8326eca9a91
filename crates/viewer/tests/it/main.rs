//! What `cotouch-viewer` promises from outside, in one program.

mod lesson;
mod page;
mod server;
