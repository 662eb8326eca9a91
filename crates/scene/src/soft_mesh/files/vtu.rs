//! VTU: VTK's XML files of unstructured grids; numbers as text, in base64, or appended, as they are or compressed by zlib.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use roxmltree::{Document, Node};

use super::cells::{Cells, MAX_ITEMS};
use super::scanner::{Encoding, Kind, whole};
use crate::mesh::LONGEST_FILE;

/// Where appended numbers begin.
const APPENDED: &[u8] = b"<AppendedData";

pub(super) fn read(bytes: &[u8]) -> Result<Cells, String> {
    let cut = bytes.windows(APPENDED.len()).position(|window| window == APPENDED);
    let (front, back) = bytes.split_at(cut.unwrap_or(bytes.len()));
    let mut text = std::str::from_utf8(front).map_err(|error| error.to_string())?.to_owned();
    if cut.is_some() {
        text.push_str("</VTKFile>");
    }
    let document = Document::parse(&text).map_err(|error| error.to_string())?;
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if !root.has_tag_name("VTKFile") || kind != "UnstructuredGrid" {
        return Err(format!("it is a {kind:?}, not a VTKFile with an UnstructuredGrid"));
    }
    let file = File { appended: Appended::of(back, root)?, ..File::of(root)? };
    let mut cells = Cells::default();
    for piece in root.descendants().filter(|node| node.has_tag_name("Piece")) {
        file.piece(piece, &mut cells)?;
    }
    Ok(cells)
}

/// How the numbers of a file are written.
struct File<'a> {
    encoding: Encoding,
    /// Of the lengths before numbers in binary.
    header: Kind,
    is_compressed: bool,
    appended: Option<Appended<'a>>,
}

/// Numbers after the XML.
struct Appended<'a> {
    bytes: &'a [u8],
    in_base64: bool,
    /// Where arrays begin, ascending.
    starts: Vec<usize>,
}

impl<'a> Appended<'a> {
    /// In the rest of a file from [`APPENDED`] on.
    fn of(back: &'a [u8], root: Node<'_, '_>) -> Result<Option<Self>, String> {
        if back.is_empty() {
            return Ok(None);
        }
        let opened = back.iter().position(|&byte| byte == b'>').ok_or("<AppendedData is cut short")?;
        let tag = String::from_utf8_lossy(&back[..opened]);
        let mark = back[opened..].iter().position(|&byte| byte == b'_');
        let bytes = &back[opened + mark.ok_or("the mark before appended numbers is missing")? + 1..];
        let offsets = root.descendants().filter_map(|node| node.attribute("offset")?.parse().ok());
        let mut starts: Vec<usize> = offsets.collect();
        starts.sort_unstable();
        Ok(Some(Self { bytes, in_base64: tag.contains("base64"), starts }))
    }

    /// The bytes of the array that begins at `offset`; in base64 up to the next one.
    fn array(&self, offset: usize) -> Option<Vec<u8>> {
        let rest = self.bytes.get(offset..)?;
        if !self.in_base64 {
            return Some(rest.to_vec());
        }
        let next = self.starts.iter().find(|&&start| start > offset).map_or(usize::MAX, |next| next - offset);
        let end = rest.iter().position(|&byte| byte == b'<').unwrap_or(rest.len());
        from_base64(rest.get(..end.min(next))?)
    }
}

impl<'a> File<'a> {
    fn of(root: Node<'_, '_>) -> Result<Self, String> {
        let encoding = match root.attribute("byte_order") {
            Some("BigEndian") => Encoding::BigEndian,
            _ => Encoding::LittleEndian,
        };
        let header = match root.attribute("header_type") {
            None | Some("UInt32") => Kind::U32,
            Some("UInt64") => Kind::U64,
            Some(other) => return Err(format!("lengths of type {other:?} are not read")),
        };
        let is_compressed = match root.attribute("compressor") {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => return Err(format!("numbers compressed by {other:?} are not read, but by zlib")),
        };
        Ok(Self { encoding, header, is_compressed, appended: None })
    }

    fn piece(&self, piece: Node<'_, '_>, cells: &mut Cells) -> Result<(), String> {
        let points = piece.children().find(|node| node.has_tag_name("Points"));
        let points = points.and_then(|points| points.children().find(|node| node.has_tag_name("DataArray")));
        let Some(points) = points else { return Ok(()) };
        let before = cells.nodes_m.len() as u64;
        cells.nodes_m.extend(self.numbers(points)?.chunks_exact(3).map(DVec3::from_slice));
        let connectivity = self.whole_numbers(piece, "connectivity")?;
        let (ends, kinds) = (self.whole_numbers(piece, "offsets")?, self.whole_numbers(piece, "types")?);
        if ends.len() != kinds.len() {
            return Err(format!("there are {} cells and {} types of cells", ends.len(), kinds.len()));
        }
        let mut start = 0;
        for (index, (&end, &kind)) in ends.iter().zip(&kinds).enumerate() {
            let nodes = connectivity.get(start as usize..end as usize);
            let nodes = nodes.ok_or_else(|| format!("the nodes of cell {} do not exist", index + 1))?;
            let nodes: Vec<u64> = nodes.iter().map(|&node| node.saturating_add(before)).collect();
            cells.add_vtk(index + 1, kind, &nodes)?;
            start = end;
        }
        Ok(())
    }

