//! Figures 5.1 to 5.4: where the centralized and the distributed controller are stable, for delays of 0 to 3 periods.

use std::fmt::Write as _;

use cotouch_analysis::map::{StabilityMap, stability_map};
use cotouch_analysis::sweep::Sweep;
use cotouch_scene::scene::Architecture;
use serde_json::json;

use super::runs::load;
use super::{Claim, Experiment, Outcome};
use crate::figure::chart::{Panel, Series, chart};
use crate::figure::map::{boundary, frame, region};

pub(super) const FIGURE_5_1: Experiment =
    Experiment { id: "fig5.1", title: "The region of stability for the centralized control architecture", run: figure_5_1 };
pub(super) const FIGURE_5_2: Experiment = Experiment {
    id: "fig5.2",
    title: "The region of stability for the distributed control architecture, k_o = 1000 N/m",
    run: figure_5_2,
};
pub(super) const FIGURE_5_3: Experiment = Experiment {
    id: "fig5.3",
    title: "The region of stability for the distributed control architecture, k_12 = k_21 = 300 N/m",
    run: figure_5_3,
};
pub(super) const FIGURE_5_4: Experiment = Experiment {
    id: "fig5.4",
    title: "The region of stability for the distributed control architecture, k_11 = k_22 = 2000 N/m",
    run: figure_5_4,
};

/// n of the figures.
const DELAYS: [usize; 4] = [0, 1, 2, 3];
/// Points of a map in each direction.
const COUNT: usize = 121;

/// A stiffness: its key, and what the thesis calls it.
#[derive(Clone, Copy)]
struct Stiffness {
    key: &'static str,
    symbol: &'static str,
}

const K_1: Stiffness = Stiffness { key: "coupling.hand_object.stiffness_n_per_m", symbol: "k_1" };
const K_2: Stiffness = Stiffness { key: "coupling.remote_hand_object.stiffness_n_per_m", symbol: "k_2" };
const K_11: Stiffness = Stiffness { symbol: "k_11 = k_22", ..K_1 };
const K_12: Stiffness = Stiffness { symbol: "k_12 = k_21", ..K_2 };
const K_O: Stiffness = Stiffness { key: "coupling.object_object.stiffness_n_per_m", symbol: "k_o" };

/// One figure: what is swept, N/m, and what is fixed.
struct Figure {
    title: &'static str,
    architecture: Architecture,
    fixed: Option<(Stiffness, f64)>,
    x: (Stiffness, f64),
    y: (Stiffness, f64),
}

/// The regions of one figure, one a delay.
struct Regions {
    figure: Figure,
    maps: Vec<StabilityMap>,
}

impl Figure {
    fn scene(&self) -> &'static str {
        match self.architecture {
            Architecture::Centralized => "single-axis-centralized",
            Architecture::Distributed => "single-axis",
        }
    }

    /// Chapter 5: b = 10 N·s/m in every coupler; m_h, m_o, T_t and T_c are the scene's own.
    fn settings(&self, delay: usize) -> Vec<String> {
        let mut settings = vec![
            "coupling.hand_object.damping_n_s_per_m=10".to_owned(),
            "coupling.remote_hand_object.damping_n_s_per_m=10".to_owned(),
        ];
        if self.architecture == Architecture::Distributed {
            settings.push("coupling.object_object.damping_n_s_per_m=10".to_owned());
        }
        settings.extend(self.fixed.map(|(fixed, value)| format!("{}={value}", fixed.key)));
        settings.push(format!("link.delay_periods={delay}"));
        settings
    }

    fn sweeps(&self) -> anyhow::Result<[Sweep; 2]> {
        let sweep = |(stiffness, largest): (Stiffness, f64)| {
            format!("{}=0..{largest}:{COUNT}", stiffness.key).parse::<Sweep>()
        };
        Ok([sweep(self.x)?, sweep(self.y)?])
    }

    fn map(&self, delay: usize) -> anyhow::Result<StabilityMap> {
        let settings = self.settings(delay);
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let [x, y] = self.sweeps()?;
        Ok(stability_map(&load(self.scene(), &settings)?, &x, Some(&y), false, &|_| ())?)
    }

    fn command(&self, delay: usize) -> String {
        let sweep = |(stiffness, largest): (Stiffness, f64)| {
            format!("--sweep {}=0..{largest}:{COUNT}", stiffness.key)
        };
        format!(
            "cotouch analyze stability {} {} {} --set {}",
            self.scene(),
            sweep(self.x),
            sweep(self.y),
            self.settings(delay).join(" --set ")
        )
    }
}

impl Regions {
    fn of(figure: Figure) -> anyhow::Result<Self> {
        let maps = DELAYS.map(|delay| figure.map(delay)).into_iter().collect::<anyhow::Result<_>>()?;
        Ok(Self { figure, maps })
    }

    /// Of the points of the grid.
    fn share(&self, delay: usize) -> f64 {
        let points: Vec<bool> = self.maps[delay].stable.concat();
        points.iter().filter(|&&stable| stable).count() as f64 / points.len() as f64
    }

    /// (N/m)².
    fn area(&self, delay: usize) -> f64 {
        let twice = |outline: &Vec<[f64; 2]>| -> f64 {
            outline.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum()
        };
        0.5 * self.maps[delay].outlines.iter().map(twice).sum::<f64>()
    }

