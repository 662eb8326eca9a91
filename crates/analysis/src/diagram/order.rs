//! In which order blocks that act at one instant are evaluated.

use std::collections::{BTreeMap, HashMap};

use super::error::DiagramError;
use super::model::{Diagram, Element, Law, Sampled};
use super::timetable::DiagramTimetable;

/// What puts something out at an instant, each after everything that it depends on.
#[derive(Clone, Debug)]
pub(crate) struct Emission {
    pub(crate) tick: i64,
    /// Places of blocks.
    pub(crate) blocks: Vec<usize>,
}

/// All instants of a pattern at which something puts something out, in time order.
pub(crate) fn emissions(
    diagram: &Diagram,
    timetable: &DiagramTimetable,
) -> Result<Vec<Emission>, DiagramError> {
    let mut acting: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for block in 0..diagram.blocks.len() {
        if let Some(instants) = timetable.of(block) {
            for index in 0..instants.count(timetable.frame) {
                acting.entry(instants.of(index)).or_default().push(block);
            }
        }
    }
    let needs = needs(diagram);
    let mut known: HashMap<Vec<(usize, bool)>, Vec<usize>> = HashMap::new();
    let mut emissions = Vec::new();
    for (tick, blocks) in acting {
        // A block whose output is used later can be evaluated at any time.
        let at_once = |&block: &usize| {
            timetable.of(block).is_some_and(|instants| {
                let used = instants.used_at(tick);
                instants.of(used) == tick
            })
        };
        let key: Vec<_> = blocks.iter().map(|block| (*block, at_once(block))).collect();
        let ordered = match known.get(&key) {
            Some(ordered) => ordered.clone(),
            None => {
                let ordered = order(&key, &needs).map_err(|circle| {
                    let name = |block: usize| diagram.blocks[block].name.clone();
                    DiagramError::AlgebraicLoop(circle.into_iter().map(name).collect())
                })?;
                known.insert(key, ordered.clone());
                ordered
            }
        };
        emissions.push(Emission { tick, blocks: ordered });
    }
    Ok(emissions)
}

/// For each block: whose outputs at an instant its own output at that instant depends on.
fn needs(diagram: &Diagram) -> Vec<Vec<usize>> {
    let mut needs = vec![Vec::new(); diagram.blocks.len()];
    for wire in &diagram.wires {
        if let Element::Sampled(Sampled { law: Law::Linear(linear), .. }) = &diagram.blocks[wire.to.0].element
            && (&linear.d * &wire.gain).iter().any(|&element| element != 0.0)
        {
            needs[wire.to.0].push(wire.from.0);
        }
    }
    needs
}

/// Blocks in the order of dependence; those of a circle where there is one.
fn order(acting: &[(usize, bool)], needs: &[Vec<usize>]) -> Result<Vec<usize>, Vec<usize>> {
    let at_once: HashMap<usize, bool> = acting.iter().copied().collect();
    let needed_now = |block: usize| {
        needs[block].iter().copied().filter(|other| at_once.get(other).copied().unwrap_or(false))
    };
    let mut done = Vec::new();
    let mut left: Vec<usize> = acting.iter().map(|&(block, _)| block).collect();
    while !left.is_empty() {
        let (ready, waiting): (Vec<_>, Vec<_>) =
            left.iter().partition(|&&block| needed_now(block).all(|other| done.contains(&other)));
        if ready.is_empty() {
            return Err(circle(&waiting, |block| {
                needed_now(block).find(|other| waiting.contains(other)).unwrap_or(block)
            }));
        }
        done.extend(ready);
        left = waiting;
    }
    Ok(done)
}

/// Follows `next` from any block until one comes up again.
fn circle(waiting: &[usize], next: impl Fn(usize) -> usize) -> Vec<usize> {
    let mut path = vec![waiting[0]];
    loop {
        let block = next(path[path.len() - 1]);
        if let Some(start) = path.iter().position(|&earlier| earlier == block) {
            return path.split_off(start);
        }
        path.push(block);
    }
}
