//! (9) of Barbagli et al. 2003 and Figures 10, 11: for which gains a PI local model is stable.

use cotouch_analysis::local_model::{PiLocalModel, SimulationLoop, StableGains};
use cotouch_analysis::{eigenvalues, spectral_radius};
use cotouch_scene::scene::{ReturnedForce, SurfaceHold};
use serde_json::{Value as Json, json};

use super::outcome::{Claim, Experiment, Outcome, csv, row};
use crate::figure::chart::{Panel, Region, Series, chart};
use crate::figure::oblique::{Volume, volumes};

pub(super) const FIGURE_10: Experiment =
    Experiment { id: "pfig10", title: "Stability area of a PI local model in K_h and INT", run: figure_10 };
pub(super) const FIGURE_11: Experiment =
    Experiment { id: "pfig11", title: "Stability volume of a PI local model over K_o", run: figure_11 };
pub(super) const EQUATION_9: Experiment =
    Experiment { id: "peq9", title: "Jury's conditions on a PI local model (9)", run: equation_9 };

/// 20 Hz and 1 kHz: §2.1.
const RATIO: u32 = 50;
const RETURNED: [(&str, ReturnedForce); 3] =
    [("first", ReturnedForce::First), ("mean", ReturnedForce::Mean), ("last", ReturnedForce::Last)];
/// Corners of (9) in units of K_o.
const PRINTED: [(f64, f64); 5] = [(0.0, 0.0), (1.0, 0.0), (3.0, 4.0), (0.0, 1.0), (0.0, 0.0)];

fn slow_loop(returned: ReturnedForce, hold: SurfaceHold) -> anyhow::Result<SimulationLoop> {
    Ok(SimulationLoop::new(RATIO, returned, hold)?)
}

/// (9) as printed, with the gains in units of K_o.
fn printed(h: f64, i: f64) -> bool {
    let distance = i - h;
    distance.abs() < 1.0 && distance > (1.0 - h) - 1.0 && distance > (h - 1.0) - 1.0
}

/// How many points of a grid over (9) and its surroundings (9) calls right, and which way it errs.
struct Comparison {
    points: usize,
    printed_stable: usize,
    /// Stable by (9) and not in the loop.
    unsafe_points: usize,
    /// The other way.
    lost_points: usize,
    /// h, i, radius, radius by lifting.
    rows: Vec<[f64; 3]>,
}

impl Comparison {
    /// With the eigenvalues of the loop lifted tick by tick, at the middles of 160 × 200 cells of 3.2 × 4.4 K_o.
    fn of(slow_loop: &SimulationLoop) -> anyhow::Result<Self> {
        let mut comparison =
            Self { points: 0, printed_stable: 0, unsafe_points: 0, lost_points: 0, rows: Vec::new() };
        for (row, column) in (0..200_u32).flat_map(|row| (0..160_u32).map(move |column| (row, column))) {
            // Not on the sides of (9).
            let (h, i) = (0.02 * (f64::from(column) + 0.4137), 0.022 * (f64::from(row) + 0.5271));
            let radius = spectral_radius(&eigenvalues(&slow_loop.lifted(&PiLocalModel::new(h, i, 1.0)?))?);
            let (says, is) = (printed(h, i), radius < 1.0);
            comparison.points += 1;
            comparison.printed_stable += usize::from(says);
            comparison.unsafe_points += usize::from(says && !is);
            comparison.lost_points += usize::from(is && !says);
            comparison.rows.push([h, i, radius]);
        }
        Ok(comparison)
    }

    fn unsafe_share(&self) -> f64 {
        self.unsafe_points as f64 / self.printed_stable as f64
    }

    fn in_words(&self) -> String {
        format!(
            "{} of {} points differ: {} stable by (9) are not ({:.0} % of its area), {} stable ones are missing",
            self.unsafe_points + self.lost_points,
            self.points,
            self.unsafe_points,
            100.0 * self.unsafe_share(),
            self.lost_points
        )
    }
}

