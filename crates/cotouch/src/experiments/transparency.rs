//! Chapter 6 and appendix B: what users perceive of the object.

mod brakes;
mod case;
mod contact;
mod free_motion;

pub(super) use brakes::{EQUATION_6_3, EQUATION_B_10, EQUATION_B_11, TABLE_6_2};
pub(super) use contact::{EQUATION_6_4, FIGURE_6_5};
pub(super) use free_motion::{FIGURE_6_2, FIGURE_6_4};
