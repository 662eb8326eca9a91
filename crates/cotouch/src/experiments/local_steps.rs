//! Figures 7–9 of Barbagli et al. 2003 and (4), (5): what a proportional local model on a slow spring does.

use cotouch_analysis::local_model::{
    HandImpedance, HandStep, PiLocalModel, SimulationLoop, StepResponse, hand_spectral_radius, stable_kh,
};
use cotouch_analysis::{eigenvalues, spectral_radius};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use cotouch_scene::time::Rate;
use serde_json::json;

use super::outcome::{Claim, Experiment, Outcome, csv, row};
use crate::figure::chart::{Panel, Series, chart};
use crate::figure::steps::{curve, panels};

pub(super) const FIGURE_7: Experiment = Experiment {
    id: "pfig7",
    title: "Step response of a P local model, K_o = 0.9, K_h = 0.1",
    run: figure_7,
};
pub(super) const FIGURE_8: Experiment = Experiment {
    id: "pfig8",
    title: "Step response of a P local model, K_o = 0.2, K_h = 0.19",
    run: figure_8,
};
pub(super) const FIGURE_9: Experiment = Experiment {
    id: "pfig9",
    title: "Step response of a P local model, K_o = 0.2, K_h = 0.22",
    run: figure_9,
};
pub(super) const EQUATION_4: Experiment = Experiment {
    id: "peq4",
    title: "A P local model is stable if and only if K_h < K_o (4)",
    run: equation_4,
};
pub(super) const EQUATION_5: Experiment = Experiment {
    id: "peq5",
    title: "How far the surface of a P local model moves in the end (5)",
    run: equation_5,
};

/// 20 Hz and 1 kHz: §2.1.
const RATIO: u32 = 50;
const PERIOD_S: f64 = 1e-3;
const UNITS: &str = "Barbagli et al. 2003 print K without a unit; N/mm is taken (0.2 is 200 N/m). Only K_h/K_o matters to the \
    motion. Slow rate 20 Hz, fast rate 1 kHz (N = 50), the hand steps at t = 0.";
const RETURNED: [(&str, ReturnedForce); 3] =
    [("first", ReturnedForce::First), ("mean", ReturnedForce::Mean), ("last", ReturnedForce::Last)];

fn slow_loop(returned: ReturnedForce, hold: SurfaceHold) -> anyhow::Result<SimulationLoop> {
    Ok(SimulationLoop::new(RATIO, returned, hold)?)
}

/// Gains and stiffness in N/m, the step in metres.
fn step(kh: f64, ko: f64, input_m: f64, one_sided: bool) -> anyhow::Result<HandStep> {
    let slow_loop = slow_loop(ReturnedForce::First, SurfaceHold::Zero)?;
    Ok(HandStep { model: PiLocalModel::new(kh, 0.0, ko)?, slow_loop, period_s: PERIOD_S, input_m, one_sided })
}

fn command(kh: f64, ko: f64, input_m: f64) -> String {
    format!("cotouch local-model step --kh {kh} --ko {ko} --input {input_m} --out step.svg")
}

fn table(responses: &[(&str, &StepResponse)]) -> String {
    let time_s: Vec<f64> = (0..responses[0].1.samples.len()).map(|tick| tick as f64 * PERIOD_S).collect();
    let mut header = vec!["time_s".to_owned()];
    let mut columns = vec![time_s];
    for (name, response) in responses {
        header.extend([format!("surface{name}_m"), format!("force{name}_n")]);
        columns.push(response.samples.iter().map(|sample| sample.surface_m).collect());
        columns.push(response.samples.iter().map(|sample| sample.force_n).collect());
    }
    csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

fn millimetres(metres: f64) -> String {
    format!("{:.2} mm", 1e3 * metres)
}

fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or_else(|| "never".to_owned(), |time_s| format!("{time_s:.2} s"))
}

