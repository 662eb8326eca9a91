//! The picture of a run: forces over time, and paths or positions.

use std::ops::Range;

use cotouch_scene::scene::{Scene, Space};
use plotters::prelude::*;

use super::canvas::{Area, GRID, INK, QUIET, WIDTH, colour, finger_colour, text, undrawable};
use super::paths;
use crate::trace::{Envelope, Trace};

/// Height of the headline, and of every line of the legend below it.
const HEADLINE: u32 = 36;
const LINE: u32 = 20;
const PANEL: u32 = 270;

/// Forces on the fingers, and where fingers and bodies were, over a run: on a line as curves over time, else as paths
/// seen from above (or from the side, where there is gravity).
pub(crate) fn session_picture(scene: &Scene, trace: &Trace, headline: &str) -> anyhow::Result<String> {
    let mut svg = String::new();
    let on_a_line = scene.space == Space::Line;
    let lower = if on_a_line { PANEL } else { paths::HEIGHT };
    let legend = Legend::of(scene, trace);
    let header_height = HEADLINE + LINE * legend.lines() + 8;
    {
        let root =
            SVGBackend::with_string(&mut svg, (WIDTH, header_height + PANEL + lower)).into_drawing_area();
        root.fill(&WHITE).map_err(undrawable)?;
        let (header, panels) = root.split_vertically(header_height);
        header.draw_text(headline, &text(15, INK), (16, 12)).map_err(undrawable)?;
        legend.draw(&header)?;
        let (forces, places) = panels.split_vertically(PANEL);
        draw_forces(&forces, trace, on_a_line)?;
        if on_a_line {
            draw_positions(&places, scene, trace)?;
        } else {
            paths::draw(&places, scene, trace)?;
        }
        root.present().map_err(undrawable)?;
    }
    Ok(svg)
}

/// Which colour is whose, and what lines of which kind are.
struct Legend {
    /// Rows of colours with their names, and where each begins, pixels.
    keys: Vec<Vec<(i32, RGBColor, String)>>,
    styles: &'static [&'static str],
}

impl Legend {
    fn of(scene: &Scene, trace: &Trace) -> Self {
        let mut keys: Vec<Vec<(i32, RGBColor, String)>> = Vec::new();
        let mut x = WIDTH as i32;
        for (index, host) in trace.hosts.iter().enumerate() {
            for finger in 0..host.fingers.len() {
                let name = match host.fingers.len() {
                    1 => host.user.clone(),
                    _ => format!("{}, finger {}", host.user, finger + 1),
                };
                let width = 28 + 8 * name.chars().count() as i32 + 24;
                if x + width > WIDTH as i32 {
                    keys.push(Vec::new());
                    x = 16;
                }
                keys.last_mut().expect("a row was begun").push((x, finger_colour(index, finger), name));
                x += width;
            }
        }
        let styles: &[&str] = match scene.space {
            Space::Line => &["solid: hand; dashed: object; black: wall"],
            _ if scene.soft.exists() => &paths::SOFT_LEGEND,
            _ => &paths::LEGEND,
        };
        Self { keys, styles }
    }

    fn lines(&self) -> u32 {
        (self.keys.len() + self.styles.len()) as u32
    }

    fn draw(&self, area: &Area<'_>) -> anyhow::Result<()> {
        let mut y = HEADLINE as i32;
        for row in &self.keys {
            for (x, colour, name) in row {
                let key = PathElement::new([(*x, y + 7), (x + 22, y + 7)], colour.stroke_width(3));
                area.draw(&key).map_err(undrawable)?;
                area.draw_text(name, &text(13, INK), (x + 28, y)).map_err(undrawable)?;
            }
            y += LINE as i32;
        }
        for style in self.styles {
            area.draw_text(style, &text(13, QUIET), (16, y)).map_err(undrawable)?;
            y += LINE as i32;
        }
        Ok(())
    }
}

fn draw_forces(area: &Area<'_>, trace: &Trace, on_a_line: bool) -> anyhow::Result<()> {
    let curves = trace.hosts.iter().enumerate().flat_map(|(index, host)| {
        host.fingers.iter().enumerate().map(move |(number, finger)| Curve {
            points: finger.force_n.points().collect(),
            colour: finger_colour(index, number),
            dashed: false,
        })
    });
    let curves: Vec<Curve> = curves.collect();
    let (y_label, x_label) =
        if on_a_line { ("force on the hand, N", "") } else { ("force on each finger, N", "time, s") };
    draw_panel(area, &curves, None, y_label, x_label)
}

fn draw_positions(area: &Area<'_>, scene: &Scene, trace: &Trace) -> anyhow::Result<()> {
    let curves = trace.hosts.iter().enumerate().flat_map(|(index, host)| {
        let fingers = host.fingers.iter().enumerate();
        let fingers = fingers.map(move |(number, finger)| (&finger.x_m, finger_colour(index, number), false));
        fingers.chain(host.bodies.iter().map(move |body| (&body.x_m, colour(index), true)))
    });
    let curves: Vec<(&Envelope, RGBColor, bool)> = curves.collect();
    let largest = curves.iter().flat_map(|(curve, ..)| curve.points());
    let largest = largest.map(|(_, metres)| metres.abs()).fold(0.0, f64::max);
    let (unit, unit_name) = paths::unit_of(2.0 * largest);
    let scaled = |&(curve, colour, dashed): &(&Envelope, RGBColor, bool)| Curve {
        points: curve.points().map(|(time_s, metres)| (time_s, unit * metres)).collect(),
        colour,
        dashed,
    };
    let curves: Vec<Curve> = curves.iter().map(scaled).collect();
    let wall = scene.wall.exists().then_some(unit * scene.wall.position_m);
    draw_panel(area, &curves, wall, &format!("position, {unit_name}"), "time, s")
}

