//! Pictures, as SVG. The only module that draws.

mod canvas;
pub(crate) mod chart;
mod contour;
pub(crate) mod map;
pub(crate) mod oblique;
mod paths;
mod session;
pub(crate) mod steps;

pub(crate) use session::session_picture;
