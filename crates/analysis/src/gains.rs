//! The gains of a scene that its linear loops depend on.

use cotouch_scene::{Scene, with_override};

use crate::modes::contact_modes;
use crate::soft::Bodies;

/// Springs and dampers, by key, in the order in which margins are told: a key that is left out has none.
const KEYS: &[&str] = &[
    "coupling.hand_object.stiffness_n_per_m",
    "coupling.hand_object.damping_n_s_per_m",
    "coupling.remote_hand_object.stiffness_n_per_m",
    "coupling.remote_hand_object.damping_n_s_per_m",
    "coupling.object_object.stiffness_n_per_m",
    "coupling.object_object.damping_n_s_per_m",
    "coupling.hand_object_tangential.stiffness_n_per_m",
    "coupling.hand_object_tangential.damping_n_s_per_m",
    "coupling.remote_hand_object_tangential.stiffness_n_per_m",
    "coupling.remote_hand_object_tangential.damping_n_s_per_m",
    "coupling.object_object_rotational.stiffness_n_m_per_rad",
    "coupling.object_object_rotational.damping_n_m_s_per_rad",
    "object.damping_n_s_per_m",
    "object.rotational_damping_n_m_s_per_rad",
    "hand.stiffness_n_per_m",
    "hand.damping_n_s_per_m",
    "wall.stiffness_n_per_m",
    "wall.damping_n_s_per_m",
    "wall.tangential_stiffness_n_per_m",
    "wall.tangential_damping_n_s_per_m",
    "contact.body_body.stiffness_n_per_m",
    "contact.body_body.damping_n_s_per_m",
    "governor.damping_n_s_per_m",
    "local_model.stiffness_n_per_m",
    "local_model.stiffness_ratio",
    "local_model.integral_n_per_m",
    "local_model.integral_ratio",
    "soft.young_pa",
];

/// A key and its value in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    pub(crate) key: &'static str,
    pub(crate) value: f64,
}

/// The gains of a scene that are not 0.
pub(crate) fn present(scene: &Scene) -> Vec<Gain> {
    let gains = KEYS.iter().filter_map(|&key| Some(Gain { key, value: scene.number(key)? }));
    gains.filter(|gain| gain.value != 0.0).collect()
}

/// The gains that are not 0 and on which the loops of some contact mode depend.
pub(crate) fn acting_gains(scene: &Scene) -> Vec<Gain> {
    let bodies = Bodies::default();
    let loops = |scene: &Scene| contact_modes(scene, &bodies).ok();
    let as_it_is = loops(scene);
    let acts = |gain: &Gain| {
        // A little either way, whichever is allowed.
        let changed =
            [1.01, 0.99].into_iter().find_map(|f| with_override(scene, gain.key, f * gain.value).ok());
        changed.is_some_and(|changed| loops(&changed) != as_it_is)
    };
    present(scene).into_iter().filter(acts).collect()
}

#[cfg(test)]
mod tests {
    use super::KEYS;

    /// The analysis has no contact of bodies along their surfaces; K_o of a generated spring is what its gains are shares of.
    const WITHOUT_MARGIN: [&str; 3] = [
        "contact.body_body_tangential.stiffness_n_per_m",
        "contact.body_body_tangential.damping_n_s_per_m",
        "soft.mesh.stiffness_n_per_m",
    ];

    #[test]
    fn every_spring_and_damper_of_a_scene_has_its_margin() {
        let units = ["(N/m)", "(N·s/m)", "(N·m/rad)", "(N·m·s/rad)"];
        let acts = |allowed: &str| {
            allowed.starts_with("a number") && units.iter().any(|unit| allowed.ends_with(unit))
        };
        let keys = cotouch_scene::reference::keys();
        let without = keys.iter().filter(|key| acts(&key.allowed) && !KEYS.contains(&key.name.as_str()));
        let without: Vec<&str> = without.map(|key| key.name.as_str()).collect();
        assert_eq!(without, WITHOUT_MARGIN);
        assert!(KEYS.iter().all(|key| keys.iter().any(|known| known.name == *key)));
    }
}
