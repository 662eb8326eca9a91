//! Stability maps as pictures.

use cotouch_analysis::{StabilityMap, Sweep};

use super::chart::{Panel, Region, Scale, Series, chart};

/// What is stable.
const STABLE: usize = 2;
/// The boundary.
const BOUNDARY: usize = 0;
/// The frame of what was looked at.
const FRAME: usize = 7;
/// A radius beyond this is drawn as this.
const LARGEST_RADIUS: f64 = 2.0;

/// A map with a headline, as SVG: the stable region with its boundary, or the radius over the only key.
pub(crate) fn map_picture(headline: &str, map: &StabilityMap) -> anyhow::Result<String> {
    let panel = match &map.y {
        Some(y) => plane(map, y),
        None => line(map),
    };
    chart(headline, &[panel])
}

fn plane(map: &StabilityMap, y: &Sweep) -> Panel {
    let is_empty = map.empty.is_some();
    let label = if is_empty { "nothing is stable" } else { "stable" };
    let mut series: Vec<Series> = boundary(map, "boundary", BOUNDARY);
    series.push(frame(&map.x, y));
    Panel {
        title: String::new(),
        x_label: axis_label(&map.x.key),
        y_label: axis_label(&y.key),
        regions: vec![region(map, label, STABLE)],
        series,
        x_scale: scale(&map.x),
        y_scale: scale(y),
        equal_scales: false,
    }
}

fn line(map: &StabilityMap) -> Panel {
    let xs = map.x.values.values();
    let radii = map.spectral_radius.as_ref().map_or(&[][..], |rows| &rows[0][..]);
    let points = xs.iter().zip(radii).map(|(&x, &radius)| (x, radius.min(LARGEST_RADIUS))).collect();
    let ends = [xs[0], xs[xs.len() - 1]].map(|x| (x, 1.0)).to_vec();
    Panel {
        x_label: axis_label(&map.x.key),
        y_label: format!("spectral radius (drawn up to {LARGEST_RADIUS})"),
        series: vec![
            Series::solid("spectral radius", BOUNDARY, points),
            Series::dashed("limit of stability", 1, ends),
        ],
        x_scale: scale(&map.x),
        ..Panel::default()
    }
}

/// The stable region as one polygon.
pub(crate) fn region(map: &StabilityMap, label: &str, colour: usize) -> Region {
    let polygon = joined(&map.outlines);
    let polygons = if polygon.is_empty() { Vec::new() } else { vec![polygon] };
    Region { label: label.to_owned(), colour, polygons }
}

/// The boundary's curves; only the first is named.
pub(crate) fn boundary(map: &StabilityMap, label: &str, colour: usize) -> Vec<Series> {
    let curves = map.boundary.iter().enumerate();
    let named = |(index, curve): (usize, &Vec<[f64; 2]>)| {
        let points = curve.iter().map(|&[x, y]| (x, y)).collect();
        Series::solid(if index == 0 { label } else { "" }, colour, points)
    };
    curves.map(named).collect()
}

/// The edge of what was looked at.
pub(crate) fn frame(x: &Sweep, y: &Sweep) -> Series {
    let ends = |sweep: &Sweep| {
        let values = sweep.values.values();
        (values[0], values[values.len() - 1])
    };
    let ((left, right), (low, high)) = (ends(x), ends(y));
    let corners = vec![(left, low), (right, low), (right, high), (left, high), (left, low)];
    Series::dashed("edge of the sweep", FRAME, corners)
}

/// Closed curves as one that goes from each to the next and back again: filled by its winding number, as SVG does, holes
/// stay open and what runs both ways does not show.
fn joined(outlines: &[Vec<[f64; 2]>]) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = outlines.iter().flatten().map(|&[x, y]| (x, y)).collect();
    let starts = outlines.iter().filter_map(|outline| outline.first());
    points.extend(starts.rev().map(|&[x, y]| (x, y)));
    points
}

/// How a sweep's values are spread.
pub(crate) fn scale(sweep: &Sweep) -> Scale {
    if sweep.values.is_logarithmic() { Scale::Logarithmic } else { Scale::Linear }
}

/// A key and its unit, which its name ends with.
fn axis_label(key: &str) -> String {
    const UNITS: [(&str, &str); 10] = [
        ("stiffness_n_per_m", "N/m"),
        ("damping_n_s_per_m", "N·s/m"),
        ("stiffness_n_m_per_rad", "N·m/rad"),
        ("damping_n_m_s_per_rad", "N·m·s/rad"),
        ("_kg", "kg"),
        ("_hz", "Hz"),
        ("_s", "s"),
        ("_m", "m"),
        ("delay_periods", "network periods"),
        ("_rad", "rad"),
    ];
    let unit = UNITS.iter().find(|(ending, _)| key.ends_with(ending));
    unit.map_or_else(|| key.to_owned(), |(_, unit)| format!("{key}, {unit}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often a polygon winds around a point.
    fn winding(polygon: &[(f64, f64)], (x, y): (f64, f64)) -> i32 {
        let mut count = 0;
        for (index, &(x0, y0)) in polygon.iter().enumerate() {
            let (x1, y1) = polygon[(index + 1) % polygon.len()];
            let is_left = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0) > 0.0;
            if y0 <= y && y1 > y && is_left {
                count += 1;
            } else if y0 > y && y1 <= y && !is_left {
                count -= 1;
            }
        }
        count
    }

    #[test]
    fn joined_outlines_keep_their_holes() {
        let square = |x: f64, y: f64, size: f64| {
            vec![[x, y], [x + size, y], [x + size, y + size], [x, y + size], [x, y]]
        };
        let mut hole = square(3.0, 3.0, 2.0);
        hole.reverse();
        let polygon = joined(&[square(0.0, 0.0, 10.0), hole, square(20.0, 1.0, 3.0)]);
        for (point, inside) in [
            ((1.0, 1.5), true),
            ((4.0, 4.1), false),
            ((21.0, 2.0), true),
            ((15.0, 2.0), false),
            ((15.0, 9.0), false),
        ] {
            assert_eq!(winding(&polygon, point) != 0, inside, "{point:?}");
        }
    }

    #[test]
    fn keys_show_their_units() {
        assert_eq!(axis_label("hand.mass_kg"), "hand.mass_kg, kg");
        assert_eq!(axis_label("wall.damping_n_s_per_m"), "wall.damping_n_s_per_m, N·s/m");
        assert_eq!(axis_label("session.users"), "session.users");
    }
}
