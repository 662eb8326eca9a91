//! Why a diagram has no map.

use super::time::Time;
use crate::check::SpecError;
use crate::eigenvalues::EigenvalueError;

/// Why a [`super::Diagram`] has no map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagramError {
    /// The loop that was to become a diagram is inconsistent.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A wire from or to a block that is not there.
    #[error("a wire names block {index}; there are {count}")]
    UnknownBlock {
        /// What was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A matrix or a list of the wrong size.
    #[error("{what} must be {needed}; found {found}")]
    Shape {
        /// Whose.
        what: String,
        /// Rows and columns, or a length.
        needed: String,
        /// Rows and columns, or a length.
        found: String,
    },
    /// NaN or infinity.
    #[error("{what} must be finite; found {found}")]
    NotFinite {
        /// Whose number.
        what: String,
        /// The number.
        found: f64,
    },
    /// A clock that is none.
    #[error("the clock of {block} {problem}")]
    Clock {
        /// Whose.
        block: String,
        /// What is wrong, and what is allowed.
        problem: String,
    },
    /// Nothing has a clock.
    #[error("nothing in the diagram is sampled: at least one block needs a clock")]
    NoClock,
    /// A plant's output drives a plant.
    #[error(
        "{from} drives {to} directly, and both are continuous: put a hold between them, or write them as one plant"
    )]
    NotHeld {
        /// A plant.
        from: String,
        /// A plant.
        to: String,
    },
    /// A later sample that is used earlier.
    #[error(
        "{block} would use a later sample before an earlier one: its delays must keep the order of its samples"
    )]
    Overtaking {
        /// Whose delays.
        block: String,
    },
    /// Clocks without a common pattern of reasonable length.
    #[error(transparent)]
    TooLong(Box<Misfit>),
    /// More work than is reasonable.
    #[error(
        "the diagram has {size} {what} and a pattern of {instants} instants: more than {most:.0e} operations; choose rates whose ratio is simpler, shorter delays or fewer blocks"
    )]
    TooLarge {
        /// How many.
        size: usize,
        /// What is counted.
        what: &'static str,
        /// In one pattern.
        instants: usize,
        /// How many operations are allowed.
        most: f64,
    },
    /// A plant so fast that nothing is left of it within the pattern.
    #[error(
        "{plant} changes too fast for a pattern of {pattern_s} s: the norm of A times that must be at most {most:.0e}; found {found:.1e}"
    )]
    TooStiff {
        /// Which.
        plant: String,
        /// How long the pattern is.
        pattern_s: f64,
        /// The limit.
        most: f64,
        /// ‖A‖·T.
        found: f64,
    },
    /// Blocks that need each other's output at the same instant.
    #[error(
        "an algebraic loop: at one instant each of {} needs the output of the next; delay one of them, or take their loop together",
        .0.join(", ")
    )]
    AlgebraicLoop(Vec<String>),
    /// Two states of one name.
    #[error("two states are called {0}; every state needs its own name")]
    Duplicate(String),
    /// Subsystem resampling needs nested rates.
    #[error(
        "subsystem resampling (Fotoohi Ghiam 2006, (4.1) – (4.11)) does not apply: {0}; the other routes do"
    )]
    NotNested(String),
    /// No eigenvalues.
    #[error(transparent)]
    Eigenvalues(#[from] EigenvalueError),
}

/// Two clocks whose common pattern is too long.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the clocks of {slow} (every {slow_period}) and {fast} (every {fast_period}) do not fit: the whole diagram repeats only after more than {most} instants; {slow} every {suggestion} would fit {fast}"
)]
pub struct Misfit {
    /// The block of the slower clock.
    pub slow: String,
    /// Its period.
    pub slow_period: Time,
    /// The block of the faster clock.
    pub fast: String,
    /// Its period.
    pub fast_period: Time,
    /// How many instants are allowed.
    pub most: u64,
    /// A period near the slower one that is a whole multiple of the faster one.
    pub suggestion: Time,
}
