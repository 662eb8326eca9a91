//! Panels of curves side by side, for experiments and reports.

use plotters::prelude::*;

use super::canvas::{Area, GRID, INK, QUIET, colour, text, undrawable};

/// Everything is put on whole units, so there are this many to a pixel: slanted lines would have steps otherwise.
const FINE: u32 = 4;
const PANEL_WIDTH: u32 = 560 * FINE;
const PANEL_HEIGHT: u32 = 360 * FINE;
const HEADLINE: u32 = 40 * FINE;
const LEGEND_LINE: u32 = 18 * FINE;
const REGION_OPACITY: f64 = 0.22;
/// Points that a curve is thinned to.
const MAX_POINTS: usize = 1500;

/// One pair of axes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Panel {
    /// What it shows.
    pub(crate) title: String,
    /// With the unit.
    pub(crate) x_label: String,
    /// With the unit.
    pub(crate) y_label: String,
    /// Areas, drawn first.
    pub(crate) regions: Vec<Region>,
    /// The curves.
    pub(crate) series: Vec<Series>,
    /// How far apart values of x are drawn.
    pub(crate) x_scale: Scale,
    /// Likewise.
    pub(crate) y_scale: Scale,
    /// Whether a metre is as long in both directions.
    pub(crate) equal_scales: bool,
}

/// How values become lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Equal differences are equally long.
    #[default]
    Linear,
    /// Equal ratios are equally long; values that are not positive are left out.
    Logarithmic,
}

impl Scale {
    fn apply(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic if value > 0.0 => value.log10(),
            Self::Logarithmic => f64::NAN,
        }
    }

    fn label(self, place: f64) -> String {
        let value = match self {
            // What differs from 0 by rounding only.
            Self::Linear => (place * 1e9).round() / 1e9 + 0.0,
            Self::Logarithmic => 10f64.powf(place),
        };
        if self == Self::Logarithmic && value < 0.99e-3 {
            return format!("{value:.0e}");
        }
        let digits = if value == 0.0 { 0 } else { (2 - value.abs().log10().floor() as i32).clamp(0, 9) };
        let text = format!("{value:.*}", digits as usize);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    }

    /// How many labels a range (of lengths) gets.
    fn labels(self, (from, to): (f64, f64)) -> usize {
        match self {
            Self::Linear => 8,
            Self::Logarithmic => ((to - from).round() as usize + 1).clamp(3, 9),
        }
    }
}

/// An area in a panel.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    /// For the legend.
    pub(crate) label: String,
    /// Which of the colours.
    pub(crate) colour: usize,
    /// Its pieces, each a polygon; they should not overlap.
    pub(crate) polygons: Vec<Vec<(f64, f64)>>,
}

/// One curve.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    /// For the legend.
    pub(crate) label: String,
    /// In order.
    pub(crate) points: Vec<(f64, f64)>,
    /// Which of the colours.
    pub(crate) colour: usize,
    /// Dashed instead of solid.
    pub(crate) dashed: bool,
}

impl Series {
    /// A solid curve.
    pub(crate) fn solid(label: &str, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.to_owned(), points, colour, dashed: false }
    }

    /// A dashed curve.
    pub(crate) fn dashed(label: &str, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Self { dashed: true, ..Self::solid(label, colour, points) }
    }
}

/// The panels in a row below a headline, as SVG.
pub(crate) fn chart(headline: &str, panels: &[Panel]) -> anyhow::Result<String> {
    let mut svg = String::new();
    let width = PANEL_WIDTH * panels.len().max(1) as u32;
    let legend = panels.iter().map(legend_lines).max().unwrap_or(0) * LEGEND_LINE;
    let height = HEADLINE + legend + PANEL_HEIGHT;
    {
        let root = SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area();
        root.fill(&WHITE).map_err(undrawable)?;
        root.draw_text(headline, &fine_text(15), at(16, 12)).map_err(undrawable)?;
        let (_, body) = root.split_vertically(HEADLINE);
        for (area, panel) in body.split_evenly((1, panels.len().max(1))).iter().zip(panels) {
            draw(area, panel, legend)?;
        }
        root.present().map_err(undrawable)?;
    }
    // The first size is that of the picture on a page; the second, of the units in it.
    let size = |fine: u32| format!("width=\"{}\" height=\"{}\"", width / fine, height / fine);
    Ok(svg.replacen(&size(1), &size(FINE), 1))
}

/// A place that is given in pixels.
const fn at(x: i32, y: i32) -> (i32, i32) {
    (x * FINE as i32, y * FINE as i32)
}

