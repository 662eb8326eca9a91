//! The step functions of every coordination scheme and its linear blocks are the same map.

use std::sync::Arc;

use cotouch_scene::limits::{MAX_CHANNEL_MEMORY, MAX_CHANNEL_VECTORS};
use cotouch_scene::{Override, load};
use cotouch_world::BodyState;
use cotouch_world::LinearBlock;
use cotouch_world::coordination::{CouplingGains, OwnMotion, Scheme, SchemeSize, TickMotion, gains, scheme};
use cotouch_world::coupler::Stretch;
use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Every scheme that a scene can name, with the gains of both kinds of channel.
fn schemes() -> Vec<Arc<dyn Scheme>> {
    let mut schemes = Vec::new();
    for name in ["pairwise", "average"] {
        let named: Override = format!("session.coordination={name}").parse().unwrap();
        let scene = load("grasp", &[named]).unwrap();
        let named = gains(&scene.coupling).map(|gains| scheme(&scene, gains));
        // The scene counts the room in packets by this.
        assert!(named.iter().all(|named| (named.size().sent > 0) == scene.session.coordination.sends()));
        schemes.extend(named);
    }
    schemes
}

/// A scheme that uses all that there is: it low-passes how far the copies are apart, sends a low-passed position and the
/// velocity, and answers what it received.
#[derive(Debug)]
struct LowPass {
    gains: CouplingGains,
}

const SHARE: f64 = 0.3;

impl Scheme for LowPass {
    fn size(&self) -> SchemeSize {
        SchemeSize { tick_memory: 1, step_memory: 1, sent: 2 }
    }

    fn tick(&self, memory: &mut [DVec3], at: &TickMotion<'_>) -> DVec3 {
        memory[0] += SHARE * (at.apart.position - memory[0]);
        self.gains.stiffness * memory[0] + self.gains.damping * at.apart.velocity + at.received[0]
            - 2.0 * at.received[1]
            - 0.5 * at.own.velocity()
    }

    fn network_step(&self, ticks: &[DVec3], memory: &mut [DVec3], own: &OwnMotion<'_>, sent: &mut [DVec3]) {
        memory[0] += SHARE * (own.position() - memory[0]);
        sent[0] = memory[0] + 3.0 * ticks[0];
        sent[1] = own.velocity();
    }

    fn tick_block(&self) -> LinearBlock {
        let CouplingGains { stiffness, damping } = self.gains;
        LinearBlock {
            a: DMatrix::from_element(1, 1, 1.0 - SHARE),
            b: DMatrix::from_row_slice(1, 6, &[SHARE, 0.0, 0.0, 0.0, 0.0, 0.0]),
            c: DMatrix::from_element(1, 1, stiffness * (1.0 - SHARE)),
            d: DMatrix::from_row_slice(1, 6, &[stiffness * SHARE, damping, 0.0, -0.5, 1.0, -2.0]),
        }
    }

    fn step_block(&self) -> LinearBlock {
        LinearBlock {
            a: DMatrix::from_element(1, 1, 1.0 - SHARE),
            b: DMatrix::from_row_slice(1, 3, &[SHARE, 0.0, 0.0]),
            c: DMatrix::from_row_slice(2, 1, &[1.0 - SHARE, 0.0]),
            d: DMatrix::from_row_slice(2, 3, &[SHARE, 0.0, 3.0, 0.0, 1.0, 0.0]),
        }
    }
}

/// States and outputs of a block, one below the other, for states and inputs given likewise.
fn apply(block: &LinearBlock, given: &DVector<f64>) -> DVector<f64> {
    let states = block.a.nrows();
    let (x, u) = (given.rows(0, states), given.rows(states, given.len() - states));
    let mut result = DVector::zeros(states + block.c.nrows());
    result.rows_mut(0, states).copy_from(&(&block.a * x + &block.b * u));
    result.rows_mut(states, block.c.nrows()).copy_from(&(&block.c * x + &block.d * u));
    result
}

