//! Springs along the edges of tetrahedra, and nodes that are tied to where they rest.
//!
//! Every tetrahedron of volume `V` gives each of its six edges, of length `l`, the stiffness `k = 24/25·E·V/l²`: for regular
//! tetrahedra the `(2√2/25)·l·E` of Lloyd, Székely & Harders (2007), which comes closest to linear tetrahedra of Young's
//! modulus `E`. Springs that act along the line between two points can only stand for a material of Poisson's ratio 1/4.
//!
//! Tetrahedra that are pressed together or pushed through themselves push back (`inversion`).
//!
//! A network has the directions of its edges: cubes that are cut into six tetrahedra are
//! stiffer along the axes (a uniaxial strain ε gives a von Mises stress of 1.31·E·ε, against the material's 0.8·E·ε);
//! a bar of such cubes that is pulled along x has 0.95 of the material's Young's modulus.

use cotouch_scene::scene::Scene;
use cotouch_scene::soft_mesh::SoftMesh;
use glam::{DMat3, DVec3};

use crate::elastic::Elastic;
use crate::factor::BlockMatrix;
use crate::implicit::{ImplicitBody, Parts};
use crate::inversion::Inversion;
use crate::mesh;

/// The ratio k·l²/(E·V) of every spring.
const STIFFNESS: f64 = 24.0 / 25.0;

/// A spring between two nodes.
#[derive(Clone, Debug)]
struct Spring {
    nodes: [u32; 2],
    length_m: f64,
    stiffness_n_per_m: f64,
}

/// A network of springs.
#[derive(Clone, Debug)]
pub(crate) struct Springs {
    springs: Vec<Spring>,
    inversion: Inversion,
    /// Of every node, to where it rests, N/m.
    tie_n_per_m: f64,
    rest_m: Vec<DVec3>,
    /// The volume that counts as each node's, m³.
    volume_m3: Vec<f64>,
}

/// The body of a scene whose `soft.model` is `mass-spring`.
pub(crate) fn mass_spring(scene: &Scene) -> ImplicitBody<Springs> {
    let (soft, mesh) = (&scene.soft, scene.soft.mesh());
    let springs = Springs::new(mesh, soft.young_pa, soft.skin_thickness_m);
    let density = soft.density_kg_per_m3;
    let parts = Parts {
        enclosed: None,
        mass_kg: springs.volume_m3.iter().map(|volume| density * volume).collect(),
        pairs: springs.springs.iter().map(|spring| spring.nodes).collect(),
        rest_m: mesh.nodes_m.clone(),
        triangles: mesh.triangles.clone(),
        fixed: mesh.fixed_nodes(&soft.fixed),
        elastic: springs,
    };
    ImplicitBody::new(scene, parts)
}

impl Springs {
    /// Without tetrahedra, nodes have the mass of a plate of `thickness_m`.
    fn new(mesh: &SoftMesh, young_pa: f64, thickness_m: f64) -> Self {
        let nodes = mesh.nodes_m.len();
        let volume_m3 = if mesh.tetrahedra.is_empty() {
            mesh::node_areas(&mesh.nodes_m, &mesh.triangles).iter().map(|area| area * thickness_m).collect()
        } else {
            mesh::node_volumes(&mesh.nodes_m, &mesh.tetrahedra)
        };
        let (springs, inversion) = (springs(mesh, young_pa), Inversion::new(mesh, young_pa));
        Self {
            springs,
            inversion,
            tie_n_per_m: mesh.tied_n_per_m / nodes as f64,
            rest_m: mesh.nodes_m.clone(),
            volume_m3,
        }
    }
}

/// A spring for every edge.
fn springs(mesh: &SoftMesh, young_pa: f64) -> Vec<Spring> {
    let mut shares: Vec<([u32; 2], f64)> = Vec::with_capacity(6 * mesh.tetrahedra.len());
    for tetrahedron in &mesh.tetrahedra {
        let volume = mesh::volume(tetrahedron.map(|node| mesh.nodes_m[node as usize]));
        shares.extend(mesh::edges(tetrahedron).map(|edge| (edge, volume)));
    }
    shares.sort_unstable_by_key(|(edge, _)| *edge);
    let spring = |shares: &[([u32; 2], f64)]| {
        let nodes = shares[0].0;
        let [a, b] = nodes.map(|node| mesh.nodes_m[node as usize]);
        let volume: f64 = shares.iter().map(|(_, volume)| volume).sum();
        let stiffness_n_per_m = STIFFNESS * young_pa * volume / a.distance_squared(b);
        Spring { nodes, length_m: a.distance(b), stiffness_n_per_m }
    };
    shares.chunk_by(|(a, _), (b, _)| a == b).map(spring).collect()
}

