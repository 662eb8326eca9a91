//! In which order blocks are evaluated whose outputs follow their inputs at once.

use crate::loop_spec::{BlockId, LoopSpec, Motion};

/// The blocks whose outputs can be used at the tick at which their inputs are sampled, each after those that it reads.
///
/// # Errors
/// Blocks that depend on each other in a circle.
pub(crate) fn direct_blocks(spec: &LoopSpec) -> Result<Vec<BlockId>, Vec<BlockId>> {
    let is_direct = |block: &BlockId| spec.blocks[block.0].is_direct();
    let mut waiting: Vec<BlockId> = (0..spec.blocks.len()).map(BlockId).filter(is_direct).collect();
    let mut ordered = Vec::with_capacity(waiting.len());
    while !waiting.is_empty() {
        let reads_waiting = |block: &BlockId| {
            let terms = spec.blocks[block.0].input.terms.iter().filter(|term| term.gain != 0.0);
            let mut read = terms.filter_map(|term| match term.motion {
                Motion::Output(other) => Some(other),
                Motion::Ground | Motion::Current(_) | Motion::Held(_) => None,
            });
            read.any(|other| waiting.contains(&other))
        };
        let (blocked, ready): (Vec<_>, Vec<_>) = waiting.iter().partition(|block| reads_waiting(block));
        if ready.is_empty() {
            return Err(blocked);
        }
        ordered.extend(ready);
        waiting = blocked;
    }
    Ok(ordered)
}