/// All numbers lie along `axis`; what comes of them must do so too.
fn along(vectors: &[DVec3], axis: DVec3) -> Vec<f64> {
    let along = |vector: &DVec3| {
        assert_eq!(*vector, axis * vector.dot(axis), "a scheme acts along each axis by itself");
        vector.dot(axis)
    };
    vectors.iter().map(along).collect()
}

fn own_motion(position: DVec3, velocity: DVec3) -> BodyState {
    let mut body = BodyState::at_rest(position);
    body.twist.linear = velocity;
    body
}

fn tick(scheme: &dyn Scheme, given: &DVector<f64>, axis: DVec3) -> Vec<f64> {
    let given: Vec<DVec3> = given.iter().map(|&number| axis * number).collect();
    let (memory, inputs) = given.split_at(scheme.size().tick_memory);
    let mut memory = memory.to_vec();
    let body = own_motion(inputs[2], inputs[3]);
    let force = scheme.tick(
        &mut memory,
        &TickMotion {
            apart: Stretch { position: inputs[0], velocity: inputs[1] },
            own: OwnMotion::Translation(&body),
            received: &inputs[4..],
        },
    );
    memory.push(force);
    along(&memory, axis)
}

fn network_step(scheme: &dyn Scheme, given: &DVector<f64>, axis: DVec3) -> Vec<f64> {
    let given: Vec<DVec3> = given.iter().map(|&number| axis * number).collect();
    let (memory, inputs) = given.split_at(scheme.size().step_memory);
    let mut memory = memory.to_vec();
    let body = own_motion(inputs[0], inputs[1]);
    let mut sent = vec![DVec3::ZERO; scheme.size().sent];
    scheme.network_step(&inputs[2..], &mut memory, &OwnMotion::Translation(&body), &mut sent);
    memory.extend(sent);
    along(&memory, axis)
}

fn assert_same(
    scheme: &dyn Scheme,
    block: &LinearBlock,
    step: fn(&dyn Scheme, &DVector<f64>, DVec3) -> Vec<f64>,
) {
    let given = block.a.ncols() + block.b.ncols();
    let columns =
        (0..given).map(|column| DVector::from_fn(given, |row, _| f64::from(u8::from(row == column))));
    let mixed = DVector::from_fn(given, |row, _| 0.7 - 0.4 * row as f64);
    for given in columns.chain([mixed]) {
        let expected = apply(block, &given);
        for axis in DVec3::AXES {
            let found = DVector::from_vec(step(scheme, &given, axis));
            let error = (&found - &expected).amax();
            assert!(
                error <= 1e-12 * expected.amax().max(1.0),
                "{scheme:?}: {given} gives {found}, not {expected}"
            );
        }
    }
}

#[test]
fn steps_and_blocks_are_the_same_map() {
    let gains = CouplingGains { stiffness: 200.0, damping: 3.0 };
    let all = schemes().into_iter().chain([Arc::new(LowPass { gains }) as Arc<dyn Scheme>]);
    for scheme in all {
        let size = scheme.size();
        assert!(
            size.tick_memory.max(size.step_memory) <= MAX_CHANNEL_MEMORY && size.sent <= MAX_CHANNEL_VECTORS
        );
        let (ticks, steps) = (scheme.tick_block(), scheme.step_block());
        assert_eq!((ticks.a.nrows(), ticks.d.shape()), (size.tick_memory, (1, 4 + size.sent)), "{scheme:?}");
        assert_eq!(
            (steps.a.nrows(), steps.d.shape()),
            (size.step_memory, (size.sent, 2 + size.tick_memory)),
            "{scheme:?}"
        );
        assert_same(&*scheme, &ticks, tick);
        assert_same(&*scheme, &steps, network_step);
    }
}

#[test]
fn an_average_counts_every_copy_that_is_there_and_a_pair_counts_fully() {
    let [pairwise, _, average, _] = &schemes()[..] else { panic!("two schemes, two kinds of channel") };
    for present in [0.0, 0.25, 1.0, 15.0] {
        assert_eq!(pairwise.weight(present), 1.0);
        assert_eq!(average.weight(present), 1.0 / (1.0 + present));
    }
}
