//! What a soft object demands of the rest of a scene.

use super::conflict::{Conflict, conflict};
use crate::limits::{MAX_SOFT_CONTACTS, MAX_USERS};
use crate::scene::{SceneValues, ShapeKind, Soft, SoftMeshKind, SoftModel};
use crate::soft_mesh::{MAX_ELEMENTS, SoftMeshError};
use crate::time::Schedule;
use crate::value::{Field as _, Value, plain};

/// From this stretch at rest on a skin is not stable whatever is around it.
const LEAST_UNSTABLE_STRETCH: f64 = 2.0;

pub(super) fn soft(scene: &SceneValues, found: &mut Vec<Conflict>) {
    if !scene.soft.exists() {
        if scene.session.users < 2 {
            let allowed = format!(
                "from 2 to {MAX_USERS}, because only with a soft object (soft.model) one user can be alone"
            );
            found.push(conflict(&["session.users", "soft.model"], "1", allowed));
        }
        return;
    }
    found.extend(simulation_rate(scene));
    found.extend(fingers(scene));
    other_bodies(scene, found);
    mesh_source(&scene.soft, found);
    technique(&scene.soft, found);
    for (index, region) in scene.soft.fixed.iter().enumerate() {
        if !region.from_m.cmple(region.to_m).all() {
            let keys = ["to_m", "from_m"].map(|end| format!("soft.fixed.{}.{end}", index + 1));
            let allowed = format!("at least {} ({}), along every axis", keys[1], region.from_m.value());
            found.push(conflict(&[&keys[0], &keys[1]], region.to_m.value().to_string(), allowed));
        }
    }
}

fn simulation_rate(scene: &SceneValues) -> Option<Conflict> {
    let (control, simulation) = (scene.rates.control_hz, scene.rates.simulation_hz);
    Schedule::new(control, simulation).is_err().then(|| {
        let allowed = format!(
            "at most rates.control_hz ({control} Hz), and in a ratio to it that repeats within a million ticks"
        );
        conflict(&["rates.simulation_hz", "rates.control_hz"], format!("{simulation} Hz"), allowed)
    })
}

/// As many fingers touch a soft object as contacts are solved together.
fn fingers(scene: &SceneValues) -> Option<Conflict> {
    let mut left = MAX_SOFT_CONTACTS;
    for (index, user) in scene.users.iter().enumerate() {
        let count = user.fingers.len();
        if count > left {
            let (key, found) = (format!("user.{}.finger", index + 1), format!("a list of {count}"));
            let allowed = format!(
                "so short that all users have at most {MAX_SOFT_CONTACTS} fingers together, because there is a soft object"
            );
            return Some(conflict(&[&key, "soft.model"], found, allowed));
        }
        left -= count;
    }
    None
}

/// A soft object is the only body.
fn other_bodies(scene: &SceneValues, found: &mut Vec<Conflict>) {
    let mut refuse = |key: &str, value: String, allowed: &str| {
        found.push(conflict(
            &[key, "soft.model"],
            value,
            format!("{allowed}, because there is a soft object"),
        ));
    };
    if !scene.bodies.is_empty() {
        refuse("body", format!("a list of {}", scene.bodies.len()), "left out");
    }
    if scene.object.shape.kind != ShapeKind::Point {
        refuse("object.shape", scene.object.shape.kind.value().to_string(), "left out");
    }
    if !scene.wall.planes.is_empty() {
        refuse("wall.plane", format!("a list of {}", scene.wall.planes.len()), "left out");
    }
    let wall = [
        ("wall.stiffness_n_per_m", scene.wall.stiffness_n_per_m),
        ("wall.damping_n_s_per_m", scene.wall.damping_n_s_per_m),
    ];
    for (key, value) in wall {
        if value > 0.0 {
            refuse(key, plain(value), "0");
        }
    }
}

