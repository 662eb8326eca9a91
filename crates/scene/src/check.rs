//! From the tree of a scene to a checked [`Scene`]: every key against its table, then the keys against each other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::consistency::{self, Conflict};
use crate::error::{Place, Problem, SceneError};
use crate::keys::parts::{
    ACTIONS, ActionKind, BODY, DO, FINGER, FINGER_LIST, FINGER_SCRIPT, FIXED, IMPAIRMENT, PLANE, SCRIPT,
    USER, WAY,
};
use crate::keys::scene::{BODY_LIST, FIXED_LIST, LINK_IMPAIRMENT, PLANE_LIST, SCENE, USER_LIST, WAY_LIST};
use crate::keys::{Fallback, Key, blank};
use crate::limits::MAX_USERS;
use crate::meshes;
use crate::scene::{
    Action, Body, Finger, FixedRegion, Scene, SceneValues, Shape, Soft, SoftMeshKind, SoftModel, User,
    WallPlane, Way,
};
use crate::tree::{self, Content, Node, Table};
use crate::value::Value;
use crate::{unknown, users};

/// Reads the scene in `tree`; `name` is its name if it has none of its own, `base` the folder from which its mesh files
/// are named.
///
/// # Errors
/// Every problem found.
pub(crate) fn scene(
    tree: Table,
    whole: Place,
    name: String,
    base: Option<&Path>,
) -> Result<Scene, Vec<SceneError>> {
    let base = base.map(Path::to_owned);
    let mut reader = Reader { base, places: BTreeMap::new(), wrong: Vec::new(), errors: Vec::new() };
    let scene = reader.scene(&mut Scope { rest: tree, prefix: String::new(), place: whole }, name);
    if reader.errors.is_empty() { Ok(Scene::from_checked(scene)) } else { Err(reader.errors) }
}

struct Reader {
    base: Option<PathBuf>,
    /// Where each key was written.
    places: BTreeMap<String, Place>,
    /// Keys with a problem of their own: no conflict of theirs is worth a word.
    wrong: Vec<String>,
    errors: Vec<SceneError>,
}

/// A table that is being read: what is left of it, and what its keys are called.
struct Scope {
    rest: Table,
    /// Empty, or ends in a dot.
    prefix: String,
    place: Place,
}

impl Scope {
    fn take(&mut self, path: &str) -> Option<Node> {
        tree::take(&mut self.rest, path)
    }
}

/// Reads one table of a list; the number counts from 1.
type ReadElement<T> = fn(&mut Reader, &mut Scope, usize) -> Option<T>;

impl Reader {
    fn scene(&mut self, scope: &mut Scope, name: String) -> SceneValues {
        let mut scene = SceneValues { name, ..SceneValues::default() };
        scene.users = self.list(scope, USER_LIST.0, Self::user);
        scene.link.ways = self.list(scope, WAY_LIST.0, Self::way);
        scene.bodies = self.list(scope, BODY_LIST.0, Self::body);
        scene.wall.planes = self.list(scope, PLANE_LIST.0, Self::plane);
        scene.soft.fixed = self.list(scope, FIXED_LIST.0, Self::fixed_region);
        let least = if wants_soft_object(&scope.rest) { 1 } else { 2 };
        scene.session.users = scene.users.len().clamp(least, MAX_USERS) as u8;
        self.fill(IMPAIRMENT, scope, LINK_IMPAIRMENT, &mut scene.link.impairment);
        self.fill(SCENE, scope, "", &mut scene);
        self.surface(scope, "object.", &mut scene.object.shape);
        self.soft_file(scope, &mut scene.soft);
        self.refuse_unknown(scope, &unknown::scene_keys());

        self.report(scope, consistency::users(&scene));
        self.settle_users(scope, &mut scene);
        self.report(scope, consistency::numbers(&scene));
        self.report(scope, consistency::names(&scene));
        self.soft_mesh(scope, &mut scene);
        scene
    }

    /// More tables than users are a slip in a file, but not when an override asks for fewer users.
    fn settle_users(&mut self, scope: &Scope, scene: &mut SceneValues) {
        const KEY: &str = "session.users";
        let (given, wanted) = (scene.users.len(), usize::from(scene.session.users));
        let overridden = matches!(self.places.get(KEY), Some(Place::Override(_)));
        if given > wanted && !overridden {
            let allowed = format!("from the number of [[user]] tables ({given}) to {MAX_USERS}");
            self.report(
                scope,
                vec![Conflict { keys: vec![KEY.to_owned()], found: wanted.to_string(), allowed }],
            );
        }
        users::fill_up(&mut scene.users, wanted);
    }

    fn user(&mut self, scope: &mut Scope, number: usize) -> Option<User> {
        let mut user = users::unwritten(number);
        user.script = self.list(scope, SCRIPT.0, Self::action);
        let fingers = self.list(scope, FINGER_LIST.0, Self::finger);
        if !fingers.is_empty() {
            user.fingers = fingers;
        }
        self.fill(USER, scope, "", &mut user);
        self.refuse_unknown(scope, &unknown::user_keys());
        Some(user)
    }

