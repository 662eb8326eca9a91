//! Figures 5.1 to 5.4: where the centralized and the distributed controller are stable, for delays of 0 to 3 periods.

use std::fmt::Write as _;

use cotouch_analysis::{StabilityMap, Sweep, stability_map};
use cotouch_scene::scene::Architecture;
use serde_json::json;

use super::outcome::{Claim, Experiment, Outcome};
use super::runs::load;
use crate::figure::chart::{Panel, Series, chart};
use crate::figure::map::{boundary, frame, region};

pub(super) const FIGURE_5_1: Experiment = Experiment {
    id: "fig5.1",
    title: "The region of stability for the centralized control architecture",
    run: figure_5_1,
};
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
const COUNT: usize = 97;
/// A region that is narrower than this share of the view is a sliver.
const SLIVER: f64 = 0.01;

/// A stiffness: its key, and what Fotoohi Ghiam 2006 calls it.
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

/// One figure: what is swept, and what is fixed, N/m.
struct Figure {
    title: &'static str,
    architecture: Architecture,
    fixed: Option<(Stiffness, f64)>,
    x: Stiffness,
    y: Stiffness,
    /// The largest values of x and y: such that the whole region without delay is seen, and those with long delays.
    views: [[f64; 2]; 2],
}

/// The regions of one figure, one a delay, in one view.
struct Regions<'a> {
    figure: &'a Figure,
    /// The largest values of x and y.
    view: [f64; 2],
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

    fn sweeps(&self, view: [f64; 2]) -> [String; 2] {
        [(self.x, view[0]), (self.y, view[1])]
            .map(|(stiffness, largest)| format!("{}=0..{largest}:{COUNT}", stiffness.key))
    }

    fn map(&self, view: [f64; 2], delay: usize) -> anyhow::Result<StabilityMap> {
        let settings = self.settings(delay);
        let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
        let [x, y] = self.sweeps(view);
        let (x, y): (Sweep, Sweep) = (x.parse()?, y.parse()?);
        Ok(stability_map(&load(self.scene(), &settings)?, &x, Some(&y), false, &|_| ())?)
    }

    fn regions(&self, view: [f64; 2]) -> anyhow::Result<Regions<'_>> {
        let maps = DELAYS.map(|delay| self.map(view, delay)).into_iter().collect::<anyhow::Result<_>>()?;
        Ok(Regions { figure: self, view, maps })
    }

    fn command(&self, delay: usize) -> String {
        format!(
            "cotouch analyze stability {} --sweep {} --set {}",
            self.scene(),
            self.sweeps(self.views[0]).join(" --sweep "),
            self.settings(delay).join(" --set ")
        )
    }

    fn outcome(
        &self,
        [far, near]: &[Regions<'_>; 2],
        agrees: bool,
        note: &str,
        claims: Vec<Claim>,
    ) -> anyhow::Result<Outcome> {
        let areas = DELAYS.map(|delay| far.area(delay));
        Ok(Outcome {
            published_value: json!("a region for each n = 0, 1, 2, 3, smaller as n grows"),
            value: json!({ "delay_periods": DELAYS, "stable_area_n2_per_m2": areas }),
            agrees,
            note: format!("{note} Fotoohi Ghiam 2006 prints no numbers, and the scan has no picture."),
            claims,
            rows: DELAYS.iter().map(|&delay| far.row(delay, near)).collect(),
            figure: Some(chart(self.title, &[far.panel("whole region"), near.panel("near the origin")])?),
            table: Some(far.table() + near.table().split_once('\n').map_or("", |(_, rows)| rows)),
            commands: DELAYS.iter().map(|&delay| self.command(delay)).collect(),
        })
    }

    fn both_views(&self) -> anyhow::Result<[Regions<'_>; 2]> {
        let [far, near] = self.views;
        Ok([self.regions(far)?, self.regions(near)?])
    }
}

