//! A tick with a soft body allocates nothing and frees nothing, whatever the local model is.

use crate::common::{BLOCK, Rig, scene};
use cotouch_scene::geometry::{Reading, Readings};
use cotouch_testkit::scenes::local_model_kinds;
use cotouch_testkit::{allocations, deallocations};
use glam::DVec3;

/// How often `act` allocates and frees.
fn calls(act: impl FnOnce()) -> u64 {
    let mut allocated = 0;
    let freed = deallocations(|| allocated = allocations(act));
    allocated + freed
}

#[test]
fn a_tick_allocates_nothing_and_frees_nothing() {
    for kind in local_model_kinds() {
        for hold in ["zero", "first"] {
            let overrides = [format!("local_model.kind={kind}"), format!("local_model.hold={hold}")];
            let mut rig = Rig::new(&scene(BLOCK, &overrides.each_ref().map(String::as_str)));
            let (mut in_ticks, mut touched) = (0, 0);
            for tick in 0..400 {
                // In, along, and out.
                let turn = f64::from(tick) * std::f64::consts::TAU / 400.0;
                let finger = DVec3::new(0.025 + 2e-5 * f64::from(tick), 0.042, 0.046 + 0.004 * turn.cos());
                let readings: Readings = [Reading::point(finger, DVec3::ZERO)].into_iter().collect();
                in_ticks += calls(|| {
                    if let Some(period) = rig.model.frame_due(rig.tick) {
                        let frame = rig.frames.pop_front().unwrap();
                        assert_eq!(frame.period, Some(period));
                        rig.model.take_frame(&mut rig.state, rig.tick, frame);
                    }
                    rig.model.tick_into(&mut rig.state, rig.tick, &readings, &mut rig.output);
                });
                touched += u32::from(rig.output.device[0].force != DVec3::ZERO);
                if let Some(input) = &rig.output.slow {
                    rig.frames.push_back(rig.slow.step(input));
                }
                rig.tick += 1;
            }
            assert_eq!(in_ticks, 0, "{kind}, {hold}");
            assert!(touched > 100, "{kind}, {hold}: {touched}");
        }
    }
}
