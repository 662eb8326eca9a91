//! Whether a hand-written [`LoopSpec`] makes sense.

use std::collections::BTreeSet;

use cotouch_scene::names::{Coordinate, Quantity};
use cotouch_scene::scene::SpringDamper;

use crate::loop_spec::{Body, Coupling, Dynamics, Force, LineId, LoopSpec, Motion, Signal};

/// Why a [`LoopSpec`] cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// A place that is not in the list.
    #[error("{what} {index} does not exist; there are {count}")]
    Missing {
        /// "body" or "line".
        what: &'static str,
        /// What was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A line of the wrong kind.
    #[error("line {0} carries {1}, and is used as {2}")]
    WrongSignal(usize, &'static str, &'static str),
    /// Matrices that do not fit each other.
    #[error(
        "the plant of {0} needs A n×n, B n, C 2×n and n state names, n at least 1; found A {1}×{2}, B {3}, C {4}×{5} and {6} names"
    )]
    Shape(String, usize, usize, usize, usize, usize, usize),
    /// A number out of range.
    #[error("{what} must be {allowed}; found {found}")]
    Number {
        /// Whose number.
        what: String,
        /// The range.
        allowed: &'static str,
        /// The number.
        found: f64,
    },
    /// Two states of one name.
    #[error("two states are called {0}; every state needs its own name")]
    Duplicate(Coordinate),
}

/// Checks that every reference exists, shapes fit, numbers are finite and names are unique.
pub(crate) fn check(spec: &LoopSpec) -> Result<(), SpecError> {
    spec.bodies.iter().try_for_each(check_body)?;
    for (index, line) in spec.lines.iter().enumerate() {
        match line.signal {
            Signal::Motion(body) => check_index("body", body.0, spec.bodies.len())?,
            Signal::Force(coupling) => {
                check_coupling(spec, &coupling, &format!("the force of line {index}"))?
            }
        }
    }
    for action in &spec.actions {
        check_index("body", action.body.0, spec.bodies.len())?;
        match action.force {
            Force::Coupling(coupling) => {
                check_coupling(spec, &coupling, &format!("a coupling of body {}", action.body.0))?;
            }
            Force::Held(line) => check_line(spec, line, false)?,
        }
    }
    check_names(spec)
}

fn check_body(body: &Body) -> Result<(), SpecError> {
    let name = || body.states.first().map_or_else(|| "a body".to_owned(), ToString::to_string);
    match &body.dynamics {
        Dynamics::Mass { mass_kg, .. } => {
            if !(mass_kg.is_finite() && *mass_kg > 0.0) {
                let what = format!("the mass of {}", name());
                return Err(SpecError::Number { what, allowed: "positive and finite", found: *mass_kg });
            }
            if body.states.len() != 2 {
                return Err(SpecError::Shape(name(), 2, 2, 2, 2, 2, body.states.len()));
            }
        }
        Dynamics::Plant(plant) => {
            let n = body.states.len();
            let ((a, a2), b, (c, c2)) = (plant.a.shape(), plant.b.len(), plant.c.shape());
            if n == 0 || (a, a2, b, c, c2) != (n, n, n, 2, n) {
                return Err(SpecError::Shape(name(), a, a2, b, c, c2, n));
            }
            for &found in plant.a.iter().chain(plant.b.iter()).chain(plant.c.iter()) {
                check_finite(found, || format!("the plant of {}", name()))?;
            }
        }
    }
    Ok(())
}

fn check_coupling(spec: &LoopSpec, coupling: &Coupling, what: &str) -> Result<(), SpecError> {
    let SpringDamper { stiffness_n_per_m, damping_n_s_per_m } = coupling.spring;
    check_finite(stiffness_n_per_m, || format!("the stiffness of {what}"))?;
    check_finite(damping_n_s_per_m, || format!("the damping of {what}"))?;
    for motion in [coupling.end, coupling.anchor] {
        match motion {
            Motion::Ground => {}
            Motion::Current(body) => check_index("body", body.0, spec.bodies.len())?,
            Motion::Held(line) => check_line(spec, line, true)?,
        }
    }
    Ok(())
}

fn check_line(spec: &LoopSpec, line: LineId, used_as_motion: bool) -> Result<(), SpecError> {
    check_index("line", line.0, spec.lines.len())?;
    let carries_motion = matches!(spec.lines[line.0].signal, Signal::Motion(_));
    if carries_motion == used_as_motion {
        return Ok(());
    }
    let kind = |motion| if motion { "a motion" } else { "a force" };
    Err(SpecError::WrongSignal(line.0, kind(carries_motion), kind(used_as_motion)))
}

fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), SpecError> {
    if index < count { Ok(()) } else { Err(SpecError::Missing { what, index, count }) }
}

fn check_finite(found: f64, what: impl FnOnce() -> String) -> Result<(), SpecError> {
    if found.is_finite() { Ok(()) } else { Err(SpecError::Number { what: what(), allowed: "finite", found }) }
}

/// Names of bodies' states, and of lines (by their first quantity: ages follow).
fn check_names(spec: &LoopSpec) -> Result<(), SpecError> {
    let states = spec.bodies.iter().flat_map(|body| body.states.iter().copied());
    let lines = spec.lines.iter().map(|line| match line.signal {
        Signal::Motion(_) => line.coordinate(Quantity::X, 1),
        Signal::Force(_) => line.coordinate(Quantity::F, 1),
    });
    let mut seen = BTreeSet::new();
    match states.chain(lines).find(|&name| !seen.insert(name)) {
        Some(name) => Err(SpecError::Duplicate(name)),
        None => Ok(()),
    }
}
