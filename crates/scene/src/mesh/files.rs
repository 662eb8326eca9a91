//! Triangles from files: STL (binary and text), OBJ, glTF and GLB.

use std::io::Cursor;
use std::path::Path;

use glam::DVec3;

use super::bytes::read_bytes;
use super::error::MeshError;
use super::gltf;
use super::triangles::Triangles;

/// What a mesh file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// STL, binary or text. Has no unit; vertices are f32.
    Stl,
    /// Wavefront OBJ. Has no unit; polygons are cut into fans.
    Obj,
    /// glTF 2.0 or GLB; its unit is the metre. All meshes of its default scene, where its nodes put them.
    Gltf,
}

impl MeshFormat {
    /// By the ending of a file's name.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "stl" => Some(Self::Stl),
            "obj" => Some(Self::Obj),
            "gltf" | "glb" => Some(Self::Gltf),
            _ => None,
        }
    }
}

impl Triangles {
    /// Reads a mesh file; a unit of it is `scale` metres.
    ///
    /// # Errors
    /// [`MeshError::Unreadable`], [`MeshError::Format`] or [`MeshError::TooLarge`].
    pub fn read(path: &Path, scale: f64) -> Result<Self, MeshError> {
        let Some(format) = MeshFormat::from_path(path) else {
            return Err(MeshError::Unreadable(
                "its name does not end in .stl, .obj, .gltf or .glb".to_owned(),
            ));
        };
        Self::parse(format, &read_bytes(path)?, scale, path.parent())
    }

    /// Reads the bytes of a mesh file. The buffers of a glTF file may be files in `folder`.
    ///
    /// # Errors
    /// [`MeshError::Unreadable`] for buffers, [`MeshError::Format`] or [`MeshError::TooLarge`].
    pub fn parse(
        format: MeshFormat,
        bytes: &[u8],
        scale: f64,
        folder: Option<&Path>,
    ) -> Result<Self, MeshError> {
        let mut triangles = match format {
            MeshFormat::Stl => stl(bytes),
            MeshFormat::Obj => obj(bytes),
            MeshFormat::Gltf => gltf::read(bytes, folder),
        }?;
        triangles.vertices.iter_mut().for_each(|vertex| *vertex *= scale);
        Ok(triangles)
    }
}

/// Text files start with "solid", but so do many binary ones, whose length then is just what their count of triangles says.
fn stl(bytes: &[u8]) -> Result<Triangles, MeshError> {
    let format = |error: std::io::Error| MeshError::Format { format: "STL", problem: error.to_string() };
    let mut bytes = bytes.to_vec();
    let count = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
    if count.is_some_and(|count| bytes.len() as u64 == 84 + 50 * u64::from(count)) {
        bytes[0] = b' ';
    }
    let mut cursor = Cursor::new(bytes);
    let mut triangles = Triangles::default();
    for triangle in stl_io::create_stl_reader(&mut cursor).map_err(format)? {
        let first = triangles.vertices.len() as u32;
        let corners = triangle.map_err(format)?.vertices;
        triangles.vertices.extend(corners.map(|corner| DVec3::from(corner.0.map(f64::from))));
        triangles.push([first, first + 1, first + 2])?;
    }
    Ok(triangles)
}

fn obj(bytes: &[u8]) -> Result<Triangles, MeshError> {
    let format = |error: tobj::LoadError| MeshError::Format { format: "OBJ", problem: error.to_string() };
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
        ..Default::default()
    };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut &*bytes, &options, no_materials).map_err(format)?;
    let mut triangles = Triangles::default();
    for mesh in models.into_iter().map(|model| model.mesh) {
        let first = triangles.vertices.len() as u32;
        triangles.vertices.extend(mesh.positions.chunks_exact(3).map(DVec3::from_slice));
        for corners in mesh.indices.chunks_exact(3) {
            triangles.push([first + corners[0], first + corners[1], first + corners[2]])?;
        }
    }
    Ok(triangles)
}
