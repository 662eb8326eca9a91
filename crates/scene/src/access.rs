//! Single keys of a scene: reading one, and a scene with one number changed (what sweeps and gain design do).

use std::sync::Arc;

use crate::check::fill_up;
use crate::consistency;
use crate::error::{Place, Problem, SceneError, SceneErrors};
use crate::keys::Key;
use crate::keys::parts::IMPAIRMENT;
use crate::keys::scene::{LINK_IMPAIRMENT, SCENE};
use crate::scene::{Impairment, Scene, Shape};
use crate::soft_mesh::SoftMesh;
use crate::unknown;
use crate::value::{Value, plain};

impl Scene {
    /// The value of a dotted key such as `coupling.hand_object.stiffness_n_per_m`; nothing when no scene has that key
    /// (the keys of lists such as `[[user]]` are fields of [`Scene::users`] and the like).
    #[must_use]
    pub fn get(&self, key: &str) -> Option<Value> {
        match find(key)? {
            Found::Scene(key) => Some((key.access.get)(self)),
            Found::Impairment(key) => Some((key.access.get)(&self.link.impairment)),
        }
    }

    /// The value of a dotted key as a number; a rate in hertz.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.number()
    }
}

/// `scene` with one number changed, checked again; keys that follow from it, such as `governor.max_slew_n_per_s`,
/// follow. Takes a few microseconds, mostly for the copy; longer where the number is one of `soft.mesh`, whose mesh is then
/// made or read again.
///
/// # Errors
/// When no scene has that key, it is not a number, or the number is not allowed.
pub fn with_override(scene: &Scene, key: &str, number: f64) -> Result<Scene, SceneErrors> {
    let mut changed = scene.clone();
    let set = match find(key) {
        Some(Found::Scene(found)) => set_number(SCENE, found, &mut changed, number),
        Some(Found::Impairment(found)) => set_number(IMPAIRMENT, found, &mut changed.link.impairment, number),
        None => return Err(unknown_key(key, number).into()),
    };
    set.map_err(|allowed| not_allowed(key, number, key.to_owned(), plain(number), allowed))?;
    rescale_surface(&mut changed.object.shape, scene.object.shape.mesh_scale);
    let users = usize::from(changed.session.users);
    fill_up(&mut changed.users, users);
    let mut conflicts = consistency::of_numbers(&changed);
    if users > scene.users.len() {
        conflicts.extend(consistency::of_names(&changed));
    }
    if conflicts.is_empty() && changed.soft.exists() && changed.soft.mesh != scene.soft.mesh {
        match SoftMesh::of(&changed.soft) {
            Ok(mesh) => changed.soft.nodes = Some(Arc::new(mesh)),
            Err(error) => conflicts.push(consistency::of_soft_mesh(&changed.soft, &error)),
        }
    }
    let errors = conflicts.into_iter().map(|conflict| {
        let key_at_fault = conflict.keys.into_iter().next().unwrap_or_default();
        not_allowed(key, number, key_at_fault, conflict.found, conflict.allowed)
    });
    SceneErrors::from_list(errors.collect()).map_or(Ok(changed), Err)
}

/// A mesh that was read in another scale than the shape now has.
fn rescale_surface(shape: &mut Shape, before: f64) {
    if shape.mesh_scale != before
        && let Some(surface) = &shape.surface
    {
        shape.surface = Some(Arc::new(surface.scaled(shape.mesh_scale / before)));
    }
}

enum Found {
    Scene(&'static Key<Scene>),
    Impairment(&'static Key<Impairment>),
}

fn find(name: &str) -> Option<Found> {
    if let Some(inner) = name.strip_prefix(LINK_IMPAIRMENT) {
        return IMPAIRMENT.iter().find(|key| key.name == inner).map(Found::Impairment);
    }
    SCENE.iter().find(|key| key.name == name).map(Found::Scene)
}

/// Sets the key, and those of `keys` that followed before. The error says what is allowed.
fn set_number<T>(keys: &[Key<T>], key: &Key<T>, owner: &mut T, number: f64) -> Result<(), String> {
    let value = key.kind.read_number(number).ok_or_else(|| key.allowed())?;
    let followed = |other: &&Key<T>| other.name != key.name && other.follows(owner);
    let following: Vec<&Key<T>> = keys.iter().filter(followed).collect();
    (key.access.set)(owner, value);
    for other in following {
        if let Some(value) = other.default(owner) {
            (other.access.set)(owner, value);
        }
    }
    Ok(())
}

fn not_allowed(key: &str, number: f64, at_fault: String, found: String, allowed: String) -> SceneError {
    SceneError { place: place(key, number), problem: Problem::NotAllowed { key: at_fault, found, allowed } }
}

fn unknown_key(key: &str, number: f64) -> SceneError {
    SceneError { place: place(key, number), problem: unknown::problem("", key, &unknown::scene_keys()) }
}

fn place(key: &str, number: f64) -> Place {
    Place::Number(format!("{key}={}", plain(number)).into())
}