/// One line of a panel.
struct Curve {
    points: Vec<(f64, f64)>,
    colour: RGBColor,
    dashed: bool,
}

/// The curves, and the wall where there is one.
fn draw_panel(
    area: &Area<'_>,
    curves: &[Curve],
    wall: Option<f64>,
    y_label: &str,
    x_label: &str,
) -> anyhow::Result<()> {
    let points = || curves.iter().flat_map(|curve| curve.points.iter().copied());
    let end_s = points().map(|point| point.0).fold(1e-3, f64::max);
    let values = range(points().map(|point| point.1).chain(wall));
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .margin_top(8)
        .margin_left(8)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..end_s, values)
        .map_err(undrawable)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(QUIET)
        .label_style(text(12, INK))
        .axis_desc_style(text(13, INK))
        .x_desc(x_label)
        .y_desc(y_label)
        .x_labels(11)
        .y_labels(7)
        .draw()
        .map_err(undrawable)?;
    if let Some(wall) = wall {
        let line = LineSeries::new([(0.0, wall), (end_s, wall)], INK.stroke_width(2));
        chart.draw_series(line).map_err(undrawable)?;
    }
    for curve in curves {
        let style = curve.colour.stroke_width(if curve.dashed { 2 } else { 1 });
        let points = curve.points.iter().copied();
        if curve.dashed {
            chart.draw_series(DashedLineSeries::new(points, 6, 4, style)).map_err(undrawable)?;
        } else {
            chart.draw_series(LineSeries::new(points, style)).map_err(undrawable)?;
        }
    }
    Ok(())
}

/// A range that holds every value with some air, and is never empty.
fn range(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (least, largest) = values
        .filter(|value| value.is_finite())
        .fold((0.0_f64, 0.0_f64), |(least, largest), value| (least.min(value), largest.max(value)));
    let air = (0.06 * (largest - least)).max(1e-6);
    least - air..largest + air
}

#[cfg(test)]
mod tests {
    use super::*;

    fn synthetic() -> (Scene, Trace) {
        let set = |text: &str| text.parse().expect("an override");
        let overrides = [set("wall.stiffness_n_per_m=3000"), set("wall.position_m=0.06")];
        let scene = cotouch_scene::load("single-axis", &overrides).expect("a built-in scene");
        let mut trace = Trace::new(&scene);
        for (index, host) in trace.hosts.iter_mut().enumerate() {
            for tick in 0..10_240_u32 {
                let t = f64::from(tick) / 1024.0;
                let swing = (3.1 * t + index as f64).sin();
                let buzz = if t > 6.0 { 0.4 * (200.0 * t).sin() } else { 0.0 };
                host.fingers[0].force_n.push(t, 2.0 * swing + buzz);
                host.fingers[0].x_m.push(t, 0.05 * swing);
                host.bodies[0].x_m.push(t, 0.047 * (3.1 * t + index as f64 - 0.1).sin());
            }
        }
        (scene, trace)
    }

    #[test]
    fn a_picture_names_its_users_axes_and_units_and_stays_small() {
        let (scene, trace) = synthetic();
        let svg = session_picture(&scene, &trace, "single-axis: stable, as predicted").unwrap();
        for words in
            ["force on the hand, N", "position, mm", "time, s", "anna", "ben", "stable, as predicted"]
        {
            assert!(svg.contains(words), "{words}");
        }
        assert!(svg.len() < 400_000, "{} bytes", svg.len());
        if let Ok(path) = std::env::var("COTOUCH_TEST_PICTURE") {
            std::fs::write(path, svg).unwrap();
        }
    }

    #[test]
    fn a_picture_of_a_plane_shows_paths_and_outlines() {
        let scene = cotouch_scene::load("grasp", &[]).expect("a built-in scene");
        let mut trace = Trace::new(&scene);
        for (index, host) in trace.hosts.iter_mut().enumerate() {
            for tick in 0..4096_u32 {
                let t = f64::from(tick) / 1024.0;
                let centre = glam::DVec3::new(0.05 * t.sin(), 0.03 * (2.0 * t).sin(), 0.0);
                let turn = glam::DQuat::from_rotation_z(0.3 * t.sin());
                for (number, finger) in host.fingers.iter_mut().enumerate() {
                    finger.force_n.push(t, 2.0 + t.sin() + index as f64);
                    let side = glam::DVec3::Y * if number == 0 { 0.05 } else { -0.05 };
                    finger.path.push(cotouch_scene::geometry::Pose::at(centre + turn * side));
                }
                for body in &mut host.bodies {
                    body.path.push(cotouch_scene::geometry::Pose { position: centre, orientation: turn });
                }
            }
        }
        let svg = session_picture(&scene, &trace, "grasp: stable, as predicted").unwrap();
        for words in ["force on each finger, N", "x, mm", "y, mm", "anna"] {
            assert!(svg.contains(words), "{words}");
        }
        assert!(svg.len() < 500_000, "{} bytes", svg.len());
        if let Ok(path) = std::env::var("COTOUCH_TEST_PICTURE") {
            std::fs::write(path, svg).unwrap();
        }
    }

    #[test]
    fn a_run_that_never_began_has_a_picture_too() {
        let (scene, _) = synthetic();
        assert!(session_picture(&scene, &Trace::new(&scene), "nothing").unwrap().ends_with("</svg>\n"));
    }
}