fn equation_9() -> anyhow::Result<Outcome> {
    let mut rows = Vec::new();
    let mut value = serde_json::Map::new();
    let mut all = Vec::new();
    for (name, returned) in RETURNED {
        let comparison = Comparison::of(&slow_loop(returned, SurfaceHold::Zero)?)?;
        rows.push(row(
            &format!("(9) against eigenvalues, {name} force"),
            "stable inside (9)",
            comparison.in_words(),
        ));
        value.insert(
            name.to_owned(),
            json!({
                "points": comparison.points,
                "stable_by_9_and_unstable": comparison.unsafe_points,
                "stable_and_not_by_9": comparison.lost_points,
            }),
        );
        all.push(comparison);
    }
    let [first, mean, last] = &all[..] else { anyhow::bail!("three returned forces") };
    let same = |one: &Comparison| one.unsafe_points + one.lost_points == 0;
    // (9) with K_h + m·INT in place of K_h.
    let sheared = |comparison: &Comparison, m: f64| {
        comparison.rows.iter().all(|&[h, i, radius]| printed(h + m * i, i) == (radius < 1.0))
    };
    let n = f64::from(RATIO);
    let claims = vec![
        Claim::new("(9) is exact where the first force of a period is returned", same(first)),
        Claim::new(
            "for the mean it is exact with K_h + (N−1)/(2N)·INT in place of K_h",
            sheared(mean, 0.5 * (n - 1.0) / n),
        ),
        Claim::new("for the last force, with K_h + (N−1)/N·INT", sheared(last, (n - 1.0) / n)),
    ];
    let columns = |pick: fn(&[f64; 3]) -> f64, of: &Comparison| of.rows.iter().map(pick).collect::<Vec<_>>();
    let columns = [
        columns(|row| row[0], first),
        columns(|row| row[1], first),
        columns(|row| row[2], first),
        columns(|row| row[2], mean),
        columns(|row| row[2], last),
    ];
    let header =
        ["kh_over_ko", "int_over_ko", "radius_first", "radius_mean", "radius_last"].map(str::to_owned);
    Ok(Outcome {
        published_value: json!("|INT − K_h| < K_o, INT > 0, INT > 2·(K_h − K_o)"),
        value: Json::Object(value),
        agrees: same(first),
        note: format!(
            "Eigenvalues of the loop lifted tick by tick, N = 50, on a grid. (9) follows from (7), in which the \
            simulation receives the force of the first tick of a period. Step 3 of the algorithm of Barbagli et al. 2003, §4, gives \
            it a mean: for the plain mean {:.0} % of the area of (9) is unstable, because an integral that runs within \
            the period acts like proportional gain.",
            100.0 * mean.unsafe_share()
        ),
        rows,
        claims,
        figure: Some(chart("(9) and the loop that the algorithm closes, N = 50", &[radius_panel()?])?),
        table: Some(csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())),
        commands: vec![
            "cotouch local-model check --kh 1200 --int 600 --ko 1000 --ratio 50 --returned-force first"
                .to_owned(),
            "cotouch local-model check --kh 1200 --int 600 --ko 1000 --ratio 50 --returned-force mean"
                .to_owned(),
        ],
    })
}

/// Radii along the straight line from the origin to the tip of (9), where a gain is scaled.
fn radius_panel() -> anyhow::Result<Panel> {
    let mut series = vec![Series::dashed("limit of stability", 7, vec![(0.0, 1.0), (1.0, 1.0)])];
    for (index, (name, returned)) in RETURNED.into_iter().enumerate() {
        let slow_loop = slow_loop(returned, SurfaceHold::Zero)?;
        let at = |step: u32| -> anyhow::Result<(f64, f64)> {
            let share = f64::from(step) / 200.0;
            Ok((share, slow_loop.spectral_radius(&PiLocalModel::new(3.0 * share, 4.0 * share, 1.0)?)))
        };
        let points = (1..=200).map(at).collect::<anyhow::Result<Vec<_>>>()?;
        let points = points.into_iter().filter(|point| point.1 < 2.5).collect();
        series.push(Series::solid(&format!("{name} force"), index, points));
    }
    Ok(Panel {
        title: "from the origin (0) to the tip of (9), K_h = 3·K_o, INT = 4·K_o (1)".to_owned(),
        x_label: "share of the way: stable by (9) below 1".to_owned(),
        y_label: "spectral radius a slow period".to_owned(),
        series,
        ..Panel::default()
    })
}

