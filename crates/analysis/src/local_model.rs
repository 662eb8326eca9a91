//! Local models on a slowly simulated elastic object (the paper, §2–3): loops, regions, step responses, choice of gains.

/// Which force of a slow period goes to the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnedForce {
    /// Of its first tick: the paper's equations.
    First,
    /// The mean of all ticks: the paper's algorithm, Step 3.
    Mean,
    /// Of its last tick.
    Last,
}

/// How the surface moves between two results of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceHold {
    /// It jumps (2).
    Zero,
    /// It moves linearly, one period late (§3.4).
    First,
}
