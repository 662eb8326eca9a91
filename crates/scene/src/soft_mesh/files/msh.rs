//! Gmsh MSH 2.2 and 4.1, text and binary, as Gmsh's reference manual has them.

use std::collections::HashMap;

use glam::DVec3;

use super::cells::Cells;
use super::scanner::{Encoding, Kind, Scanner};

/// Which nodes have which tags.
type Tags = HashMap<u64, u64>;

pub(super) fn read(bytes: &[u8]) -> Result<Cells, String> {
    let mut file = Scanner::new(bytes);
    if file.next_word() != Some("$MeshFormat") {
        return Err("it does not begin with $MeshFormat".to_owned());
    }
    let is_four = header(&mut file)?;
    let (mut cells, mut tags) = (Cells::default(), Tags::new());
    while let Some(section) = file.next_word() {
        match (section, is_four) {
            ("$Nodes", false) => nodes_2(&mut file, &mut cells, &mut tags)?,
            ("$Nodes", true) => nodes_4(&mut file, &mut cells, &mut tags)?,
            ("$Elements", false) => elements_2(&mut file, &mut cells, &tags)?,
            ("$Elements", true) => elements_4(&mut file, &mut cells, &tags)?,
            _ => (),
        }
        let Some(name) = section.strip_prefix('$') else {
            return Err(file.problem(format_args!("{section:?} is not a section")));
        };
        file.skip_to(&format!("$End{name}"))?;
    }
    Ok(cells)
}

/// Whether it is version 4.1; sets how numbers are written.
fn header(file: &mut Scanner<'_>) -> Result<bool, String> {
    let (version, binary, size) = (file.word()?, file.word()?, file.word()?);
    let is_four = match version {
        "2" | "2.0" | "2.1" | "2.2" => false,
        "4.1" => true,
        _ => return Err(format!("version {version:?} is not read, but 2.2 and 4.1 are")),
    };
    if size != "8" {
        return Err(format!("its numbers have {size:?} bytes, not 8"));
    }
    match binary {
        "0" => (),
        "1" => {
            file.line();
            file.encoding = Encoding::LittleEndian;
            let one = file.number(Kind::I32)?;
            if one != 1.0 {
                file.encoding = Encoding::BigEndian;
            }
        }
        _ => return Err(format!("{binary:?} is neither text (0) nor binary (1)")),
    }
    file.skip_to("$EndMeshFormat")?;
    Ok(is_four)
}

fn add_node(file: &mut Scanner<'_>, cells: &mut Cells, tags: &mut Tags, tag: u64) -> Result<(), String> {
    let [x, y, z] = [file.number(Kind::F64)?, file.number(Kind::F64)?, file.number(Kind::F64)?];
    if tags.insert(tag, cells.nodes_m.len() as u64).is_some() {
        return Err(file.problem(format_args!("node {tag} comes twice")));
    }
    cells.nodes_m.push(DVec3::new(x, y, z));
    Ok(())
}

fn nodes_2(file: &mut Scanner<'_>, cells: &mut Cells, tags: &mut Tags) -> Result<(), String> {
    for _ in 0..count_line(file)? {
        let tag = file.whole(Kind::I32)?;
        add_node(file, cells, tags, tag)?;
    }
    Ok(())
}

/// A count on a line of its own, in text also in a binary file.
fn count_line(file: &mut Scanner<'_>) -> Result<u64, String> {
    let count = file.count_in_words()?;
    file.line();
    file.check_count(count)
}

fn elements_2(file: &mut Scanner<'_>, cells: &mut Cells, tags: &Tags) -> Result<(), String> {
    let count = count_line(file)?;
    let (mut number, mut nodes) = (0, Vec::new());
    while number < count {
        // In text every element has its own header, after its number.
        let is_text = file.encoding == Encoding::Text;
        if is_text {
            file.whole(Kind::I32)?;
        }
        let kind = file.whole(Kind::I32)?;
        let alike = if is_text { 1 } else { file.count(Kind::I32)?.max(1) };
        let labels = file.count(Kind::I32)?;
        for _ in 0..alike.min(count - number) {
            number += 1;
            if !is_text {
                file.whole(Kind::I32)?;
            }
            for _ in 0..labels {
                file.number(Kind::I32)?;
            }
            element(file, Kind::I32, kind, number, &mut nodes)?;
            add(cells, tags, kind, number, &nodes)?;
        }
    }
    Ok(())
}

