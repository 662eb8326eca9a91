//! Figure 8.3: the net force that moves the box along a sinusoid, with and without compensation of the network's drag.

use serde_json::json;

use super::runs::{Run, rms};
use super::{Claim, Experiment, Outcome, csv};
use crate::figure::chart::{Panel, Series, chart};

pub(super) const FIGURE_8_3: Experiment = Experiment {
    id: "fig8.3",
    title: "Net force along a sinusoidal path, with and without compensation",
    run,
};

/// The seed's compensation, N·s/m and N·m·s/rad.
const SEED_DAMPING: f64 = 0.88;
const SEED_ROTATIONAL_DAMPING: f64 = 0.025;
/// 2 rad/s; three whole periods are looked at, after one.
const PERIOD_S: f64 = std::f64::consts::PI;
const SETTLED_S: f64 = 2.0 + PERIOD_S;
const DURATION_S: f64 = SETTLED_S + 3.0 * PERIOD_S + 0.1;

/// A run, and what a mass and a damper would have to be to need the same force.
struct Fit {
    run: Run,
    /// All copies together, kg.
    mass_kg: f64,
    /// From the regression F = m·a + b·v over whole periods.
    fitted_mass_kg: f64,
    drag_n_s_per_m: f64,
    net_rms_n: f64,
    inertial_rms_n: f64,
}

impl Fit {
    fn of(scene: &str, settings: &[&str]) -> anyhow::Result<Self> {
        let run = Run::of(scene, settings, DURATION_S)?;
        let copies =
            if scene.ends_with("centralized") || settings.iter().any(|set| set.ends_with("=centralized")) {
                1.0
            } else {
                run.scene.users.len() as f64
            };
        let mass_kg = copies * run.scene.world_bodies()[0].mass_kg;
        let host = &run.hosts[0];
        let points = host.between(SETTLED_S..SETTLED_S + 3.0 * PERIOD_S);
        let step_s = host.time_s[1] - host.time_s[0];
        let (mut vv, mut va, mut aa, mut fv, mut fa) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for at in points.clone() {
            let (v, a, f) = (host.body_m_per_s[at].y, acceleration(&run, at, step_s), host.net_force_n(at).y);
            vv += v * v;
            va += v * a;
            aa += a * a;
            fv += f * v;
            fa += f * a;
        }
        let determinant = vv * aa - va * va;
        let (drag, fitted) = ((fv * aa - fa * va) / determinant, (fa * vv - fv * va) / determinant);
        Ok(Self {
            mass_kg,
            fitted_mass_kg: fitted,
            drag_n_s_per_m: drag,
            net_rms_n: rms(points.clone().map(|at| host.net_force_n(at).y)),
            inertial_rms_n: rms(points.map(|at| mass_kg * acceleration(&run, at, step_s))),
            run,
        })
    }

    fn excess(&self) -> f64 {
        self.net_rms_n / self.inertial_rms_n
    }
}

/// The box's, along y, m/s².
fn acceleration(run: &Run, at: usize, step_s: f64) -> f64 {
    let velocity = &run.hosts[0].body_m_per_s;
    let (before, after) = (velocity[at.saturating_sub(1)].y, velocity[(at + 1).min(velocity.len() - 1)].y);
    (after - before) / (2.0 * step_s)
}

