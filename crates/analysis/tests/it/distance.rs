//! The distance to the line, as it is told, holds for every mode that was judged.

use cotouch_analysis::Switching;
use cotouch_scene::Scene;
use cotouch_scene::scene::SpringDamper;

use crate::whole::analyze;

/// The scene with contacts that are stiffer by a factor; with dampers too, or not.
fn stiffer(scene: &Scene, factor: f64, dampers: bool) -> Scene {
    let damper = if dampers { factor } else { 1.0 };
    let of = |spring: &mut SpringDamper| {
        spring.stiffness_n_per_m *= factor;
        spring.damping_n_s_per_m *= damper;
    };
    let edited = scene.edit(|scene| {
        let coupling = &mut scene.coupling;
        of(&mut coupling.hand_object);
        of(&mut coupling.hand_object_tangential);
        of(&mut coupling.remote_hand_object);
        of(&mut coupling.remote_hand_object_tangential);
        of(&mut scene.contact.body_body);
        of(&mut scene.contact.body_body_tangential);
        scene.wall.stiffness_n_per_m *= factor;
        scene.wall.tangential_stiffness_n_per_m *= factor;
        scene.wall.damping_n_s_per_m *= damper;
        scene.wall.tangential_damping_n_s_per_m *= damper;
    });
    edited.unwrap()
}

fn is_where_it_is_told(name: &str) {
    let scene = cotouch_scene::load(name, &[]).unwrap();
    let told = analyze(&scene).unwrap();
    assert_eq!((told.stable, told.switching), (Some(true), Switching::Searched), "{name}");
    let distance = told.switching_distance.unwrap();
    let unstable = |share: f64| {
        [false, true].map(|dampers| {
            let found = analyze(&stiffer(&scene, share * distance, dampers)).unwrap();
            !found.each_mode_is_stable()
        })
    };
    assert_eq!(unstable(0.99), [false, false], "{name}: {distance}");
    assert_ne!(unstable(1.01), [false, false], "{name}: {distance}");
}

#[test]
fn every_judged_mode_of_grasp_is_stable_up_to_the_distance_and_one_is_not_beyond() {
    is_where_it_is_told("grasp");
}

#[test]
fn every_judged_mode_of_sinusoid_is_stable_up_to_the_distance_and_one_is_not_beyond() {
    is_where_it_is_told("sinusoid");
}
