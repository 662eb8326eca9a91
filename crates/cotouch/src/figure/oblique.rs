//! Slices of a volume, one above the other, in an oblique projection.

use plotters::prelude::*;

use super::canvas::{Area, GRID, INK, QUIET, colour, text, undrawable};

const PANEL_WIDTH: u32 = 560;
const PANEL_HEIGHT: u32 = 460;
const HEADLINE: u32 = 40;
const OPACITY: f64 = 0.25;
/// The origin, and where the ends of the three axes lie from there, pixels to the right and down.
const ORIGIN: (f64, f64) = (70.0, 400.0);
const AXES: [(f64, f64); 3] = [(250.0, 0.0), (190.0, -110.0), (0.0, -235.0)];

/// A volume of which some slices are drawn.
pub(crate) struct Volume {
    /// What it is.
    pub(crate) title: String,
    /// Which of the colours.
    pub(crate) colour: usize,
    /// Height and corners of each, from the bottom; corners of the same number belong to the same edge of the volume.
    pub(crate) slices: Vec<(f64, Vec<[f64; 2]>)>,
}

/// The volumes in a row below a headline, as SVG, all to the same scale. `labels` name the axes to the right, into the
/// page and up.
pub(crate) fn volumes(headline: &str, labels: [&str; 3], volumes: &[Volume]) -> anyhow::Result<String> {
    let mut svg = String::new();
    {
        let width = PANEL_WIDTH * volumes.len().max(1) as u32;
        let root = SVGBackend::with_string(&mut svg, (width, HEADLINE + PANEL_HEIGHT)).into_drawing_area();
        root.fill(&WHITE).map_err(undrawable)?;
        root.draw_text(headline, &text(15, INK), (16, 12)).map_err(undrawable)?;
        let (_, body) = root.split_vertically(HEADLINE);
        let view = View::of(volumes);
        for (area, volume) in body.split_evenly((1, volumes.len().max(1))).iter().zip(volumes) {
            draw(area, &view, labels, volume)?;
        }
        root.present().map_err(undrawable)?;
    }
    Ok(svg)
}

/// How places become pixels: each axis is as long as its largest value.
struct View {
    most: [f64; 3],
}

impl View {
    fn of(volumes: &[Volume]) -> Self {
        let slices = || volumes.iter().flat_map(|volume| &volume.slices);
        let most = |axis: usize| {
            let of_slice = slices().flat_map(|(_, corners)| corners.iter().map(move |corner| corner[axis]));
            of_slice.fold(1e-9, f64::max)
        };
        Self { most: [most(0), most(1), slices().map(|slice| slice.0).fold(1e-9, f64::max)] }
    }

    fn place(&self, values: [f64; 3]) -> (i32, i32) {
        let (mut right, mut down) = ORIGIN;
        for ((value, most), axis) in values.into_iter().zip(self.most).zip(AXES) {
            right += value / most * axis.0;
            down += value / most * axis.1;
        }
        (right.round() as i32, down.round() as i32)
    }
}

fn draw(area: &Area<'_>, view: &View, labels: [&str; 3], volume: &Volume) -> anyhow::Result<()> {
    area.draw_text(&volume.title, &text(13, INK), (60, 4)).map_err(undrawable)?;
    for (axis, label) in labels.into_iter().enumerate() {
        draw_axis(area, view, axis, label)?;
    }
    let base = colour(volume.colour);
    let line = |points: Vec<(i32, i32)>, style: ShapeStyle| {
        area.draw(&PathElement::new(points, style)).map_err(undrawable)
    };
    // The lowest first, so that higher ones lie on it.
    for (height, corners) in &volume.slices {
        let mut outline: Vec<_> = corners.iter().map(|&[x, y]| view.place([x, y, *height])).collect();
        area.draw(&Polygon::new(outline.clone(), base.mix(OPACITY).filled())).map_err(undrawable)?;
        outline.extend(outline.first().copied());
        line(outline, base.stroke_width(2))?;
    }
    for (low, high) in volume.slices.iter().zip(volume.slices.iter().skip(1)) {
        for (one, other) in low.1.iter().zip(&high.1).filter(|_| low.1.len() == high.1.len()) {
            let edge = [view.place([one[0], one[1], low.0]), view.place([other[0], other[1], high.0])];
            line(edge.to_vec(), base.mix(0.6).stroke_width(1))?;
        }
    }
    Ok(())
}

fn draw_axis(area: &Area<'_>, view: &View, axis: usize, label: &str) -> anyhow::Result<()> {
    let at = |value: f64| {
        let mut place = [0.0; 3];
        place[axis] = value;
        view.place(place)
    };
    let end = at(1.08 * view.most[axis]);
    area.draw(&PathElement::new([at(0.0), end], QUIET.stroke_width(1))).map_err(undrawable)?;
    let step = tick_step(view.most[axis]);
    let (x, y) = [(-6, 6), (6, 2), (-32, -6)][axis];
    for tick in 1..=(view.most[axis] / step + 1e-9) as u32 {
        let value = f64::from(tick) * step;
        let place = at(value);
        area.draw(&Circle::new(place, 2, GRID.filled())).map_err(undrawable)?;
        area.draw(&Circle::new(place, 2, QUIET.stroke_width(1))).map_err(undrawable)?;
        let digits = if step < 0.1 { 2 } else { usize::from(step < 1.0) };
        let number = format!("{value:.digits$}");
        area.draw_text(&number, &text(12, INK), (place.0 + x, place.1 + y)).map_err(undrawable)?;
    }
    let (x, y) = [(-14, 10), (8, -12), (-14, -22)][axis];
    area.draw_text(label, &text(13, INK), (end.0 + x, end.1 + y)).map_err(undrawable)
}

/// 1, 2 or 5 times a power of ten: some four ticks.
fn tick_step(most: f64) -> f64 {
    let rough = (most / 4.0).max(1e-9);
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|&step| step >= rough)
        .unwrap_or(rough)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_name_their_axes_and_nothing_is_drawn_too() {
        let slice = |depth: f64| (depth, vec![[0.0, 0.0], [depth, 0.0], [0.0, 2.0 * depth]]);
        let volume = Volume { title: "a cone".into(), colour: 0, slices: vec![slice(0.5), slice(1.0)] };
        let svg = volumes("headline", ["to the right", "into", "up"], &[volume]).unwrap();
        for words in ["headline", "a cone", "to the right", "up", "into"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(volumes("", ["", "", ""], &[]).unwrap().ends_with("</svg>\n"));
        assert_eq!(
            [tick_step(1.0), tick_step(4.0), tick_step(0.9)].map(|step| (step * 100.0).round()),
            [50.0, 100.0, 50.0]
        );
    }
}
