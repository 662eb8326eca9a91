//! The picture of a run: forces over time, and paths or positions.

use std::ops::Range;

use cotouch_scene::scene::{Scene, Space};
use plotters::prelude::*;

use super::canvas::{Area, GRID, INK, QUIET, WIDTH, colour, text, undrawable};
use super::paths;
use crate::trace::{self, Envelope, HostTrace, Trace};

const HEADER: u32 = 64;
const PANEL: u32 = 270;

/// Forces on the fingers, and where fingers and bodies were, over a run: on a line as curves over time, else as paths
/// seen from above (or from the side, where there is gravity).
pub(crate) fn session_picture(scene: &Scene, trace: &Trace, headline: &str) -> anyhow::Result<String> {
    let mut svg = String::new();
    let on_a_line = scene.space == Space::Line;
    let lower = if on_a_line { PANEL } else { paths::HEIGHT };
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, HEADER + PANEL + lower)).into_drawing_area();
        root.fill(&WHITE).map_err(undrawable)?;
        let (header, panels) = root.split_vertically(HEADER);
        let styles = if on_a_line { "solid: hand, dashed: object" } else { "thin: fingers, thick: bodies" };
        draw_header(&header, trace, headline, styles)?;
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

fn draw_header(area: &Area<'_>, trace: &Trace, headline: &str, styles: &str) -> anyhow::Result<()> {
    area.draw_text(headline, &text(15, INK), (16, 12)).map_err(undrawable)?;
    let mut x = 16;
    for (index, host) in trace.hosts.iter().enumerate() {
        let key = PathElement::new([(x, 46), (x + 22, 46)], colour(index).stroke_width(3));
        area.draw(&key).map_err(undrawable)?;
        area.draw_text(&host.user, &text(13, INK), (x + 28, 39)).map_err(undrawable)?;
        x += 28 + 8 * host.user.chars().count() as i32 + 24;
    }
    area.draw_text(styles, &text(13, QUIET), (WIDTH as i32 - 200, 39)).map_err(undrawable)
}

fn draw_forces(area: &Area<'_>, trace: &Trace, on_a_line: bool) -> anyhow::Result<()> {
    let curve =
        |finger: &trace::FingerTrace| Curve { points: finger.force_n.points().collect(), dashed: false };
    let hosts: Vec<Vec<Curve>> =
        trace.hosts.iter().map(|host| host.fingers.iter().map(curve).collect()).collect();
    let (y_label, x_label) =
        if on_a_line { ("force on the hand, N", "") } else { ("force on each finger, N", "time, s") };
    draw_panel(area, &hosts, None, y_label, x_label)
}

fn draw_positions(area: &Area<'_>, scene: &Scene, trace: &Trace) -> anyhow::Result<()> {
    let curves = |host: &HostTrace| {
        let fingers = host.fingers.iter().map(|finger| (finger.x_m.clone(), false));
        fingers.chain(host.bodies.iter().map(|body| (body.x_m.clone(), true))).collect::<Vec<_>>()
    };
    let hosts: Vec<Vec<(Envelope, bool)>> = trace.hosts.iter().map(curves).collect();
    let largest = hosts.iter().flatten().flat_map(|(curve, _)| curve.points());
    let largest = largest.map(|(_, metres)| metres.abs()).fold(0.0, f64::max);
    let (unit, label) = if largest < 0.5 { (1e3, "position, mm") } else { (1.0, "position, m") };
    let scaled = |(curve, dashed): &(Envelope, bool)| Curve {
        points: curve.points().map(|(time_s, metres)| (time_s, unit * metres)).collect(),
        dashed: *dashed,
    };
    let hosts: Vec<Vec<Curve>> = hosts.iter().map(|curves| curves.iter().map(scaled).collect()).collect();
    let wall = scene.wall.exists().then_some(unit * scene.wall.position_m);
    draw_panel(area, &hosts, wall, label, "time, s")
}

/// One line of a panel.
struct Curve {
    points: Vec<(f64, f64)>,
    dashed: bool,
}

/// The curves of every host in its colour, and the wall where there is one.
fn draw_panel(
    area: &Area<'_>,
    hosts: &[Vec<Curve>],
    wall: Option<f64>,
    y_label: &str,
    x_label: &str,
) -> anyhow::Result<()> {
    let points = || hosts.iter().flatten().flat_map(|curve| curve.points.iter().copied());
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
    for (index, curves) in hosts.iter().enumerate() {
        for curve in curves {
            let style = colour(index).stroke_width(if curve.dashed { 2 } else { 1 });
            let points = curve.points.iter().copied();
            if curve.dashed {
                chart.draw_series(DashedLineSeries::new(points, 6, 4, style)).map_err(undrawable)?;
            } else {
                chart.draw_series(LineSeries::new(points, style)).map_err(undrawable)?;
            }
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
