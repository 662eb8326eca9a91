//! A verdict on a session in which something acts that no loop has.

use cotouch_analysis::Stability;

use crate::whole::analyze;

fn verdict(name: &str, set: &[&str]) -> Stability {
    let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    analyze(&cotouch_scene::load(name, &set).unwrap()).unwrap()
}

#[test]
fn what_acts_and_is_in_no_loop_keeps_a_scene_from_being_called_stable() {
    let rows: &[&[&str]] = &[
        &["device.kind=phantom", "device.encoder_counts_per_turn=4000", "device.velocity=difference"],
        &["governor.max_slew_n_per_s=3"],
        &["governor.max_force_n=0.1"],
        &["link.play_out=on-arrival", "link.impairment.jitter_s=0.03"],
        &["session.peer_timeout_s=0.01", "link.impairment.loss_rate=0.5"],
        &["link.impairment.loss_rate=0.5"],
        &["device.kind=phantom", "device.max_joint_torque_n_m=0.05"],
        &["governor.passivity_control=true"],
    ];
    for set in rows {
        let found = verdict("single-axis", set);
        assert_eq!(found.stable, None, "{set:?}");
        assert!(!found.left_out.is_empty() && found.each_mode_is_stable(), "{set:?}: {found:?}");
        assert!(found.left_out.iter().all(|gap| found.warnings.contains(&gap.to_string())), "{set:?}");
    }
}

#[test]
fn an_unstable_mode_stays_unstable_whatever_else_acts() {
    let set = ["coupling.object_object.stiffness_n_per_m=30000", "link.impairment.loss_rate=0.5"];
    assert_eq!(verdict("single-axis", &set).stable, Some(false));
}

#[test]
fn built_in_scenes_whose_every_key_is_in_the_loop_are_called_stable() {
    for name in ["single-axis", "single-axis-centralized", "sinusoid", "push-wall", "grasp"] {
        let found = verdict(name, &[]);
        assert_eq!((found.stable, found.left_out.len()), (Some(true), 0), "{name}");
    }
}
