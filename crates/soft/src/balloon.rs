//! A closed elastic skin around a fluid that keeps its volume: pressing here bulges there.
//!
//! The skin was cut smaller than the mesh by `soft.skin_stretch`, from material of `soft.skin_thickness_m`, and blown up to the
//! mesh's volume; at rest its tension and the pressure balance (in a sphere `p = 2·T/r`, Laplace). Young's modulus and Poisson's
//! ratio are the skin's, the density is the fluid's. The pressure is what keeps the volume (a Lagrange multiplier).
//!
//! The fluid's mass is shared by the skin's nodes, by area, and the skin's own is left out. So is the fluid's weight where
//! there is gravity: it pulls at the nodes evenly instead of pressing more below (hydrostatics).

use cotouch_scene::scene::Scene;

use crate::body::SoftError;
use crate::enclosed::Enclosed;
use crate::implicit::{ImplicitBody, Parts};
use crate::membrane::Membrane;
use crate::mesh;

/// The body of a scene whose `soft.model` is `balloon`.
///
/// # Errors
/// When it does not come to rest.
pub(crate) fn balloon(scene: &Scene) -> Result<ImplicitBody<Membrane>, SoftError> {
    let (soft, mesh) = (&scene.soft, scene.soft.mesh());
    let enclosed = Enclosed::new(&mesh.nodes_m, &mesh.triangles);
    debug_assert!(
        mesh.tetrahedra.is_empty() && enclosed.volume_m3 > 0.0,
        "a scene's balloon has a closed skin"
    );
    let areas = mesh::node_areas(&mesh.nodes_m, &mesh.triangles);
    let mass_per_area = soft.density_kg_per_m3 * enclosed.volume_m3 / areas.iter().sum::<f64>();
    let material = [soft.young_pa, soft.poisson_ratio];
    let parts = Parts {
        elastic: Membrane::new(
            &mesh.nodes_m,
            &mesh.triangles,
            material,
            soft.skin_thickness_m,
            soft.skin_stretch,
        ),
        enclosed: Some(enclosed),
        rest_m: mesh.nodes_m.clone(),
        triangles: mesh.triangles.clone(),
        mass_kg: areas.iter().map(|area| area * mass_per_area).collect(),
        pairs: mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect(),
        fixed: mesh.fixed_nodes(&soft.fixed),
    };
    ImplicitBody::new_settled(scene, parts)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::elastic::Elastic;

    /// An octahedron whose faces are cut into `cells`² triangles each, blown up to the unit sphere.
    fn sphere(cells: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let (mut nodes, mut triangles) = (Vec::<DVec3>::new(), Vec::new());
        let mut node = |place: DVec3| {
            let at = place.normalize();
            let known = nodes.iter().position(|other| other.distance(at) < 1e-9);
            known.unwrap_or_else(|| {
                nodes.push(at);
                nodes.len() - 1
            }) as u32
        };
        for signs in
            (0..8).map(|bits| DVec3::from([1, 2, 4].map(|bit| if bits & bit == 0 { 1.0 } else { -1.0 })))
        {
            let mut corner = |i: u32, j: u32| node(signs * DVec3::from([i, j, cells - i - j].map(f64::from)));
            for (i, j) in (0..cells).flat_map(|i| (0..cells - i).map(move |j| (i, j))) {
                let mut both = vec![[corner(i, j), corner(i + 1, j), corner(i, j + 1)]];
                if i + j + 1 < cells {
                    both.push([corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
                }
                let outwards = signs.x * signs.y * signs.z > 0.0;
                triangles.extend(both.iter().map(|&[a, b, c]| if outwards { [a, b, c] } else { [a, c, b] }));
            }
        }
        (nodes, triangles)
    }

    /// Pressure that balances a sphere's skin, over Laplace's 2·T/r.
    fn against_laplace(cells: u32) -> f64 {
        let (nodes, triangles) = sphere(cells);
        let (young, poisson, thickness, stretch) = (2e5, 0.4, 1e-3, 1.5);
        let skin = Membrane::new(&nodes, &triangles, [young, poisson], thickness, stretch);
        let tension = thickness * young / (1.0 - poisson) * (stretch - 1.0) / stretch;
        let mut forces = vec![DVec3::ZERO; nodes.len()];
        skin.add_forces(&nodes, &mut forces);
        let gradient = Enclosed::new(&nodes, &triangles).gradient(&nodes);
        let product = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let pressure = -product(&forces, &gradient) / product(&gradient, &gradient);
        pressure / (2.0 * tension)
    }

    #[test]
    fn a_spheres_pressure_is_laplaces_the_nearer_the_finer_it_is() {
        let errors = [4, 8, 16].map(|cells| (against_laplace(cells) - 1.0).abs());
        assert!(errors[2] < 0.01, "{errors:?}");
        assert!(errors[1] < 0.4 * errors[0] && errors[2] < 0.4 * errors[1], "{errors:?}");
    }

    #[test]
    fn forces_are_the_slopes_of_energy_and_volume() {
        let (nodes, triangles) = sphere(3);
        let skin = Membrane::new(&nodes, &triangles, [2e5, 0.3], 1e-3, 1.2);
        let enclosed = Enclosed::new(&nodes, &triangles);
        let bent: Vec<DVec3> =
            nodes.iter().map(|at| *at + 0.2 * DVec3::new(at.y * at.z, at.x, 0.3 * at.z)).collect();
        let mut forces = vec![DVec3::ZERO; nodes.len()];
        skin.add_forces(&bent, &mut forces);
        let gradient = enclosed.gradient(&bent);
        let sum = |field: &[DVec3]| field.iter().sum::<DVec3>().length();
        assert!(sum(&forces) < 1e-12 && sum(&gradient) < 1e-14, "neither moves it as a whole");
        let step = 1e-6;
        for (node, axis) in [(0, 0), (5, 1), (11, 2), (17, 0)] {
            let [up, down] = [step, -step].map(|step| {
                let mut moved = bent.clone();
                moved[node][axis] += step;
                moved
            });
            let slope = (skin.energy_j(&up) - skin.energy_j(&down)) / (2.0 * step);
            assert!(
                (slope + forces[node][axis]).abs() < 1e-6 * slope.abs().max(1.0),
                "{slope} {}",
                forces[node]
            );
            let slope = (enclosed.volume(&up) - enclosed.volume(&down)) / (2.0 * step);
            assert!((slope - gradient[node][axis]).abs() < 1e-8, "{slope} {}", gradient[node]);
        }
    }
}
