//! A TOML text as a tree in which every node knows its place; the text and the overrides meet in it.

use std::collections::BTreeMap;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Place, Problem, SceneError};

/// A value and where it was written.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) content: Content,
}

/// A value as written; numbers keep their text, so that rates can be taken exactly.
#[derive(Clone, Debug)]
pub(crate) enum Content {
    Text(String),
    Integer(i64),
    Float { value: f64, text: String },
    Flag(bool),
    Date(String),
    List(Vec<Node>),
    Table(Table),
}

pub(crate) type Table = BTreeMap<String, Node>;

/// The tree of a text.
///
/// # Errors
/// Every place at which the text is not TOML.
pub(crate) fn parse(text: &str, label: &str) -> Result<Table, Vec<SceneError>> {
    let lines = Lines::of(text, label.into());
    let (document, errors) = DeTable::parse_recoverable(text);
    if errors.is_empty() {
        return Ok(lines.table(document.into_inner()));
    }
    let describe = |error: &toml::de::Error| SceneError {
        place: lines.place(error.span().map_or(0, |span| span.start)),
        problem: Problem::Syntax(one_line(error.message())),
    };
    let mut described: Vec<SceneError> = errors.iter().map(describe).collect();
    // After a slip the reader stumbles over the rest of that line; the first complaint about a line says it all.
    described.sort_by_key(|error| error.place.order());
    described.dedup_by_key(|error| error.place.order());
    Err(described)
}

/// The value in `text` as TOML, if it is one; every part of it is at `place`.
pub(crate) fn parse_value(text: &str, place: &Place) -> Option<Node> {
    let document = format!("value = {text}");
    let mut table = DeTable::parse(&document).ok()?.into_inner();
    let value = table.remove("value").filter(|_| table.is_empty())?;
    let mut node = Lines::of("", "".into()).node(0, value.into_inner());
    node.put_at(place);
    Some(node)
}

/// Turns byte offsets into lines.
struct Lines {
    starts: Vec<usize>,
    label: Arc<str>,
}

impl Lines {
    fn of(text: &str, label: Arc<str>) -> Self {
        let breaks = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n');
        Self { starts: breaks.map(|(offset, _)| offset + 1).collect(), label }
    }

    fn place(&self, offset: usize) -> Place {
        let line = 1 + self.starts.partition_point(|&start| start <= offset);
        Place::File { label: self.label.clone(), line: Some(line) }
    }

    fn table(&self, table: DeTable<'_>) -> Table {
        let node = |(key, value): (Spanned<_>, Spanned<DeValue<'_>>)| {
            let offset = key.span().start;
            (std::borrow::Cow::into_owned(key.into_inner()), self.node(offset, value.into_inner()))
        };
        table.into_iter().map(node).collect()
    }

    fn node(&self, offset: usize, value: DeValue<'_>) -> Node {
        let content = match value {
            DeValue::String(text) => Content::Text(text.into_owned()),
            DeValue::Integer(integer) => match i64::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(value) => Content::Integer(value),
                // Too long for a whole number; as a decimal it is out of every range and gets its own message.
                Err(_) => float(integer.as_str()),
            },
            DeValue::Float(number) => float(number.as_str()),
            DeValue::Boolean(flag) => Content::Flag(flag),
            DeValue::Datetime(date) => Content::Date(date.to_string()),
            DeValue::Array(list) => Content::List(
                list.into_iter().map(|item| self.node(item.span().start, item.into_inner())).collect(),
            ),
            DeValue::Table(table) => Content::Table(self.table(table)),
        };
        Node { place: self.place(offset), content }
    }
}

fn float(text: &str) -> Content {
    Content::Float { value: text.parse().unwrap_or(f64::NAN), text: text.trim_start_matches('+').to_owned() }
}

impl Node {
    /// A text at `place`.
    pub(crate) fn text(text: &str, place: Place) -> Self {
        Self { place, content: Content::Text(text.to_owned()) }
    }

    /// A decimal at `place`, for numbers that TOML spells differently (`.5`, `5.`).
    pub(crate) fn decimal(text: &str, place: Place) -> Self {
        Self { place, content: float(text) }
    }

    /// What was found, for a message: short and in one line.
    pub(crate) fn found(&self) -> String {
        match &self.content {
            Content::Text(text) => format!("\"{}\"", shorten(text)),
            Content::Integer(value) => value.to_string(),
            Content::Float { text, .. } | Content::Date(text) => shorten(text),
            Content::Flag(flag) => flag.to_string(),
            Content::List(items) => {
                let items: Vec<String> = items.iter().take(LONGEST).map(Self::found).collect();
                format!("[{}]", shorten(&items.join(", ")))
            }
            Content::Table(_) => "a table".to_owned(),
        }
    }

    fn put_at(&mut self, place: &Place) {
        self.place = place.clone();
        match &mut self.content {
            Content::List(items) => items.iter_mut().for_each(|item| item.put_at(place)),
            Content::Table(table) => table.values_mut().for_each(|node| node.put_at(place)),
            _ => (),
        }
    }
}

/// Takes the node at `path` out of `table`, and tables that become empty with it.
pub(crate) fn take(table: &mut Table, path: &str) -> Option<Node> {
    let Some((first, rest)) = path.split_once('.') else { return table.remove(path) };
    let Content::Table(inner) = &mut table.get_mut(first)?.content else { return None };
    let taken = take(inner, rest)?;
    if inner.is_empty() {
        table.remove(first);
    }
    Some(taken)
}

/// The node at `path`.
pub(crate) fn find<'a>(table: &'a Table, path: &str) -> Option<&'a Node> {
    let Some((first, rest)) = path.split_once('.') else { return table.get(path) };
    match &table.get(first)?.content {
        Content::Table(inner) => find(inner, rest),
        _ => None,
    }
}

/// Puts `node` at `path`, in place of what was there; an element of a list is named by its number, from 1.
///
/// # Errors
/// The part of the path that exists but has nothing inside, or the number of an element that does not exist.
pub(crate) fn put(table: &mut Table, path: &[&str], node: Node) -> Result<(), String> {
    let Some((first, rest)) = path.split_first() else { return Ok(()) };
    if rest.is_empty() {
        table.insert((*first).to_owned(), node);
        return Ok(());
    }
    let empty = || Node { place: node.place.clone(), content: Content::Table(Table::new()) };
    put_into(table.entry((*first).to_owned()).or_insert_with(empty), first, rest, node)
}

fn put_into(parent: &mut Node, name: &str, path: &[&str], node: Node) -> Result<(), String> {
    match &mut parent.content {
        Content::Table(inner) => put(inner, path, node),
        Content::List(items) => {
            let (number, rest) = (path[0], &path[1..]);
            let count = items.len();
            let index = number.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
            let item = index.and_then(|index| items.get_mut(index));
            let item =
                item.ok_or_else(|| format!("{name} is a list whose elements are numbered 1 to {count}"))?;
            if rest.is_empty() {
                *item = node;
                return Ok(());
            }
            put_into(item, number, rest, node)
        }
        _ => Err(format!("{name} is a value, not a table")),
    }
}

/// Longest piece of a text that a message repeats, in characters.
const LONGEST: usize = 60;

/// At most 60 characters, with nothing in it that would break a line or a terminal.
pub(crate) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}

fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
