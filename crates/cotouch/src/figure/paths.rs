//! Where fingers and bodies went, in one plane: outlines of bodies at the start, on the way and at the end, a soft object at
//! rest and as it was pressed most, and walls.

use cotouch_scene::geometry::Pose;
use cotouch_scene::scene::{Body, Scene, Shape, ShapeKind, WallPlane};
use glam::DVec3;
use plotters::prelude::*;

use super::canvas::{Area, GRID, INK, QUIET, WIDTH, colour, finger_colour, text, undrawable};
use super::contour::contour;
use crate::trace::Trace;

/// What the picture's lines are, for its legend.
pub(super) const LEGEND: [&str; 2] = [
    "thin: path of a finger, with a ring where it ended; thick: path of a body",
    "grey: outlines of bodies on the way, darker at the end; black: walls and what is fixed",
];
/// The same of a soft object.
pub(super) const SOFT_LEGEND: [&str; 2] = [
    "thin: path of a finger, with a ring where it ended",
    "grey: the soft object at rest; dark: where it was deformed most",
];

pub(super) const HEIGHT: u32 = 520;
/// Outlines of each body that are drawn between the first and the last.
const OUTLINES: usize = 6;
const BODY: RGBColor = RGBColor(92, 92, 86);

/// The plane of the picture: two world axes, m.
#[derive(Clone, Copy)]
struct View {
    across: DVec3,
    up: (DVec3, &'static str),
}

impl View {
    /// From above; from the side where things can fall, and on a soft object.
    fn of(scene: &Scene) -> Self {
        let from_the_side = scene.gravity_m_per_s2 != DVec3::ZERO || scene.soft.exists();
        Self { across: DVec3::X, up: if from_the_side { (DVec3::Z, "z") } else { (DVec3::Y, "y") } }
    }