impl Regions<'_> {
    /// (N/m)².
    fn area(&self, delay: usize) -> f64 {
        let twice = |outline: &Vec<[f64; 2]>| -> f64 {
            outline.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum()
        };
        0.5 * self.maps[delay].outlines.iter().map(twice).sum::<f64>()
    }

    /// The largest stable value of x (0) or y (1).
    fn largest(&self, delay: usize, direction: usize) -> f64 {
        let outlines = self.maps[delay].outlines.iter().flatten();
        outlines.map(|point| point[direction]).fold(0.0, f64::max)
    }

    /// Whether the largest stable value of x or y falls with every further period, empty regions left out.
    fn falls(&self, direction: usize) -> bool {
        let stable = DELAYS.iter().copied().filter(|&delay| self.maps[delay].empty.is_none());
        let largest: Vec<f64> = stable.map(|delay| self.largest(delay, direction)).collect();
        largest.windows(2).all(|pair| pair[1] < pair[0])
    }

    /// What people read about one delay.
    fn row(&self, delay: usize, near: &Self) -> [String; 3] {
        let here = match (&self.maps[delay].empty, &near.maps[delay].empty) {
            (Some(reason), Some(_)) => format!("empty. {reason}"),
            (Some(_), None) => near.in_words(delay),
            (None, _) => self.in_words(delay),
        };
        [format!("n = {delay}"), "a region".to_owned(), here]
    }

    fn in_words(&self, delay: usize) -> String {
        let Figure { x, y, .. } = self.figure;
        let up_to = |direction: usize, symbol: &str| {
            let largest = self.largest(delay, direction);
            let beyond = if largest < self.view[direction] { "" } else { " and more" };
            format!("{symbol} up to {largest:.0} N/m{beyond}")
        };
        format!("{:.3e} (N/m)²; {}, {}", self.area(delay), up_to(0, x.symbol), up_to(1, y.symbol))
    }

    fn panel(&self, title: &str) -> Panel {
        let (x, y) = (self.figure.x, self.figure.y);
        let maps = || self.maps.iter().enumerate();
        let mut series: Vec<Series> = maps().flat_map(|(delay, map)| boundary(map, "", delay)).collect();
        series.extend(self.maps.first().and_then(|map| Some(frame(&map.x, map.y.as_ref()?))));
        Panel {
            title: title.to_owned(),
            x_label: format!("{}, N/m", x.symbol),
            y_label: format!("{}, N/m", y.symbol),
            regions: maps().map(|(delay, map)| region(map, &self.label(delay), delay)).collect(),
            series,
            ..Panel::default()
        }
    }

    fn label(&self, delay: usize) -> String {
        let is_thin = (0..2).any(|direction| self.largest(delay, direction) < SLIVER * self.view[direction]);
        let word = match &self.maps[delay].empty {
            Some(_) => ": empty",
            None if is_thin => ": a sliver",
            None => "",
        };
        format!("n = {delay}{word}")
    }

    /// The boundary's points.
    fn table(&self) -> String {
        let Figure { x, y, .. } = self.figure;
        let mut text = format!("view_n_per_m,delay_periods,curve,{},{}\n", x.key, y.key);
        for (delay, map) in self.maps.iter().enumerate() {
            for (curve, points) in map.boundary.iter().enumerate() {
                for [x, y] in points {
                    let _ = writeln!(text, "{},{delay},{curve},{x:?},{y:?}", self.view[0]);
                }
            }
        }
        text
    }
}

