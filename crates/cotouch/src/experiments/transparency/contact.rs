//! Figure 6.5, (6.4) and (6.5): the object against a rigid wall.

use cotouch_analysis::Grid;
use cotouch_analysis::transparency::{closed_forms, equivalent_stiffness};
use cotouch_scene::Scene;
use serde_json::json;

use super::case::{CENTRALIZED, Case, DISTRIBUTED, table, table_6_1};
use crate::experiments::outcome::{Claim, Experiment, Outcome};
use crate::figure::chart::{Panel, Scale, chart};

pub(in crate::experiments) const FIGURE_6_5: Experiment = Experiment {
    id: "fig6.5",
    title: "Perceived admittance when the object is in contact with a rigid wall",
    run: figure_6_5,
};
pub(in crate::experiments) const EQUATION_6_4: Experiment =
    Experiment { id: "eq6.4", title: "Equivalent stiffness against a wall", run: equation_6_4 };

const FREQUENCIES: &str = "0.1..400:400:log";
const ALL: (f64, f64) = (0.0, 400.0);
const WALL: [&str; 3] = ["link.delay_periods=1", "wall.stiffness_n_per_m=30000", "wall.damping_n_s_per_m=20"];
const SOFT_WALL: [&str; 3] =
    ["link.delay_periods=1", "wall.stiffness_n_per_m=300", "wall.damping_n_s_per_m=20"];