    fn whole_numbers(&self, piece: Node<'_, '_>, name: &str) -> Result<Vec<u64>, String> {
        let cells = piece.children().find(|node| node.has_tag_name("Cells"));
        let named =
            |node: &Node<'_, '_>| node.has_tag_name("DataArray") && node.attribute("Name") == Some(name);
        let array = cells.and_then(|cells| cells.children().find(named));
        let numbers = self.numbers(array.ok_or_else(|| format!("the cells have no {name}"))?)?;
        let as_whole = |number| whole(number).ok_or_else(|| format!("{number} is among the {name}"));
        numbers.into_iter().map(as_whole).collect()
    }

    /// The numbers of a DataArray.
    fn numbers(&self, array: Node<'_, '_>) -> Result<Vec<f64>, String> {
        let text = array.text().unwrap_or_default();
        let bytes = match array.attribute("format") {
            None | Some("ascii") => {
                let number = |word: &str| word.parse().map_err(|_| format!("{word:?} is not a number"));
                return text.split_ascii_whitespace().map(number).collect();
            }
            Some("binary") => from_base64(text.as_bytes()),
            Some("appended") => {
                let offset = array.attribute("offset").and_then(|offset| offset.parse().ok());
                self.appended.as_ref().and_then(|appended| appended.array(offset?))
            }
            Some(other) => return Err(format!("numbers in the format {other:?} are not read")),
        };
        let kind = kind(array.attribute("type").unwrap_or_default())?;
        let told =
            || format!("the numbers of {:?} are cut short", array.attribute("Name").unwrap_or_default());
        let bytes = bytes.and_then(|bytes| self.unpack(&bytes)).ok_or_else(told)?;
        if (bytes.len() / kind.size()) as u64 > 4 * MAX_ITEMS {
            return Err("there are too many numbers".to_owned());
        }
        Ok(bytes.chunks_exact(kind.size()).map(|number| kind.decode(number, self.encoding)).collect())
    }

    /// The numbers in what is a length and bytes; or, compressed, the count of blocks, the length of each and of the last,
    /// the compressed lengths, and the blocks.
    fn unpack(&self, bytes: &[u8]) -> Option<Vec<u8>> {
        let size = self.header.size();
        let length = |index: usize| -> Option<usize> {
            let header = bytes.get(index.checked_mul(size)?..)?.get(..size)?;
            usize::try_from(whole(self.header.decode(header, self.encoding))?).ok()
        };
        if !self.is_compressed {
            return Some(bytes.get(size..)?.get(..length(0)?)?.to_vec());
        }
        let (blocks, each) = (length(0)?, length(1)?);
        if blocks.checked_mul(each)? as u64 > LONGEST_FILE {
            return None;
        }
        let mut start = blocks.checked_add(3)?.checked_mul(size)?;
        let mut unpacked = Vec::new();
        for block in 0..blocks {
            let end = start.checked_add(length(3 + block)?)?;
            unpacked.extend(decompress_to_vec_zlib_with_limit(bytes.get(start..end)?, each).ok()?);
            start = end;
        }
        Some(unpacked)
    }
}

fn kind(name: &str) -> Result<Kind, String> {
    Ok(match name {
        "Int8" => Kind::I8,
        "UInt8" => Kind::U8,
        "Int16" => Kind::I16,
        "UInt16" => Kind::U16,
        "Int32" => Kind::I32,
        "UInt32" => Kind::U32,
        "Int64" => Kind::I64,
        "UInt64" => Kind::U64,
        "Float32" => Kind::F32,
        "Float64" => Kind::F64,
        _ => return Err(format!("numbers of type {name:?} are not read")),
    })
}

/// What is in base64: parts that may each end in padding.
fn from_base64(text: &[u8]) -> Option<Vec<u8>> {
    let letters: Vec<u8> = text.iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let mut bytes = Vec::new();
    let mut rest = &letters[..];
    while !rest.is_empty() {
        let padded = rest.chunks(4).position(|four| four.contains(&b'=')).map(|fours| 4 * (fours + 1));
        let (part, after) = rest.split_at(padded.unwrap_or(rest.len()).min(rest.len()));
        bytes.extend(STANDARD.decode(part).ok()?);
        rest = after;
    }
    Some(bytes)
}