    fn finger(&mut self, scope: &mut Scope, _: usize) -> Option<Finger> {
        let mut finger = blank(FINGER);
        finger.script = self.list(scope, FINGER_SCRIPT.0, Self::action);
        self.fill(FINGER, scope, "", &mut finger);
        self.refuse_unknown(scope, &unknown::finger_keys());
        Some(finger)
    }

    fn body(&mut self, scope: &mut Scope, number: usize) -> Option<Body> {
        let mut body = Body { name: format!("body{number}"), ..Body::default() };
        self.fill(BODY, scope, "", &mut body);
        let prefix = scope.prefix.clone();
        self.surface(scope, &prefix, &mut body.shape);
        self.refuse_unknown(scope, &unknown::body_keys());
        Some(body)
    }

    fn plane(&mut self, scope: &mut Scope, number: usize) -> Option<WallPlane> {
        let mut plane = WallPlane { name: format!("wall{number}"), ..WallPlane::default() };
        self.fill(PLANE, scope, "", &mut plane);
        self.refuse_unknown(scope, &unknown::plane_keys());
        Some(plane)
    }

    fn fixed_region(&mut self, scope: &mut Scope, _: usize) -> Option<FixedRegion> {
        let mut region = FixedRegion::default();
        self.fill(FIXED, scope, "", &mut region);
        self.refuse_unknown(scope, &unknown::fixed_keys());
        Some(region)
    }

    /// The path of a soft object's mesh file becomes absolute.
    fn soft_file(&mut self, scope: &Scope, soft: &mut Soft) {
        let mesh = &mut soft.mesh;
        if mesh.generator != SoftMeshKind::File || mesh.file.is_empty() || soft.model == SoftModel::None {
            return;
        }
        if let Some(path) = self.path(scope, "soft.mesh.file", &mesh.file) {
            meshes::make_absolute(&path, &mut mesh.file);
        }
    }

    /// Makes or reads the mesh of the soft object, if the keys about it are in order.
    fn soft_mesh(&mut self, scope: &Scope, scene: &mut SceneValues) {
        let is_of_soft = |error: &SceneError| match &error.problem {
            Problem::NotAllowed { key, .. }
            | Problem::Missing { key, .. }
            | Problem::UnknownKey { key, .. } => key.starts_with("soft."),
            Problem::Syntax(_) | Problem::Unreadable(_) => false,
        };
        if !scene.soft.exists() || self.errors.iter().any(is_of_soft) {
            return;
        }
        if let Err(conflict) = meshes::make_soft(&mut scene.soft) {
            self.report(scope, vec![conflict]);
        }
    }

    /// Reads the mesh file of a hull or mesh; its path becomes absolute, so that the scene can be read again elsewhere.
    fn surface(&mut self, scope: &Scope, prefix: &str, shape: &mut Shape) {
        let key = format!("{prefix}mesh");
        if !meshes::has_file(shape) || self.wrong.contains(&key) {
            return;
        }
        let Some(path) = self.path(scope, &key, &shape.mesh) else { return };
        match meshes::read_surface(shape, &path) {
            Ok(surface) => shape.surface = Some(surface),
            Err(error) => {
                self.report(scope, vec![consistency::surface(prefix, &path, &error)]);
                self.wrong.push(key);
            }
        }
        meshes::make_absolute(&path, &mut shape.mesh);
    }

    /// The path of the file that `key` names: from the scene's folder, or from the current one where an override names it.
    fn path(&mut self, scope: &Scope, key: &str, name: &str) -> Option<PathBuf> {
        let place = self.places.get(key).unwrap_or(&scope.place).clone();
        match (&place, &self.base) {
            (Place::File { .. }, Some(base)) => Some(base.join(name)),
            (Place::File { .. }, None) if Path::new(name).is_relative() => {
                let allowed = "an absolute path, because this scene is not in a file".to_owned();
                let found = format!("\"{}\"", tree::shorten(name));
                self.wrong.push(key.to_owned());
                self.add(place, Problem::NotAllowed { key: key.to_owned(), found, allowed });
                None
            }
            _ => Some(PathBuf::from(name)),
        }
    }

    fn way(&mut self, scope: &mut Scope, _: usize) -> Option<Way> {
        let mut way = Way::default();
        self.fill(WAY, scope, "", &mut way);
        self.fill(IMPAIRMENT, scope, "", &mut way.impairment);
        self.refuse_unknown(scope, &unknown::way_keys());
        Some(way)
    }

    fn action(&mut self, scope: &mut Scope, _: usize) -> Option<Action> {
        let kind = self.action_kind(scope)?;
        let mut action = (kind.blank)();
        self.fill(kind.keys, scope, "", &mut action);
        self.refuse_unknown(scope, &unknown::names(kind.keys));
        Some(action)
    }

