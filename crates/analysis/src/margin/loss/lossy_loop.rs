//! A loop with what lost packets do to it as inputs and outputs.

use std::ops::Range;

use cotouch_scene::names::HostIndex;
use cotouch_world::LinearBlock;
use nalgebra::{DMatrix, DVector};

use crate::check::{SpecError, check};
use crate::deflate::deflate;
use crate::lift::layout::Layout;
use crate::lift::stepping::{Fault, lift_with_faults};
use crate::loop_spec::LoopSpec;
use crate::margin::found::Found;
use crate::rigid::Structure;
use cotouch_matrix::balance;

/// Numbers of the state and of all samples of a pattern: more take more than a minute.
const MAX_NUMBERS: usize = 1000;

/// The system of this module's parent over a pattern.
pub(super) struct LossyLoop {
    pub(super) system: LinearBlock,
    /// The numbers of w and v that belong to each packet.
    pub(super) packets: Vec<Range<usize>>,
}

impl LossyLoop {
    pub(super) fn new(spec: &LoopSpec) -> Result<Found<Self>, SpecError> {
        check(spec)?;
        let layout = Layout::with_memory(spec);
        let (faults, packets) = faults(spec, &layout);
        let samples = packets.last().map_or(0, |packet| packet.end);
        let states = layout.coordinates.len();
        if states + samples > MAX_NUMBERS {
            return Ok(Err(format!(
                "The loss margin is only computed for loops of up to {MAX_NUMBERS} states and samples a pattern; this one has {states} and {samples}."
            )));
        }
        let system = lift_with_faults(spec, &layout, &faults);
        if !is_causal(&system.d, &packets) {
            return Ok(Err(
                "The loss margin is not computed where packets of one network step depend on each other."
                    .to_owned(),
            ));
        }
        let rigid = Structure::new(spec, &layout, &system.a).rigid;
        Ok(Ok(Self { system: without_unaffected(system, rigid), packets }))
    }
}

/// What one host sends to another at one network step of a pattern. Samples of motions and of forces that follow from them
/// never share one: see [`is_causal`].
type Packet = (i64, HostIndex, HostIndex);

/// Every sample of a pattern, with the place of its numbers in w and v, packet by packet.
pub(super) fn faults(spec: &LoopSpec, layout: &Layout) -> (Vec<Fault>, Vec<Range<usize>>) {
    let line = |register: usize| &spec.lines[layout.registers[register].line.0];
    let packet =
        |&(step, register): &(i64, usize)| -> Packet { (step, line(register).from, line(register).host) };
    let steps = 0..spec.network_steps() as i64;
    let mut samples: Vec<(i64, usize)> =
        steps.flat_map(|step| (0..layout.registers.len()).map(move |register| (step, register))).collect();
    samples.sort_by_key(packet);
    let mut first = 0;
    let mut faults = Vec::new();
    let mut packets = Vec::new();
    for of_packet in samples.chunk_by(|one, other| packet(one) == packet(other)) {
        let begin = first;
        for &(step, register) in of_packet {
            faults.push(Fault { step, register, first });
            first += layout.registers[register].numbers;
        }
        packets.push(begin..first);
    }
    (faults, packets)
}

/// Whether what a receiver holds of a packet never depends, within a pattern, on whether that packet itself arrived: whether
/// packets can be put in an order in which each depends on earlier ones only.
pub(super) fn is_causal(d: &DMatrix<f64>, packets: &[Range<usize>]) -> bool {
    let depends = |packet: &Range<usize>, on: &Range<usize>| {
        d.view((packet.start, on.start), (packet.len(), on.len())).iter().any(|&gain| gain != 0.0)
    };
    let mut left: Vec<_> = packets.iter().collect();
    while !left.is_empty() {
        let before = left.len();
        let still = left.clone();
        left.retain(|packet| still.iter().any(|on| depends(packet, on)));
        if left.len() == before {
            return false;
        }
    }
    true
}

/// The system in a well-scaled basis, without the directions of `candidates` that it and all losses leave as they are.
fn without_unaffected(mut system: LinearBlock, candidates: Vec<DVector<f64>>) -> LinearBlock {
    let scales = DVector::from_vec(balance(&mut system.a));
    for (index, &scale) in scales.iter().enumerate() {
        system.b.row_mut(index).unscale_mut(scale);
        system.c.column_mut(index).scale_mut(scale);
    }
    let mut vectors: Vec<_> = candidates.iter().map(|vector| vector.component_div(&scales)).collect();
    vectors.reverse();
    while let Some(vector) = vectors.pop() {
        let size = 1e-9 * vector.norm();
        let stays = (&system.a * &vector - &vector).norm() <= size * (1.0 + system.a.norm());
        if !stays || (&system.c * &vector).norm() > size * (1.0 + system.c.norm()) {
            continue;
        }
        let (a, reflection) = deflate(&system.a, &vector);
        let reflected = |columns: &DMatrix<f64>| {
            let columns: Vec<_> =
                columns.column_iter().map(|column| reflection.deflate_vector(&column.into_owned())).collect();
            DMatrix::from_fn(a.nrows(), columns.len(), |row, column| columns[column][row])
        };
        let (b, c) = (reflected(&system.b), reflected(&system.c.transpose()).transpose());
        system = LinearBlock { a, b, c, d: system.d };
        vectors.iter_mut().for_each(|later| *later = reflection.deflate_vector(later));
    }
    system
}
