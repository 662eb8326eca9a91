//! The surface of a soft object as pages draw it: what stays (triangles, where its vertices rest), and how what moves is
//! packed.

use cotouch_host::SlowFrame;
use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::Scene;
use cotouch_scene::soft_mesh::SoftMesh;
use glam::DVec3;
use serde_json::{Value, json};

/// Where a soft object is, as its surface is drawn. One entry a node of the mesh, inner ones included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deformed<'a> {
    /// Where the nodes are, m.
    pub(crate) positions_m: &'a [DVec3],
    /// Von Mises stress at the nodes, Pa; none where it is not known.
    pub(crate) stress_pa: &'a [f32],
    /// K_o of all fingers that touch, N/m.
    pub(crate) ko_n_per_m: f64,
}

impl<'a> From<&'a SlowFrame> for Deformed<'a> {
    fn from(frame: &'a SlowFrame) -> Self {
        Self { positions_m: &frame.positions_m, stress_pa: &frame.stress_pa, ko_n_per_m: frame.ko_n_per_m }
    }
}

/// The nodes that are seen, and the triangles between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Which node of the mesh each vertex is, rising.
    nodes: Vec<u32>,
    /// Where each vertex rests, m.
    rest_m: Vec<DVec3>,
    /// Three vertices each, counter-clockwise seen from outside.
    triangles: Vec<[u32; 3]>,
}

impl Skin {
    /// Of the soft object of `scene`, where it has one.
    #[must_use]
    pub fn of(scene: &Scene) -> Option<Self> {
        scene.soft.nodes.as_deref().map(Self::new)
    }

    fn new(mesh: &SoftMesh) -> Self {
        let mut nodes = mesh.triangles.concat();
        nodes.sort_unstable();
        nodes.dedup();
        // Every node of a triangle is in the list.
        let vertex = |node: &u32| nodes.partition_point(|other| other < node) as u32;
        let triangles = mesh.triangles.iter().map(|corners| corners.each_ref().map(vertex)).collect();
        let rest_m = nodes.iter().map(|node| mesh.nodes_m[*node as usize]).collect();
        Self { nodes, rest_m, triangles }
    }

    /// What a page is told once. As single precision: a display needs no more.
    pub(crate) fn facts(&self) -> Value {
        let vertices: Vec<f32> = self.rest_m.iter().flat_map(|vertex| vertex.as_vec3().to_array()).collect();
        json!({ "vertices_m": vertices, "triangles": self.triangles.concat() })
    }

    /// Writes the surface of a host after what `out` holds; nothing and `false` where it is of another mesh. See
    /// [`crate::picture`] for the layout.
    pub(crate) fn encode(&self, host: HostIndex, body: Deformed, out: &mut Vec<u8>) -> bool {
        if self.nodes.last().is_none_or(|last| body.positions_m.len() <= *last as usize) {
            return false;
        }
        let way = |index: usize| body.positions_m[self.nodes[index] as usize] - self.rest_m[index];
        let stress = |index: usize| body.stress_pa.get(self.nodes[index] as usize).copied().unwrap_or(0.0);
        let all = 0..self.nodes.len();
        let step_m = step(all.clone().map(|index| way(index).abs().max_element()), i16::MAX.into());
        let step_pa = step(all.clone().map(|index| f64::from(stress(index))), u16::MAX.into());
        out.extend(u16::from(host.0).to_le_bytes());
        out.extend(0_u16.to_le_bytes());
        out.extend((self.nodes.len() as u32).to_le_bytes());
        for number in [body.ko_n_per_m, step_m, step_pa] {
            out.extend((number as f32).to_le_bytes());
        }
        for index in all {
            for part in (way(index) / step_m).to_array() {
                out.extend((part.round() as i16).to_le_bytes());
            }
            out.extend(((f64::from(stress(index)) / step_pa).round() as u16).to_le_bytes());
        }
        true
    }
}