const CENTRALIZED: Figure = Figure {
    title: "Figure 5.1: where the centralized controller is stable, for a round trip of n network periods",
    architecture: Architecture::Centralized,
    fixed: None,
    x: K_1,
    y: K_2,
    views: [[25_000.0, 3500.0], [2500.0, 600.0]],
};
const DISTRIBUTED: Figure = Figure {
    title: "Figure 5.2: where the distributed controller is stable (k_o = 1000 N/m), for a delay of n network periods each way",
    architecture: Architecture::Distributed,
    fixed: Some((K_O, 1000.0)),
    x: K_12,
    y: K_11,
    views: [[10_000.0, 25_000.0], [800.0, 25_000.0]],
};
const FIXED_REMOTE: Figure = Figure {
    title: "Figure 5.3: where the distributed controller is stable (k_12 = k_21 = 300 N/m), for a delay of n network periods each way",
    architecture: Architecture::Distributed,
    fixed: Some((K_12, 300.0)),
    x: K_O,
    y: K_11,
    views: [[25_000.0, 25_000.0], [3000.0, 25_000.0]],
};
const FIXED_LOCAL: Figure = Figure {
    title: "Figure 5.4: where the distributed controller is stable (k_11 = k_22 = 2000 N/m), for a delay of n network periods each way",
    architecture: Architecture::Distributed,
    fixed: Some((K_11, 2000.0)),
    x: K_12,
    y: K_O,
    views: [[5000.0, 14_000.0], [2000.0, 3500.0]],
};

fn figure_5_1() -> anyhow::Result<Outcome> {
    let views = CENTRALIZED.both_views()?;
    let far = &views[0];
    let local = [0, 1].map(|delay| far.largest(delay, 0));
    let claims = vec![
        Claim::new(
            "at n = 0 the packet rate costs most of the stiffness that the user across the network may have: the largest k_2 is far below the largest k_1",
            far.largest(0, 1) < 0.5 * far.largest(0, 0),
        ),
        Claim::new("from n = 0 to n = 1 the largest k_2 falls", far.falls(1)),
        Claim::new(
            "from n = 0 to n = 1 the largest stiffness of the local user, k_1, changes by less than 5 %",
            (local[1] / local[0] - 1.0).abs() < 0.05,
        ),
    ];
    let note = "Fotoohi Ghiam 2006 says that the regions shrink as n grows, and that the delay does not affect the local user. Both hold up to n = 1. With b = 10 N·s/m over held samples the region is empty for n = 2 and 3, for the local user too.";
    CENTRALIZED.outcome(&views, false, note, claims)
}

fn figure_5_2() -> anyhow::Result<Outcome> {
    let views = DISTRIBUTED.both_views()?;
    let centralized = CENTRALIZED.regions(CENTRALIZED.views[0])?;
    let [far, near] = &views;
    let claims = DELAYS.iter().map(|&delay| {
        let area = far.area(delay).max(near.area(delay));
        Claim::new(
            format!(
                "the region is larger than that of the centralized controller, in (N/m)², at n = {delay}"
            ),
            area > centralized.area(delay),
        )
    });
    let claims = claims.collect();
    let note = "\"Noticeably enlarged\" holds at every n (for n = 2 and 3 because the centralized region is empty). But the region does not merely shrink: of n = 3 only a sliver with almost no coupling to the remote hand remains.";
    DISTRIBUTED.outcome(&views, false, note, claims)
}

fn figure_5_3() -> anyhow::Result<Outcome> {
    let views = FIXED_REMOTE.both_views()?;
    let claims =
        vec![Claim::new("each further period of delay reduces the marginal value of k_o", views[0].falls(0))];
    let agrees = claims.iter().all(|claim| claim.holds);
    FIXED_REMOTE.outcome(&views, agrees, "The regions shrink as n grows, as the text says.", claims)
}

fn figure_5_4() -> anyhow::Result<Outcome> {
    let views = FIXED_LOCAL.both_views()?;
    let claims = vec![
        Claim::new("each further period of delay reduces the marginal value of k_12", views[0].falls(0)),
        Claim::new("each further period of delay reduces the marginal value of k_o", views[0].falls(1)),
    ];
    let agrees = claims.iter().all(|claim| claim.holds);
    FIXED_LOCAL.outcome(&views, agrees, "The regions shrink as n grows, as the text says.", claims)
}