/// In binary, the sections of version 4 begin right after the line of their name.
fn begin(file: &mut Scanner<'_>) {
    if file.encoding != Encoding::Text {
        file.line();
    }
}

fn nodes_4(file: &mut Scanner<'_>, cells: &mut Cells, tags: &mut Tags) -> Result<(), String> {
    begin(file);
    let blocks = file.count(Kind::U64)?;
    for _ in 0..3 {
        file.whole(Kind::U64)?;
    }
    for _ in 0..blocks {
        let dimension = file.whole(Kind::I32)?.min(3);
        file.number(Kind::I32)?;
        let parameters = if file.whole(Kind::I32)? == 0 { 0 } else { dimension };
        let count = file.count(Kind::U64)?;
        let block: Result<Vec<u64>, String> = (0..count).map(|_| file.whole(Kind::U64)).collect();
        for tag in block? {
            add_node(file, cells, tags, tag)?;
            for _ in 0..parameters {
                file.number(Kind::F64)?;
            }
        }
    }
    Ok(())
}

fn elements_4(file: &mut Scanner<'_>, cells: &mut Cells, tags: &Tags) -> Result<(), String> {
    begin(file);
    let blocks = file.count(Kind::U64)?;
    for _ in 0..3 {
        file.whole(Kind::U64)?;
    }
    let (mut number, mut nodes) = (0, Vec::new());
    for _ in 0..blocks {
        file.whole(Kind::I32)?;
        file.number(Kind::I32)?;
        let kind = file.whole(Kind::I32)?;
        for _ in 0..file.count(Kind::U64)? {
            number += 1;
            file.whole(Kind::U64)?;
            element(file, Kind::U64, kind, number, &mut nodes)?;
            add(cells, tags, kind, number, &nodes)?;
        }
    }
    Ok(())
}

/// Reads the tags of an element's nodes.
fn element(
    file: &mut Scanner<'_>,
    tag: Kind,
    kind: u64,
    number: u64,
    nodes: &mut Vec<u64>,
) -> Result<(), String> {
    let Some(&(_, count)) = ELEMENTS.get((kind as usize).wrapping_sub(1)) else {
        return Err(file.problem(format_args!("element {number} has type {kind}, which is not read")));
    };
    nodes.clear();
    for _ in 0..count {
        nodes.push(file.whole(tag)?);
    }
    Ok(())
}

fn add(cells: &mut Cells, tags: &Tags, kind: u64, number: u64, nodes: &[u64]) -> Result<(), String> {
    let (shape, _) = ELEMENTS[kind as usize - 1];
    let corners = match shape {
        Shape::Tetrahedron => 4,
        Shape::Triangle => 3,
        Shape::Flat => return Ok(()),
        Shape::OtherVolume => return Err(format!("element {number} of type {kind} is not a tetrahedron")),
    };
    let mut indices = [0; 4];
    for (index, tag) in indices.iter_mut().zip(&nodes[..corners]) {
        *index = *tags
            .get(tag)
            .ok_or_else(|| format!("element {number} names node {tag}, which does not exist"))?;
    }
    if corners == 4 {
        cells.add_tetrahedron(number as usize, &indices)
    } else {
        cells.add_triangle(number as usize, &indices[..3])
    }
}

/// What an element type is, and how many nodes it has.
#[derive(Clone, Copy)]
enum Shape {
    Triangle,
    Tetrahedron,
    /// A point, a line, or of four sides.
    Flat,
    OtherVolume,
}

/// Types 1 to 31 of Gmsh. The corners come first in each.
#[rustfmt::skip]
const ELEMENTS: [(Shape, usize); 31] = {
    use Shape::{Flat, OtherVolume, Tetrahedron, Triangle};
    [
        (Flat, 2), (Triangle, 3), (Flat, 4), (Tetrahedron, 4), (OtherVolume, 8), (OtherVolume, 6), (OtherVolume, 5),
        (Flat, 3), (Triangle, 6), (Flat, 9), (Tetrahedron, 10), (OtherVolume, 27), (OtherVolume, 18), (OtherVolume, 14),
        (Flat, 1), (Flat, 8), (OtherVolume, 20), (OtherVolume, 15), (OtherVolume, 13), (Triangle, 9), (Triangle, 10),
        (Triangle, 12), (Triangle, 15), (Triangle, 15), (Triangle, 21), (Flat, 4), (Flat, 5), (Flat, 6),
        (Tetrahedron, 20), (Tetrahedron, 35), (Tetrahedron, 56),
    ]
};
