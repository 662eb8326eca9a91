//! What counts as the mechanics' own, and what never does.

use cotouch_scene::names::{Coordinate, HostIndex, Part};
use cotouch_scene::scene::{Integrator, SpringDamper};
use cotouch_scene::time::Schedule;

use crate::dof::motion_quantities;
use crate::loop_spec::{Delay, Dynamics, LINE, Line, LoopBody, LoopSpec, Motion, Plant, Signal};
use crate::{LoopStability, analyze_loop};

const MASS_KG: f64 = 0.2;

/// A mass on a line that a spring and a damper pull to the ground, every 1/1024 s.
fn mass(spring: SpringDamper, plant: bool) -> LoopSpec {
    let host = HostIndex::FIRST;
    let mut spec = LoopSpec::new(Schedule::new("1024".parse().unwrap(), "128".parse().unwrap()).unwrap());
    let own = |quantity| Coordinate::Own { host, part: Part::Object(0), quantity };
    let dynamics = if plant {
        Dynamics::Plant(Plant::mass(MASS_KG, SpringDamper::default()))
    } else {
        Dynamics::Mass { mass_kg: MASS_KG, integrator: Integrator::ExactHold }
    };
    let body =
        spec.body(LoopBody { states: motion_quantities(LINE).map(own).collect(), axes: LINE, dynamics });
    spec.pull(body, Motion::Ground, spring);
    spec
}

fn spring(stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> SpringDamper {
    SpringDamper { stiffness_n_per_m, damping_n_s_per_m }
}

fn verdict(spec: &LoopSpec) -> LoopStability {
    analyze_loop(spec).unwrap()
}

#[test]
fn an_inverted_pendulum_topples_as_fast_as_its_statics_say() {
    for plant in [false, true] {
        for (stiffness, damping) in [(-5.0, 0.0), (-5.0, 1.0), (-200.0, 3.0)] {
            let found = verdict(&mass(spring(stiffness, damping), plant));
            // s² + b/m·s − k/m = 0.
            let (b, k) = (damping / MASS_KG, -stiffness / MASS_KG);
            let rate = -0.5 * b + (0.25 * b * b + k).sqrt();
            let [topples] = found.toppling_per_s[..] else { panic!("{stiffness} {damping}: {found:?}") };
            assert!((topples / rate - 1.0).abs() < 0.02, "{stiffness} {damping}: {topples}, {rate}");
            assert!(found.stable && found.spectral_radius < 1.0, "{found:?}");
        }
    }
}

#[test]
fn what_a_damper_drives_is_the_loops() {
    let found = verdict(&mass(spring(0.0, -1.0), false));
    assert!(!found.stable && found.toppling_per_s.is_empty(), "{found:?}");
    // Statics that topple excuse one pole, and no faster one.
    let found = verdict(&mass(spring(-5.0, -20.0), false));
    assert!(!found.stable && found.toppling_per_s.is_empty(), "{found:?}");
}

#[test]
fn what_sampling_drives_is_the_loops() {
    // k > 4·m/T²: the sampled spring overshoots more and more.
    let found = verdict(&mass(spring(5.0 * MASS_KG * 1024.0 * 1024.0, 0.0), false));
    assert!(!found.stable && found.toppling_per_s.is_empty(), "{found:?}");
}

/// Two masses, each of which a spring pulls to what it heard of the other some periods ago.
fn couple(spring: SpringDamper, periods: u32, more: SpringDamper) -> LoopSpec {
    let mut spec = mass(more, false);
    let one = crate::loop_spec::BodyId(0);
    let other = HostIndex(1);
    let own = |quantity| Coordinate::Own { host: other, part: Part::Object(0), quantity };
    let copy = LoopBody { states: motion_quantities(LINE).map(own).collect(), ..spec.bodies[0].clone() };
    let two = spec.body(copy);
    spec.pull(two, Motion::Ground, more);
    for (near, far, host, from) in [(one, two, HostIndex::FIRST, other), (two, one, other, HostIndex::FIRST)]
    {
        let line = spec.line(Line {
            host,
            from,
            part: Part::Object(0),
            signal: Signal::Motion(far),
            delay: Delay::periods(periods),
        });
        spec.pull(near, Motion::Held(line), spring);
    }
    spec
}

#[test]
fn what_delay_drives_is_the_loops() {
    // Held data damp the drift of two masses on a spring, and drive what oscillates.
    let found = verdict(&couple(spring(300.0, 0.0), 2, SpringDamper::default()));
    assert!(!found.stable && found.toppling_per_s.is_empty(), "{found:?}");
}

#[test]
fn two_coupled_pendulums_topple_once_alike_and_stand_against_each_other() {
    let found = verdict(&couple(spring(100.0, 5.0), 1, spring(-4.0, 1.0)));
    let [topples] = found.toppling_per_s[..] else { panic!("{found:?}") };
    assert!(topples < (4.0 / MASS_KG).sqrt() && found.stable, "{found:?}");
    // A spring that is too weak to hold them apart: both ways.
    let found = verdict(&couple(spring(1.0, 0.1), 1, spring(-4.0, 1.0)));
    assert_eq!(found.toppling_per_s.len(), 2, "{found:?}");
    assert!(found.stable, "{found:?}");
}
