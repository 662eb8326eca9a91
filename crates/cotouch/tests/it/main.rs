//! What `cotouch` promises from outside, in one program.

mod agreement;
mod agreement_soft;
mod analysis_commands;
mod command_line;
mod falsification;
mod grasps;
mod growth;
mod outages;
mod probe;
mod program;
mod safety;
mod scenes;
mod scripted_limits;
mod settled_grasp;
mod soak;
mod soft_commands;
mod soft_scenes;
mod support;
mod switching;