    fn point(self, position: DVec3) -> (f64, f64) {
        (position.dot(self.across), position.dot(self.up.0))
    }
}

pub(super) fn draw(area: &Area<'_>, scene: &Scene, trace: &Trace) -> anyhow::Result<()> {
    let view = View::of(scene);
    let bodies = scene.world_bodies();
    let soft = soft_outlines(view, scene, trace);
    let (x, y) = frame(view, &bodies, &soft, trace);
    let (unit, unit_name) = unit_of(x.1 - x.0);
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .margin_top(8)
        .margin_left(8)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(unit * x.0..unit * x.1, unit * y.0..unit * y.1)
        .map_err(undrawable)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(QUIET)
        .label_style(text(12, INK))
        .axis_desc_style(text(13, INK))
        .x_desc(format!("x, {unit_name}"))
        .y_desc(format!("{}, {unit_name}", view.up.1))
        .draw()
        .map_err(undrawable)?;
    let mut line = |points: Vec<(f64, f64)>, style: ShapeStyle| -> anyhow::Result<()> {
        let points = points.into_iter().map(|(across, up)| (unit * across, unit * up));
        chart.draw_series(LineSeries::new(points, style)).map_err(undrawable)?;
        Ok(())
    };
    for wall in scene.walls() {
        line(wall_line(view, &wall, x, y), INK.stroke_width(2))?;
    }
    for (outline, strength) in soft {
        line(outline, BODY.mix(strength).stroke_width(1))?;
    }
    for body in bodies.iter().filter(|body| body.fixed) {
        for outline in outlines(view, &body.shape, &start(body)) {
            line(outline, INK.stroke_width(2))?;
        }
    }
    for (index, host) in trace.hosts.iter().enumerate() {
        for traced in &host.bodies {
            let shape = &bodies[traced.body].shape;
            // The first host's copy stands for all; the paths of all copies are drawn.
            if index == 0 {
                for (pose, strength) in stations(&traced.path) {
                    for outline in outlines(view, shape, &pose) {
                        line(outline, BODY.mix(strength).stroke_width(1))?;
                    }
                }
            }
            line(
                traced.path.points().map(|point| view.point(point)).collect(),
                colour(index).mix(0.55).stroke_width(3),
            )?;
        }
        for (number, finger) in host.fingers.iter().enumerate() {
            let style = finger_colour(index, number);
            line(finger.path.points().map(|point| view.point(point)).collect(), style.stroke_width(1))?;
            if let Some((_, last)) = finger.path.ends() {
                line(circle(view, last.position, scene.hand.finger_radius_m), style.stroke_width(2))?;
            }
        }
    }
    Ok(())
}

/// Poses of a path whose outlines are drawn, the last the strongest.
fn stations(path: &crate::trace::Path) -> Vec<(Pose, f64)> {
    let poses: Vec<Pose> = path.poses().collect();
    let Some(&last) = poses.last() else { return Vec::new() };
    let step = (poses.len() / OUTLINES).max(1);
    poses.iter().step_by(step).map(|&pose| (pose, 0.35)).chain([(last, 1.0)]).collect()
}

fn start(body: &Body) -> Pose {
    Pose { position: body.position_m, orientation: glam::DQuat::from_scaled_axis(body.rotation_rad) }
}

/// The range of everything that moved, with the same scale both ways.
fn frame(
    view: View,
    bodies: &[Body],
    soft: &[(Vec<(f64, f64)>, f64)],
    trace: &Trace,
) -> ((f64, f64), (f64, f64)) {
    let mut points: Vec<(f64, f64)> = soft.iter().flat_map(|(outline, _)| outline.clone()).collect();
    for host in &trace.hosts {
        points.extend(
            host.fingers.iter().flat_map(|finger| finger.path.points()).map(|point| view.point(point)),
        );
        for traced in &host.bodies {
            let shape = &bodies[traced.body].shape;
            points.extend(traced.path.poses().flat_map(|pose| extremes(view, shape, &pose)));
        }
    }
    let extent = |of: fn(&(f64, f64)) -> f64| {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| points.iter().map(of).fold(start, pick);
        (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max))
    };
    let (x, y) = (extent(|point| point.0), extent(|point| point.1));
    if x.0 > x.1 {
        return ((-0.1, 0.1), (-0.06, 0.06));
    }
    let (wide, high) = (f64::from(WIDTH) - 110.0, f64::from(HEIGHT) - 60.0);
    let scale = 1.1 * ((x.1 - x.0) / wide).max((y.1 - y.0) / high).max(1e-6);
    let about = |range: (f64, f64), length: f64| {
        let middle = 0.5 * (range.0 + range.1);
        (middle - 0.5 * scale * length, middle + 0.5 * scale * length)
    };
    (about(x, wide), about(y, high))
}

/// Where a wall cuts the frame; walls that the picture's plane is parallel to are not seen.
fn wall_line(view: View, wall: &WallPlane, x: (f64, f64), y: (f64, f64)) -> Vec<(f64, f64)> {
    let (nx, ny) = (wall.normal.dot(view.across), wall.normal.dot(view.up.0));
    let length = nx.hypot(ny);
    if length < 1e-9 {
        return Vec::new();
    }
    let (px, py) = view.point(wall.point_m);
    let (along_x, along_y) = (-ny / length, nx / length);
    let reach = (x.1 - x.0) + (y.1 - y.0);
    // In small steps, so that what lies outside the frame is left out and not moved to its edge.
    let inside = |&(a, b): &(f64, f64)| a >= x.0 && a <= x.1 && b >= y.0 && b <= y.1;
    (-500..=500)
        .map(|step| f64::from(step) / 500.0 * reach)
        .map(|s| (px + s * along_x, py + s * along_y))
        .filter(inside)
        .collect()
}

fn circle(view: View, centre: DVec3, radius_m: f64) -> Vec<(f64, f64)> {
    let (x, y) = view.point(centre);
    let on = |step: i32| {
        let (sine, cosine) = (f64::from(step) / 48.0 * std::f64::consts::TAU).sin_cos();
        (x + radius_m * cosine, y + radius_m * sine)
    };
    (0..=48).map(on).collect()
}

