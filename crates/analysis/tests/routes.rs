//! Three routes, one map.

mod common;

use common::{spring, table_6_1, way, with_ratio, with_users};
use cotouch_analysis::compile::compile;
use cotouch_analysis::diagram::{Diagram, DiagramError, Route};
use cotouch_analysis::loop_spec::LoopSpec;
use cotouch_scene::scene::{Architecture, Coordination, Integrator, PlayOut, Scene};
use nalgebra::DMatrix;
use proptest::prelude::*;

fn assert_close(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> Result<(), TestCaseError> {
    prop_assert_eq!(found.shape(), expected.shape());
    let (error, size) = ((found - expected).amax(), expected.amax());
    prop_assert!(error <= 1e-10 * size, "{} of {}", error, size);
    Ok(())
}

fn any_scene() -> impl Strategy<Value = Scene> {
    let shape = (any::<bool>(), 2u8..4, 0u32..4, 1u32..9, any::<[bool; 5]>());
    let gains = (10.0..2000.0, 0.0..20.0, 10.0..300.0, 0.0..10.0, 0.05..0.5, -1.0..5.0);
    (shape, gains, prop::array::uniform4(0.0..0.006)).prop_map(|(shape, gains, latencies)| {
        let (distributed, users, n, ratio, [grounded, average, euler, on_arrival, uneven]) = shape;
        let (k1, b1, k2, b2, mass_kg, damping_n_s_per_m) = gains;
        let architecture = if distributed { Architecture::Distributed } else { Architecture::Centralized };
        let mut scene = with_ratio(with_users(table_6_1(architecture), users), ratio);
        if uneven {
            scene.rates.network_hz = format!("{}/{}", 1024 * 2, 2 * ratio + 1).parse().unwrap();
        }
        scene.coupling.hand_object = spring(k1, b1);
        scene.coupling.remote_hand_object = spring(k2, b2);
        scene.coupling.object_object = spring(k2, b1);
        scene.hand.mass_kg = mass_kg;
        scene.object.damping_n_s_per_m = damping_n_s_per_m;
        scene.link.delay_periods = n;
        if grounded {
            scene.hand.stiffness_n_per_m = 100.0;
        }
        if average {
            scene.session.coordination = Coordination::Average;
        }
        if euler {
            scene.session.integrator = Integrator::SemiImplicitEuler;
        }
        if on_arrival {
            scene.link.play_out = PlayOut::OnArrival;
        }
        let [a, b, c, d] = latencies;
        scene.link.ways = vec![way(0, 1, a), way(1, 0, b)];
        scene.link.impairment.latency_s = c.min(d);
        scene
    })
}

fn assert_routes_agree(spec: &LoopSpec) -> Result<(), TestCaseError> {
    let expected = spec.lift().unwrap();
    let diagram = spec.to_diagram().unwrap();
    let names: Vec<_> = expected.coordinates.iter().map(ToString::to_string).collect();
    prop_assert_eq!(diagram.states().unwrap(), names);
    for route in [Route::Stepping, Route::StateSpace, Route::Resampling] {
        match diagram.lift(route) {
            Ok(map) => assert_close(&map.matrix, &expected.matrix)?,
            Err(error) => {
                let is_allowed = route == Route::Resampling && matches!(error, DiagramError::NotNested(_));
                prop_assert!(is_allowed, "{}", error);
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_routes_agree_on_scenes(scene in any_scene()) {
        assert_routes_agree(&compile(&scene)[0].spec)?;
    }
}
