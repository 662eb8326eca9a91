//! Single keys of a scene, and scenes that are changed: in one number (what sweeps and gain design do), or at will.

use crate::consistency::{self, Conflict};
use crate::error::{Place, Problem, SceneError, SceneErrors};
use crate::keys::Key;
use crate::keys::parts::IMPAIRMENT;
use crate::keys::scene::{LINK_IMPAIRMENT, SCENE};
use crate::scene::{Impairment, Scene, SceneValues};
use crate::value::{Value, plain};
use crate::{meshes, ranges, reference, unknown, users};

impl SceneValues {
    /// The value of a dotted key such as `coupling.hand_object.stiffness_n_per_m`; nothing when no scene has that key
    /// (the keys of lists such as `[[user]]` are fields of [`SceneValues::users`] and the like).
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

    /// The dotted keys whose values differ from those of `other`, with the values here; lists such as `[[user]]` are not looked at.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<(String, Value)> {
        let keys = reference::keys().into_iter().map(|key| key.name);
        let differing = keys.filter_map(|key| {
            let value = self.get(&key)?;
            (other.get(&key).as_ref() != Some(&value)).then_some((key, value))
        });
        differing.collect()
    }
}

/// `scene` with one number changed, checked again; keys that follow from it, such as `governor.max_slew_n_per_s`,
/// follow. Takes a few microseconds, mostly for the copy; longer where the number is one of `soft.mesh`, whose mesh is then
/// made or read again.
///
/// # Errors
/// When no scene has that key, it is not a number, or the number is not allowed.
pub fn with_override(scene: &Scene, key: &str, number: f64) -> Result<Scene, SceneErrors> {
    let mut changed = SceneValues::clone(scene);
    let set = match find(key) {
        Some(Found::Scene(found)) => set_number(SCENE, found, &mut changed, number),
        Some(Found::Impairment(found)) => set_number(IMPAIRMENT, found, &mut changed.link.impairment, number),
        None => return Err(unknown_key(key, number).into()),
    };
    set.map_err(|allowed| not_allowed(place(key, number), key.to_owned(), plain(number), allowed))?;
    let users = usize::from(changed.session.users);
    users::fill_up(&mut changed.users, users);
    let mut conflicts = consistency::numbers(&changed);
    if users > scene.users.len() {
        conflicts.extend(consistency::names(&changed));
    }
    if conflicts.is_empty() {
        conflicts = meshes::follow(scene, &mut changed);
    }
    checked(changed, conflicts, &place(key, number))
}

impl Scene {
    /// The scene with `change` made to its values, which are then checked as a whole; meshes follow what they are made from.
    /// Values are taken as they are: no key follows another that it followed before, as it does in [`with_override`].
    /// Takes some tens of microseconds, unless a mesh is made or read again.
    ///
    /// # Errors
    /// Everything that is not allowed.
    pub fn edit(&self, change: impl FnOnce(&mut SceneValues)) -> Result<Self, SceneErrors> {
        let mut changed = SceneValues::clone(self);
        change(&mut changed);
        let mut conflicts = ranges::admit(&mut changed);
        if conflicts.is_empty() {
            conflicts = consistency::all(&changed);
        }
        if conflicts.is_empty() {
            conflicts = meshes::follow(self, &mut changed);
        }
        checked(changed, conflicts, &Place::file(&format!("{}, edited", self.name)))
    }
}

/// The scene of values in which these conflicts were found.
fn checked(values: SceneValues, conflicts: Vec<Conflict>, place: &Place) -> Result<Scene, SceneErrors> {
    let errors = conflicts.into_iter().map(|conflict| {
        let key_at_fault = conflict.keys.into_iter().next().unwrap_or_default();
        not_allowed(place.clone(), key_at_fault, conflict.found, conflict.allowed)
    });
    SceneErrors::from_list(errors.collect()).map_or_else(|| Ok(Scene::from_checked(values)), Err)
}

enum Found {
    Scene(&'static Key<SceneValues>),
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

fn not_allowed(place: Place, key: String, found: String, allowed: String) -> SceneError {
    SceneError { place, problem: Problem::NotAllowed { key, found, allowed } }
}

fn unknown_key(key: &str, number: f64) -> SceneError {
    SceneError { place: place(key, number), problem: unknown::problem("", key, &unknown::scene_keys()) }
}

fn place(key: &str, number: f64) -> Place {
    Place::Number(format!("{key}={}", plain(number)).into())
}