fn figure_6_5() -> anyhow::Result<Outcome> {
    let frequencies: Grid = FREQUENCIES.parse()?;
    let local = Case::new("centralized, local", (CENTRALIZED, 0), &WALL, 0, &frequencies)?;
    let remote = Case::new("centralized, remote", (CENTRALIZED, 1), &WALL, 1, &frequencies)?;
    let distributed = Case::new("distributed", (DISTRIBUTED, 0), &WALL, 2, &frequencies)?;
    let cases = [&local, &remote, &distributed];
    let scene = table_6_1(DISTRIBUTED, &WALL)?;
    let k_11 = closed_forms::stiffness_at_rigid_wall(&scene, false);
    let k_2 = closed_forms::stiffness_at_rigid_wall(&*table_6_1(CENTRALIZED, &WALL)?, true);
    let ideal = local.felt.ideal.magnitude[0];
    let near = |compliance: f64, stiffness: f64| (compliance * stiffness - 1.0).abs() < 0.1;
    let claims = vec![
        Claim::new(
            "at low frequencies the remote user's response is close to 1/k_2",
            near(remote.at_rest(), k_2),
        ),
        Claim::new("the distributed user's is close to 1/k_11", near(distributed.at_rest(), k_11)),
        Claim::new("the ideal system's is close to 1/k_w", near(ideal, 30_000.0)),
        Claim::new(
            "the stiffness that the centralized architecture renders to the remote user is far smaller than the distributed",
            remote.at_rest() > 10.0 * distributed.at_rest(),
        ),
    ];
    let rows = [(&remote, "1/k_2", k_2), (&distributed, "1/k_11", k_11)].map(|(case, symbol, stiffness)| {
        let here = format!("{:.4e} m/N at 0.1 rad/s: {:.1} N/m", case.at_rest(), case.at_rest().recip());
        [case.name.to_owned(), format!("close to {symbol} = {:.4e} m/N", stiffness.recip()), here]
    });
    let of_local = format!("{:.4e} m/N at 0.1 rad/s: {:.1} N/m", local.at_rest(), local.at_rest().recip());
    let of_ideal = format!("{ideal:.4e} m/N at 0.1 rad/s");
    let more = [
        [local.name.to_owned(), "(no number)".to_owned(), of_local],
        ["ideal".to_owned(), "close to 1/k_w = 3.3333e-5 m/N".to_owned(), of_ideal],
    ];
    Ok(Outcome {
        published_value: json!({ "remote_m_per_n": k_2.recip(), "distributed_m_per_n": k_11.recip(), "ideal_m_per_n": 1.0 / 30_000.0 }),
        value: json!({
            "remote_m_per_n": remote.at_rest(),
            "distributed_m_per_n": distributed.at_rest(),
            "local_m_per_n": local.at_rest(),
            "ideal_m_per_n": ideal,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: "Table 6.1 with k_w = 30000 N/m, b_w = 20 N·s/m on every copy, n = 1. Solid: the slow-rate response; dashed in \
               the same colour: the exact fundamental. The scan has no figure, so the curves are held to the text. \
               Couplers and wall act in series: k_2 = 85 N/m is felt as 84.8 N/m, k_11 = 3000 N/m as 2729 N/m."
            .to_owned(),
        rows: rows.into_iter().chain(more).collect(),
        claims,
        figure: Some(figure(&cases)?),
        table: Some(table(&cases)),
        commands: vec![
            distributed.command(FREQUENCIES, "distributed"),
            local.command(FREQUENCIES, "centralized"),
            format!("cotouch analyze stiffness {DISTRIBUTED} --set {}", WALL.join(" --set ")),
        ],
    })
}

fn figure(cases: &[&Case]) -> anyhow::Result<String> {
    let series = cases.iter().flat_map(|case| case.series(ALL));
    let panel = Panel {
        title: "k_w = 30000 N/m, b_w = 20 N·s/m, n = 1".to_owned(),
        x_label: "frequency, rad/s".to_owned(),
        y_label: "|X/F|, m/N".to_owned(),
        series: series.chain([cases[0].ideal("ideal", ALL)]).collect(),
        x_scale: Scale::Logarithmic,
        y_scale: Scale::Logarithmic,
        ..Panel::default()
    };
    chart("Figure 6.5: |X/F|, the box against a rigid wall (dashed colours: exact fundamental)", &[panel])
}

/// One formula at one wall.
struct Checked {
    name: String,
    printed: f64,
    exact: f64,
}

impl Checked {
    fn new(name: &str, scene: &Scene, user: usize, printed: f64) -> anyhow::Result<Self> {
        let exact = equivalent_stiffness(scene)?.users[user].stiffness_n_per_m;
        let name = format!("{name}, k_w = {} N/m", scene.wall.stiffness_n_per_m);
        Ok(Self { name, printed, exact })
    }

    fn agrees(&self) -> bool {
        (self.printed / self.exact - 1.0).abs() < 1e-6
    }

    fn row(&self) -> [String; 3] {
        let limit = if self.agrees() { "" } else { ": misprinted" };
        [self.name.clone(), format!("{:.4} N/m", self.printed), format!("{:.4} N/m{limit}", self.exact)]
    }
}

fn equation_6_4() -> anyhow::Result<Outcome> {
    let mut checked = Vec::new();
    let mut corrected = true;
    for wall in [&SOFT_WALL, &WALL] {
        let (distributed, centralized) = (table_6_1(DISTRIBUTED, wall)?, table_6_1(CENTRALIZED, wall)?);
        let printed = closed_forms::distributed_stiffness_as_printed(&distributed);
        let as_printed = Checked::new("distributed", &distributed, 0, printed)?;
        let right = closed_forms::distributed_stiffness(&distributed);
        corrected &= (right / as_printed.exact - 1.0).abs() < 1e-9;
        checked.push(as_printed);
        let remote = closed_forms::centralized_stiffness(&centralized, true);
        checked.push(Checked::new("centralized, remote", &centralized, 1, remote)?);
    }
    let rigid = ["wall.stiffness_n_per_m=1e7", "wall.damping_n_s_per_m=20"];
    let at_rigid_wall = [(DISTRIBUTED, 0, false), (CENTRALIZED, 1, true)].map(|(scene, user, remote)| {
        let scene = table_6_1(scene, &rigid)?;
        let limit = closed_forms::stiffness_at_rigid_wall(&scene, remote);
        anyhow::Ok((equivalent_stiffness(&scene)?.users[user].stiffness_n_per_m / limit - 1.0).abs() < 1e-3)
    });
    let limits_hold =
        at_rigid_wall.into_iter().collect::<anyhow::Result<Vec<_>>>()?.into_iter().all(|holds| holds);
    let claims = vec![
        Claim::new("(6.5): towards a rigid wall the users feel k_2 and k_11", limits_hold),
        Claim::new("(6.4) for the remote user", checked.iter().skip(1).step_by(2).all(Checked::agrees)),
        Claim::new("(6.4) for the distributed user, corrected as in the note", corrected),
    ];
    let exact: Vec<_> = checked.iter().map(|one| json!({ "case": one.name, "n_per_m": one.exact })).collect();
    let printed: Vec<_> =
        checked.iter().map(|one| json!({ "case": one.name, "n_per_m": one.printed })).collect();
    Ok(Outcome {
        published_value: json!(printed),
        value: json!(exact),
        agrees: checked.iter().all(Checked::agrees),
        note: "The distributed form is misprinted: its terms in k_o² do not belong. Hooke and Newton give 1/k_eq = (k_11·k_21 \
               + k_11·k_o + k_11·k_w + k_21·k_o + k_21·k_w + 2·k_o·k_w + k_w²) / (k_11·(k_w² + k_w·(2·k_o + k_21))). As \
               printed, a user without a wall would feel a stiffness. (6.5) is right all the same: the terms vanish beside \
               a stiff wall."
            .to_owned(),
        claims,
        rows: checked.iter().map(Checked::row).collect(),
        figure: None,
        table: None,
        commands: [DISTRIBUTED, CENTRALIZED]
            .iter()
            .flat_map(|scene| {
                [&SOFT_WALL, &WALL]
                    .map(|wall| format!("cotouch analyze stiffness {scene} --set {}", wall.join(" --set ")))
            })
            .collect(),
    })
}