/// The size of a step with which the largest of `values` takes `most` of them. Never 0.
fn step(values: impl Iterator<Item = f64>, most: f64) -> f64 {
    let largest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
    // As the page will read it, so that what is packed is unpacked with the same number.
    let step = f64::from((largest / most) as f32);
    if step > 0.0 { step } else { f64::from(f32::MIN_POSITIVE) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with a node inside, and one that nothing uses first.
    fn mesh() -> SoftMesh {
        let nodes_m = vec![DVec3::ZERO, DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::splat(0.2), DVec3::Z];
        SoftMesh {
            nodes_m,
            tetrahedra: Vec::new(),
            triangles: vec![[1, 3, 2], [1, 2, 5], [1, 5, 3], [2, 3, 5]],
            tied_n_per_m: 0.0,
        }
    }

    #[test]
    fn only_what_is_seen_is_told() {
        let facts = Skin::new(&mesh()).facts();
        assert_eq!(facts["vertices_m"].as_array().unwrap().len(), 12);
        assert_eq!(facts["triangles"], json!([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]));
    }

    #[test]
    fn a_surface_is_packed_to_a_fraction_of_what_it_moves() {
        let (mesh, mut out) = (mesh(), Vec::new());
        let mut positions_m = mesh.nodes_m.clone();
        positions_m[5] += DVec3::new(0.012, -0.03, 0.001);
        let stress_pa = [0.0, 100.0, 250.0, 5000.0, 9e9, 0.0];
        let body = Deformed { positions_m: &positions_m, stress_pa: &stress_pa, ko_n_per_m: 812.5 };
        assert!(Skin::new(&mesh).encode(HostIndex(1), body, &mut out));
        assert_eq!(out.len(), 20 + 4 * 8);
        let f32_at = |at: usize| f64::from(f32::from_le_bytes(out[at..at + 4].try_into().unwrap()));
        let i16_at = |at: usize| f64::from(i16::from_le_bytes(out[at..at + 2].try_into().unwrap()));
        assert_eq!((out[0], out[4], f32_at(8)), (1, 4, 812.5));
        let (step_m, last) = (f32_at(12), 20 + 3 * 8);
        let way: Vec<f64> = (0..3).map(|axis| i16_at(last + 2 * axis) * step_m).collect();
        for (packed, meant) in way.iter().zip([0.012, -0.03, 0.001]) {
            assert!((packed - meant).abs() <= 0.5001 * 0.03 / 32767.0, "{packed} for {meant}");
        }
        let stress = f64::from(u16::from_le_bytes(out[last - 2..last].try_into().unwrap())) * f32_at(16);
        assert!((stress - 5000.0).abs() < 0.1, "the inner node's stress counts for nothing: {stress}");
    }

    #[test]
    fn a_body_at_rest_and_one_out_of_all_bounds_are_packed_too() {
        let (mesh, skin, mut out) = (mesh(), Skin::new(&mesh()), Vec::new());
        let body = Deformed { positions_m: &mesh.nodes_m, stress_pa: &[], ko_n_per_m: f64::INFINITY };
        assert!(skin.encode(HostIndex(0), body, &mut out));
        assert!(out[20..].iter().all(|byte| *byte == 0));
        let nowhere = [DVec3::NAN, DVec3::INFINITY, DVec3::X, DVec3::Y, DVec3::ZERO, DVec3::splat(1e300)];
        assert!(skin.encode(HostIndex(0), Deformed { positions_m: &nowhere, ..body }, &mut out));
    }

    #[test]
    fn a_body_of_another_mesh_is_not_shown() {
        let (mesh, mut out) = (mesh(), Vec::new());
        let body = Deformed { positions_m: &mesh.nodes_m[..5], stress_pa: &[], ko_n_per_m: 1.0 };
        assert!(!Skin::new(&mesh).encode(HostIndex(0), body, &mut out));
        assert!(out.is_empty());
    }
}