fn area_panel(hold: SurfaceHold, title: &str) -> anyhow::Result<Panel> {
    let mut panel = Panel {
        title: title.to_owned(),
        x_label: "K_h / K_o".to_owned(),
        y_label: "INT / K_o".to_owned(),
        ..Panel::default()
    };
    for (index, (name, returned)) in RETURNED.into_iter().enumerate() {
        let boundary = StableGains::new(&slow_loop(returned, hold)?, 1.0).boundary;
        let polygon: Vec<(f64, f64)> = boundary.iter().map(|&[h, i]| (h, i)).collect();
        let closed = polygon.iter().chain(polygon.first()).copied().collect();
        panel.series.push(Series::solid("", index, closed));
        panel.regions.push(Region { label: format!("{name} force"), colour: index, polygons: vec![polygon] });
    }
    panel.series.push(Series::dashed("(9) as printed, for a zero-order hold", 7, PRINTED.to_vec()));
    Ok(panel)
}

fn figure_10() -> anyhow::Result<Outcome> {
    let mut rows = Vec::new();
    let mut value = serde_json::Map::new();
    let (mut header, mut columns) = (Vec::new(), Vec::new());
    for (hold_name, hold) in [("zero", SurfaceHold::Zero), ("first", SurfaceHold::First)] {
        for (name, returned) in RETURNED {
            let region = StableGains::new(&slow_loop(returned, hold)?, 1.0);
            let printed = if hold == SurfaceHold::Zero { "3.5·K_o² by (9)" } else { "not shown" };
            rows.push(row(
                &format!("area, {hold_name}-order hold, {name} force"),
                printed,
                format!("{:.4}·K_o²", region.area()),
            ));
            value.insert(format!("area_{hold_name}_hold_{name}_force"), json!(region.area()));
            for (axis, gain) in ["kh", "int"].into_iter().enumerate() {
                header.push(format!("{gain}_{hold_name}_hold_{name}_force"));
                columns.push(region.boundary.iter().map(|corner| corner[axis]).collect::<Vec<f64>>());
            }
        }
    }
    let corners = StableGains::new(&slow_loop(ReturnedForce::First, SurfaceHold::Zero)?, 1.0).boundary;
    let agrees = corners.len() == 4
        && PRINTED.iter().all(|&(h, i)| {
            corners.iter().any(|corner| (corner[0] - h).abs() < 1e-12 && (corner[1] - i).abs() < 1e-12)
        });
    let example = PiLocalModel::new(1200.0, 600.0, 1000.0)?;
    let radius = |returned| -> anyhow::Result<f64> {
        Ok(slow_loop(returned, SurfaceHold::Zero)?.spectral_radius(&example))
    };
    let (first, mean) = (radius(ReturnedForce::First)?, radius(ReturnedForce::Mean)?);
    rows.push(row(
        "K_h = 1.2·K_o, INT = 0.6·K_o, first force",
        "stable",
        format!("spectral radius {first:.4}"),
    ));
    rows.push(row("the same gains, mean force", "stable", format!("spectral radius {mean:.4}")));
    Ok(Outcome {
        published_value: json!("the area of (9), with corners (0, 0), (K_o, 0), (3·K_o, 4·K_o), (0, K_o)"),
        value: Json::Object(value),
        agrees,
        note: "The printed area is exact where the first force of a period is returned. The algorithm of §4 returns a \
            mean: the area is sheared to the left by (N−1)/(2N)·INT (and cut at K_h = 0), for the last force by \
            (N−1)/N·INT, so that gains inside the printed area can be unstable. The first-order hold of §3.4 is one \
            period late and gives other areas, which are smaller for the first force."
            .to_owned(),
        rows,
        claims: vec![
            Claim::new("the area has the corners of (9), first force returned", agrees),
            Claim::new("gains inside the printed area can be unstable when the mean is returned", first < 1.0 && mean > 1.0),
        ],
        figure: Some(chart(
            "Figure 10: gains for which the simulation loop is stable, N = 50",
            &[
                area_panel(SurfaceHold::Zero, "the surface jumps: zero-order hold")?,
                area_panel(SurfaceHold::First, "the surface moves linearly: first-order hold")?,
            ],
        )?),
        table: Some(csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())),
        commands: vec![
            "cotouch local-model check --kh 1200 --int 600 --ko 1000 --ratio 50 --returned-force first".to_owned(),
            "cotouch local-model check --kh 1200 --int 600 --ko 1000 --ratio 50 --returned-force mean".to_owned(),
        ],
    })
}