impl Spring {
    /// From the first node to the second: direction (zero if they are at one place), distance.
    fn reach(&self, positions_m: &[DVec3]) -> (DVec3, f64) {
        let [a, b] = self.nodes.map(|node| positions_m[node as usize]);
        ((b - a).normalize_or_zero(), a.distance(b))
    }

    /// Its pull, N; negative when it is compressed.
    fn tension_n(&self, distance_m: f64) -> f64 {
        self.stiffness_n_per_m * (distance_m - self.length_m)
    }

    fn tangent(&self, positions_m: &[DVec3], positive: bool) -> DMat3 {
        let (direction, distance) = self.reach(positions_m);
        let along =
            DMat3::from_cols(direction.x * direction, direction.y * direction, direction.z * direction);
        let across = self.tension_n(distance) / distance.max(1e-9 * self.length_m);
        let across = if positive { across.max(0.0) } else { across };
        self.stiffness_n_per_m * along + across * (DMat3::IDENTITY - along)
    }
}

impl Elastic for Springs {
    fn energy_j(&self, positions_m: &[DVec3]) -> f64 {
        let of_spring = |spring: &Spring| {
            let longer = spring.reach(positions_m).1 - spring.length_m;
            0.5 * spring.stiffness_n_per_m * longer * longer
        };
        let ties: f64 =
            positions_m.iter().zip(&self.rest_m).map(|(at, rest)| at.distance_squared(*rest)).sum();
        let springs: f64 = self.springs.iter().map(of_spring).sum();
        springs + 0.5 * self.tie_n_per_m * ties + self.inversion.energy_j(positions_m)
    }

    fn add_forces(&self, positions_m: &[DVec3], forces_n: &mut [DVec3]) {
        self.inversion.add_forces(positions_m, forces_n);
        for spring in &self.springs {
            let (direction, distance) = spring.reach(positions_m);
            let pull = spring.tension_n(distance) * direction;
            let [a, b] = spring.nodes.map(|node| node as usize);
            forces_n[a] += pull;
            forces_n[b] -= pull;
        }
        for (node, force) in forces_n.iter_mut().enumerate() {
            *force += self.tie_n_per_m * (self.rest_m[node] - positions_m[node]);
        }
    }

    fn add_tangent(&self, positions_m: &[DVec3], positive: bool, scale: f64, matrix: &mut BlockMatrix) {
        self.inversion.add_tangent(positions_m, positive, scale, matrix);
        for spring in &self.springs {
            let block = scale * spring.tangent(positions_m, positive);
            let [a, b] = spring.nodes;
            matrix.add_pair(a, a, block);
            matrix.add_pair(b, b, block);
            matrix.add_pair(a, b, -block);
        }
        let places = matrix.symbolic().free_nodes();
        (0..places).for_each(|place| matrix.add_to_diagonal(place, scale * self.tie_n_per_m));
    }

    /// Of the mean stress of the springs that meet in a node (the virial: half of force times length, in its volume); of
    /// nodes that are only tied, zero.
    fn stress_pa(&self, positions_m: &[DVec3], stress: &mut Vec<f32>) {
        let mut virial = vec![DMat3::ZERO; positions_m.len()];
        for spring in &self.springs {
            let (direction, distance) = spring.reach(positions_m);
            let half = 0.5 * spring.tension_n(distance) * distance * direction;
            let share = DMat3::from_cols(direction.x * half, direction.y * half, direction.z * half);
            spring.nodes.iter().for_each(|&node| virial[node as usize] += share);
        }
        stress.clear();
        let of_node =
            |(sum, volume): (&DMat3, &f64)| von_mises(*sum * (1.0 / volume.max(f64::MIN_POSITIVE))) as f32;
        stress.extend(virial.iter().zip(&self.volume_m3).map(of_node));
    }
}

/// √(3/2·s:s) of the deviator s.
pub(crate) fn von_mises(stress: DMat3) -> f64 {
    let mean = (stress.x_axis.x + stress.y_axis.y + stress.z_axis.z) / 3.0;
    let deviator = stress - mean * DMat3::IDENTITY;
    let square: f64 = deviator.to_cols_array().iter().map(|entry| entry * entry).sum();
    (1.5 * square).sqrt()
}
