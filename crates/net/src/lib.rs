//! The session protocol without sockets or clocks, its wire format, and simulated links.

pub mod packet;