fn figure_11() -> anyhow::Result<Outcome> {
    let stiffnesses = [0.2, 0.4, 0.6, 0.8, 1.0];
    let volume = |title: &str, colour: usize, returned| -> anyhow::Result<Volume> {
        let slow_loop = slow_loop(returned, SurfaceHold::Zero)?;
        let slice = |ko: f64| (ko, StableGains::new(&slow_loop, ko).boundary);
        Ok(Volume { title: title.to_owned(), colour, slices: stiffnesses.into_iter().map(slice).collect() })
    };
    let shown = [
        volume("first force returned: (9)", 0, ReturnedForce::First)?,
        volume("mean force returned: the algorithm of §4", 1, ReturnedForce::Mean)?,
    ];
    let first = slow_loop(ReturnedForce::First, SurfaceHold::Zero)?;
    let areas: Vec<f64> = stiffnesses.iter().map(|&ko| StableGains::new(&first, ko).area()).collect();
    let scales = stiffnesses.iter().zip(&areas).all(|(ko, area)| (area - 3.5 * ko * ko).abs() < 1e-12);
    let same_transient = stiffnesses.iter().all(|&ko| {
        let radius =
            |ko: f64| PiLocalModel::new(0.8 * ko, 0.5 * ko, ko).map(|model| first.spectral_radius(&model));
        matches!((radius(ko), radius(1.0)), (Ok(one), Ok(other)) if (one - other).abs() < 1e-12)
    });
    let volume_below = StableGains::new(&first, 1.0).volume_below(1.0);
    let mut rows: Vec<[String; 3]> = stiffnesses
        .iter()
        .zip(&areas)
        .map(|(ko, area)| row(&format!("area at K_o = {ko}"), "slice", format!("{area:.4}")))
        .collect();
    rows.push(row("volume up to K_o", "not printed", format!("{volume_below:.4}·K_o³")));
    let (mut header, mut columns) = (Vec::new(), Vec::new());
    for (name, volume) in ["first", "mean"].into_iter().zip(&shown) {
        for (ko, corners) in &volume.slices {
            for (axis, gain) in ["kh", "int"].into_iter().enumerate() {
                header.push(format!("{gain}_ko_{ko}_{name}_force"));
                columns.push(corners.iter().map(|corner| corner[axis]).collect::<Vec<f64>>());
            }
        }
    }
    Ok(Outcome {
        published_value: json!("slices of the same shape that grow with K_o"),
        value: json!({ "ko": stiffnesses, "area": areas, "volume_over_ko_cubed": volume_below }),
        agrees: scales && same_transient,
        note: "Any unit of stiffness: slices scale with K_o, their area with K_o², the volume up to K_o with K_o³. The \
            right-hand volume is that of the algorithm of Barbagli et al. 2003, §4, which returns the mean of a period's forces."
            .to_owned(),
        rows,
        claims: vec![
            Claim::new("the area has the same shape for all K_o and is larger for stiffer objects", scales),
            Claim::new("points of the same relative position have the same transient", same_transient),
        ],
        figure: Some(volumes(
            "Figure 11: gains for which the simulation loop is stable, while K_o varies (five slices)",
            ["K_h", "INT", "K_o"],
            &shown,
        )?),
        table: Some(csv(&header, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>())),
        commands: vec![
            "cotouch local-model check --kh 160 --int 100 --ko 200 --ratio 50 --returned-force first".to_owned(),
            "cotouch local-model check --kh 800 --int 500 --ko 1000 --ratio 50 --returned-force first".to_owned(),
        ],
    })
}
