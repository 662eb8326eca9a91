//! How a body is somewhere else, or moves, without a force.

use crate::loop_spec::{Dynamics, Estimate, LoopBody, Plant};

/// Some states and their sizes; all others are 0.
pub(super) type Sparse = Vec<(usize, f64)>;

/// One degree of freedom of a body.
#[derive(Clone, Debug, Default)]
pub(super) struct Coasting {
    /// At rest 1 m away; `None` where the body's own dynamics tie it to a place.
    pub(super) still: Option<Sparse>,
    /// Passing the origin at 1 m/s; `None` where the body's own dynamics brake it.
    pub(super) moving: Option<Sparse>,
}

/// For each of a body's degrees of freedom.
pub(super) fn coasting(body: &LoopBody, period_s: f64) -> Vec<Coasting> {
    let axes = body.axes.len();
    match &body.dynamics {
        Dynamics::Mass { .. } | Dynamics::Rigid { .. } => {
            let of =
                |axis| Coasting { still: Some(vec![(axis, 1.0)]), moving: Some(vec![(axes + axis, 1.0)]) };
            (0..axes).map(of).collect()
        }
        Dynamics::Plant(plant) => (0..axes).map(|axis| of_plant(plant, axis)).collect(),
        Dynamics::Sensed { plant, estimate } => {
            let states = plant.a.nrows();
            let of = |axis| {
                let mut coasting = of_plant(plant, axis);
                if let Some(still) = &mut coasting.still {
                    still.push((states + axis, 1.0));
                }
                if let Some(moving) = &mut coasting.moving {
                    moving.push((states + axis, -period_s));
                    if matches!(estimate, Estimate::Filtered { .. }) {
                        moving.push((states + axes + axis, 1.0));
                    }
                }
                coasting
            };
            (0..axes).map(of).collect()
        }
    }
}

fn of_plant(plant: &Plant, axis: usize) -> Coasting {
    let axes = plant.b.ncols();
    let states = || 0..plant.a.nrows();
    let read_only_as = |state: usize, output: usize| {
        let mut column = plant.c.column(state).into_iter().enumerate();
        column.all(|(row, &element)| (element != 0.0) == (row == output))
    };
    // A position is a state that nothing depends on; it is read as the position alone.
    let is_position = |&state: &usize| {
        plant.a.column(state).iter().all(|&element| element == 0.0) && read_only_as(state, axis)
    };
    let Some(position) = states().find(is_position) else { return Coasting::default() };
    let per_metre = plant.c[(axis, position)].recip();
    // A velocity is a state on which only that position depends.
    let velocity = states().find_map(|state| {
        let size = plant.c[(axes + axis, state)].recip();
        let mut column = plant.a.column(state).into_iter().enumerate();
        let drives_only_position = column.all(|(row, &element)| (element != 0.0) == (row == position));
        let consistent = drives_only_position && plant.a[(position, state)] * size == per_metre;
        (consistent && read_only_as(state, axes + axis)).then_some((state, size))
    });
    Coasting { still: Some(vec![(position, per_metre)]), moving: velocity.map(|velocity| vec![velocity]) }
}