/// A mesh has the numbers that its generator needs.
fn mesh_source(soft: &Soft, found: &mut Vec<Conflict>) {
    let mesh = &soft.mesh;
    let word = mesh.generator.value();
    let mut need = |name: &str, value: Value, allowed: &str| {
        let keys = [format!("soft.mesh.{name}"), "soft.mesh.generator".to_owned()];
        let allowed = format!("{allowed}, because soft.mesh.generator is {word}");
        found.push(conflict(&[&keys[0], &keys[1]], value.to_string(), allowed));
    };
    let has_size = matches!(mesh.generator, SoftMeshKind::Beam | SoftMeshKind::Block | SoftMeshKind::Organ);
    if has_size && mesh.size_m.min_element() <= 0.0 {
        need("size_m", mesh.size_m.value(), "3 numbers above 0 (m)");
    }
    let [x, y, z] = mesh.cells.map(u64::from);
    let is_grid = matches!(mesh.generator, SoftMeshKind::Beam | SoftMeshKind::Block);
    if is_grid && 6 * x * y * z > MAX_ELEMENTS as u64 {
        let allowed = format!("at most {} cubes in all", MAX_ELEMENTS / 6);
        need("cells", mesh.cells.value(), &allowed);
    }
    let is_round = matches!(mesh.generator, SoftMeshKind::Ball | SoftMeshKind::Balloon);
    if is_round && mesh.radius_m == 0.0 {
        need("radius_m", Value::Number(0.0), "more than 0 (m)");
    }
    if mesh.generator == SoftMeshKind::Spring && mesh.stiffness_n_per_m == 0.0 {
        need("stiffness_n_per_m", Value::Number(0.0), "more than 0 (N/m)");
    }
    if mesh.generator == SoftMeshKind::File && mesh.file.is_empty() {
        let allowed = "the path of an .msh, .vtk, .vtu, .stl, .obj, .gltf or .glb file";
        need("file", mesh.file.value(), allowed);
    }
}

/// Which technique works with which mesh.
fn technique(soft: &Soft, found: &mut Vec<Conflict>) {
    let keys = ["soft.mesh.generator", "soft.model"];
    let generator = soft.mesh.generator;
    if generator == SoftMeshKind::Spring && soft.model != SoftModel::MassSpring {
        let allowed = "anything but \"spring\", because soft.model is not \"mass-spring\"";
        found.push(conflict(&keys, generator.value().to_string(), allowed));
    }
    if generator == SoftMeshKind::Balloon && soft.model != SoftModel::Balloon {
        let allowed =
            "anything but \"balloon\" (\"ball\" is a full one), because soft.model is not \"balloon\"";
        found.push(conflict(&keys, generator.value().to_string(), allowed));
    }
    if generator == SoftMeshKind::Spring && !soft.fixed.is_empty() {
        let allowed = "left out, because a spring is tied to where it rests";
        let list = format!("a list of {}", soft.fixed.len());
        found.push(conflict(&["soft.fixed", keys[0]], list, allowed));
    }
    if soft.model == SoftModel::Balloon && soft.skin_stretch >= LEAST_UNSTABLE_STRETCH {
        let allowed = format!(
            "less than {LEAST_UNSTABLE_STRETCH}, where the pressure of a balloon's skin begins to fall as it grows"
        );
        found.push(conflict(&["soft.skin_stretch", "soft.model"], plain(soft.skin_stretch), allowed));
    }
    let is_network = soft.model == SoftModel::MassSpring && generator != SoftMeshKind::Spring;
    if is_network && !(0.2..=0.3).contains(&soft.poisson_ratio) {
        let keys = ["soft.poisson_ratio", "soft.model"];
        let allowed = "from 0.2 to 0.3, because a mass-spring network has 1/4 whatever is written";
        found.push(conflict(&keys, plain(soft.poisson_ratio), allowed));
    }
}

/// What is wrong with the mesh of a soft object.
pub(crate) fn soft_mesh(soft: &Soft, error: &SoftMeshError) -> Conflict {
    if error.is_of_fixed() {
        let regions = match soft.fixed.len() {
            1 => "1 region".to_owned(),
            count => format!("{count} regions"),
        };
        return conflict(
            &["soft.fixed", "soft.mesh.generator"],
            format!("{regions}, and {error}"),
            error.allowed(),
        );
    }
    let (key, value) = match soft.mesh.generator {
        SoftMeshKind::File => ("soft.mesh.file", soft.mesh.file.value()),
        generator => ("soft.mesh.generator", generator.value()),
    };
    conflict(&[key, "soft.mesh"], format!("{value}, and {error}"), error.allowed())
}
