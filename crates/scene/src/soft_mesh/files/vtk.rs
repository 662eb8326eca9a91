//! Legacy VTK files: unstructured grids and polygons, text and binary, up to version 5.1.

use glam::DVec3;

use super::cells::Cells;
use super::scanner::{Encoding, Kind, Scanner};

/// The nodes of many cells: those of cell i are `nodes[starts[i]..starts[i + 1]]`.
#[derive(Default)]
struct Lists {
    starts: Vec<usize>,
    nodes: Vec<u64>,
}

impl Lists {
    fn cells(&self) -> impl Iterator<Item = &[u64]> {
        self.starts.windows(2).map(|ends| self.nodes.get(ends[0]..ends[1]).unwrap_or(&[]))
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Cells, String> {
    let mut file = Scanner::new(bytes);
    let version = file.line().and_then(|line| line.strip_prefix("# vtk DataFile Version "));
    let version = version.ok_or("it does not begin with \"# vtk DataFile Version\"")?;
    let with_offsets = version.trim_start().split('.').next().is_some_and(|major| major >= "5");
    file.line();
    match file.line() {
        Some("ASCII") => (),
        Some("BINARY") => file.encoding = Encoding::BigEndian,
        other => return Err(format!("{:?} is neither ASCII nor BINARY", other.unwrap_or_default())),
    }
    let (mut cells, mut grid, mut kinds) = (Cells::default(), Lists::default(), Vec::new());
    while let Some(word) = file.next_word() {
        match word {
            "DATASET" => check_dataset(&mut file)?,
            "FIELD" => skip_field(&mut file)?,
            "METADATA" => skip_metadata(&mut file),
            "POINTS" => cells.nodes_m = points(&mut file)?,
            "CELLS" => grid = lists(&mut file, with_offsets)?,
            "CELL_TYPES" => kinds = cell_types(&mut file)?,
            "POLYGONS" => add_polygons(&lists(&mut file, with_offsets)?, &mut cells)?,
            "VERTICES" | "LINES" => drop(lists(&mut file, with_offsets)?),
            "CELL_DATA" | "POINT_DATA" => break,
            _ => return Err(file.problem(format_args!("{word:?} is not read"))),
        }
    }
    if grid.cells().count() != kinds.len() {
        return Err(format!("there are {} cells and {} types of cells", grid.cells().count(), kinds.len()));
    }
    for (index, (nodes, &kind)) in grid.cells().zip(&kinds).enumerate() {
        cells.add_vtk(index + 1, kind, nodes)?;
    }
    Ok(cells)
}

fn check_dataset(file: &mut Scanner<'_>) -> Result<(), String> {
    match file.word()? {
        "UNSTRUCTURED_GRID" | "POLYDATA" => Ok(()),
        other => Err(file.problem(format_args!("a data set of type {other:?} is not read"))),
    }
}

/// The kind of number that a word of the file names.
fn kind(file: &mut Scanner<'_>) -> Result<Kind, String> {
    let word = file.word()?;
    Ok(match word.to_ascii_lowercase().as_str() {
        "char" | "signed_char" => Kind::I8,
        "unsigned_char" => Kind::U8,
        "short" => Kind::I16,
        "unsigned_short" => Kind::U16,
        "int" => Kind::I32,
        "unsigned_int" => Kind::U32,
        "long" | "vtkidtype" | "vtktypeint64" => Kind::I64,
        "unsigned_long" | "vtktypeuint64" => Kind::U64,
        "float" => Kind::F32,
        "double" => Kind::F64,
        _ => return Err(file.problem(format_args!("{word:?} is not a kind of number that is read"))),
    })
}

/// Goes to the numbers after a line of words.
fn to_numbers(file: &mut Scanner<'_>) {
    file.line();
}

/// Up to the next empty line.
fn skip_metadata(file: &mut Scanner<'_>) {
    file.line();
    while file.line().is_some_and(|line| !line.is_empty()) {}
}

fn skip_field(file: &mut Scanner<'_>) -> Result<(), String> {
    file.word()?;
    let arrays = file.count_in_words()?;
    for _ in 0..file.check_count(arrays)? {
        // An array may have METADATA before the name of the next one.
        while file.word()? == "METADATA" {
            skip_metadata(file);
        }
        let (components, tuples) = (file.count_in_words()?, file.count_in_words()?);
        let kind = kind(file)?;
        to_numbers(file);
        for _ in 0..file.check_count(components.saturating_mul(tuples))? {
            file.number(kind)?;
        }
    }
    Ok(())
}

fn points(file: &mut Scanner<'_>) -> Result<Vec<DVec3>, String> {
    let count = file.count_in_words()?;
    let kind = kind(file)?;
    to_numbers(file);
    let count = file.check_count(count)?;
    let point = |_| Ok(DVec3::new(file.number(kind)?, file.number(kind)?, file.number(kind)?));
    (0..count).map(point).collect()
}

fn cell_types(file: &mut Scanner<'_>) -> Result<Vec<u64>, String> {
    let count = file.count_in_words()?;
    to_numbers(file);
    let count = file.check_count(count)?;
    (0..count).map(|_| file.whole(Kind::I32)).collect()
}

/// Up to version 4 every cell is the count of its nodes and the nodes; from 5 on there are two arrays.
fn lists(file: &mut Scanner<'_>, with_offsets: bool) -> Result<Lists, String> {
    let (first, second) = (file.count_in_words()?, file.count_in_words()?);
    to_numbers(file);
    let (first, second) = (file.check_count(first)?, file.check_count(second)?);
    if with_offsets {
        let starts = array(file, "OFFSETS", first)?;
        let nodes = array(file, "CONNECTIVITY", second)?;
        let is_rising = starts.windows(2).all(|ends| ends[0] <= ends[1]);
        if !is_rising || starts.last().is_some_and(|&end| end > second) {
            return Err(file.problem("the offsets of the cells are not in order"));
        }
        return Ok(Lists { starts: starts.iter().map(|&start| start as usize).collect(), nodes });
    }
    let mut lists = Lists { starts: vec![0], nodes: Vec::new() };
    for _ in 0..first {
        let count = file.count(Kind::I32)?;
        for _ in 0..count {
            lists.nodes.push(file.whole(Kind::I32)?);
        }
        lists.starts.push(lists.nodes.len());
    }
    Ok(lists)
}

fn array(file: &mut Scanner<'_>, name: &str, count: u64) -> Result<Vec<u64>, String> {
    let word = file.word()?;
    if word != name {
        return Err(file.problem(format_args!("{word:?} is in place of {name}")));
    }
    let kind = kind(file)?;
    to_numbers(file);
    (0..count).map(|_| file.whole(kind)).collect()
}

/// Polygons are cut into fans.
fn add_polygons(lists: &Lists, cells: &mut Cells) -> Result<(), String> {
    for (index, polygon) in lists.cells().enumerate() {
        for two in polygon.windows(2).skip(1) {
            cells.add_triangle(index + 1, &[polygon[0], two[0], two[1]])?;
        }
    }
    Ok(())
}
