//! Flags of `local-model`.

use clap::{Subcommand, ValueEnum};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Rate;

use super::super::invocation::{LocalModel, LocalModelCheck, LocalModelChoose, LocalModelStep};
use super::numbers::{below_one, duration, not_negative, positive, ratio};

#[derive(Debug, Subcommand)]
pub(super) enum LocalModelCommand {
    /// Whether the loop of a local model and the simulation is stable; exit status 1 when not
    #[command(after_help = "\
Example:
  cotouch local-model check --kh 500 --int 300 --ko 1000 --ratio 50 --returned-force mean")]
    Check {
        /// Proportional gain K_h, N/m
        #[arg(long, value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        kh: f64,
        /// Integral gain over one slow period, N·T·I, N/m
        #[arg(long = "int", value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        int: f64,
        /// Stiffness of the object K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// Haptic ticks in one period of the simulation, N
        #[arg(long, value_name = "N", value_parser = ratio())]
        ratio: u32,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum)]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
        /// A hand of this mass holds the device, kg; without it the hand is held still
        #[arg(long, value_name = "KG", value_parser = positive, allow_negative_numbers = true)]
        hand_mass: Option<f64>,
        /// Damping of that hand, N·s/m
        #[arg(long, value_name = "N·S/M", default_value = "5", value_parser = not_negative, requires = "hand_mass")]
        hand_damping: f64,
        /// Stiffness of that hand, N/m
        #[arg(long, value_name = "N/M", default_value = "0", value_parser = not_negative, requires = "hand_mass")]
        hand_stiffness: f64,
        /// Haptic rate; counts only with a hand, Hz
        #[arg(long, value_name = "HZ", default_value = "1000")]
        fast_hz: Rate,
    },
    /// How surface and force answer when the hand steps into the object
    #[command(after_help = "\
Example:
  cotouch local-model step --kh 190 --ko 200 --input 0.025 --out step.svg")]
    Step {
        /// Proportional gain K_h, N/m
        #[arg(long, value_name = "N/M", value_parser = not_negative, allow_negative_numbers = true)]
        kh: f64,
        /// Integral gain over one slow period, N·T·I, N/m
        #[arg(long = "int", value_name = "N/M", default_value = "0", value_parser = not_negative, allow_negative_numbers = true)]
        int: f64,
        /// Stiffness of the object K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// How far the hand steps into the object, m
        #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
        input: f64,
        /// Rate of the simulation, Hz
        #[arg(long, value_name = "HZ", default_value = "20")]
        slow_hz: Rate,
        /// Rate of the haptic loop, Hz; a whole multiple of the slow rate
        #[arg(long, value_name = "HZ", default_value = "1000")]
        fast_hz: Rate,
        /// The local model pushes and never pulls
        #[arg(long)]
        unilateral: bool,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum, default_value = "first")]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
        /// How long to look, s [default: until it has settled, 1 to 20 s]
        #[arg(long, value_name = "S", value_parser = duration, allow_negative_numbers = true)]
        duration: Option<f64>,
    },
    /// Gains for an object whose stiffness is known to some accuracy
    #[command(after_help = "\
The gains are those whose slowest transient, over all stiffnesses within the error and all ways in which the contacts \
can move together, dies out fastest.

