//! A scene as TOML again, and its hash.

use std::fmt::Write as _;

use glam::DVec3;
use xxhash_rust::xxh3::xxh3_64;

use crate::keys::parts::{
    BODY, DO, FINGER, FINGER_LIST, FIXED, IMPAIRMENT, PLANE, SCRIPT, USER, WAY, kind_of,
};
use crate::keys::scene::{BODY_LIST, FIXED_LIST, LINK_IMPAIRMENT, PLANE_LIST, SCENE, USER_LIST, WAY_LIST};
use crate::keys::{Key, blank};
use crate::scene::{Action, Impairment, Scene, SceneValues, Shape, SoftMeshKind, User};
use crate::soft_mesh::SoftMesh;
use crate::value::Value;

/// The scene as TOML, every key written, except those that just follow from others. Reading it back gives an equal
/// scene.
#[must_use]
pub fn to_toml(scene: &Scene) -> String {
    let mut document = Document::default();
    document.keys(SCENE, scene, "", true);
    // After [link], in which the keys of SCENE leave off, only sub-tables of it may follow.
    document.keys(IMPAIRMENT, &scene.link.impairment, LINK_IMPAIRMENT, true);
    document.lists(scene, true);
    document.text
}

/// A link file, as `link.include` takes it: what a link does to packets, and the figures that were measured on it,
/// which are for people. Figures that are not finite are left out.
#[must_use]
pub fn link_file(impairment: &Impairment, measured: &[(&str, f64)]) -> String {
    let mut document = Document::default();
    document.heading("[impairment]");
    document.lines(IMPAIRMENT, impairment, true);
    document.heading("[measured]");
    for (name, figure) in measured.iter().filter(|(_, figure)| figure.is_finite()) {
        document.line(name, &Value::Number(*figure));
    }
    document.text
}

/// A hash of everything that both ends of a session must agree on: all keys but `name` and `description`, and what is in
/// mesh files in place of their paths.
///
/// It is the XXH3 of the values in the order of the key tables, written as `key = value` lines.
#[must_use]
pub fn scene_hash(scene: &Scene) -> u64 {
    let mut document = Document::default();
    let not_shared = ["name", "description", "object.mesh", "soft.mesh.file"];
    for key in SCENE.iter().filter(|key| !not_shared.contains(&key.name)) {
        document.line(key.name, &(key.access.get)(scene));
    }
    document.lines(IMPAIRMENT, &scene.link.impairment, false);
    document.lists(scene, false);
    for shape in scene.bodies.iter().map(|body| &body.shape).chain([&scene.object.shape]) {
        document.surface(shape);
    }
    if let (SoftMeshKind::File, Some(mesh)) = (scene.soft.mesh.generator, &scene.soft.nodes) {
        document.soft_mesh(mesh);
    }
    xxh3_64(document.text.as_bytes())
}

#[derive(Default)]
struct Document {
    text: String,
    table: String,
}

impl Document {
    /// Keys with dots, below `[table]` headings.
    fn keys<T>(&mut self, keys: &[Key<T>], owner: &T, prefix: &str, omit_following: bool) {
        for key in keys.iter().filter(|key| !(omit_following && key.follows(owner))) {
            let path = format!("{prefix}{}", key.name);
            let (table, name) = path.rsplit_once('.').unwrap_or(("", &path));
            if table != self.table {
                self.heading(&format!("[{table}]"));
                table.clone_into(&mut self.table);
            }
            self.line(name, &(key.access.get)(owner));
        }
    }

    /// Keys without headings.
    fn lines<T>(&mut self, keys: &[Key<T>], owner: &T, omit_following: bool) {
        for key in keys.iter().filter(|key| !(omit_following && key.follows(owner))) {
            self.line(key.name, &(key.access.get)(owner));
        }
    }

    fn list_element(&mut self, list: &str) {
        self.heading(&format!("[[{list}]]"));
    }

    fn heading(&mut self, heading: &str) {
        let gap = if self.text.is_empty() { "" } else { "\n" };
        self.push(format_args!("{gap}{heading}\n"));
    }

    fn line(&mut self, name: &str, value: &Value) {
        self.push(format_args!("{name} = {value}\n"));
    }

    fn lists(&mut self, scene: &SceneValues, for_reading: bool) {
        for way in &scene.link.ways {
            self.list_element(WAY_LIST.0);
            self.lines(WAY, way, for_reading);
            self.lines(IMPAIRMENT, &way.impairment, for_reading);
        }
        for body in &scene.bodies {
            self.list_element(BODY_LIST.0);
            for key in BODY.iter().filter(|key| for_reading || key.name != "mesh") {
                self.line(key.name, &(key.access.get)(body));
            }
        }
        for plane in &scene.wall.planes {
            self.list_element(PLANE_LIST.0);
            self.lines(PLANE, plane, for_reading);
        }
        for region in &scene.soft.fixed {
            self.list_element(FIXED_LIST.0);
            self.lines(FIXED, region, for_reading);
        }
        for user in &scene.users {
            self.user(user, for_reading);
        }
    }

    fn user(&mut self, user: &User, for_reading: bool) {
        self.list_element(USER_LIST.0);
        self.lines(USER, user, for_reading);
        self.script(&user.script);
        if user.fingers == [blank(FINGER)] {
            return;
        }
        for finger in &user.fingers {
            self.list_element(&format!("{}.{}", USER_LIST.0, FINGER_LIST.0));
            self.lines(FINGER, finger, for_reading);
            if !finger.script.is_empty() {
                self.script(&finger.script);
            }
        }
    }

    /// What is in a shape's mesh file, for the hash.
    fn surface(&mut self, shape: &Shape) {
        let Some(surface) = &shape.surface else { return };
        self.mesh("mesh", &surface.vertices, surface.triangles.iter().flatten());
    }

    /// What is in a soft object's mesh file, for the hash.
    fn soft_mesh(&mut self, mesh: &SoftMesh) {
        let corners = mesh.tetrahedra.iter().flatten().chain(mesh.triangles.iter().flatten());
        self.mesh("soft mesh", &mesh.nodes_m, corners);
    }

    fn mesh<'a>(&mut self, name: &str, vertices: &[DVec3], corners: impl Iterator<Item = &'a u32>) {
        let vertices = vertices.iter().flat_map(|vertex| vertex.to_array()).flat_map(f64::to_le_bytes);
        let bytes: Vec<u8> = vertices.chain(corners.copied().flat_map(u32::to_le_bytes)).collect();
        self.push(format_args!("{name} {:016x}\n", xxh3_64(&bytes)));
    }

    fn script(&mut self, script: &[Action]) {
        self.push(format_args!("{} = [\n", SCRIPT.0));
        for action in script {
            self.push(format_args!("  {{ {} }},\n", in_line(action)));
        }
        self.push(format_args!("]\n"));
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        self.text.write_fmt(text).expect("a String takes any text");
    }
}

fn in_line(action: &Action) -> String {
    let kind = kind_of(action);
    let word = Value::Text(kind.word.to_owned());
    let fields = kind.keys.iter().map(|key| format!(", {} = {}", key.name, (key.access.get)(action)));
    format!("{DO} = {word}{}", fields.collect::<String>())
}