    fn action_kind(&mut self, scope: &mut Scope) -> Option<&'static ActionKind> {
        let words: Vec<String> = ACTIONS.iter().map(|kind| format!("\"{}\"", kind.word)).collect();
        let (key, allowed) = (format!("{}{DO}", scope.prefix), format!("one of {}", words.join(", ")));
        let Some(node) = scope.take(DO) else {
            self.add(scope.place.clone(), Problem::Missing { key, allowed });
            return None;
        };
        let named = |kind: &&ActionKind| matches!(&node.content, Content::Text(word) if word == kind.word);
        let kind = ACTIONS.iter().find(named);
        if kind.is_none() {
            self.not_allowed(&key, &node, allowed);
        }
        kind
    }

    /// The tables of a list.
    fn list<T>(&mut self, scope: &mut Scope, path: &str, read: ReadElement<T>) -> Vec<T> {
        let Some(node) = scope.take(path) else { return Vec::new() };
        let key = format!("{}{path}", scope.prefix);
        self.places.insert(key.clone(), node.place.clone());
        let found = node.found();
        let Content::List(items) = node.content else {
            let allowed = "a list of tables".to_owned();
            self.add(node.place, Problem::NotAllowed { key, found, allowed });
            return Vec::new();
        };
        let mut list = Vec::new();
        for (index, item) in items.into_iter().enumerate() {
            let number = index + 1;
            let found = item.found();
            if let Content::Table(rest) = item.content {
                let mut inner = Scope { rest, prefix: format!("{key}.{number}."), place: item.place };
                list.extend(read(self, &mut inner, number));
            } else {
                let (key, allowed) = (format!("{key}.{number}"), "a table".to_owned());
                self.add(item.place, Problem::NotAllowed { key, found, allowed });
            }
        }
        list
    }

    /// Sets every one of `keys` in `owner`: first those that are written or have a fixed default, then those that
    /// follow from these. The keys are below `inner`, which is empty or ends in a dot.
    fn fill<T>(&mut self, keys: &[Key<T>], scope: &mut Scope, inner: &str, owner: &mut T) {
        let mut left = Vec::new();
        for key in keys {
            match self.written(key, scope, inner) {
                Some(value) => (key.access.set)(owner, value),
                None if key.is_derived() => left.push(key),
                None => key.set_default(owner),
            }
        }
        for key in left {
            key.set_default(owner);
        }
    }

    /// The value of a key as written, if it is and is allowed.
    fn written<T>(&mut self, key: &Key<T>, scope: &mut Scope, inner: &str) -> Option<Value> {
        let path = format!("{inner}{}", key.name);
        let name = format!("{}{path}", scope.prefix);
        let Some(node) = scope.take(&path) else {
            if matches!(key.fallback, Fallback::Required) {
                self.wrong.push(name.clone());
                self.add(scope.place.clone(), Problem::Missing { key: name, allowed: key.allowed() });
            }
            return None;
        };
        let value = key.kind.read(&node);
        if value.is_none() {
            self.not_allowed(&name, &node, key.allowed());
        }
        self.places.insert(name, node.place);
        value
    }

    fn refuse_unknown(&mut self, scope: &mut Scope, known: &[String]) {
        let rest = std::mem::take(&mut scope.rest);
        unknown::refuse(rest, &scope.prefix, "", known, &mut self.errors);
    }

    /// Reports conflicts: at an override if one is involved, else where the first key is written.
    fn report(&mut self, scope: &Scope, conflicts: Vec<Conflict>) {
        for Conflict { keys, found, allowed } in conflicts {
            if keys.iter().any(|key| self.wrong.contains(key)) {
                continue;
            }
            let places: Vec<&Place> = keys.iter().filter_map(|key| self.places.get(key)).collect();
            let overridden = places.iter().find(|place| matches!(place, Place::Override(_)));
            let place = overridden.or(places.first()).map_or(&scope.place, |place| place).clone();
            let key = keys.into_iter().next().unwrap_or_default();
            self.add(place, Problem::NotAllowed { key, found, allowed });
        }
    }

    fn not_allowed(&mut self, key: &str, node: &Node, allowed: String) {
        self.wrong.push(key.to_owned());
        let problem = Problem::NotAllowed { key: key.to_owned(), found: node.found(), allowed };
        self.add(node.place.clone(), problem);
    }

    fn add(&mut self, place: Place, problem: Problem) {
        self.errors.push(SceneError { place, problem });
    }
}

/// Whether the scene writes a soft object; what else it may have depends on it before its keys are read.
fn wants_soft_object(tree: &Table) -> bool {
    let model = tree::find(tree, "soft.model").map(|node| &node.content);
    matches!(model, Some(Content::Text(word)) if word != "none")
}
