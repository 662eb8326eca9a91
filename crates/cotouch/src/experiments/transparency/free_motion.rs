//! Figures 6.2 and 6.4: velocity over force in free motion.

use cotouch_analysis::Grid;
use cotouch_analysis::transparency::added_damping;
use cotouch_scene::names::HostIndex;
use serde_json::{Value as Json, json};

use super::case::{CENTRALIZED, Case, DISTRIBUTED, table, table_6_1};
use crate::experiments::outcome::{Claim, Experiment, Outcome};
use crate::figure::chart::{Panel, Scale, Series, chart};

pub(in crate::experiments) const FIGURE_6_2: Experiment =
    Experiment { id: "fig6.2", title: "Perceived admittance of the object in free motion", run: figure_6_2 };
pub(in crate::experiments) const FIGURE_6_4: Experiment = Experiment {
    id: "fig6.4",
    title: "Perceived admittance of the object before and after compensation",
    run: figure_6_4,
};

/// Up to half the network rate, 402 rad/s.
const FREQUENCIES: &str = "0.01..400:400:log";
const LOW: (f64, f64) = (0.0, 10.0);
const HIGH: (f64, f64) = (10.0, 400.0);
const ALL: (f64, f64) = (0.0, 400.0);
const N_1: &str = "link.delay_periods=1";
const N_0: &str = "link.delay_periods=0";
const COMPENSATION: &str = "object.damping_n_s_per_m=-3";