fn fine_text(size: u32) -> TextStyle<'static> {
    text(size * FINE, INK)
}

fn draw(area: &Area<'_>, panel: &Panel, legend_height: u32) -> anyhow::Result<()> {
    let (legend, plot) = area.split_vertically(legend_height);
    draw_legend(&legend, panel)?;
    let (x_scale, y_scale) = (panel.x_scale, panel.y_scale);
    let place = |&(x, y): &(f64, f64)| (x_scale.apply(x), y_scale.apply(y));
    let (mut x, mut y) = (extent(panel, |point| place(&point).0), extent(panel, |point| place(&point).1));
    if panel.equal_scales {
        let (wide, high) = (f64::from(PANEL_WIDTH - 100 * FINE), f64::from(PANEL_HEIGHT - 80 * FINE));
        let scale = ((x.1 - x.0) / wide).max((y.1 - y.0) / high);
        x = about(x, scale * wide);
        y = about(y, scale * high);
    }
    let mut chart = ChartBuilder::on(&plot)
        .margin_right(20 * FINE)
        .margin_top(22 * FINE)
        .margin_left(8 * FINE)
        .caption(&panel.title, fine_text(13))
        .x_label_area_size(40 * FINE)
        .y_label_area_size(60 * FINE)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)
        .map_err(undrawable)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID.stroke_width(FINE))
        .axis_style(QUIET.stroke_width(FINE))
        .set_all_tick_mark_size(5 * FINE)
        .label_style(fine_text(12))
        .axis_desc_style(fine_text(13))
        .x_desc(&panel.x_label)
        .y_desc(&panel.y_label)
        .x_labels(x_scale.labels(x))
        .y_labels(y_scale.labels(y))
        .x_label_formatter(&|&place| x_scale.label(place))
        .y_label_formatter(&|&place| y_scale.label(place))
        .draw()
        .map_err(undrawable)?;
    for region in &panel.regions {
        let style = colour(region.colour).mix(REGION_OPACITY).filled();
        let polygons = region
            .polygons
            .iter()
            .map(|polygon| Polygon::new(polygon.iter().map(place).collect::<Vec<_>>(), style));
        chart.draw_series(polygons).map_err(undrawable)?;
    }
    for series in &panel.series {
        let placed: Vec<_> = series.points.iter().map(place).collect();
        let points = thinned(&placed);
        if series.dashed {
            let style = colour(series.colour).stroke_width(2 * FINE);
            chart
                .draw_series(DashedLineSeries::new(points, 6 * FINE, 4 * FINE, style))
                .map_err(undrawable)?;
        } else {
            // A line and a half wide.
            let style = colour(series.colour).stroke_width(3 * FINE / 2);
            chart.draw_series(LineSeries::new(points, style)).map_err(undrawable)?;
        }
    }
    Ok(())
}

/// Every named area and curve, in order.
fn labels(panel: &Panel) -> impl Iterator<Item = &str> {
    let regions = panel.regions.iter().map(|region| region.label.as_str());
    regions.chain(panel.series.iter().map(|series| series.label.as_str())).filter(|label| !label.is_empty())
}

/// Where each label's sign begins, in pixels.
fn legend_places(panel: &Panel) -> impl Iterator<Item = (i32, i32)> {
    const FIRST: i32 = 66;
    let (mut x, mut y) = (FIRST, 0);
    labels(panel).map(move |label| {
        let width = 28 + 7 * label.chars().count() as i32 + 12;
        if x > FIRST && x + width > (PANEL_WIDTH / FINE) as i32 {
            (x, y) = (FIRST, y + (LEGEND_LINE / FINE) as i32);
        }
        x += width;
        (x - width, y)
    })
}

fn legend_lines(panel: &Panel) -> u32 {
    legend_places(panel).last().map_or(0, |(_, y)| y as u32 / (LEGEND_LINE / FINE) + 1)
}

