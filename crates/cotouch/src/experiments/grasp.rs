//! Figure 8.1: two users grasp and move a box, distributed and centralized.

use serde_json::json;

use super::outcome::{Claim, Experiment, Outcome, csv};
use super::runs::{self, Run, curve, rms};
use crate::figure::chart::{Panel, Series, chart};

pub(super) const FIGURE_8_1: Experiment = Experiment {
    id: "fig8.1",
    title: "Cooperative grasp: force between finger and box, and the box's path",
    run,
};

const DURATION_S: f64 = 20.0;
const SOFT_REMOTE: &[&str] = &[
    "coupling.remote_hand_object.stiffness_n_per_m=170",
    "coupling.remote_hand_object.damping_n_s_per_m=3",
    "coupling.remote_hand_object_tangential.stiffness_n_per_m=270",
    "coupling.remote_hand_object_tangential.damping_n_s_per_m=5",
];

fn run() -> anyhow::Result<Outcome> {
    let distributed = Run::of("grasp", &[], DURATION_S)?;
    let centralized = Run::of("grasp-centralized", &[], DURATION_S)?;
    let soft = Run::of("grasp-centralized", SOFT_REMOTE, DURATION_S)?;
    let cases = [
        ("distributed, 800 N/m", "stable", true, &distributed),
        ("centralized, remote at 800 N/m", "unstable", false, &centralized),
        ("centralized, remote at 170 N/m", "stable", true, &soft),
    ];
    let mass_only: Vec<f64> = cases
        .iter()
        .map(|(.., run)| runs::radius_of_mass_only_hands(&run.scene))
        .collect::<Result<_, _>>()?;
    let mut claims = Vec::new();
    let mut rows = Vec::new();
    let mut values = serde_json::Map::new();
    for ((name, word, stable, run), mass_only) in cases.iter().zip(&mass_only) {
        let shaking_n = shaking_n(run);
        claims.push(Claim::new(
            format!("{name}: {word}"),
            run.predicted.each_mode_is_stable() == *stable && run.summary.stable == *stable,
        ));
        let here = format!(
            "{}; the remote finger's force shakes by {shaking_n:.4} N rms; with mass-only hands the radius is {mass_only:.4}",
            run.verdict_in_words()
        );
        rows.push([(*name).to_owned(), (*word).to_owned(), here]);
        values.insert(
            (*name).to_owned(),
            json!({
                "predicted_stable": run.predicted.stable,
                "spectral_radius": run.predicted.spectral_radius,
                "run_stable": run.summary.stable,
                "shaking_rms_n": shaking_n,
                "spectral_radius_mass_only_hands": mass_only,
            }),
        );
    }
    let agrees = claims.iter().all(|claim| claim.holds);
    Ok(Outcome {
        published_value: json!({
            "distributed, 800 N/m": "stable",
            "centralized, remote at 800 N/m": "unstable",
            "centralized, remote at 170 N/m": "stable",
        }),
        value: values.into(),
        agrees,
        note: "An oscillation that friction bounds keeps its size instead of growing: such a run shakes. The users of Fotoohi Ghiam 2006 are people; here simulated hands of 5 N·s/m follow one script under every \
               architecture. Hands that are masses and nothing else are less stable: their radius stands beside."
            .to_owned(),
        claims,
        rows,
        figure: Some(figure(&distributed, &centralized)?),
        table: Some(table(&distributed, &centralized)),
        commands: vec![
            "cotouch run grasp --virtual --duration 20".to_owned(),
            "cotouch run grasp-centralized --virtual --duration 20".to_owned(),
            format!("cotouch run grasp-centralized --virtual --duration 20 --set {}", SOFT_REMOTE.join(" --set ")),
        ],
    })
}

/// The remote user is the second one.
const REMOTE: usize = 1;

/// While the box is held.
const HELD_S: std::ops::Range<f64> = 3.0..18.0;

/// What changes from one network period to the next but one in the force on the remote user's first finger, rms, N: fast
/// oscillation, without what the users do.
fn shaking_n(run: &Run) -> f64 {
    let host = &run.hosts[REMOTE];
    let force = &host.fingers[0].force_n;
    let second_difference = |at: usize| (force[at - 1] - 2.0 * force[at] + force[at + 1]).length() / 4.0;
    rms(host.between(HELD_S).map(second_difference))
}

fn figure(distributed: &Run, centralized: &Run) -> anyhow::Result<String> {
    let force = |run: &Run, colour, label: &str| {
        let host = &run.hosts[REMOTE];
        Series::solid(label, colour, curve(&host.time_s, |at| host.fingers[0].largest_force_n[at]))
    };
    let path = |run: &Run, colour, label: &str| {
        let host = &run.hosts[0];
        let points = host.body_m.iter().map(|position| (1e3 * position.x, 1e3 * position.y));
        Series::solid(label, colour, points.collect())
    };
    let (one, other) = ("distributed", "centralized, remote user");
    let panels = [
        Panel {
            title: "(a) force between a finger of the second user and the box".to_owned(),
            x_label: "time, s".to_owned(),
            y_label: "force, N".to_owned(),
            series: vec![force(centralized, 1, other), force(distributed, 0, one)],
            equal_scales: false,
            ..Panel::default()
        },
        Panel {
            title: "(b) path of the box".to_owned(),
            x_label: "x, mm".to_owned(),
            y_label: "y, mm".to_owned(),
            series: vec![path(centralized, 1, "centralized"), path(distributed, 0, one)],
            equal_scales: true,
            ..Panel::default()
        },
    ];
    chart("Figure 8.1: cooperative grasp at n = 1, Tables 8.1 and 8.2", &panels)
}

fn table(distributed: &Run, centralized: &Run) -> String {
    let mut header = vec!["time_s".to_owned()];
    let mut columns: Vec<Vec<f64>> = vec![distributed.hosts[REMOTE].time_s.clone()];
    for (name, run) in [("distributed", distributed), ("centralized", centralized)] {
        let (remote, first) = (&run.hosts[REMOTE], &run.hosts[0]);
        header.extend(
            ["finger_force_n", "box_x_m", "box_y_m", "box_turn_rad"].map(|what| format!("{name}_{what}")),
        );
        columns.push(remote.fingers[0].largest_force_n.clone());
        columns.push(first.body_m.iter().map(|position| position.x).collect());
        columns.push(first.body_m.iter().map(|position| position.y).collect());
        columns.push(first.body_turn_rad.clone());
    }
    csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}
