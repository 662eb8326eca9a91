//! `cotouch soft compliance` and `deflect`.

use std::fmt::Write as _;

use cotouch_scene::{Override, Scene};
use cotouch_soft::{MaterialPoint, SoftBody, SoftError, material_point_at, soft_body};
use glam::DVec3;
use serde::Serialize;

use crate::arguments::Soft;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

/// Does what was asked for with a soft object.
pub(super) fn soft(what: &Soft, overrides: &[Override], output: &Output) -> Result<Verdict, Failure> {
    match what {
        Soft::Compliance { scene, at } => compliance(scene, overrides, at, output),
        Soft::Deflect { scene, at } => deflect(scene, overrides, at, output),
    }
}

impl From<SoftError> for Failure {
    fn from(error: SoftError) -> Self {
        match error {
            SoftError::NoEquilibrium(_) => Self::Running(error.into()),
            SoftError::Outside { .. } | SoftError::Unsuitable(_) => Self::usage(error),
        }
    }
}

/// The soft object of a scene.
struct Body {
    scene: Scene,
    body: Box<dyn SoftBody>,
}

impl Body {
    fn load(name: &str, overrides: &[Override]) -> Result<Self, Failure> {
        let scene = cotouch_scene::load(name, overrides)?;
        let body = soft_body(&scene)?;
        Ok(Self { scene, body })
    }

    fn points(&self, at: &[DVec3]) -> Result<Vec<MaterialPoint>, SoftError> {
        let mesh = self.scene.soft.mesh();
        let point = |&at| material_point_at(&mesh.nodes_m, &mesh.tetrahedra, &mesh.triangles, at);
        at.iter().map(point).collect()
    }
}

#[derive(Serialize)]
struct Compliance {
    /// m, as they were asked for.
    points: Vec<[f64; 3]>,
    /// 3m × 3m, by rows.
    compliance_m_per_n: Vec<Vec<f64>>,
}

fn compliance(name: &str, overrides: &[Override], at: &[DVec3], output: &Output) -> Result<Verdict, Failure> {
    let progress = output.progress("computing the compliance");
    let body = Body::load(name, overrides)?;
    let compliance = body.body.compliance(&body.points(at)?).ok_or_else(|| {
        Failure::usage("this simulation cannot tell its compliance; soft.model must be another one")
    })?;
    drop(progress);
    let rows = compliance.row_iter().map(|row| row.iter().copied().collect()).collect();
    let answer = Compliance { points: at.iter().map(DVec3::to_array).collect(), compliance_m_per_n: rows };
    output.answer_as(&answer, &compliance_text(&answer))?;
    Ok(Verdict::Good)
}

fn compliance_text(answer: &Compliance) -> String {
    let mut text = String::from("displacement (row) for a force (column), mm/N\n\n        ");
    let names: Vec<String> = (1..=answer.points.len())
        .flat_map(|point| ["x", "y", "z"].map(|axis| format!("{axis}{point}")))
        .collect();
    names.iter().for_each(|name| _ = write!(text, "{name:>12}"));
    for (name, row) in names.iter().zip(&answer.compliance_m_per_n) {
        let _ = write!(text, "\n{name:>8}");
        row.iter().for_each(|value| _ = write!(text, "{:>12.5}", value * 1e3));
    }
    text.push('\n');
    for (number, [x, y, z]) in answer.points.iter().enumerate() {
        let _ = write!(text, "\npoint {} at ({x}, {y}, {z}) m", number + 1);
    }
    text
}

#[derive(Serialize)]
struct Deflection {
    /// Of all nodes.
    max_displacement_m: f64,
    points: Vec<Displacement>,
}

#[derive(Serialize)]
struct Displacement {
    /// m, as it was asked for.
    at: [f64; 3],
    displacement_m: [f64; 3],
}

fn deflect(name: &str, overrides: &[Override], at: &[DVec3], output: &Output) -> Result<Verdict, Failure> {
    let progress = output.progress("computing the equilibrium");
    let mut body = Body::load(name, overrides)?;
    let points = body.points(at)?;
    body.body.settle(&[])?;
    drop(progress);
    let (rest, settled) = (body.body.rest_m(), &body.body.state().positions_m);
    let displacement = |(&at, point): (&DVec3, &MaterialPoint)| Displacement {
        at: at.to_array(),
        displacement_m: (point.at(settled) - point.at(rest)).to_array(),
    };
    let answer = Deflection {
        max_displacement_m: rest
            .iter()
            .zip(settled)
            .map(|(rest, now)| rest.distance(*now))
            .fold(0.0, f64::max),
        points: at.iter().zip(&points).map(displacement).collect(),
    };
    output.answer_as(&answer, &deflection_text(&body.scene, &answer))?;
    Ok(Verdict::Good)
}

fn deflection_text(scene: &Scene, answer: &Deflection) -> String {
    let DVec3 { x, y, z } = scene.gravity_m_per_s2;
    let mut text = format!(
        "in equilibrium under gravity ({x}, {y}, {z}) m/s²\nlargest displacement  {:.4} mm",
        answer.max_displacement_m * 1e3
    );
    for Displacement { at: [x, y, z], displacement_m } in &answer.points {
        let [dx, dy, dz] = displacement_m.map(|metres| metres * 1e3);
        let _ = write!(text, "\nat ({x}, {y}, {z}) m     ({dx:.4}, {dy:.4}, {dz:.4}) mm");
    }
    if scene.gravity_m_per_s2 == DVec3::ZERO {
        text.push_str("\nnote: the scene has no gravity; --set gravity_m_per_s2=[0,0,-9.81] switches it on");
    }
    text
}