fn figure_6_2() -> anyhow::Result<Outcome> {
    let frequencies: Grid = FREQUENCIES.parse()?;
    let local = Case::new("centralized, local", (CENTRALIZED, 0), &[N_1], 0, &frequencies)?;
    let remote = Case::new("centralized, remote", (CENTRALIZED, 1), &[N_1], 1, &frequencies)?;
    let distributed = Case::new("distributed", (DISTRIBUTED, 0), &[N_1], 2, &frequencies)?;
    let cases = [&local, &remote, &distributed];
    let is_viscous = |case: &Case| {
        let phase = case.of_user().phase_rad[0].abs();
        phase < 0.05
    };
    let claims = vec![
        Claim::new(
            "the local centralized user observes the admittance closest to that of the mass",
            local.deviation(ALL) < remote.deviation(ALL).min(distributed.deviation(ALL)),
        ),
        Claim::new(
            "at higher frequencies the coupler lets the local user's response deviate from that of a mass",
            local.deviation((100.0, 400.0)) > 5.0 * local.deviation(LOW),
        ),
        Claim::new(
            "at medium to high frequencies the remote centralized user's deviation is the largest",
            remote.deviation(HIGH) > local.deviation(HIGH).max(distributed.deviation(HIGH)),
        ),
        Claim::new(
            "at low frequencies the distributed and the remote centralized user feel a viscous damper",
            is_viscous(&distributed) && is_viscous(&remote) && !is_viscous(&local),
        ),
    ];
    let rows = cases.iter().map(|case| {
        let here = format!(
            "mean deviation from the mass: factor {:.2} up to 10 rad/s, {:.2} from 10 to 400 rad/s; {:.4} N·s/m at 0.01 rad/s",
            case.deviation(LOW).exp(),
            case.deviation(HIGH).exp(),
            case.at_rest().recip()
        );
        [case.name.to_owned(), "curve".to_owned(), here]
    });
    let value = |case: &Case| {
        json!({
            "magnitude_at_0.01_rad_s": case.at_rest(),
            "mean_deviation_factor_low": case.deviation(LOW).exp(),
            "mean_deviation_factor_high": case.deviation(HIGH).exp(),
            "stable": case.of_user().stable,
        })
    };
    Ok(Outcome {
        published_value: json!("curves; local closest to the mass, remote farthest at high frequencies"),
        value: json!({
            "local": value(&local), "remote": value(&remote), "distributed": value(&distributed),
            "ideal_mass_kg": local.felt.ideal.mass_kg,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: "Table 6.1, n = 1. Solid: the slow-rate response of Fotoohi Ghiam 2006, (6.1); dashed in the same colour: the exact \
               fundamental under a continuous sinusoidal force. The two part \
               where a network period is no longer short against the oscillation. The scan has no figures, so the curves are held to what the text says of them. The mass is hand and object, \
               0.5 kg; the distributed user also moves the other host's copy."
            .to_owned(),
        rows: rows.collect(),
        claims,
        figure: Some(figure_of_6_2(&cases)?),
        table: Some(table(&cases)),
        commands: vec![
            distributed.command(FREQUENCIES, "distributed"),
            local.command(FREQUENCIES, "centralized"),
        ],
    })
}

fn figure_of_6_2(cases: &[&Case]) -> anyhow::Result<String> {
    let panel = |title: &str, range| {
        let ideal = cases[0].ideal("ideal: a mass", range);
        panel(title, cases.iter().flat_map(|case| case.series(range)).chain([ideal]).collect())
    };
    let panels = [panel("(a) low frequency", LOW), panel("(b) medium to high frequency", HIGH)];
    chart(
        "Figure 6.2: object perceived admittance |V/F| in free motion, n = 1 (dashed colours: exact fundamental)",
        &panels,
    )
}

fn panel(title: &str, series: Vec<Series>) -> Panel {
    Panel {
        title: title.to_owned(),
        x_label: "frequency, rad/s".to_owned(),
        y_label: "|V/F|, m/s/N".to_owned(),
        series,
        x_scale: Scale::Logarithmic,
        y_scale: Scale::Logarithmic,
        ..Panel::default()
    }
}

fn figure_6_4() -> anyhow::Result<Outcome> {
    let frequencies: Grid = FREQUENCIES.parse()?;
    // Rounded towards too little: overdone by a hair, the user alone would drive the object.
    let compensation = (compensation_of_whole_model()? * 100.0).floor() / 100.0;
    let whole = format!("object.damping_n_s_per_m={:.2}", -compensation);
    let before = Case::new("before compensation", (DISTRIBUTED, 0), &[N_1], 0, &frequencies)?;
    let after = Case::new("after, −3 N·s/m", (DISTRIBUTED, 0), &[N_1, COMPENSATION], 2, &frequencies)?;
    let fully = Case::new("by the whole model", (DISTRIBUTED, 0), &[N_1, &whole], 1, &frequencies)?;
    let [plain, with, full, undelayed] = [
        Viscous::at(&[N_1])?,
        Viscous::at(&[N_1, COMPENSATION])?,
        Viscous::at(&[N_1, &whole])?,
        Viscous::at(&[N_0, COMPENSATION])?,
    ];
    let nearer = |range| after.deviation(range) < before.deviation(range) - 0.5;
    let claims = vec![
        Claim::new(
            "compensation by −3 N·s/m at n = 1 brings the low-frequency response nearer to the mass's, and stays stable",
            nearer(LOW)
                && with.damping < 0.5 * plain.damping
                && after.of_user().stable
                && with.drag_pole < 1.0,
        ),
        Claim::new(
            "the simplified model underestimates the damping, so that some remains",
            plain.simplified < plain.damping && with.damping > 0.0,
        ),
    ];
    let row = |name: &str, seed: &str, here: String| [name.to_owned(), seed.to_owned(), here];
    let curve = |case: &Case, viscous: &Viscous| {
        let close = close_from(case).map_or("nowhere".to_owned(), |from| format!("from {from:.2} rad/s"));
        format!(
            "{:.3} N·s/m, drag pole {:.4}; within a factor of 2 of the mass {close}",
            // No sign where nothing is left.
            (viscous.damping * 1e3).round() / 1e3 + 0.0,
            viscous.drag_pole
        )
    };
    let rows = vec![
        row("simplified damping, n = 1", "3 N·s/m", format!("{:.4} N·s/m", plain.simplified)),
        row("before", "curve", curve(&before, &plain)),
        row("after", "curve, close to the mass for a wide range", curve(&after, &with)),
        row(&format!("with {whole}"), "(not done)", curve(&fully, &full)),
        row(
            "the same −3 N·s/m at n = 0",
            "(not said)",
            format!(
                "{:.4} N·s/m, drag pole {:.4}: unstable, the object runs away",
                undelayed.damping, undelayed.drag_pole
            ),
        ),
    ];
    Ok(Outcome {
        published_value: json!({ "compensation_n_s_per_m": -3.0, "n": 1, "after": "close to the mass for a wide range" }),
        value: json!({
            "simplified_damping_n_s_per_m": plain.simplified,
            "before": plain.to_json(&before),
            "after": with.to_json(&after),
            "compensated_by_whole_model": full.to_json(&fully),
            "after_at_n_0": { "damping_n_s_per_m": undelayed.damping, "drag_pole": undelayed.drag_pole },
        }),
        agrees: false,
        note: format!(
            "Table 6.1, n = 1; solid: slow-rate response, dashed in the same colour: exact fundamental. The printed −3 N·s/m \
             \"obtained using n = 1\" stands for the simplified damping, {:.2} N·s/m exactly. The improvement is there, but \
             {:.2} of {:.2} N·s/m remain, so below {:.0} rad/s the response is still that of a damper. What brings the whole \
             model's damping to nearly 0 is {:.2} N·s/m on every copy; the user then feels hand and both copies (0.9 kg). A link that \
             delays less than assumed turns compensation into a drive: with −3 N·s/m at n = 0 the drag pole is {:.4}.",
            plain.simplified,
            with.damping,
            plain.damping,
            close_from(&after).unwrap_or(f64::NAN),
            -compensation,
            undelayed.drag_pole
        ),
        rows,
        claims,
        figure: Some(figure_of_6_4(&[&before, &after, &fully])?),
        table: Some(table(&[&before, &after, &fully])),
        commands: vec![
            before.command(FREQUENCIES, "before"),
            after.command(FREQUENCIES, "after"),
            fully.command(FREQUENCIES, "whole-model"),
            format!("cotouch analyze damping {DISTRIBUTED} --set {N_1}"),
            format!("cotouch analyze damping {DISTRIBUTED} --set {N_0} --set {COMPENSATION}"),
        ],
    })
}

/// How the distributed user is braked.
struct Viscous {
    damping: f64,
    simplified: f64,
    drag_pole: f64,
}

impl Viscous {
    fn at(settings: &[&str]) -> anyhow::Result<Self> {
        let damping = added_damping(&table_6_1(DISTRIBUTED, settings)?, HostIndex::FIRST)?;
        Ok(Self {
            damping: damping.damping_n_s_per_m.unwrap_or(f64::NAN),
            simplified: damping.simplified_damping_n_s_per_m.unwrap_or(f64::NAN),
            drag_pole: damping.drag_pole.unwrap_or(f64::NAN),
        })
    }

    fn to_json(&self, case: &Case) -> Json {
        json!({
            "damping_n_s_per_m": self.damping,
            "drag_pole": self.drag_pole,
            "within_factor_2_of_mass_from_rad_s": close_from(case),
        })
    }
}

/// The damping (N·s/m) that every copy would have to lose so that the user feels none at n = 1, by the secant rule.
fn compensation_of_whole_model() -> anyhow::Result<f64> {
    let remaining = |compensation: f64| -> anyhow::Result<f64> {
        Ok(Viscous::at(&[N_1, &format!("object.damping_n_s_per_m={}", -compensation)])?.damping)
    };
    let (mut before, mut compensation) = (0.0, 3.0);
    let (mut damping_before, mut damping) = (remaining(before)?, remaining(compensation)?);
    for _ in 0..8 {
        if damping.abs() < 1e-9 || damping == damping_before {
            break;
        }
        let next = compensation - damping * (compensation - before) / (damping - damping_before);
        (before, damping_before) = (compensation, damping);
        compensation = next;
        damping = remaining(compensation)?;
    }
    Ok(compensation)
}

/// The lowest frequency at which the magnitude is within a factor of 2 of the mass's.
fn close_from(case: &Case) -> Option<f64> {
    let own = case.between(ALL, &case.of_user().magnitude);
    let ideal = case.between(ALL, &case.felt.ideal.magnitude);
    let is_near = |(own, ideal): (&(f64, f64), &(f64, f64))| (0.5..=2.0).contains(&(own.1 / ideal.1));
    own.iter().zip(&ideal).position(is_near).map(|index| own[index].0)
}

fn figure_of_6_4(cases: &[&Case]) -> anyhow::Result<String> {
    let series = cases.iter().flat_map(|case| case.series(ALL));
    let series = series.chain([cases[0].ideal("pure mass", ALL)]).collect();
    chart(
        "Figure 6.4: |V/F|, distributed, n = 1 (dashed colours: exact fundamental)",
        &[panel("before and after compensation", series)],
    )
}
