//! A change of a session's settings that its running loops take between two ticks.
//!
//! What can change so is what forces are made of: couplings, masses, dampings, friction, the wall's stiffness, kind and gains
//! of the local model, the governor's damping and passivity control, and what the network does to packets. States are kept, so nothing else may: who takes part and
//! with what, where things are, rates, delays. A change is made outside of the haptic thread, which only swaps it in.

use std::sync::Arc;

use cotouch_host::{HostModel, HostState};
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{LocalModel, Scene, SceneValues};

/// The constants of one host in a changed scene.
#[derive(Clone, Debug)]
pub struct HostChange {
    pub(crate) model: HostModel,
    pub(crate) scene: Arc<Scene>,
    /// The whole changed scene, for the recording.
    pub(crate) scene_toml: String,
}

impl HostChange {
    /// The constants of `host` in `scene`.
    #[must_use]
    pub fn new(scene: &Scene, host: HostIndex) -> Self {
        Self {
            model: HostModel::new(scene, host),
            scene: Arc::new(scene.clone()),
            scene_toml: cotouch_scene::to_toml(scene),
        }
    }

    /// Whether a session that runs `from` can run `to` from one tick to the next.
    #[must_use]
    pub fn is_possible(from: &Scene, to: &Scene) -> bool {
        let mut reached = SceneValues::clone(from);
        take_what_can_change(&mut reached, to);
        reached == **to && from.hosts().all(|host| has_the_same_states(from, to, host))
    }
}

fn take_what_can_change(scene: &mut SceneValues, to: &SceneValues) {
    scene.link.impairment = to.link.impairment.clone();
    scene.coupling = to.coupling.clone();
    scene.ground = to.ground.clone();
    let moment_cancellation = scene.contact.moment_cancellation;
    scene.contact = to.contact.clone();
    scene.contact.moment_cancellation = moment_cancellation;
    let (wall, from) = (&mut scene.wall, &to.wall);
    (wall.stiffness_n_per_m, wall.damping_n_s_per_m) = (from.stiffness_n_per_m, from.damping_n_s_per_m);
    wall.tangential_stiffness_n_per_m = from.tangential_stiffness_n_per_m;
    wall.tangential_damping_n_s_per_m = from.tangential_damping_n_s_per_m;
    (wall.static_friction, wall.dynamic_friction) = (from.static_friction, from.dynamic_friction);
    let (object, from) = (&mut scene.object, &to.object);
    (object.mass_kg, object.damping_n_s_per_m) = (from.mass_kg, from.damping_n_s_per_m);
    object.axis_damping_n_s_per_m = from.axis_damping_n_s_per_m;
    object.rotational_damping_n_m_s_per_rad = from.rotational_damping_n_m_s_per_rad;
    for (body, from) in scene.bodies.iter_mut().zip(&to.bodies) {
        body.mass_kg = from.mass_kg;
    }
    scene.governor.damping_n_s_per_m = to.governor.damping_n_s_per_m;
    scene.governor.passivity_control = to.governor.passivity_control;
    take_local_model(&mut scene.local_model, &to.local_model);
}

/// Kind and gains. What the slow loop is made of (which force it returns, when results come, how the surface moves, whether
/// contacts pull) stays.
fn take_local_model(model: &mut LocalModel, to: &LocalModel) {
    *model = LocalModel {
        stiffness_from: model.stiffness_from,
        returned_force: model.returned_force,
        hold: model.hold,
        result_delay_periods: model.result_delay_periods,
        sides: model.sides,
        ..to.clone()
    };
}

/// A wall that comes or goes has contacts of its own, for example.
fn has_the_same_states(from: &Scene, to: &Scene, host: HostIndex) -> bool {
    HostState::new(&HostModel::new(to, host)).fits(&HostModel::new(from, host))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(name: &str, settings: &[&str]) -> Scene {
        let overrides: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
        cotouch_scene::load(name, &overrides).unwrap()
    }

    #[test]
    fn forces_may_change_and_what_states_are_made_of_may_not() {
        let possible = [
            ("single-axis", "coupling.object_object.stiffness_n_per_m=900"),
            ("single-axis", "coupling.hand_object.damping_n_s_per_m=1.5"),
            ("single-axis", "object.mass_kg=0.5"),
            ("single-axis", "object.damping_n_s_per_m=-2"),
            ("single-axis", "wall.stiffness_n_per_m=300"),
            ("single-axis", "link.impairment.loss_rate=0.1"),
            ("grasp", "coupling.remote_hand_object.stiffness_n_per_m=100"),
            ("grasp", "contact.dynamic_friction=0.2"),
            ("grasp", "wall.stiffness_n_per_m=700"),
            ("grasp", "governor.damping_n_s_per_m=1"),
        ];
        for (name, setting) in possible {
            let changed = scene(name, &[setting]);
            assert_ne!(changed, scene(name, &[]), "{setting}");
            assert!(HostChange::is_possible(&scene(name, &[]), &changed), "{name} {setting}");
        }
        let impossible = [
            ("single-axis", "session.users=3"),
            ("single-axis", "link.delay_periods=3"),
            ("single-axis", "rates.network_hz=256"),
            ("single-axis", "hand.mass_kg=0.2"),
            ("single-axis", "session.coordination=\"average\""),
            ("grasp", "object.position_m=[0.0, 0.1, 0.0]"),
            ("grasp", "governor.max_force_n=2"),
        ];
        for (name, setting) in impossible {
            assert!(
                !HostChange::is_possible(&scene(name, &[]), &scene(name, &[setting])),
                "{name} {setting}"
            );
        }
        assert!(!HostChange::is_possible(&scene("single-axis", &[]), &scene("grasp", &[])));
        let without_walls = ["wall.stiffness_n_per_m=0", "wall.damping_n_s_per_m=0"];
        assert!(!HostChange::is_possible(&scene("grasp", &[]), &scene("grasp", &without_walls)));
    }
}
