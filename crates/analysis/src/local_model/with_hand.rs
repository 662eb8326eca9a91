//! Haptic loop and simulation loop together: a hand that is free to move, on a local model, on a slow elastic object.
//!
//! Barbagli et al. 2003 leaves this open (§2.1, §5) and calls a stable slow loop, the hand held still, necessary. It
//! is, for all hands together: a hand may hold as still as it likes. For one given hand it is neither necessary (a
//! light, well damped one follows the surface) nor enough (one that swings on the local model sees a force that is a
//! slow period old).

use cotouch_scene::names::{Axis, Coordinate, HostIndex, Part, Quantity};
use cotouch_scene::scene::{SpringDamper, SurfaceHold};
use cotouch_scene::time::{Rate, Schedule};
use cotouch_world::LinearBlock;
use nalgebra::DMatrix;

use super::error::LocalModelError;
use super::gains::PiLocalModel;
use super::simulation_loop::SimulationLoop;
use crate::loop_spec::{
    Block, BlockId, BodyId, Delay, Dynamics, ForceGains, Hold, LINE, LoopBody, LoopSpec, Motion, Term,
};
use crate::plant::Plant;
use cotouch_matrix::{eigenvalues, spectral_radius};

/// A hand with the device in it: `m·ẍ + b·ẋ + k·x = −F`, F held over each haptic tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandImpedance {
    /// kg, above 0.
    pub mass_kg: f64,
    /// N·s/m.
    pub damping_n_s_per_m: f64,
    /// N/m, to where the hand wants to be.
    pub stiffness_n_per_m: f64,
}

const HAND: BodyId = BodyId(0);
const SURFACE: BlockId = BlockId(0);
const INTEGRAL: BlockId = BlockId(1);

/// A hand on a PI local model on an elastic object, as one loop. Its state is the hand's position and speed in m and
/// m/s, the last result of the simulation in m (under a first-order hold the one before, too), and, where INT is not
/// 0, the integral's force in N.
///
/// ```text
/// hand      m·ẍ_h + b·ẋ_h + k·x_h = −F, F held over each haptic tick
/// local     F(k) = K_h·e(k) + I(k),  I(k+1) = I(k) + INT/N·e(k),  e = x_h − x_surface      Barbagli et al. 2003, (6)
/// object    x_o = F_returned / K_o, computed every N ticks from the forces of the N ticks that just ended
/// surface   x_o from then on, held for N ticks, or moving there linearly within N ticks
/// ```
///
/// # Errors
/// When a number of the hand is not finite, its mass is not positive, or N periods of `fast` are no period of a rate.
pub fn hand_on_local_model(
    hand: HandImpedance,
    model: &PiLocalModel,
    simulation_loop: &SimulationLoop,
    fast: Rate,
) -> Result<LoopSpec, LocalModelError> {
    let ratio = simulation_loop.ratio();
    let frames = Schedule::new(fast, Rate::new(fast.numerator(), fast.denominator() * ratio as u64)?)?;
    let mut spec = LoopSpec::new(Schedule::new(fast, fast)?);
    spec.body(hand.body()?);
    let with_integral = model.int_n_per_m() > 0.0;
    let force = |sign: f64| {
        let mut force = error(sign * model.kh_n_per_m());
        if with_integral {
            force.terms.push(term(Motion::Output(INTEGRAL), sign));
        }
        force
    };
    let surface = |age| Coordinate::Surface { host: HostIndex::FIRST, slot: 0, axis: Axis::X, age };
    let compliance = LinearBlock::gain(DMatrix::from_element(1, 1, model.ko_n_per_m().recip()));
    spec.block(Block {
        outputs: vec![surface(1)],
        weights: vec![simulation_loop.weights().to_vec()],
        hold: match simulation_loop.hold() {
            SurfaceHold::Zero => Hold::Zero,
            SurfaceHold::First => Hold::First,
        },
        ..Block::sampled(frames, force(1.0), compliance, Delay::periods(1))
    });
    if with_integral {
        let one = DMatrix::identity(1, 1);
        let per_tick = DMatrix::from_element(1, 1, model.int_n_per_m() / ratio as f64);
        let integrator = LinearBlock { a: one.clone(), b: per_tick, c: one, d: DMatrix::zeros(1, 1) };
        spec.block(Block {
            states: vec![Coordinate::Integral { host: HostIndex::FIRST, slot: 0 }],
            ..Block::sampled(spec.schedule, error(1.0), integrator, Delay::NONE)
        });
    }
    spec.act(HAND, force(-1.0));
    Ok(spec)
}

/// The largest absolute eigenvalue of [`hand_on_local_model`] over one slow period.
///
/// # Errors
/// As there, and when the eigenvalues are not found.
pub fn hand_spectral_radius(
    hand: HandImpedance,
    model: &PiLocalModel,
    simulation_loop: &SimulationLoop,
    fast: Rate,
) -> Result<f64, LocalModelError> {
    let map = hand_on_local_model(hand, model, simulation_loop, fast)?.lift()?;
    Ok(spectral_radius(&eigenvalues(&map.matrix)?))
}

impl HandImpedance {
    fn body(self) -> Result<LoopBody, LocalModelError> {
        let Self { mass_kg, damping_n_s_per_m, stiffness_n_per_m } = self;
        for (what, allowed, found, is_allowed) in [
            ("the hand's mass, kg,", "above 0", mass_kg, mass_kg > 0.0),
            ("the hand's damping, N·s/m,", "finite", damping_n_s_per_m, true),
            ("the hand's stiffness, N/m,", "finite", stiffness_n_per_m, true),
        ] {
            if !(found.is_finite() && is_allowed) {
                return Err(LocalModelError::Number { what, allowed, found });
            }
        }
        let own = |quantity| Coordinate::Own { host: HostIndex::FIRST, part: Part::HAND, quantity };
        let plant = Plant::mass(mass_kg, SpringDamper { stiffness_n_per_m, damping_n_s_per_m });
        let states = vec![own(Quantity::Position(Axis::X)), own(Quantity::Velocity(Axis::X))];
        Ok(LoopBody { states, axes: LINE, dynamics: Dynamics::Plant(plant) })
    }
}

/// `gain·e`.
fn error(gain: f64) -> ForceGains {
    let terms = vec![term(Motion::Current(HAND), gain), term(Motion::Output(SURFACE), -gain)];
    ForceGains { components: 1, terms }
}

const fn term(motion: Motion, gain: f64) -> Term {
    Term { component: 0, motion, number: 0, gain }
}
