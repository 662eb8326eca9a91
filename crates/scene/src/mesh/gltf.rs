//! glTF 2.0 and GLB: positions and indices of all triangles of the default scene. Every offset is checked here, because the
//! reader checks indices only.

use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3};
use gltf::accessor::{Accessor, DataType, Dimensions};
use gltf::buffer::{Buffer, Source};
use gltf::mesh::Mode;
use gltf::{Document, Gltf, Mesh, Node, Primitive, Semantic};

use super::bytes::read_bytes;
use super::error::MeshError;
use super::triangles::Triangles;

/// The triangles in the bytes of a file; buffers may be files in `folder`.
pub(super) fn read(bytes: &[u8], folder: Option<&Path>) -> Result<Triangles, MeshError> {
    // The reader of binary files relies on the header's length being at least the header's.
    let length = bytes.get(8..12).and_then(|length| length.try_into().ok()).map(u32::from_le_bytes);
    if bytes.starts_with(b"glTF") && length.is_none_or(|length| length < 12) {
        return Err(problem("the header is cut short"));
    }
    let unusable = |error: gltf::Error| problem(error.to_string());
    let Gltf { document, blob } = Gltf::from_slice_without_validation(bytes).map_err(unusable)?;
    let json = document.into_json();
    // The reader's own checks rely on this one.
    let primitives = json.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let mut accessors = primitives.flat_map(|primitive| primitive.attributes.values());
    if accessors.any(|accessor| accessor.value() >= json.accessors.len()) {
        return Err(problem("a mesh names an accessor that does not exist"));
    }
    let file = Document::from_json(json).map_err(unusable)?;
    let blob = blob.as_deref();
    let buffers: Result<Vec<Vec<u8>>, MeshError> =
        file.buffers().map(|buffer| contents(&buffer, blob, folder)).collect();
    let mut collector = Collector { buffers: buffers?, triangles: Triangles::default() };
    match file.default_scene().or_else(|| file.scenes().next()) {
        Some(scene) => collector.nodes(scene.nodes().collect(), file.nodes().len())?,
        None => file.meshes().try_for_each(|mesh| collector.mesh(&mesh, DMat4::IDENTITY))?,
    }
    Ok(collector.triangles)
}

fn problem(text: impl Into<String>) -> MeshError {
    MeshError::Format { format: "glTF", problem: text.into() }
}

fn contents(buffer: &Buffer<'_>, blob: Option<&[u8]>, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
    match buffer.source() {
        Source::Bin => blob.map(<[u8]>::to_vec).ok_or_else(|| problem("it has no binary part")),
        Source::Uri(uri) => match (uri.strip_prefix("data:"), folder) {
            (Some(data), _) => {
                let base64 =
                    data.split_once(";base64,").ok_or_else(|| problem("a buffer is not in base64"))?.1;
                STANDARD.decode(base64).map_err(|error| problem(error.to_string()))
            }
            (None, Some(folder)) if is_beside(uri) => read_bytes(&folder.join(uri.replace("%20", " "))),
            _ => Err(problem("a buffer must be in the file or in its folder")),
        },
    }
}

/// Whether a name is of a file in the same folder or below it.
fn is_beside(uri: &str) -> bool {
    let name = Path::new(uri);
    name.is_relative() && name.components().all(|part| matches!(part, std::path::Component::Normal(_)))
}

struct Collector {
    buffers: Vec<Vec<u8>>,
    triangles: Triangles,
}

impl Collector {
    /// All meshes of `roots` and the nodes below; a file has `count` nodes, each with one parent at most.
    fn nodes(&mut self, roots: Vec<Node<'_>>, count: usize) -> Result<(), MeshError> {
        let mut seen = vec![false; count];
        let mut left: Vec<(Node<'_>, DMat4)> =
            roots.into_iter().map(|node| (node, DMat4::IDENTITY)).collect();
        while let Some((node, parent)) = left.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                return Err(problem(format!("node {} has two parents", node.index())));
            }
            let columns = node.transform().matrix().map(|column| column.map(f64::from));
            let placed = parent * DMat4::from_cols_array_2d(&columns);
            if let Some(mesh) = node.mesh() {
                self.mesh(&mesh, placed)?;
            }
            left.extend(node.children().map(|child| (child, placed)));
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: &Mesh<'_>, placed: DMat4) -> Result<(), MeshError> {
        mesh.primitives().try_for_each(|primitive| self.primitive(&primitive, placed))
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, placed: DMat4) -> Result<(), MeshError> {
        match primitive.mode() {
            Mode::Triangles => (),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return Ok(()),
            Mode::TriangleStrip | Mode::TriangleFan => return Err(problem("strips and fans are not read")),
        }
        let positions =
            primitive.get(&Semantic::Positions).ok_or_else(|| problem("a mesh has no positions"))?;
        if positions.dimensions() != Dimensions::Vec3 || positions.data_type() != DataType::F32 {
            return Err(problem("positions are not three f32 each"));
        }
        let first = self.triangles.vertices.len() as u32;
        let vertices: Vec<DVec3> =
            self.items(&positions)?.map(|item| placed.transform_point3(position(item))).collect();
        let indices: Vec<u32> = match primitive.indices() {
            Some(indices) if indices.dimensions() == Dimensions::Scalar => {
                self.items(&indices)?.map(index).collect()
            }
            Some(_) => return Err(problem("indices are not numbers")),
            None => (0..vertices.len() as u32).collect(),
        };
        self.triangles.vertices.extend(&vertices);
        let mirrored = placed.determinant() < 0.0;
        for corner in indices.chunks_exact(3) {
            // An index beyond the vertices of its own mesh must not meet those of the next.
            let place = |index: u32| if index as usize >= vertices.len() { u32::MAX } else { first + index };
            let [a, b, c] = [place(corner[0]), place(corner[1]), place(corner[2])];
            self.triangles.push(if mirrored { [a, c, b] } else { [a, b, c] })?;
        }
        Ok(())
    }

    /// The bytes of each item of an accessor.
    fn items<'a>(
        &'a self,
        accessor: &Accessor<'_>,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, MeshError> {
        let beyond = || problem(format!("accessor {} lies beyond its buffer", accessor.index()));
        let view = accessor.view().filter(|_| accessor.sparse().is_none());
        let view = view.ok_or_else(|| problem("sparse accessors are not read"))?;
        let (size, count) = (accessor.size(), accessor.count());
        let stride = view.stride().unwrap_or(size).max(1);
        let buffer = self.buffers.get(view.buffer().index()).ok_or_else(beyond)?;
        let end = view.offset().checked_add(view.length()).ok_or_else(beyond)?;
        let data = buffer
            .get(view.offset()..end)
            .and_then(|data| data.get(accessor.offset()..))
            .ok_or_else(beyond)?;
        let last = count.checked_sub(1).ok_or_else(|| problem("an accessor is empty"))?;
        let needed = last.checked_mul(stride).and_then(|start| start.checked_add(size)).ok_or_else(beyond)?;
        let data = data.get(..needed).ok_or_else(beyond)?;
        Ok((0..count).map(move |item| &data[item * stride..item * stride + size]))
    }
}

fn position(item: &[u8]) -> DVec3 {
    let number = |at: usize| {
        item.get(at..at + 4).and_then(|four| four.try_into().ok()).map_or(f32::NAN, f32::from_le_bytes)
    };
    DVec3::new(number(0).into(), number(4).into(), number(8).into())
}

/// A whole number of 1, 2 or 4 bytes.
fn index(item: &[u8]) -> u32 {
    item.iter().rev().fold(0, |high, &byte| high << 8 | u32::from(byte))
}
