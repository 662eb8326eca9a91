//! The gains of a scene that its linear loops depend on.

use cotouch_scene::reference::{GainKey, gain_keys};
use cotouch_scene::{Scene, with_override};

use crate::modes::contact_modes;
use crate::soft::Bodies;

/// Tables of a scene in the order in which their margins are told; others come after them.
const TABLES: [&str; 8] =
    ["coupling", "object", "hand", "wall", "contact", "governor", "local_model", "soft"];

/// A key and its value in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    pub(crate) key: &'static str,
    pub(crate) value: f64,
    /// Whether it is a damper.
    pub(crate) damps: bool,
}

/// The gains of a scene that are not 0.
pub(crate) fn present(scene: &Scene) -> Vec<Gain> {
    let gains = keys()
        .into_iter()
        .filter_map(|GainKey { name, damps }| Some(Gain { key: name, value: scene.number(name)?, damps }));
    gains.filter(|gain| gain.value != 0.0).collect()
}

/// All gains that a scene can have, in the order in which margins are told: a spring, then its damper.
fn keys() -> Vec<GainKey> {
    let mut keys: Vec<GainKey> = gain_keys().collect();
    let stems: Vec<&str> = keys.iter().map(|key| stem(key.name)).collect();
    keys.sort_by_key(|key| {
        let table = TABLES.iter().position(|table| key.name.split('.').next() == Some(table));
        let pair = stems.iter().position(|stem| *stem == self::stem(key.name));
        (table.unwrap_or(TABLES.len()), pair, key.damps)
    });
    keys
}

/// What the keys of a spring and of its damper have in common.
fn stem(key: &str) -> &str {
    key.split_once("stiffness").or(key.split_once("damping")).map_or(key, |(stem, _)| stem)
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
    use super::keys;

    /// Scripts may read rows by their place, so that of what there was stays.
    #[test]
    fn margins_are_told_in_an_order_that_stays() {
        let told = "coupling.hand_object.stiffness_n_per_m coupling.hand_object.damping_n_s_per_m \
                    coupling.remote_hand_object.stiffness_n_per_m coupling.remote_hand_object.damping_n_s_per_m \
                    coupling.object_object.stiffness_n_per_m coupling.object_object.damping_n_s_per_m \
                    coupling.hand_object_tangential.stiffness_n_per_m coupling.hand_object_tangential.damping_n_s_per_m \
                    coupling.remote_hand_object_tangential.stiffness_n_per_m \
                    coupling.remote_hand_object_tangential.damping_n_s_per_m \
                    coupling.object_object_rotational.stiffness_n_m_per_rad \
                    coupling.object_object_rotational.damping_n_m_s_per_rad \
                    object.damping_n_s_per_m object.rotational_damping_n_m_s_per_rad hand.stiffness_n_per_m \
                    hand.damping_n_s_per_m wall.stiffness_n_per_m wall.damping_n_s_per_m \
                    wall.tangential_stiffness_n_per_m wall.tangential_damping_n_s_per_m \
                    contact.body_body.stiffness_n_per_m contact.body_body.damping_n_s_per_m \
                    governor.damping_n_s_per_m local_model.stiffness_n_per_m local_model.stiffness_ratio \
                    local_model.integral_n_per_m local_model.integral_ratio soft.young_pa";
        let mut names = keys().into_iter().map(|key| key.name);
        for key in told.split_whitespace() {
            assert!(names.any(|name| name == key), "{key}");
        }
    }

    #[test]
    fn what_no_loop_has_has_no_margin() {
        let names: Vec<&str> = keys().iter().map(|key| key.name).collect();
        for key in
            ["contact.body_body_tangential.damping_n_s_per_m", "soft.mesh.stiffness_n_per_m", "hand.mass_kg"]
        {
            assert!(!names.contains(&key), "{key}");
        }
    }
}