Example:
  cotouch local-model choose --ko 800 --ko-error 0.3 --contacts 4 --correlation 0.5")]
    Choose {
        /// Stiffness of the object at one contact K_o, N/m
        #[arg(long, value_name = "N/M", value_parser = positive, allow_negative_numbers = true)]
        ko: f64,
        /// Share by which K_o may be wrong, either way: 0 to below 1
        #[arg(long, value_name = "FRACTION", default_value = "0", value_parser = below_one, allow_negative_numbers = true)]
        ko_error: f64,
        /// How many contacts there are on the object
        #[arg(long, value_name = "N", default_value = "1", value_parser = ratio())]
        contacts: u32,
        /// How much one contact moves the surface under another: 0 not at all, below 1
        #[arg(long, value_name = "R", default_value = "0", value_parser = below_one, allow_negative_numbers = true)]
        correlation: f64,
        /// Haptic ticks in one period of the simulation, N
        #[arg(long, value_name = "N", default_value = "50", value_parser = ratio())]
        ratio: u32,
        /// Which force of a slow period goes to the simulation
        #[arg(long, value_enum, default_value = "mean")]
        returned_force: RawReturnedForce,
        /// How the surface moves between two results of the simulation
        #[arg(long, value_enum, default_value = "zero")]
        hold: RawHold,
    },
    /// Which local model renders a soft object how well, and how stiff an object each can take
    #[command(after_help = "\
Open loop: every finger presses and slides along a given path, and each model's forces stand beside those of the same scene \
simulated at the haptic rate, with the contact's spring four times as stiff as the object. force_error is the root mean square \
of the difference over that of the reference; peak_error the largest difference over the largest force of the reference; \
max_jump_n the largest change of a force from one tick to the next. The scene's own model has the scene's gains; hold, p and \
pi otherwise those that the analysis chooses for an object of that K_o, compliance the reference's spring; these are halved \
until the analysis calls the scene stable.

Closed loop: the scene's own simulated hands, with Young's modulus from 500 Pa to 1 MPa, doubling; a model counts as stable \
where its run is quiet (`cotouch help run`).

Example:
  cotouch local-model compare soft-block")]
    Compare {
        /// A built-in scene with a soft object, or a TOML file
        scene: String,
        /// How long each closed loop runs, s of simulated time
        #[arg(long, value_name = "S", default_value = "8", value_parser = duration, allow_negative_numbers = true)]
        duration: f64,
    },
}

impl LocalModelCommand {
    pub(super) fn lift(self) -> LocalModel {
        match self {
            Self::Check {
                kh,
                int,
                ko,
                ratio,
                returned_force,
                hold,
                hand_mass,
                hand_damping,
                hand_stiffness,
                fast_hz,
            } => LocalModel::Check(LocalModelCheck {
                kh,
                int,
                ko,
                ratio,
                returned_force: returned_force.lift(),
                hold: hold.lift(),
                hand: hand_mass.map(|mass_kg| [mass_kg, hand_damping, hand_stiffness]),
                fast_hz,
            }),
            Self::Step {
                kh,
                int,
                ko,
                input,
                slow_hz,
                fast_hz,
                unilateral,
                returned_force,
                hold,
                duration,
            } => LocalModel::Step(LocalModelStep {
                kh,
                int,
                ko,
                input_m: input,
                slow_hz,
                fast_hz,
                unilateral,
                returned_force: returned_force.lift(),
                hold: hold.lift(),
                duration_s: duration,
            }),
            Self::Compare { scene, duration: duration_s } => LocalModel::Compare { scene, duration_s },
            Self::Choose { ko, ko_error, contacts, correlation, ratio, returned_force, hold } => {
                LocalModel::Choose(LocalModelChoose {
                    ko,
                    ko_error,
                    contacts,
                    correlation,
                    ratio,
                    returned_force: returned_force.lift(),
                    hold: hold.lift(),
                })
            }
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum RawReturnedForce {
    /// Of its first tick
    First,
    /// The mean of all its ticks
    Mean,
    /// Of its last tick
    Last,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum RawHold {
    /// It jumps
    Zero,
    /// It moves linearly, one period late
    First,
}

impl RawReturnedForce {
    fn lift(self) -> ReturnedForce {
        match self {
            Self::First => ReturnedForce::First,
            Self::Mean => ReturnedForce::Mean,
            Self::Last => ReturnedForce::Last,
        }
    }
}

impl RawHold {
    fn lift(self) -> SurfaceHold {
        match self {
            Self::Zero => SurfaceHold::Zero,
            Self::First => SurfaceHold::First,
        }
    }
}
