//! Linear functions of what a loop has: forces, and inputs of blocks.

use glam::DMat3;

use crate::dof::Dof;

/// A body of a [`LoopSpec`](super::LoopSpec), by its place in its list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(pub usize);

/// A delay line of a [`LoopSpec`](super::LoopSpec), by its place in its list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LineId(pub usize);

/// A sampled block of a [`LoopSpec`](super::LoopSpec), by its place in its list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub usize);

/// What a force can depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// At rest at the origin.
    Ground,
    /// A body as it is at this instant.
    Current(BodyId),
    /// The sample that a line holds; the line carries a motion.
    Held(LineId),
    /// What of a block's outputs is used at this instant.
    Output(BlockId),
}

/// A force that is a linear function of motions: `Σ K_m·q_m + B_m·v_m`, written as its elements that are not 0.
///
/// A spring and a damper are the special case of [`LoopSpec::spring`](super::LoopSpec::spring); preload adds terms that are neither symmetric nor
/// relative.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForceGains {
    /// Components of the force.
    pub components: usize,
    /// Their elements.
    pub terms: Vec<Term>,
}

/// One element of a gain matrix: `gain` times one number of a motion adds to one component of the force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Which component of the force, N or N·m.
    pub component: usize,
    /// What is read; never the ground.
    pub motion: Motion,
    /// Which of its numbers: with d degrees of freedom, positions are 0 to d − 1 and velocities d to 2d − 1;
    /// of a block, which output.
    pub number: usize,
    /// N/m, N·s/m and their likes for turns.
    pub gain: f64,
}

impl ForceGains {
    /// A force with this many components and no terms yet.
    #[must_use]
    pub const fn new(components: usize) -> Self {
        Self { components, terms: Vec::new() }
    }

    /// Adds a 3 × 3 block of a gain matrix in world axes: its rows are the force's components of one kind (forces or
    /// torques), its columns the motion's numbers of one kind and order. Directions that either side lacks are left out.
    pub fn add(&mut self, rows: Rows, motion: (Motion, &[Dof]), columns: Columns, block: &DMat3) {
        let (motion, axes) = motion;
        let Columns { turns, velocity } = columns;
        let first = if velocity { axes.len() } else { 0 };
        for (component, row) in rows.axes.iter().enumerate().filter(|(_, dof)| dof.turns() == rows.turns) {
            for (number, column) in axes.iter().enumerate().filter(|(_, dof)| dof.turns() == turns) {
                let gain = block.col(column.axis().index())[row.axis().index()];
                if gain != 0.0 {
                    self.terms.push(Term { component, motion, number: first + number, gain });
                }
            }
        }
    }
}

/// The components that a block of gains adds to.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    /// What the force acts on.
    pub axes: &'static [Dof],
    /// Torques, not forces.
    pub turns: bool,
}

/// The numbers that a block of gains reads.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    /// Turns, not positions.
    pub turns: bool,
    /// Velocities.
    pub velocity: bool,
}
