//! Whether a hand-written [`LoopSpec`] makes sense.

use std::collections::BTreeSet;

use cotouch_scene::names::Coordinate;

use crate::discretise::per_inertia;
use crate::lift::layout::quantities;
use crate::loop_spec::{Body, Coupling, Dynamics, Estimate, Force, LineId, LoopSpec, Motion, Plant, Signal};

/// Why a [`LoopSpec`] cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// A place that is not in the list.
    #[error("{what} {index} does not exist; there are {count}")]
    Missing {
        /// "body", "line", "component" or "number".
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
        "{body} has {axes} degrees of freedom: its plant needs A n×n, B n×{axes} and C {}×n, n at least 1, and the body {states} states; found A {}×{}, B {}×{}, C {}×{} and {names} names",
        2 * axes, a.0, a.1, b.0, b.1, c.0, c.1
    )]
    Shape {
        /// The body's first state.
        body: String,
        /// d.
        axes: usize,
        /// Rows and columns.
        a: (usize, usize),
        /// Rows and columns.
        b: (usize, usize),
        /// Rows and columns.
        c: (usize, usize),
        /// How many states it needs.
        states: usize,
        /// How many names there are.
        names: usize,
    },
    /// A line whose samples have another number of components than the force on the body that they act on.
    #[error("a force of {found} components acts on a body with {allowed} degrees of freedom")]
    Components {
        /// Of the force.
        found: usize,
        /// Of the body.
        allowed: usize,
    },
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
        match &line.signal {
            Signal::Motion(body) => check_index("body", body.0, spec.bodies.len())?,
            Signal::Force(coupling) => {
                // Along x, y, z.
                check_components(coupling.components, coupling.components.clamp(1, 3))?;
                check_coupling(spec, coupling, || format!("the force of line {index}"))?;
            }
        }
    }
    for action in &spec.actions {
        check_index("body", action.body.0, spec.bodies.len())?;
        let components = match &action.force {
            Force::Coupling(coupling) => {
                check_coupling(spec, coupling, || format!("a force on body {}", action.body.0))?;
                coupling.components
            }
            &Force::Held(line) => {
                check_line(spec, line, false)?;
                match &spec.lines[line.0].signal {
                    Signal::Force(coupling) => coupling.components,
                    Signal::Motion(_) => 0,
                }
            }
        };
        check_components(components, spec.bodies[action.body.0].axes.len())?;
    }
    check_names(spec)
}

fn check_components(found: usize, allowed: usize) -> Result<(), SpecError> {
    if found == allowed { Ok(()) } else { Err(SpecError::Components { found, allowed }) }
}

fn check_body(body: &Body) -> Result<(), SpecError> {
    let (name, axes) =
        (|| body.states.first().map_or_else(|| "a body".to_owned(), ToString::to_string), body.axes.len());
    let (shapes, states) = match &body.dynamics {
        &Dynamics::Mass { mass_kg, .. } | &Dynamics::Rigid { mass_kg, .. } => {
            if !(mass_kg.is_finite() && mass_kg > 0.0) {
                let what = format!("the mass of {}", name());
                return Err(SpecError::Number { what, allowed: "positive and finite", found: mass_kg });
            }
            let whole = 2 * axes;
            (((whole, whole), (whole, axes), (whole, whole)), whole)
        }
        Dynamics::Plant(plant) => (shapes(plant), plant.a.nrows()),
        Dynamics::Sensed { plant, estimate: Estimate::Difference } => (shapes(plant), plant.a.nrows() + axes),
        Dynamics::Sensed { plant, estimate: Estimate::Filtered { .. } } => {
            (shapes(plant), plant.a.nrows() + 2 * axes)
        }
    };
    let (a, b, c) = shapes;
    if a.0 == 0
        || axes == 0
        || (a.1, b, c) != (a.0, (a.0, axes), (2 * axes, a.0))
        || body.states.len() != states
    {
        return Err(SpecError::Shape { body: name(), axes, a, b, c, states, names: body.states.len() });
    }
    let what = || format!("the plant of {}", name());
    match &body.dynamics {
        Dynamics::Mass { .. } => Ok(()),
        Dynamics::Rigid { .. } => per_inertia(body)
            .iter()
            .try_for_each(|&found| check_finite(found, || format!("the inverse inertia of {}", name()))),
        Dynamics::Plant(plant) => check_plant(plant, &what),
        Dynamics::Sensed { plant, estimate } => {
            if let &Estimate::Filtered { cutoff_rad_per_s } = estimate {
                check_finite(cutoff_rad_per_s, || format!("the velocity filter's corner of {}", name()))?;
            }
            check_plant(plant, &what)
        }
    }
}

type Shapes = ((usize, usize), (usize, usize), (usize, usize));

fn shapes(plant: &Plant) -> Shapes {
    (plant.a.shape(), plant.b.shape(), plant.c.shape())
}

fn check_plant(plant: &Plant, what: &impl Fn() -> String) -> Result<(), SpecError> {
    let numbers = plant.a.iter().chain(plant.b.iter()).chain(plant.c.iter());
    numbers.into_iter().try_for_each(|&found| check_finite(found, what))
}

fn check_coupling(spec: &LoopSpec, coupling: &Coupling, what: impl Fn() -> String) -> Result<(), SpecError> {
    for term in &coupling.terms {
        check_finite(term.gain, || format!("a gain of {}", what()))?;
        check_index("component", term.component, coupling.components)?;
        match term.motion {
            Motion::Ground => {}
            Motion::Current(body) => check_index("body", body.0, spec.bodies.len())?,
            Motion::Held(line) => check_line(spec, line, true)?,
        }
        if term.motion != Motion::Ground {
            check_index("number", term.number, 2 * spec.axes_of(term.motion).len())?;
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
    let first = |line| quantities(spec, line).first().map(|&quantity| line.coordinate(quantity, 1));
    let lines = spec.lines.iter().filter_map(first);
    let mut seen = BTreeSet::new();
    match states.chain(lines).find(|&name| !seen.insert(name)) {
        Some(name) => Err(SpecError::Duplicate(name)),
        None => Ok(()),
    }
}
