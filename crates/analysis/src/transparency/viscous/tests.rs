//! Damping by a coordination scheme with memory, against the loop pushed until its pace is steady.

use std::sync::Arc;

use cotouch_testkit::scenes::built_in;

use super::*;
use crate::compile::schemes_with_memory::{Filtered, WithMemory};
use crate::compile::{compile, compile_with_schemes};
use crate::transparency::source::{self, Cut};

const USER: HostIndex = HostIndex(0);

fn with_memory(share: f64, filtered: Filtered) -> LoopSpec {
    let scene = built_in("single-axis", &[]);
    let mut modes = compile_with_schemes(&scene, |gains| Arc::new(WithMemory { gains, share, filtered }));
    modes.swap_remove(0).spec
}

fn damping(spec: &LoopSpec) -> Option<f64> {
    Viscous::new(spec, Some(USER), USER).unwrap().damping
}

/// 1 N over the velocity that it leads to, pattern after pattern.
fn pushed_for_long(spec: &LoopSpec) -> f64 {
    let mut held = Held::by_hand(spec, USER, &|_| DVec3::X);
    let read = held.answer(1);
    let source = source::at_ticks(&mut held, 0.0);
    let whole = held.spec.lift_shared().unwrap();
    let first = whole.index_of(held.spec.bodies[source.0].states[0]).unwrap();
    let cut = Cut::new(&whole.matrix, &[first, first + 1]);
    let push = cut.column(&whole.matrix, first);
    let mut state = push.clone();
    for _ in 0..20_000 {
        state = &cut.map * state + &push;
    }
    let velocity = |&(body, number, factor): &(crate::loop_spec::BodyId, usize, f64)| {
        let name = held.spec.bodies[body.0].states[number];
        let place = whole.index_of(name).unwrap();
        state[cut.places.iter().position(|&own| own == place).unwrap()] * factor
    };
    read.iter().map(velocity).sum::<f64>().recip()
}

#[test]
fn a_low_pass_on_differences_has_its_damping() {
    let share = -(-std::f64::consts::TAU * 50.0 / 1024.0).exp_m1();
    let found = damping(&with_memory(share, Filtered::Apart)).unwrap();
    assert!((found - 6.431).abs() < 5e-4, "{found}");
}

#[test]
fn damping_is_that_of_a_long_push() {
    for filtered in [Filtered::Apart, Filtered::Sent] {
        for share in [0.1, 0.5, 1.0] {
            let spec = with_memory(share, filtered);
            let (found, pushed) = (damping(&spec).unwrap(), pushed_for_long(&spec));
            assert!((found - pushed).abs() < 1e-7 * pushed, "{filtered:?} {share}: {found} {pushed}");
        }
    }
    let pairwise = &compile(&built_in("single-axis", &[]))[0].spec;
    let (known, same) = (damping(pairwise).unwrap(), damping(&with_memory(1.0, Filtered::Apart)).unwrap());
    assert!((known - same).abs() < 1e-9 * known, "{known} {same}");
}

#[test]
fn a_scheme_that_reads_a_place_leaves_no_damping() {
    let grounded = Viscous::new(&with_memory(0.3, Filtered::ToStart), Some(USER), USER).unwrap();
    assert_eq!(grounded.damping, None);
    assert!(grounded.why_none.is_some_and(|why| why.starts_with("A spring ties")));
}

/// Whether what a push set in motion is found at a steady pace after a long time.
fn comes_to_a_pace(held: &Held) -> bool {
    let mut held = held.clone();
    let source = source::at_ticks(&mut held, 0.0);
    let whole = held.spec.lift_shared().unwrap();
    let first = whole.index_of(held.spec.bodies[source.0].states[0]).unwrap();
    let cut = Cut::new(&whole.matrix, &[first, first + 1]);
    let push = cut.column(&whole.matrix, first);
    let step = |state: &nalgebra::DVector<f64>| &cut.map * state + &push;
    let mut state = push.clone();
    for _ in 0..3_000 {
        state = step(&state);
    }
    let (moved, then) = (step(&state) - &state, step(&step(&state)) - step(&state));
    (&moved - then).norm() <= 1e-6 * moved.norm()
}

#[test]
fn a_damping_that_a_loop_never_comes_to_is_told_from_one_that_it_does() {
    let hand = "coupling.hand_object.stiffness_n_per_m=200000";
    let copies = "coupling.object_object.stiffness_n_per_m=200000";
    for (overrides, by_hand, simplified) in
        [(&[][..], true, true), (&[hand], false, true), (&[copies], false, false)]
    {
        let spec = &compile(&built_in("single-axis", overrides))[0].spec;
        let found = Viscous::new(spec, Some(USER), USER).unwrap();
        assert!(found.damping.is_some() && found.simplified.is_some());
        assert_eq!((found.by_hand_is_stable, found.simplified_is_stable), (by_hand, simplified));
        assert_eq!(comes_to_a_pace(&Held::by_hand(spec, USER, &|_| DVec3::X)), by_hand);
        assert_eq!(comes_to_a_pace(&Held::directly(spec, USER)), simplified);
    }
}