fn run() -> anyhow::Result<Outcome> {
    let centralized = Fit::of("sinusoid", &["session.architecture=centralized"])?;
    let uncompensated = Fit::of("sinusoid", &[])?;
    let with = |damping: f64, rotational: f64| {
        let settings = [
            format!("object.damping_n_s_per_m={}", -damping),
            format!("object.rotational_damping_n_m_s_per_rad={}", -rotational),
        ];
        Fit::of("sinusoid", &settings.each_ref().map(String::as_str))
    };
    let seed = with(SEED_DAMPING, SEED_ROTATIONAL_DAMPING)?;
    // Each copy carries its share of the drag.
    let exact_damping = uncompensated.drag_n_s_per_m / uncompensated.run.scene.users.len() as f64;
    let exact = with(exact_damping, SEED_ROTATIONAL_DAMPING)?;
    let cases = [
        ("centralized, local user", &centralized),
        ("distributed", &uncompensated),
        ("distributed, compensated by 0.88 N·s/m", &seed),
        ("distributed, compensated by its own drag", &exact),
    ];
    let claims = vec![
        Claim::new(
            "the uncompensated distributed user applies a noticeably larger force for the same motion",
            uncompensated.excess() > 1.2 * centralized.excess(),
        ),
        Claim::new(
            "compensation by 0.88 N·s/m improves the response significantly",
            seed.drag_n_s_per_m.abs() < 0.7 * uncompensated.drag_n_s_per_m,
        ),
        Claim::new(
            "compensation by the drag itself brings the net force to the inertial force",
            (exact.excess() - 1.0).abs() < 0.1,
        ),
    ];
    let row = |(name, fit): &(&str, &Fit)| {
        let here = format!(
            "net force {:.3} N rms, inertial {:.3} N rms; F = {:.3} kg·a + {:.3} N·s/m·v (copies weigh {:.1} kg); {}",
            fit.net_rms_n,
            fit.inertial_rms_n,
            fit.fitted_mass_kg,
            fit.drag_n_s_per_m,
            fit.mass_kg,
            fit.run.verdict_in_words()
        );
        [(*name).to_owned(), "curve".to_owned(), here]
    };
    let value = |fit: &Fit| {
        json!({
            "net_force_rms_n": fit.net_rms_n,
            "inertial_force_rms_n": fit.inertial_rms_n,
            "fitted_mass_kg": fit.fitted_mass_kg,
            "drag_n_s_per_m": fit.drag_n_s_per_m,
            "stable": fit.run.summary.stable,
        })
    };
    Ok(Outcome {
        seed_value: json!({ "compensation_n_s_per_m": SEED_DAMPING, "rotational_n_m_s_per_rad": SEED_ROTATIONAL_DAMPING }),
        value: json!({
            "centralized": value(&centralized),
            "distributed": value(&uncompensated),
            "distributed_compensated_0.88": value(&seed),
            "distributed_compensated_exactly": value(&exact),
            "compensation_n_s_per_m": exact_damping,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: format!(
            "The thesis chose 0.88 N·s/m; the drag that this run has is {:.2} N·s/m on two copies, {exact_damping:.2} \
             N·s/m each. The thesis does not say how its value came about.",
            uncompensated.drag_n_s_per_m
        ),
        rows: cases.iter().map(row).collect(),
        claims,
        figure: Some(figure(&cases)?),
        table: Some(table(&cases)),
        commands: vec![
            "cotouch run sinusoid --virtual --duration 15".to_owned(),
            format!(
                "cotouch run sinusoid --virtual --duration 15 --set object.damping_n_s_per_m=-{SEED_DAMPING}"
            ),
        ],
    })
}

fn figure(cases: &[(&str, &Fit)]) -> anyhow::Result<String> {
    let mut series: Vec<Series> = cases
        .iter()
        .enumerate()
        .map(|(index, (name, fit))| {
            let host = &fit.run.hosts[0];
            let points = host.between(SETTLED_S..SETTLED_S + 3.0 * PERIOD_S);
            Series::solid(name, index, points.map(|at| (host.time_s[at], host.net_force_n(at).y)).collect())
        })
        .collect();
    let reference = cases[1].1;
    let host = &reference.run.hosts[0];
    let step_s = host.time_s[1] - host.time_s[0];
    let inertial = host
        .between(SETTLED_S..SETTLED_S + 3.0 * PERIOD_S)
        .map(|at| (host.time_s[at], reference.mass_kg * acceleration(&reference.run, at, step_s)));
    let inertial = Series::dashed("inertial force", 7, inertial.collect());
    let rest = series.split_off(2);
    series.push(inertial.clone());
    let panel = |title: &str, series| Panel {
        title: title.to_owned(),
        x_label: "time, s".to_owned(),
        y_label: "net force on the box, N".to_owned(),
        series,
        equal_scales: false,
    };
    let panels =
        [panel("without compensation", series), panel("with compensation", [rest, vec![inertial]].concat())];
    chart("Figure 8.3: net force along 0.05 m · sin(2 rad/s · t)", &panels)
}

fn table(cases: &[(&str, &Fit)]) -> String {
    let mut header = vec!["time_s".to_owned()];
    let mut columns: Vec<Vec<f64>> = vec![cases[0].1.run.hosts[0].time_s.clone()];
    for (name, fit) in cases {
        let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let host = &fit.run.hosts[0];
        header.push(format!("{name}_net_force_n"));
        columns.push((0..host.time_s.len()).map(|at| host.net_force_n(at).y).collect());
        header.push(format!("{name}_box_y_m"));
        columns.push(host.body_m.iter().map(|position| position.y).collect());
    }
    csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}
