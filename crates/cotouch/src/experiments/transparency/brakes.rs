//! Table 6.2, (6.3), (B.10) and (B.11): the damping that held data add.

use cotouch_analysis::transparency::{AddedDamping, added_damping, closed_forms};
use cotouch_scene::names::HostIndex;
use serde_json::json;

use super::case::{CENTRALIZED, DISTRIBUTED, table_6_1};
use crate::experiments::outcome::{Claim, Experiment, Outcome};

pub(in crate::experiments) const TABLE_6_2: Experiment = Experiment {
    id: "table6.2",
    title: "Damping by the original and the simplified model for N = 8",
    run: table_6_2,
};
pub(in crate::experiments) const EQUATION_6_3: Experiment = Experiment {
    id: "eq6.3",
    title: "Damping of the simplified distributed model for N = 2, n = 0",
    run: equation_6_3,
};
pub(in crate::experiments) const EQUATION_B_10: Experiment = Experiment {
    id: "eqB.10",
    title: "Damping of the centralized remote user for N = 2, n = 0",
    run: equation_b_10,
};
pub(in crate::experiments) const EQUATION_B_11: Experiment = Experiment {
    id: "eqB.11",
    title: "Damping of the distributed user for N = 2, n = 0",
    run: equation_b_11,
};

const N_2: &str = "rates.network_hz=512";
const UNDELAYED: &str = "link.delay_periods=0";
const AT_N_8: [&str; 1] = [UNDELAYED];
const AT_N_2: [&str; 2] = [N_2, UNDELAYED];
const LOCAL: HostIndex = HostIndex(0);
const REMOTE: HostIndex = HostIndex(1);
/// (6.3) and (B.10) are exact.
const EXACT: f64 = 1e-9;

fn damping(scene: &str, settings: &[&str], user: HostIndex) -> anyhow::Result<AddedDamping> {
    Ok(added_damping(&table_6_1(scene, settings)?, user)?)
}

fn original(scene: &str, settings: &[&str], user: HostIndex) -> anyhow::Result<f64> {
    Ok(damping(scene, settings, user)?.damping_n_s_per_m.unwrap_or(f64::NAN))
}

fn simplified(scene: &str, settings: &[&str]) -> anyhow::Result<f64> {
    Ok(damping(scene, settings, LOCAL)?.simplified_damping_n_s_per_m.unwrap_or(f64::NAN))
}

fn command(scene: &str, settings: &[&str], user: HostIndex) -> String {
    let user = user.0 + 1;
    format!("cotouch analyze damping {scene} --user {user} --set {}", settings.join(" --set "))
}

fn n_s_per_m(value: f64) -> String {
    if value == 0.0 { "0 N·s/m".to_owned() } else { format!("{value:.4} N·s/m") }
}

fn row(name: &str, printed: &str, here: String) -> [String; 3] {
    [name.to_owned(), printed.to_owned(), here]
}