fn draw_legend(area: &Area<'_>, panel: &Panel) -> anyhow::Result<()> {
    let mut places = legend_places(panel);
    let mut next = || places.next().unwrap_or_default();
    for region in panel.regions.iter().filter(|region| !region.label.is_empty()) {
        let (x, y) = next();
        let style = colour(region.colour).mix(REGION_OPACITY).filled();
        area.draw(&Rectangle::new([at(x, y + 3), at(x + 23, y + 15)], style)).map_err(undrawable)?;
        area.draw_text(&region.label, &fine_text(12), at(x + 28, y + 2)).map_err(undrawable)?;
    }
    for series in panel.series.iter().filter(|series| !series.label.is_empty()) {
        let (x, y) = next();
        let style = colour(series.colour).stroke_width(3 * FINE);
        let pieces: &[(i32, i32)] = if series.dashed { &[(0, 9), (14, 23)] } else { &[(0, 23)] };
        for &(from, to) in pieces {
            area.draw(&PathElement::new([at(x + from, y + 9), at(x + to, y + 9)], style))
                .map_err(undrawable)?;
        }
        area.draw_text(&series.label, &fine_text(12), at(x + 28, y + 2)).map_err(undrawable)?;
    }
    Ok(())
}

/// The range of all curves, with some air.
fn extent(panel: &Panel, of: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
    let of_series = panel.series.iter().flat_map(|series| &series.points);
    let of_regions = panel.regions.iter().flat_map(|region| region.polygons.iter().flatten());
    let points: Vec<f64> = of_series.chain(of_regions).map(|&point| of(point)).collect();
    let values = || points.iter().copied();
    let finite = || values().filter(|value| value.is_finite());
    let (least, largest) =
        (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    if least > largest {
        return (0.0, 1.0);
    }
    let air = (0.05 * (largest - least)).max(1e-6);
    (least - air, largest + air)
}

fn about(range: (f64, f64), length: f64) -> (f64, f64) {
    let middle = 0.5 * (range.0 + range.1);
    (middle - 0.5 * length, middle + 0.5 * length)
}

/// A curve of at most about [`MAX_POINTS`] points: of each stretch its first, lowest, highest and last one, so that what
/// stands out stays.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let finite: Vec<_> =
        points.iter().copied().filter(|point| point.0.is_finite() && point.1.is_finite()).collect();
    if finite.len() <= MAX_POINTS {
        return finite;
    }
    let stretch = finite.len().div_ceil(MAX_POINTS / 4);
    let mut kept = Vec::new();
    for part in finite.chunks(stretch) {
        let extreme = |better: fn(f64, f64) -> bool| {
            (1..part.len())
                .fold(0, |best, index| if better(part[index].1, part[best].1) { index } else { best })
        };
        let mut indices = [0, extreme(|a, b| a < b), extreme(|a, b| a > b), part.len() - 1];
        indices.sort_unstable();
        for (place, &index) in indices.iter().enumerate() {
            if place == 0 || indices[place - 1] != index {
                kept.push(part[index]);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_names_everything_and_keeps_its_spikes() {
        let wave: Vec<_> = (0..50_000)
            .map(|i| (f64::from(i) * 1e-3, if i == 31_415 { 9.0 } else { (f64::from(i) * 1e-3).sin() }))
            .collect();
        assert!(thinned(&wave).len() <= MAX_POINTS + 4);
        assert!(thinned(&wave).iter().any(|point| point.1 == 9.0));
        let panel = |equal_scales| Panel {
            title: "a panel".into(),
            x_label: "time, s".into(),
            y_label: "force, N".into(),
            series: vec![
                Series::solid("distributed", 0, wave.clone()),
                Series::dashed("centralized", 1, vec![(0.0, 0.0), (f64::NAN, 1.0), (50.0, 1.0)]),
            ],
            equal_scales,
            ..Panel::default()
        };
        let svg = chart("the headline", &[panel(false), panel(true)]).unwrap();
        for words in ["the headline", "a panel", "time, s", "force, N", "distributed", "centralized"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(svg.len() < 300_000, "{}", svg.len());
    }

    #[test]
    fn nothing_to_draw_is_drawn() {
        let panel = Panel { equal_scales: true, ..Panel::default() };
        assert!(chart("", &[panel]).unwrap().ends_with("</svg>\n"));
    }

    #[test]
    fn logarithmic_axes_show_decades_and_regions_their_names() {
        let panel = Panel {
            x_label: "frequency, rad/s".into(),
            regions: vec![Region {
                label: "stable".into(),
                colour: 2,
                polygons: vec![vec![(0.1, 1.0), (100.0, 1.0), (100.0, 1e3)]],
            }],
            series: vec![Series::solid("line", 0, vec![(0.1, 1.0), (0.0, 5.0), (1000.0, 1e4)])],
            x_scale: Scale::Logarithmic,
            y_scale: Scale::Logarithmic,
            ..Panel::default()
        };
        let svg = chart("log", &[panel]).unwrap();
        for words in ["stable", "line", ">\n100\n<", ">\n0.1\n<", ">\n10000\n<"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(!svg.contains("NaN"));
    }
}
