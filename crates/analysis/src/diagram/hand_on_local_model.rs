//! A hand on a local model of a slowly simulated elastic object: haptic loop and simulation loop together.
//!
//! Barbagli et al. 2003 (§2.1) analyses its simulation loop with the hand held still and leaves the two loops together
//! open (§5).

use cotouch_scene::scene::SpringDamper;
use cotouch_scene::time::Rate;
use cotouch_world::LinearBlock;
use nalgebra::{DMatrix, dmatrix};

use super::{Clock, Diagram, DiagramBlockId, Plant, Sampled, Time};
use crate::local_model::{ReturnedForce, SurfaceHold};

/// A hand on a PI local model (6) on an elastic object.
///
/// ```text
/// hand      m·ẍ_h + b·ẋ_h + k·x_h = −F, F held over each tick of period T
/// local     F(k) = K_h·e(k) + I(k),  I(k+1) = I(k) + INT/N·e(k),  e = x_h − x_surface      INT = N·T·I of Barbagli et al. 2003
/// object    x_o = F_returned / K_o, computed every N ticks from the force of the N ticks that just ended
/// surface   x_o from then on, held for N ticks, or moving there linearly within N ticks
/// ```
///
/// So the first force of period p moves the surface at the start of period p + 1: Barbagli et al.'s delay of N·T, and
/// the hold. `hand` is kg, N·s/m and N/m; `kh`, `int` and `ko` are N/m. With a hand that does not move, the eigenvalues
/// are those of Barbagli et al.'s simulation loop (8): for [`ReturnedForce::First`] and [`SurfaceHold::Zero`] the roots
/// of z² + (h − 1)·z + (i − h), h = K_h/K_o, i = INT/K_o.
#[must_use]
#[expect(clippy::too_many_arguments, reason = "the symbols of Barbagli et al. 2003")]
pub fn hand_on_local_model(
    hand: [f64; 3],
    kh: f64,
    int: f64,
    ko: f64,
    ratio: u32,
    fast: Rate,
    returned: ReturnedForce,
    hold: SurfaceHold,
) -> Diagram {
    let weight = |tick: u32| match returned {
        ReturnedForce::First => f64::from(u8::from(tick == 0)),
        ReturnedForce::Mean => f64::from(ratio).recip(),
        ReturnedForce::Last => f64::from(u8::from(tick + 1 == ratio)),
    };
    let weights: Vec<f64> = (0..ratio).map(weight).collect();
    hand_on_weighted_local_model(hand, [kh, int], ko, &weights, fast, hold)
}

/// The same with any weights of the N forces of a period (paper §4, Step 3), one a tick; `gains` are K_h and INT.
#[must_use]
pub fn hand_on_weighted_local_model(
    hand: [f64; 3],
    gains: [f64; 2],
    ko: f64,
    weights: &[f64],
    fast: Rate,
    hold: SurfaceHold,
) -> Diagram {
    let mut diagram = Diagram::new();
    let ticks = Clock::at_rate(fast);
    let frames = Clock::every(Time::period(fast).times(weights.len() as u64));
    let hand = add_hand(&mut diagram, hand);
    let local_model = diagram.sampled("local_model", pi(ticks, gains, weights.len()));
    let returned = diagram.sampled("returned_force", Sampled::average(frames.clone(), 1, weights.to_vec()));
    let surface = match hold {
        SurfaceHold::Zero => Sampled::gain(frames, dmatrix![1.0]),
        SurfaceHold::First => Sampled::first_order_hold(frames, 1),
    };
    let surface = diagram.sampled("surface", surface);
    diagram.wire(hand, local_model, dmatrix![1.0, 0.0]);
    diagram.connect_scaled(surface, local_model, -1.0);
    diagram.connect_scaled(local_model, hand, -1.0);
    diagram.connect(local_model, returned);
    diagram.connect_scaled(returned, surface, ko.recip());
    diagram
}

fn add_hand(
    diagram: &mut Diagram,
    [mass_kg, damping_n_s_per_m, stiffness_n_per_m]: [f64; 3],
) -> DiagramBlockId {
    let plant = Plant::mass(mass_kg, SpringDamper { stiffness_n_per_m, damping_n_s_per_m });
    let hand = diagram.plant("hand", plant);
    diagram.blocks[hand.0].states = vec!["hand.x".into(), "hand.v".into()];
    hand
}

/// F(k) = K_h·e(k) + I(k), I(k+1) = I(k) + INT/N·e(k).
fn pi(clock: Clock, [kh, int]: [f64; 2], ratio: usize) -> Sampled {
    let one = DMatrix::identity(1, 1);
    let law = LinearBlock { a: one.clone(), b: dmatrix![int / ratio as f64], c: one, d: dmatrix![kh] };
    Sampled::linear(clock, law)
}
