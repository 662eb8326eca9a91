//! Equilibria that are not stable by statics alone.

use cotouch_analysis::analyze_settled;
use cotouch_scene::scene::Scene;

/// Two free fingers that squeeze a box from both sides with 1 N, and stick to it.
fn squeezed(stick_n_per_m: f64, hand_n_per_m: f64) -> Scene {
    let user = |name: &str, side: f64| {
        format!(
            "[[user]]\nname = \"{name}\"\nscript = [ {{ do = \"force\", force_n = [{}, 0, 0], duration_s = 9 }} ]\n\
             [[user.finger]]\nposition_m = [{}, 0, 0]\n",
            -side,
            side * 0.06
        )
    };
    let text = format!(
        "space = \"plane\"\n[session]\narchitecture = \"centralized\"\nusers = 2\n[link]\ndelay_periods = 0\n\
         [rates]\ncontrol_hz = 4000\nnetwork_hz = 4000\n\
         [hand]\nmass_kg = 0.02\ndamping_n_s_per_m = 2\nstiffness_n_per_m = {hand_n_per_m}\nfinger_radius_m = 0.008\n\
         [object]\nmass_kg = 0.4\nshape = \"box\"\nsize_m = [0.1, 0.06, 0.05]\n\
         [coupling]\nhand_object = {{ stiffness_n_per_m = 2000, damping_n_s_per_m = 4 }}\n\
         hand_object_tangential = {{ stiffness_n_per_m = {stick_n_per_m}, damping_n_s_per_m = 4 }}\n\
         remote_hand_object = {{ stiffness_n_per_m = 2000, damping_n_s_per_m = 4 }}\n\
         remote_hand_object_tangential = {{ stiffness_n_per_m = {stick_n_per_m}, damping_n_s_per_m = 4 }}\n{}{}",
        user("anna", -1.0),
        user("ben", 1.0)
    );
    cotouch_scene::parse(&text, "squeezed", None, &[]).unwrap()
}

#[test]
fn a_box_between_free_fingers_turns_as_statics_say() {
    let verdict = analyze_settled(&squeezed(4000.0, 0.0)).unwrap();
    let both = verdict.modes.iter().find(|mode| mode.contacts == ["anna.finger1", "ben.finger1"]).unwrap();
    // Stuck to the box, fingers go with it: (I + 2·m·L²)·θ̈ + 2·b·L²·θ̇ = 2·F·L·θ.
    let (mass, size, arm, hand) = (0.4, [0.1, 0.06], 0.058, 0.02);
    let inertia: f64 = mass / 12.0 * (size[0] * size[0] + size[1] * size[1]) + 2.0 * hand * arm * arm;
    let (damping, push) = (2.0 * 2.0 * arm * arm, 2.0 * 1.0 * arm);
    let rate = (-damping + (damping * damping + 4.0 * inertia * push).sqrt()) / (2.0 * inertia);
    let topples = both.toppling_per_s.expect("it is squeezed");
    assert!((topples / rate - 1.0).abs() < 0.03, "{topples} {rate}");
    assert!(both.stable && both.spectral_radius <= 1.0 + 1e-11, "{both:?}");
}

#[test]
fn hands_that_stay_where_they_are_hold_it() {
    let verdict = analyze_settled(&squeezed(4000.0, 200.0)).unwrap();
    assert!(verdict.modes.iter().all(|mode| mode.toppling_per_s.is_none()), "{:?}", verdict.modes);
}

#[test]
fn a_plate_on_one_finger_topples_and_the_loop_is_stable() {
    let verdict = analyze_settled(&cotouch_scene::load("four-hands", &[]).unwrap()).unwrap();
    let toppling: Vec<_> = verdict.modes.iter().filter(|mode| mode.toppling_per_s.is_some()).collect();
    assert!(!toppling.is_empty());
    let unstable: Vec<_> = verdict.modes.iter().filter(|mode| !mode.stable).collect();
    assert!(unstable.is_empty(), "{unstable:?}");
}
