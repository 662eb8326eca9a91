//! The meshes that a scene names: read, and kept where what they are made from stays.

use std::path::Path;
use std::sync::Arc;

use crate::consistency::{self, Conflict};
use crate::mesh::{MeshError, TriangleMesh, Triangles};
use crate::scene::{SceneValues, Shape, ShapeKind, Soft};

/// What is in the file of a hull or mesh, of a shape that has one.
pub(crate) fn read_surface(shape: &Shape, path: &Path) -> Result<Arc<TriangleMesh>, MeshError> {
    let body = if shape.kind == ShapeKind::Hull { TriangleMesh::hull } else { TriangleMesh::closed };
    Triangles::read(path, shape.mesh_scale).and_then(|triangles| body(&triangles)).map(Arc::new)
}

/// Whether a shape has a mesh file.
pub(crate) fn has_file(shape: &Shape) -> bool {
    matches!(shape.kind, ShapeKind::Hull | ShapeKind::Mesh) && !shape.mesh.is_empty()
}

/// Makes the name of a file absolute, so that a scene can be read again elsewhere.
pub(crate) fn make_absolute(path: &Path, name: &mut String) {
    let absolute = std::path::absolute(path).ok();
    if let Some(text) = absolute.as_deref().and_then(Path::to_str) {
        text.clone_into(name);
    }
}

/// Makes the mesh of the soft object, if there is one.
pub(crate) fn make_soft(soft: &mut Soft) -> Result<(), Conflict> {
    if !soft.exists() {
        soft.nodes = None;
        return Ok(());
    }
    let made = soft.make_mesh().map_err(|error| consistency::soft_mesh(soft, &error))?;
    soft.nodes = Some(Arc::new(made));
    Ok(())
}

/// Gives `after` the meshes that belong to its values: those of `before` where nothing about them changed.
pub(crate) fn follow(before: &SceneValues, after: &mut SceneValues) -> Vec<Conflict> {
    let mut conflicts = Vec::new();
    conflicts.extend(follow_surface("object.", Some(&before.object.shape), &mut after.object.shape).err());
    for (index, body) in after.bodies.iter_mut().enumerate() {
        let shape = before.bodies.get(index).map(|body| &body.shape);
        conflicts.extend(follow_surface(&format!("body.{}.", index + 1), shape, &mut body.shape).err());
    }
    let is_as_before = {
        let (one, other) = (&before.soft, &after.soft);
        (one.model, &one.mesh, &one.fixed) == (other.model, &other.mesh, &other.fixed)
    };
    if is_as_before {
        after.soft.nodes.clone_from(&before.soft.nodes);
    } else {
        conflicts.extend(make_soft(&mut after.soft).err());
    }
    conflicts
}

fn follow_surface(table: &str, before: Option<&Shape>, shape: &mut Shape) -> Result<(), Conflict> {
    if !has_file(shape) {
        shape.surface = None;
        return Ok(());
    }
    let same_file = before.filter(|before| (before.kind, &before.mesh) == (shape.kind, &shape.mesh));
    if let Some((before, surface)) = same_file.and_then(|before| Some((before, before.surface.as_ref()?))) {
        let is_as_large = shape.mesh_scale == before.mesh_scale;
        let scaled = || Arc::new(surface.scaled(shape.mesh_scale / before.mesh_scale));
        shape.surface = Some(if is_as_large { surface.clone() } else { scaled() });
        return Ok(());
    }
    let path = Path::new(&shape.mesh).to_owned();
    shape.surface =
        Some(read_surface(shape, &path).map_err(|error| consistency::surface(table, &path, &error))?);
    make_absolute(&path, &mut shape.mesh);
    Ok(())
}
