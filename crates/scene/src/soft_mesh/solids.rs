//! Solids that are filled: a ball, an organ, and what is inside a closed surface.

use glam::DVec3;
use parry3d_f64::query::PointQuery as _;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use super::body::SoftMesh;
use super::error::{MAX_ELEMENTS, SoftMeshError};
use super::fill::{Solid, fill};
use crate::mesh::{TriangleMesh, Triangles};

/// How much of a surface's volume its filling must have.
const LEAST_FILLED: f64 = 0.8;

/// A ball of tetrahedra with edges of about `edge_m`.
///
/// # Errors
/// When there are more than [`MAX_ELEMENTS`].
pub fn ball(radius_m: f64, edge_m: f64, centre_m: DVec3) -> Result<SoftMesh, SoftMeshError> {
    let depth = |point: DVec3| radius_m - point.distance(centre_m);
    let half = DVec3::splat(radius_m);
    fill(&Solid { depth, low: centre_m - half, high: centre_m + half }, edge_m)
}

/// A bean-shaped blob of tetrahedra, like a kidney that is thicker at one end: with half axes a, b, c and the world's
/// x/a, y/b, z/c from `centre_m` called u, v, w, the points of
///
/// ```text
/// u² + ((v − 0.09 + 0.7·u²) / s)² + (w / (1.15·s))² ≤ 1,   s = 0.85·(1 + 0.18·u)
/// ```
///
/// which fill −1 to 1 along u, −0.94 to 0.94 along v and −1 to 1 along w, but for a hundredth. Edges are about `edge_m` long.
///
/// # Errors
/// When there are more than [`MAX_ELEMENTS`], or a half axis is hardly longer than an edge.
pub fn organ(half_axes_m: DVec3, edge_m: f64, centre_m: DVec3) -> Result<SoftMesh, SoftMeshError> {
    let depth = |point: DVec3| {
        let DVec3 { x: u, y: v, z: w } = (point - centre_m) / half_axes_m;
        // Beyond the ends it stays as bent and as thick as there.
        let end = u.clamp(-1.0, 1.0);
        let thickness = 0.85 * (1.0 + 0.18 * end);
        let bent = v - 0.09 + 0.7 * end * end;
        let from_middle = DVec3::new(u, bent / thickness, w / (1.15 * thickness));
        (1.0 - from_middle.length()) * half_axes_m.min_element()
    };
    fill(&Solid { depth, low: centre_m - half_axes_m, high: centre_m + half_axes_m }, edge_m)
}

/// What is inside closed `triangles`.
///
/// # Errors
/// When they are not closed, as [`TriangleMesh::closed`]; when there are more than [`MAX_ELEMENTS`]; when parts of it are
/// thinner than an edge.
pub fn filled(triangles: &Triangles, edge_m: f64) -> Result<SoftMesh, SoftMeshError> {
    let volume_m3 = TriangleMesh::closed(triangles)?.volume_m3;
    let found = 12.0 * volume_m3 / edge_m.powi(3);
    if found > 2.0 * MAX_ELEMENTS as f64 {
        return Err(SoftMeshError::TooLarge { found: found as usize });
    }
    let (vertices, corners) = TriangleMesh::closed_in_place(triangles)?;
    let (low, high) = crate::mesh::bounds(&vertices);
    let not_filled = |problem: String| SoftMeshError::NotFilled { edge_m, problem };
    let surface = TriMesh::with_flags(vertices, corners, TriMeshFlags::ORIENTED)
        .map_err(|error| not_filled(error.to_string()))?;
    let depth = |point: DVec3| {
        let nearest = surface.project_local_point(point, false);
        let distance = nearest.point.distance(point);
        if nearest.is_inside { distance } else { -distance }
    };
    let mesh = fill(&Solid { depth, low, high }, edge_m)?;
    let part = mesh.volume_m3() / volume_m3;
    if part < LEAST_FILLED {
        return Err(not_filled(format!("they have {:.0} % of its volume", 100.0 * part)));
    }
    Ok(mesh)
}