fn figure_7() -> anyhow::Result<Outcome> {
    let step = step(100.0, 900.0, 0.1, false)?;
    let response = step.response(Some(1.0))?;
    let settling = response.settling;
    let claims = vec![
        Claim::new(
            "the surface moves only 1 cm for a movement of the hand of 10 cm",
            (settling.steady_state_m - 0.01).abs() < 1e-12,
        ),
        Claim::new(
            "the settling time is virtually null: two periods of the simulation",
            settling.to_2_percent_s.is_some_and(|time_s| time_s < 0.1 + 1e-9),
        ),
    ];
    let headline = "Figure 7: K_o = 0.9 N/mm, K_h = 0.1 N/mm, the hand steps 10 cm";
    Ok(Outcome {
        published_value: json!({ "surface_m": 0.01, "settling_s": "virtually null" }),
        value: json!({
            "surface_m": settling.steady_state_m,
            "settling_s": { "5%": settling.to_5_percent_s, "2%": settling.to_2_percent_s },
            "overshoot": settling.overshoot,
            "spectral_radius": settling.spectral_radius,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: UNITS.to_owned(),
        rows: vec![
            row("surface at rest", "1 cm", millimetres(settling.steady_state_m)),
            row(
                "settling time",
                "virtually null",
                format!(
                    "{} to 5 %, {} to 2 %",
                    seconds(settling.to_5_percent_s),
                    seconds(settling.to_2_percent_s)
                ),
            ),
            row("overshoot", "curve", percent(settling.overshoot)),
        ],
        claims,
        figure: Some(chart(headline, &panels(&step, &response, "", ""))?),
        table: Some(table(&[("", &response)])),
        commands: vec![command(100.0, 900.0, 0.1)],
    })
}

fn figure_8() -> anyhow::Result<Outcome> {
    let step = step(190.0, 200.0, 0.025, false)?;
    let response = step.response(Some(5.0))?;
    let settling = response.settling;
    let from_2_s = response.samples[2000..].iter();
    let left =
        from_2_s.map(|sample| (sample.surface_m / settling.steady_state_m - 1.0).abs()).fold(0.0, f64::max);
    let distance_m = step.input_m - settling.steady_state_m;
    let share = |share: f64| 1.0 - share;
    let headline = "Figure 8: K_o = 0.2 N/mm, K_h = 0.19 N/mm, the hand steps 25 mm";
    Ok(Outcome {
        published_value: json!({ "settling_s": 2.0, "distance_m": 0.025, "surface_m": 0.012 }),
        value: json!({
            "settling_s": { "5%": settling.to_5_percent_s, "2%": settling.to_2_percent_s },
            "within_after_2_s": left,
            "overshoot": settling.overshoot,
            "surface_m": settling.steady_state_m,
            "distance_m": distance_m,
            "hand_m": step.input_m,
            "spectral_radius": settling.spectral_radius,
        }),
        agrees: false,
        note: format!(
            "{UNITS} The oscillation falls by 5 % a period of 50 ms, so that 2 s bring it to 13 % only; the usual bands \
            of 5 % and 2 % take 59 and 77 periods. By (5) the surface makes K_h/K_o = 0.95 times the distance that is \
            left: 25 mm of distance would go with 24 mm of surface. The printed 25 mm is the hand's travel: with it (5) \
            gives the printed 12 mm of surface, and 12.8 mm of distance."
        ),
        rows: vec![
            row(
                "settling time",
                "about 2 s",
                format!(
                    "{} to 5 %, {} to 2 %; after 2 s within {:.1} %",
                    seconds(settling.to_5_percent_s),
                    seconds(settling.to_2_percent_s),
                    100.0 * left
                ),
            ),
            row("surface at rest", "12 mm", millimetres(settling.steady_state_m)),
            row("distance from surface to hand", "25 mm", millimetres(distance_m)),
            row("hand's travel", "not printed", millimetres(step.input_m)),
            row("overshoot", "curve", percent(settling.overshoot)),
        ],
        claims: vec![
            Claim::new(
                "the response is stable and clearly oscillates",
                settling.to_2_percent_s.is_some()
                    && settling.overshoot.is_some_and(|overshoot| overshoot > 0.5),
            ),
            Claim::new(
                "the steady-state error, as a share of the hand's travel, is smaller than in Fig 7",
                share(step.model.steady_share())
                    < share(PiLocalModel::new(100.0, 0.0, 900.0)?.steady_share()),
            ),
        ],
        figure: Some(chart(headline, &panels(&step, &response, "", ""))?),
        table: Some(table(&[("", &response)])),
        commands: vec![command(190.0, 200.0, 0.025)],
    })
}

fn figure_9() -> anyhow::Result<Outcome> {
    let (two, one) = (step(220.0, 200.0, 0.025, false)?, step(220.0, 200.0, 0.025, true)?);
    let (grows, cycles) = (two.response(Some(2.0))?, one.response(Some(2.0))?);
    let peak = |from: usize, to: usize| {
        grows.samples[from..to].iter().map(|sample| sample.surface_m).fold(0.0, f64::max)
    };
    let rising =
        cycles.samples[1000..2000].windows(2).filter(|pair| pair[1].surface_m > pair[0].surface_m).count();
    let least_force_n = cycles.samples.iter().map(|sample| sample.force_n).fold(f64::INFINITY, f64::min);
    let highest_m = cycles.samples.iter().map(|sample| sample.surface_m).fold(0.0, f64::max);
    let radius = grows.settling.spectral_radius;
    let claims = vec![
        Claim::new(
            "with K_h > K_o the oscillation grows",
            radius > 1.0 && peak(1000, 2000) > 2.0 * peak(0, 1000),
        ),
        Claim::new(
            "with a local model that only pushes it ends in a cycle that neither grows nor settles",
            least_force_n >= 0.0 && cycles.settling.to_5_percent_s.is_none() && highest_m < 2.0 * one.input_m,
        ),
    ];
    let [two_sided, _] = panels(&two, &grows, "the local model pushes and pulls", "");
    let [mut one_sided, _] = panels(&one, &cycles, "the local model only pushes", "");
    one_sided.series[2] = Series::solid("surface", 0, curve(&one, &cycles, |sample| 1e3 * sample.surface_m));
    let headline = "Figure 9: K_o = 0.2 N/mm, K_h = 0.22 N/mm, the hand steps 25 mm";
    Ok(Outcome {
        published_value: json!("unstable by (4)"),
        value: json!({
            "spectral_radius": radius,
            "one_sided_cycle_hz": rising,
            "one_sided_overshoot": cycles.settling.overshoot,
        }),
        agrees: claims.iter().all(|claim| claim.holds),
        note: format!(
            "{UNITS} No hand's travel is printed here; Figure 8's is taken. Its text does not say which of the two \
            its curve shows: contact that also pulls grows by 10 % a period without end; contact that only pushes lets \
            go every other period and cycles at {rising} Hz, half the rate of the simulation."
        ),
        rows: vec![
            row("growth a period", "curve", format!("{radius:.3}")),
            row("cycle when contact only pushes", "not printed", format!("{rising} Hz")),
            row("highest surface then", "not printed", millimetres(highest_m)),
        ],
        claims,
        figure: Some(chart(headline, &[two_sided, one_sided])?),
        table: Some(table(&[("", &grows), ("_one_sided", &cycles)])),
        commands: vec![
            command(220.0, 200.0, 0.025),
            format!("{} --unilateral", command(220.0, 200.0, 0.025)),
        ],
    })
}

/// P's limit by bisection of the lifted map's radius, in units of K_o.
fn limit_by_bisection(radius: impl Fn(f64) -> anyhow::Result<f64>) -> anyhow::Result<f64> {
    let (mut stable, mut unstable) = (1e-6, 4.0);
    for _ in 0..60 {
        let middle = 0.5 * (stable + unstable);
        if radius(middle)? < 1.0 {
            stable = middle;
        } else {
            unstable = middle;
        }
    }
    Ok(stable)
}

fn equation_4() -> anyhow::Result<Outcome> {
    let mut rows = Vec::new();
    let mut limits = Vec::new();
    let mut figure_panels = Vec::new();
    let (mut header, mut columns) = (vec!["kh_over_ko".to_owned()], vec![ratios()]);
    for (hold_name, hold) in [("zero", SurfaceHold::Zero), ("first", SurfaceHold::First)] {
        let mut panel = Panel {
            title: format!("{hold_name}-order hold"),
            x_label: "K_h / K_o".to_owned(),
            y_label: "spectral radius a slow period".to_owned(),
            series: vec![Series::dashed("limit of stability", 7, vec![(0.0, 1.0), (2.2, 1.0)])],
            ..Panel::default()
        };
        for (index, (name, returned)) in RETURNED.into_iter().enumerate() {
            let slow_loop = slow_loop(returned, hold)?;
            let lifted = |h: f64| -> anyhow::Result<f64> {
                Ok(spectral_radius(&eigenvalues(&slow_loop.lifted(&PiLocalModel::new(h, 0.0, 1.0)?))?))
            };
            let limit = limit_by_bisection(lifted)?;
            let closed = stable_kh(&slow_loop, 0.0, 1.0).last().map_or(0.0, |interval| interval.1);
            anyhow::ensure!(
                (limit - closed).abs() < 1e-9,
                "two ways to P's limit differ: {limit} and {closed}"
            );
            limits.push((hold, limit));
            let printed = if hold == SurfaceHold::Zero { "K_o" } else { "no formula" };
            rows.push(row(
                &format!("largest K_h, {hold_name}-order hold, {name} force"),
                printed,
                format!("{limit:.6}·K_o"),
            ));
            let radii = ratios().into_iter().map(lifted).collect::<anyhow::Result<Vec<f64>>>()?;
            let points = ratios().into_iter().zip(radii.iter().copied()).collect();
            panel.series.push(Series {
                dashed: hold == SurfaceHold::Zero && index > 0,
                ..Series::solid(name, index, points)
            });
            header.push(format!("radius_{hold_name}_hold_{name}_force"));
            columns.push(radii);
        }
        figure_panels.push(panel);
    }
    rows.push(with_a_hand(900.0, 0.5, 1.0)?);
    rows.push(with_a_hand(1200.0, 0.2, 5.0)?);
    let agrees = limits
        .iter()
        .filter(|(hold, _)| *hold == SurfaceHold::Zero)
        .all(|(_, limit)| (limit - 1.0).abs() < 1e-9);
    Ok(Outcome {
        published_value: json!("K_h < K_o"),
        value: json!({
            "largest_kh_over_ko": {
                "zero_hold": { "first": limits[0].1, "mean": limits[1].1, "last": limits[2].1 },
                "first_hold": { "first": limits[3].1, "mean": limits[4].1, "last": limits[5].1 },
            }
        }),
        agrees,
        note: "The lifted loop, tick by tick, against (4). While the surface stands still within a period, so does the \
            force, and it does not matter which one is returned. Under the first-order hold (§3.4: \"similar results\", \
            not shown) it does: the mean's limit is 2N/(N+1) = 1.96. Barbagli et al. 2003 hold the hand still and call (4) \
            necessary for the whole. The last rows let the hand go (K_o = 1000 N/m): for one given hand (4) is neither \
            enough nor necessary; it is necessary for all hands together, because one of them may hold still."
            .to_owned(),
        rows,
        claims: vec![Claim::new("a P local model under a zero-order hold is stable if and only if K_h < K_o", agrees)],
        figure: Some(chart("(4): a P local model on an elastic object, N = 50", &figure_panels)?),
        table: Some(csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())),
        commands: vec![
            "cotouch local-model check --kh 999 --int 0 --ko 1000 --ratio 50 --returned-force first".to_owned(),
            "cotouch local-model check --kh 1950 --int 0 --ko 1000 --ratio 50 --returned-force mean --hold first"
                .to_owned(),
            "cotouch local-model check --kh 900 --int 0 --ko 1000 --ratio 50 --returned-force mean --hand-mass 0.5 --hand-damping 1"
                .to_owned(),
        ],
    })
}

/// What becomes of (4) when a hand is free to move, K_o = 1000 N/m: K_h, and the hand's mass and damping.
fn with_a_hand(kh: f64, mass_kg: f64, damping_n_s_per_m: f64) -> anyhow::Result<[String; 3]> {
    const KO: f64 = 1000.0;
    let hand = HandImpedance { mass_kg, damping_n_s_per_m, stiffness_n_per_m: 0.0 };
    let (slow_loop, model) =
        (slow_loop(ReturnedForce::Mean, SurfaceHold::Zero)?, PiLocalModel::new(kh, 0.0, KO)?);
    let radius = hand_spectral_radius(hand, &model, &slow_loop, Rate::new(1000, 1)?)?;
    Ok(row(
        &format!("K_h = {}·K_o, a free hand of {mass_kg} kg, {damping_n_s_per_m} N·s/m", kh / KO),
        "left open",
        format!("radius {radius:.4}; held still {:.4}", slow_loop.spectral_radius(&model)),
    ))
}

fn ratios() -> Vec<f64> {
    (1..=220).map(|index| 0.01 * f64::from(index)).collect()
}

fn equation_5() -> anyhow::Result<Outcome> {
    let shares: Vec<f64> = (1..=19).map(|index| 0.05 * f64::from(index)).collect();
    let mut simulated = Vec::new();
    let mut stiffness = 0.0_f64;
    let mut with_integral = Vec::new();
    for &h in &shares {
        let of = |int: f64| -> anyhow::Result<(f64, f64)> {
            let slow_loop = slow_loop(ReturnedForce::First, SurfaceHold::Zero)?;
            let model = PiLocalModel::new(h * 200.0, int, 200.0)?;
            let step = HandStep { model, slow_loop, period_s: PERIOD_S, input_m: 0.01, one_sided: false };
            let last = *step.response(Some(30.0))?.samples.last().expect("a response has samples");
            Ok((last.surface_m / 0.01, last.force_n / last.surface_m / 200.0))
        };
        let (share, perceived) = of(0.0)?;
        simulated.push(share);
        stiffness = stiffness.max((perceived - 1.0).abs());
        with_integral.push(of(60.0)?.0);
    }
    let printed: Vec<f64> = shares.iter().map(|h| h / (1.0 + h)).collect();
    let largest = |one: &[f64], other: &[f64]| {
        one.iter().zip(other).map(|(one, other)| (one - other).abs()).fold(0.0, f64::max)
    };
    let error = largest(&simulated, &printed);
    let integral_error = largest(&with_integral, &vec![1.0; shares.len()]);
    let claims = vec![
        Claim::new("the surface ends where (5) says", error < 1e-9),
        Claim::new("steady force over the surface's travel is K_o", stiffness < 1e-9),
        Claim::new("with an integral the steady-state error vanishes", integral_error < 1e-9),
    ];
    let points = |values: &[f64]| shares.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    let panel = Panel {
        title: "30 s after the hand's step, tick by tick".to_owned(),
        x_label: "K_h / K_o".to_owned(),
        y_label: "surface / hand".to_owned(),
        series: vec![
            Series::solid("(5): K_h/(K_h + K_o)", 0, points(&printed)),
            Series::dashed("P, simulated", 1, points(&simulated)),
            Series::solid("PI, simulated, INT = 0.3·K_o", 2, points(&with_integral)),
        ],
        ..Panel::default()
    };
    Ok(Outcome {
        published_value: json!("x_o = K_h/(K_h + K_o)·x_h"),
        value: json!({ "largest_difference": error, "largest_difference_with_integral": integral_error }),
        agrees: error < 1e-9,
        note: "The loop is simulated tick by tick for 30 s at 19 values of K_h/K_o from 0.05 to 0.95; differences are \
            shares of the hand's travel."
            .to_owned(),
        rows: vec![
            row("surface over hand", "K_h/(K_h + K_o)", format!("the same to {error:.1e}")),
            row("force over surface", "K_o", format!("the same to {stiffness:.1e}")),
            row("the same with an integral", "no error", format!("{integral_error:.1e}")),
        ],
        claims,
        figure: Some(chart("(5): how far the surface moves in the end", &[panel])?),
        table: Some(csv(
            &["kh_over_ko", "printed", "simulated", "simulated_with_integral"].map(str::to_owned),
            &[&shares, &printed, &simulated, &with_integral],
        )),
        commands: vec![
            "cotouch local-model step --kh 100 --ko 200 --input 0.01".to_owned(),
            "cotouch local-model step --kh 100 --int 60 --ko 200 --input 0.01".to_owned(),
        ],
    })
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "without end".to_owned(), |share| format!("{:.1} %", 100.0 * share))
}
