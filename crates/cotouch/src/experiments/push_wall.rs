//! Figure 8.4: the box pushed against a stiff wall, by the distributed, the local and the remote user.

use serde_json::json;

use super::outcome::{Claim, Experiment, Outcome, csv};
use super::runs::{Run, curve, load};
use crate::figure::chart::{Panel, Series, chart};

pub(super) const FIGURE_8_4: Experiment =
    Experiment { id: "fig8.4", title: "Finger position while the box is pushed against a stiff wall", run };

/// Three periods of 1.5·sin(3t) N.
const DURATION_S: f64 = 7.0;
const SOFT_REMOTE: &[&str] = &[
    "session.architecture=centralized",
    "coupling.remote_hand_object.stiffness_n_per_m=170",
    "coupling.remote_hand_object.damping_n_s_per_m=3",
    "coupling.remote_hand_object_tangential.stiffness_n_per_m=270",
    "coupling.remote_hand_object_tangential.damping_n_s_per_m=5",
];

/// One user's push: the curves of the finger that pushes.
struct Push {
    run: Run,
    host: usize,
    /// How far the finger went beyond where it would just touch a box that just touches the wall, at most, m.
    penetration_m: f64,
}

impl Push {
    /// The first user of the scene pushes; `by_the_second`: the users change places, so that the pusher is remote.
    fn of(settings: &[&str], by_the_second: bool) -> anyhow::Result<Self> {
        let mut scene = load("push-wall", settings)?;
        if by_the_second {
            scene = scene.edit(|scene| scene.users.swap(0, 1))?;
        }
        let run = Run::of_scene(scene, DURATION_S)?;
        let host = usize::from(by_the_second);
        let finger = &run.hosts[host].fingers[0];
        let furthest = finger.position_m.iter().map(|position| position.y).fold(f64::MIN, f64::max);
        let wall_m = run.scene.walls()[0].point_m.y;
        let touch_m = wall_m - run.scene.object.shape.size_m.y - run.scene.hand.finger_radius_m;
        Ok(Self { penetration_m: furthest - touch_m, run, host })
    }
}

fn run() -> anyhow::Result<Outcome> {
    let distributed = Push::of(&[], false)?;
    let local = Push::of(SOFT_REMOTE, false)?;
    let remote = Push::of(SOFT_REMOTE, true)?;
    let cases = [
        ("distributed", &distributed),
        ("centralized, local user", &local),
        ("centralized, remote user", &remote),
    ];
    let claims = vec![
        Claim::new(
            "the distributed user penetrates far less than the remote one",
            distributed.penetration_m < 0.5 * remote.penetration_m,
        ),
        Claim::new(
            "the centralized local user penetrates far less than the remote one",
            local.penetration_m < 0.5 * remote.penetration_m,
        ),
        Claim::new("all three stay stable", cases.iter().all(|(_, push)| push.run.summary.stable)),
    ];
    let rows = cases.iter().map(|(name, push)| {
        let here = format!("{:.2} mm; {}", 1e3 * push.penetration_m, push.run.verdict_in_words());
        [(*name).to_owned(), "curve".to_owned(), here]
    });
    Ok(Outcome {
        published_value: json!("distributed and local far smaller than remote"),
        value: json!({
            "distributed_penetration_m": distributed.penetration_m,
            "local_penetration_m": local.penetration_m,
            "remote_penetration_m": remote.penetration_m,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: "Penetration is how far the finger goes beyond where it would just touch a box that just touches the wall."
            .to_owned(),
        rows: rows.collect(),
        claims,
        figure: Some(figure(&cases)?),
        table: Some(table(&cases)),
        commands: vec![
            "cotouch run push-wall --virtual --duration 7".to_owned(),
            format!("cotouch run push-wall --virtual --duration 7 --set {}", SOFT_REMOTE.join(" --set ")),
        ],
    })
}

fn figure(cases: &[(&str, &Push)]) -> anyhow::Result<String> {
    let series = |of: fn(&Push, usize) -> f64| {
        let one = |(index, (name, push)): (usize, &(&str, &Push))| {
            let times = &push.run.hosts[push.host].time_s;
            // Dashed where the curve before it may lie below.
            let dashed = index == 1;
            Series { dashed, ..Series::solid(name, index, curve(times, |at| of(push, at))) }
        };
        cases.iter().enumerate().map(one).collect::<Vec<_>>()
    };
    let finger = |push: &Push, at: usize| 1e3 * push.run.hosts[push.host].fingers[0].position_m[at].y;
    let force = |push: &Push, at: usize| -push.run.hosts[push.host].fingers[0].force_n[at].y;
    let panel = |title: &str, y_label: &str, series| Panel {
        title: title.to_owned(),
        x_label: "time, s".to_owned(),
        y_label: y_label.to_owned(),
        series,
        equal_scales: false,
        ..Panel::default()
    };
    let panels = [
        panel("finger", "position, mm", series(finger)),
        panel("force of the finger on the box", "force, N", series(force)),
    ];
    chart("Figure 8.4: 1.5 N · sin(3 rad/s · t) against a wall of 4000 N/m", &panels)
}

fn table(cases: &[(&str, &Push)]) -> String {
    let mut header = vec!["time_s".to_owned()];
    let mut columns: Vec<Vec<f64>> = vec![cases[0].1.run.hosts[0].time_s.clone()];
    for (name, push) in cases {
        let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let host = &push.run.hosts[push.host];
        header.extend([format!("{name}_finger_y_m"), format!("{name}_force_y_n"), format!("{name}_box_y_m")]);
        columns.push(host.fingers[0].position_m.iter().map(|position| position.y).collect());
        columns.push(host.fingers[0].force_n.iter().map(|force| -force.y).collect());
        columns.push(host.body_m.iter().map(|position| position.y).collect());
    }
    csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}