    /// The largest stable value along x (0) or y (1).
    fn largest(&self, delay: usize, direction: usize) -> f64 {
        let outlines = self.maps[delay].outlines.iter().flatten();
        outlines.map(|point| point[direction]).fold(0.0, f64::max)
    }

    fn rows(&self) -> Vec<[String; 3]> {
        let row = |delay: usize| {
            let here = match &self.maps[delay].empty {
                Some(reason) => format!("empty. {reason}"),
                None => format!(
                    "{:.2} % of {} × {} N/m; {} up to {:.0}, {} up to {:.0}",
                    100.0 * self.area(delay) / (self.figure.x.1 * self.figure.y.1),
                    self.figure.x.1,
                    self.figure.y.1,
                    self.figure.x.0.symbol,
                    self.largest(delay, 0),
                    self.figure.y.0.symbol,
                    self.largest(delay, 1),
                ),
            };
            [format!("n = {delay}"), "a region".to_owned(), here]
        };
        DELAYS.iter().map(|&delay| row(delay)).collect()
    }

    fn outcome(self, agrees: bool, note: &str, claims: Vec<Claim>) -> anyhow::Result<Outcome> {
        let areas: Vec<f64> = DELAYS.iter().map(|&delay| self.area(delay)).collect();
        Ok(Outcome {
            seed_value: json!("a region for each n = 0, 1, 2, 3, smaller as n grows"),
            value: json!({ "delay_periods": DELAYS, "stable_area_n2_per_m2": areas }),
            agrees,
            note: note.to_owned(),
            claims,
            rows: self.rows(),
            figure: Some(self.picture()?),
            table: Some(self.table()),
            commands: DELAYS.iter().map(|&delay| self.figure.command(delay)).collect(),
        })
    }

    fn picture(&self) -> anyhow::Result<String> {
        let mut panel = self.panel();
        for (delay, map) in self.maps.iter().enumerate() {
            let label = self.label(delay);
            panel.regions.push(region(map, &label, delay));
            panel.series.extend(boundary(map, "", delay));
        }
        chart(self.figure.title, &[panel])
    }

    fn label(&self, delay: usize) -> String {
        let word = match self.share(delay) {
            _ if self.maps[delay].empty.is_some() => ": empty",
            share if share < 0.01 => ": slivers",
            _ => "",
        };
        format!("n = {delay}{word}")
    }

    fn panel(&self) -> Panel {
        let (x, y) = (self.figure.x.0, self.figure.y.0);
        let mut series: Vec<Series> = Vec::new();
        series.extend(self.maps.first().and_then(|map| Some(frame(&map.x, map.y.as_ref()?))));
        Panel {
            x_label: format!("{}, N/m", x.symbol),
            y_label: format!("{}, N/m", y.symbol),
            series,
            ..Panel::default()
        }
    }

    /// The boundary's points.
    fn table(&self) -> String {
        let mut text = format!("delay_periods,curve,{},{}\n", self.figure.x.0.key, self.figure.y.0.key);
        for (delay, map) in self.maps.iter().enumerate() {
            for (curve, points) in map.boundary.iter().enumerate() {
                for [x, y] in points {
                    let _ = writeln!(text, "{delay},{curve},{x:?},{y:?}");
                }
            }
        }
        text
    }
}

const CENTRALIZED: Figure = Figure {
    title: "Figure 5.1: where the centralized controller is stable, for delays of n network periods",
    architecture: Architecture::Centralized,
    fixed: None,
    x: (K_1, 10_000.0),
    y: (K_2, 2000.0),
};
const DISTRIBUTED: Figure = Figure {
    title: "Figure 5.2: where the distributed controller is stable (k_o = 1000 N/m), for delays of n network periods",
    architecture: Architecture::Distributed,
    fixed: Some((K_O, 1000.0)),
    x: (K_12, 2000.0),
    y: (K_11, 10_000.0),
};

fn figure_5_1() -> anyhow::Result<Outcome> {
    Regions::of(CENTRALIZED)?.outcome(false, "", Vec::new())
}

fn figure_5_2() -> anyhow::Result<Outcome> {
    Regions::of(DISTRIBUTED)?.outcome(false, "", Vec::new())
}

fn figure_5_3() -> anyhow::Result<Outcome> {
    let figure = Figure {
        title: "Figure 5.3: where the distributed controller is stable (k_12 = 300 N/m), for delays of n network periods",
        architecture: Architecture::Distributed,
        fixed: Some((K_12, 300.0)),
        x: (K_O, 5000.0),
        y: (K_11, 10_000.0),
    };
    Regions::of(figure)?.outcome(false, "", Vec::new())
}

fn figure_5_4() -> anyhow::Result<Outcome> {
    let figure = Figure {
        title: "Figure 5.4: where the distributed controller is stable (k_11 = 2000 N/m), for delays of n network periods",
        architecture: Architecture::Distributed,
        fixed: Some((K_11, 2000.0)),
        x: (K_12, 2000.0),
        y: (K_O, 5000.0),
    };
    Regions::of(figure)?.outcome(false, "", Vec::new())
}
