//! Exact sampled-data stability analysis: what a session will do, before anyone touches it.
//!
//! Hands are continuous; forces are computed at ticks of period `T_c` and held in between; samples cross the network
//! every `T_t` and are held, some periods old, until the next one is used. Between two instants all of that is linear,
//! so one pattern of ticks and network steps maps the state exactly:
//!
//! ```text
//! plant under hold    x(k+1) = A_D·x(k) + B_D·f(k),   exp([A B; 0 0]·T_c) = [A_D B_D; 0 I]     Fotoohi Ghiam 2006, (3.14), (3.15)
//! spring and damper   f = k·(x_anchor − x_end) + b·(v_anchor − v_end)                         Fotoohi Ghiam 2006, (4.25) – (4.28)
//! stuck contact       f = −(k_N·n·nᵀ + k_T·(I − n·nᵀ))·x − (b_N·n·nᵀ + b_T·(I − n·nᵀ))·v      Fotoohi Ghiam 2006, (7.3)
//! one pattern         z(K+1) = Φ·z(K),   Φ = Φ_p ··· Φ_2·Φ_1 (one factor a tick)
//! verdict             stable iff all eigenvalues of Φ but the rigid-body poles lie inside the unit circle   (3.19)
//! ```
//!
//! Where fingers touch bodies with surfaces, the loop is the exact linearisation about a settled grasp
//! ([`OperatingPoint`]), in all directions at once: faces turn with their bodies, and preload pushes sideways on what
//! turns. A scene compiles to one [`loop_spec::LoopSpec`] for each contact mode ([`compile()`]); its map ([`LiftedMap`]) names
//! each of its coordinates, samples in flight included; [`eigenvalues()`] balances first; poles that are 1 by structure are
//! removed by structure; [`analyze`] gives the verdict: on all that users can touch, not only on what scripts hold.
//!
//! What follows from verdicts: [`stability_map`] draws the plane of two scene keys ([`Sweep`], [`Evaluator`]), [`margins`] says how far
//! each gain, the delay, the rates and the loss of packets are from instability. What users perceive of the object is in
//! [`transparency`]: admittance, the damping that held data add, equivalent stiffness (Fotoohi Ghiam 2006, ch. 6).
//!
//! A [`diagram`] describes any sampled-data loop: continuous plants, discrete blocks with periods and phases of their own,
//! samplers, holds, delays of any rational length. Every loop lowers to one, and three routes that share no more than the
//! description lift it: instant by instant, by the direct state-space method (4.12)–(4.30), and by subsystem resampling
//! (4.1)–(4.11). [`cross_check`] holds the verdict on a scene to them. One writes a loop spec where everything happens at ticks, and a diagram where something happens between
//! them: at another phase, or after a delay that is no whole number of ticks. Local models on slowly simulated objects are
//! in [`local_model`] (Barbagli et al. 2003, §2–3). Whole sessions around a soft body, hands, network and slow simulation
//! together, are loops of the same kind.
//!
//! # Example
//! A mass of 0.1 kg on a sampled spring of 500 N/m, whose damper is what keeps it stable:
//!
//! ```
//! use cotouch_analysis::loop_spec::{LoopBody, Dynamics, LINE, LoopSpec, Motion, Plant};
//! use cotouch_analysis::analyze_loop;
//! use cotouch_scene::{scene::SpringDamper, time::Schedule};
//! let spring = |stiffness_n_per_m, damping_n_s_per_m| SpringDamper { stiffness_n_per_m, damping_n_s_per_m };
//! let verdict = |damping| {
//!     let mut spec = LoopSpec::new(Schedule::new("1000".parse().unwrap(), "1000".parse().unwrap()).unwrap());
//!     let states = ["host1.hand.x", "host1.hand.v"].map(|name| name.parse().unwrap()).to_vec();
//!     let dynamics = Dynamics::Plant(Plant::mass(0.1, spring(0.0, 0.0)));
//!     let hand = spec.body(LoopBody { states, axes: LINE, dynamics });
//!     spec.pull(hand, Motion::Ground, spring(500.0, damping));
//!     analyze_loop(&spec).unwrap()
//! };
//! assert!(verdict(1.0).stable);
//! assert!(verdict(0.2).spectral_radius > 1.0); // less than k·T/2: the hold returns more energy than it takes
//! ```

mod balance;
mod check;
mod compile;
mod contact;
mod coverage;
mod cross_check;
mod crossing;
mod deflate;
pub mod diagram;
mod discretise;
mod dof;
mod dominant;
mod evaluator;
mod gains;
mod independent;
mod left_out;
mod lift;
pub mod local_model;
pub mod loop_spec;
mod map;
mod margin;
mod modes;
mod operating_point;
mod order;
mod outage;
mod plant;
mod poles;
mod rigid;
mod soft;
mod stability;
mod sweep;
mod switching;
mod symmetry;
mod toppling;
pub mod transparency;
mod unmodelled;
mod variants;
mod verdict;
mod warnings;

pub use check::SpecError;
pub use compile::{ContactMode, along_normal, compile, compile_at};
pub use cotouch_matrix::{EigenvalueError, eigenvalues, spectral_radius};
pub use cross_check::{ModeCheck, RouteCheck, cross_check};
pub use evaluator::Evaluator;
pub use left_out::LeftOut;
pub use lift::LiftedMap;
pub use map::{StabilityMap, stability_map};
pub use margin::{Cure, DelayAndLoss, GainMargin, Margins, RateMargin, margins};
pub use operating_point::{CornerContact, FingerContact, OperatingPoint};
pub use outage::{FingerPush, Outage, OutageDirection, Outages, WorstReturn, outages};
pub use poles::analyze_loop;
pub use soft::{SingularStep, SoftAnalysisError, compile_unreduced, gain_ratios};
pub use stability::{analyze, analyze_settled};
pub use sweep::{Grid, Sweep, SweepError};
pub use switching::{MAX_DISTANCE, MIN_DISTANCE};
pub use verdict::{
    AnalysisError, ContactPlace, HandPolicy, LoopStability, ModeStability, PointVerdict, Stability,
    Switching, UnsettledMotion, Worst, WorstGain,
};