fn table_6_2() -> anyhow::Result<Outcome> {
    let distributed = damping(DISTRIBUTED, &AT_N_8, LOCAL)?;
    let remote = damping(CENTRALIZED, &AT_N_8, REMOTE)?;
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let cells = [
        ("centralized (remote user), original", 0.04, number(remote.damping_n_s_per_m), 0.005),
        ("centralized (remote user), simplified", 0.0, number(remote.simplified_damping_n_s_per_m), 0.0),
        ("distributed, original", 2.1, number(distributed.damping_n_s_per_m), 0.05),
        ("distributed, simplified", 1.4, number(distributed.simplified_damping_n_s_per_m), 0.05),
    ];
    let same = |&(_, printed, exact, within): &(&str, f64, f64, f64)| (printed - exact).abs() <= within;
    let at_n_2 = original(CENTRALIZED, &AT_N_2, REMOTE)?;
    let local = original(CENTRALIZED, &AT_N_8, LOCAL)?;
    let of = |cell: usize| cells[cell].2;
    let claims = vec![
        Claim::new("the simplified model of the centralized controller has no damping", of(1) == 0.0),
        Claim::new("the simplified model underestimates the damping", of(3) < of(2) && of(1) < of(0)),
        Claim::new("the distributed controller brakes more than the centralized one", of(2) > of(0)),
    ];
    let mut rows: Vec<_> =
        cells.iter().map(|cell| row(cell.0, &format!("{} N·s/m", cell.1), n_s_per_m(cell.2))).collect();
    rows.push(row("centralized (remote user), original, N = 2", "(B.10)", format!("{at_n_2:.4} N·s/m")));
    rows.push(row("centralized (local user), original", "(none)", n_s_per_m(local)));
    let values = |which: fn(&(&str, f64, f64, f64)) -> f64| {
        json!({
            "centralized": { "original": which(&cells[0]), "simplified": which(&cells[1]) },
            "distributed": { "original": which(&cells[2]), "simplified": which(&cells[3]) },
        })
    };
    Ok(Outcome {
        published_value: values(|cell| cell.1),
        value: values(|cell| cell.2),
        agrees: cells.iter().all(same),
        note: format!(
            "Table 6.1, N = 8, n = 0; V at the network instants. The printed table cannot come from Table 6.1 at N = 8: 0.04 is \
             the centralized value at N = 2 ({at_n_2:.4}; {:.4} at N = 8), and 2.1 and 1.4 stand for {:.4} and {:.4}. Which \
             parameters gave them is not said.",
            of(0),
            of(2),
            of(3)
        ),
        claims,
        rows,
        figure: None,
        table: None,
        commands: vec![
            command(DISTRIBUTED, &AT_N_8, LOCAL),
            command(CENTRALIZED, &AT_N_8, REMOTE),
            command(CENTRALIZED, &AT_N_2, REMOTE),
        ],
    })
}

fn equation_6_3() -> anyhow::Result<Outcome> {
    let printed = closed_forms::simplified_damping(&*table_6_1(DISTRIBUTED, &AT_N_2)?);
    let exact = simplified(DISTRIBUTED, &AT_N_2)?;
    let slower = ["rates.control_hz=512", "rates.network_hz=256", UNDELAYED];
    let tighter = ["coupling.object_object.stiffness_n_per_m=600", N_2, UNDELAYED];
    let (at_half_rate, with_tight_copies) =
        (simplified(DISTRIBUTED, &slower)?, simplified(DISTRIBUTED, &tighter)?);
    let claims = vec![
        Claim::new("(6.3) is what the loop does", (printed / exact - 1.0).abs() < EXACT),
        Claim::new("the viscous damping increases as the control rate decreases", at_half_rate > exact),
        Claim::new("tightening the coupling between the copies increases it", with_tight_copies > exact),
        Claim::new(
            "with the centralized controller the simplified model has none",
            simplified(CENTRALIZED, &AT_N_2)? == 0.0,
        ),
    ];
    Ok(Outcome {
        published_value: json!({ "damping_n_s_per_m": printed }),
        value: json!({
            "damping_n_s_per_m": exact,
            "at_half_the_rates": at_half_rate,
            "with_twice_the_coupling": with_tight_copies,
        }),
        agrees: (printed / exact - 1.0).abs() < EXACT,
        note: "Table 6.1 with N = 2, n = 0. The user's force acts on both copies, V is the velocity of the local copy at the \
               network instants: then the printed formula is exact."
            .to_owned(),
        claims,
        rows: vec![
            row("2·m_o·k_o/(4·m_o/T_c − T_c·k_o − 2·b_o)", &format!("{printed:.8} N·s/m"), format!("{exact:.8} N·s/m")),
            row("at half the rates", "larger", format!("{at_half_rate:.8} N·s/m")),
            row("with twice the coupling", "larger", format!("{with_tight_copies:.8} N·s/m")),
        ],
        figure: None,
        table: None,
        commands: [&AT_N_2[..], &slower, &tighter]
            .map(|settings| command(DISTRIBUTED, settings, LOCAL))
            .to_vec(),
    })
}

