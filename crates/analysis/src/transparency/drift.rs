//! What a constant force does in the long run: the limit z → 1 of (6.2), by structure and without a limit.

use nalgebra::{DMatrix, DVector};

use super::alone::Held;
use super::source::{self, Cut};
use crate::check::SpecError;
use crate::lift::layout::{Layout, Registers};
use crate::rigid::Structure;

/// How what a user holds moves under a constant force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Drift {
    /// It does not: a stiffness ties it to the ground.
    Grounded,
    /// The loop grows so much within one pattern that nothing else can be told.
    Outgrown,
    /// Faster and faster: momentum is conserved, and nothing is damped.
    Accelerating,
    /// At a steady pace.
    Steady {
        /// At the first network instant of each pattern, m/s/N.
        at_network_instants: f64,
        /// In the mean, m/s/N.
        mean: f64,
    },
}

impl Drift {
    /// In a plain sentence.
    pub(super) fn why_no_damping(self) -> Option<&'static str> {
        match self {
            Self::Grounded => Some(
                "A spring ties the hand to the ground, so that no constant force keeps it moving: there is no damping in \
                 the sense of (6.2).",
            ),
            Self::Outgrown => Some(
                "The loop is so unstable that its slow motion cannot be told: there is no damping to speak of.",
            ),
            Self::Accelerating | Self::Steady { .. } => None,
        }
    }

    /// F/V (N·s/m), by one of the velocities.
    pub(super) fn damping(self, velocity: impl Fn(f64, f64) -> f64) -> Option<f64> {
        match self {
            Self::Grounded | Self::Outgrown => None,
            Self::Accelerating => Some(0.0),
            Self::Steady { at_network_instants, mean } => Some(velocity(at_network_instants, mean).recip()),
        }
    }
}

/// Per pattern, in SI units: beyond it the drift drowns in rounding.
const LARGEST_GROWTH: f64 = 1e12;

/// In a steady drift, one pattern moves everything (positions and samples of positions) by the same length ℓ:
/// `Φ·x + b = x + ℓ·e` with the translation e. So `(I − Φ)·x + ℓ·e = b`, which leaves only the place open:
///
/// ```text
/// [I − Φ  E] [x]   [b]
/// [  Eᵀ   0]·[ℓ] = [0]
/// ```
///
/// has one solution, where E are the translations that are possible by structure, of the whole and of parts that no
/// stiffness ties to it. No frequency is small, and no digits are lost.
pub(super) fn drift(held: &Held) -> Result<Drift, SpecError> {
    let layout = Layout::new(&held.spec, Registers::Shared);
    let mut pushed = held.clone();
    let source = source::at_ticks(&mut pushed, 0.0);
    let whole = pushed.spec.lift_shared()?;
    let name = pushed.spec.bodies[source.0].states[0];
    let Some(first) = whole.index_of(name) else { return Ok(Drift::Grounded) };
    let cut = Cut::new(&whole.matrix, &[first, first + 1]);
    if whole.matrix.iter().any(|value| !value.is_finite() || value.abs() > LARGEST_GROWTH) {
        return Ok(Drift::Outgrown);
    }
    let structure = Structure::new(&held.spec, &layout, &cut.map);
    let conserved = structure.rigid.len() > 1;
    if conserved {
        return Ok(Drift::Accelerating);
    }
    let translations: Vec<&DVector<f64>> = structure.rigid.iter().chain(&structure.loose).collect();
    let Some((state, lengths)) = bordered(&cut.map, &translations, &cut.column(&whole.matrix, first)) else {
        return Ok(Drift::Grounded);
    };
    let read = |order: usize, state: &DVector<f64>| -> f64 {
        let answer = held.answer(order).into_iter();
        answer.map(|(body, number, factor)| state[layout.bodies[body.0] + number] * factor).sum()
    };
    let moved: f64 = translations.iter().zip(lengths.iter()).map(|(e, length)| read(0, e) * length).sum();
    if moved == 0.0 {
        return Ok(Drift::Grounded);
    }
    let velocity = read(1, &state);
    Ok(Drift::Steady { at_network_instants: velocity, mean: moved / held.spec.pattern_s() })
}

fn bordered(
    map: &DMatrix<f64>,
    translations: &[&DVector<f64>],
    input: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let (states, count) = (map.nrows(), translations.len());
    let mut matrix = DMatrix::zeros(states + count, states + count);
    matrix.view_mut((0, 0), (states, states)).copy_from(&(DMatrix::identity(states, states) - map));
    for (index, translation) in translations.iter().enumerate() {
        matrix.view_mut((0, states + index), (states, 1)).copy_from(*translation);
        matrix.view_mut((states + index, 0), (1, states)).copy_from(&translation.transpose());
    }
    let mut right = DVector::zeros(states + count);
    right.rows_mut(0, states).copy_from(input);
    let solution = matrix.full_piv_lu().solve(&right)?;
    let is_finite = solution.iter().all(|value| value.is_finite());
    is_finite.then(|| (solution.rows(0, states).into_owned(), solution.rows(states, count).into_owned()))
}