/// The outlines of a shape as it is seen in the picture's plane, holes and folds of meshes included.
fn outlines(view: View, shape: &Shape, pose: &Pose) -> Vec<Vec<(f64, f64)>> {
    match (shape.kind, &shape.surface) {
        (ShapeKind::Mesh, Some(mesh)) => {
            let corners: Vec<(f64, f64)> =
                mesh.vertices.iter().map(|&corner| view.point(pose.to_world(corner))).collect();
            contour(&corners, &mesh.triangles)
        }
        _ => vec![extremes(view, shape, pose)],
    }
}

/// The hull of a shape as it is seen: the outline of a convex one.
fn extremes(view: View, shape: &Shape, pose: &Pose) -> Vec<(f64, f64)> {
    let corners: Vec<DVec3> = match shape.kind {
        ShapeKind::Point => Vec::new(),
        ShapeKind::Ball => return circle(view, pose.position, shape.radius_m),
        ShapeKind::Box => {
            let half = 0.5 * shape.size_m;
            (0..8)
                .map(|corner| {
                    let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
                    half * DVec3::new(sign(0), sign(1), sign(2))
                })
                .collect()
        }
        ShapeKind::Capsule => {
            let end = |side: f64| view.point(pose.to_world(DVec3::Y * (0.5 * side * shape.length_m)));
            let around = |(x, y): (f64, f64)| {
                circle(view, DVec3::ZERO, shape.radius_m).into_iter().map(move |(dx, dy)| (x + dx, y + dy))
            };
            return hull(around(end(-1.0)).chain(around(end(1.0))).collect());
        }
        ShapeKind::Hull | ShapeKind::Mesh => {
            shape.surface.as_ref().map(|mesh| mesh.vertices.clone()).unwrap_or_default()
        }
    };
    hull(corners.into_iter().map(|corner| view.point(pose.to_world(corner))).collect())
}

/// The outlines of a soft object at rest and as it was deformed most, each with how strongly it is drawn; or nothing.
fn soft_outlines(view: View, scene: &Scene, trace: &Trace) -> Vec<(Vec<(f64, f64)>, f64)> {
    let Some(mesh) = &scene.soft.nodes else { return Vec::new() };
    let seen = |nodes: &[DVec3], strength: f64| {
        let corners: Vec<(f64, f64)> = nodes.iter().map(|&node| view.point(node)).collect();
        contour(&corners, &mesh.triangles).into_iter().map(move |line| (line, strength))
    };
    let deformed = trace.soft.most_deformed().filter(|nodes| nodes.len() == mesh.nodes_m.len());
    let at_rest = seen(&mesh.nodes_m, if deformed.is_some() { 0.45 } else { 1.0 });
    at_rest.chain(deformed.into_iter().flat_map(|nodes| seen(nodes, 1.0))).collect()
}

/// What a metre is multiplied by, and the name of the unit, for a picture of this width, m.
pub(super) fn unit_of(width_m: f64) -> (f64, &'static str) {
    if width_m < 1.0 { (1e3, "mm") } else { (1.0, "m") }
}

/// The closed convex hull of points (Andrew's monotone chain).
fn hull(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let turn =
        |a: (f64, f64), b: (f64, f64), c: (f64, f64)| (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
    let half = |points: &mut dyn Iterator<Item = (f64, f64)>| {
        let mut chain: Vec<(f64, f64)> = Vec::new();
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        chain
    };
    if points.is_empty() {
        return points;
    }
    let mut outline = half(&mut points.iter().copied());
    outline.pop();
    outline.extend(half(&mut points.iter().rev().copied()));
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_is_its_rim() {
        let points = vec![(0.0, 0.0), (1.0, 1.0), (0.5, 0.5), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0)];
        let rim = hull(points);
        assert_eq!(rim, [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]);
    }
}