fn equation_b_10() -> anyhow::Result<Outcome> {
    let printed = closed_forms::centralized_remote_damping(&*table_6_1(CENTRALIZED, &AT_N_2)?);
    let exact = original(CENTRALIZED, &AT_N_2, REMOTE)?;
    let at_n_8 = original(CENTRALIZED, &AT_N_8, REMOTE)?;
    let local = original(CENTRALIZED, &AT_N_2, LOCAL)?;
    let agrees = (printed / exact - 1.0).abs() < EXACT;
    Ok(Outcome {
        published_value: json!({ "damping_n_s_per_m": printed }),
        value: json!({ "damping_n_s_per_m": exact, "at_N_8": at_n_8, "local_user": local }),
        agrees,
        note: "Table 6.1 with N = 2, n = 0, the remote user; the local one feels no damping. The value is Table 6.2's 0.04."
            .to_owned(),
        claims: vec![Claim::new("(B.10) is what the loop does", agrees)],
        rows: vec![
            row("k_2/(2/T_c − b_2/m_o)", &format!("{printed:.8} N·s/m"), format!("{exact:.8} N·s/m")),
            row("the same user at N = 8", "(not given)", format!("{at_n_8:.8} N·s/m")),
            row("the local user", "(not given)", n_s_per_m(local)),
        ],
        figure: None,
        table: None,
        commands: vec![command(CENTRALIZED, &AT_N_2, REMOTE), command(CENTRALIZED, &AT_N_8, REMOTE)],
    })
}

/// Couplers without dampers.
const UNDAMPED: [&str; 3] = [
    "coupling.hand_object.damping_n_s_per_m=0",
    "coupling.remote_hand_object.damping_n_s_per_m=0",
    "coupling.object_object.damping_n_s_per_m=0",
];
/// Every sample is used one tick after it was taken.
const OLDER: [&str; 2] = ["link.play_out=on-arrival", "link.impairment.latency_s=0.0009765625"];

fn equation_b_11() -> anyhow::Result<Outcome> {
    let (undamped, older) = ([&AT_N_2[..], &UNDAMPED].concat(), [&AT_N_2[..], &OLDER].concat());
    let undamped_older = [&undamped[..], &OLDER].concat();
    let as_printed = |settings: &[&str]| -> anyhow::Result<f64> {
        Ok(closed_forms::distributed_damping_as_printed(&*table_6_1(DISTRIBUTED, settings)?))
    };
    let (printed, printed_undamped) = (as_printed(&AT_N_2)?, as_printed(&undamped)?);
    let exact = original(DISTRIBUTED, &AT_N_2, LOCAL)?;
    let exact_older = original(DISTRIBUTED, &older, LOCAL)?;
    let exact_undamped = original(DISTRIBUTED, &undamped, LOCAL)?;
    let exact_undamped_older = original(DISTRIBUTED, &undamped_older, LOCAL)?;
    let same = |one: f64, other: f64| (one / other - 1.0).abs() < 1e-8;
    Ok(Outcome {
        published_value: json!({ "damping_n_s_per_m": printed, "without_dampers_n_s_per_m": printed_undamped }),
        value: json!({
            "damping_n_s_per_m": exact,
            "one_tick_later_n_s_per_m": exact_older,
            "without_dampers_n_s_per_m": exact_undamped,
            "without_dampers_one_tick_later_n_s_per_m": exact_undamped_older,
        }),
        agrees: same(printed, exact),
        note: format!(
            "Table 6.1 with N = 2, n = 0; M_o in (B.12) read as m_o. As printed the value is {:.2} times the exact one. \
             Without dampers the printed form is exactly what samples give that are used one T_c after they were taken, so \
             it belongs to n = 0 with one tick of delay more; with dampers it differs from that by {:.1} %.",
            printed / exact,
            100.0 * (printed / exact_older - 1.0).abs()
        ),
        claims: vec![Claim::new(
            "without dampers (B.11) is the damping for samples that are one T_c older",
            same(printed_undamped, exact_undamped_older),
        )],
        rows: vec![
            row("(B.12)/(B.13)", &format!("{printed:.6} N·s/m"), format!("{exact:.6} N·s/m")),
            row(
                "samples used one T_c later",
                &format!("{printed:.6} N·s/m"),
                format!("{exact_older:.6} N·s/m"),
            ),
            row(
                "without dampers",
                &format!("{printed_undamped:.6} N·s/m"),
                format!("{exact_undamped:.6} N·s/m; {exact_undamped_older:.6} N·s/m one T_c later"),
            ),
        ],
        figure: None,
        table: None,
        commands: [&AT_N_2[..], &older, &undamped, &undamped_older]
            .map(|settings| command(DISTRIBUTED, settings, LOCAL))
            .to_vec(),
    })
}
