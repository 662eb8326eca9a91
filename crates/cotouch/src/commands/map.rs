//! `cotouch analyze stability --sweep …`.

use std::fmt::Write as _;

use cotouch_analysis::{StabilityMap, Sweep, SweepError, stability_map};
use cotouch_scene::Override;

use super::prediction;
use crate::failure::{Failure, Verdict};
use crate::figure::map::map_picture;
use crate::output::Output;

/// Characters of a map on a terminal.
const COLUMNS: usize = 64;
const ROWS: usize = 24;
/// Crossings that people are shown.
const MAX_CROSSINGS: usize = 24;

/// Says where in the plane of two keys a scene is stable.
pub(super) fn map(
    name: &str,
    x: &Sweep,
    y: Option<&Sweep>,
    with_radius: bool,
    overrides: &[Override],
    output: &Output,
) -> Result<Verdict, Failure> {
    let scene = cotouch_scene::load(name, overrides)?;
    let ending = output.file.as_deref().and_then(|file| file.extension()).and_then(|ending| ending.to_str());
    // The picture of one key is the curve of its radius.
    let needs_radius = with_radius || (y.is_none() && ending == Some("svg"));
    let progress = output.progress("analysing");
    let mut map =
        stability_map(&scene, x, y, needs_radius, &|share| progress.show(share)).map_err(failure)?;
    drop(progress);
    let title = format!("{}: {}", scene.name, prediction::who_and_how(&scene));
    let file_text = match ending {
        Some("svg") => Some(map_picture(&format!("Where {} is stable", scene.name), &map)?),
        Some("csv") => Some(csv(&map)),
        _ => None,
    };
    if !with_radius {
        map.spectral_radius = None;
    }
    let text = text(&title, &map);
    match file_text {
        Some(file_text) => output.answer_and_file(&map, &text, &file_text)?,
        None => output.answer_as(&map, &text)?,
    }
    Ok(Verdict::Good)
}

/// What the user asked for cannot be, or the analysis failed.
pub(super) fn failure(error: SweepError) -> Failure {
    match error {
        SweepError::Analysis(error) => Failure::Running(error.into()),
        error => Failure::usage(error),
    }
}

fn text(title: &str, map: &StabilityMap) -> String {
    let mut text = format!("{title}\n\n");
    match &map.y {
        Some(y) => write_plane(&mut text, map, y),
        None => write_line(&mut text, map),
    }
    let points = map.stable.iter().map(Vec::len).sum::<usize>();
    let stable = map.stable.iter().flatten().filter(|&&stable| stable).count();
    let share = 100.0 * stable as f64 / points as f64;
    let curves = match (map.boundary.len(), map.y.is_some()) {
        (0, _) => "no boundary".to_owned(),
        (1, true) => "1 boundary curve".to_owned(),
        (count, true) => format!("{count} boundary curves"),
        (1, false) => "1 crossing".to_owned(),
        (count, false) => format!("{count} crossings"),
    };
    let _ = writeln!(
        text,
        "stable at {stable} of {points} points ({share:.1} %), {curves}; {} points analysed",
        map.evaluated
    );
    if let Some(reason) = &map.empty {
        let _ = writeln!(text, "{reason}");
    } else if stable == points {
        let _ = writeln!(text, "The scene is stable all over this range; there is no boundary in it.");
    }
    let sweeps_a_rate = |sweep: &Sweep| sweep.key.starts_with("rates.");
    if map.spectral_radius.is_some() && (sweeps_a_rate(&map.x) || map.y.as_ref().is_some_and(sweeps_a_rate)) {
        let _ = writeln!(
            text,
            "note: a spectral radius is per pattern of ticks and network steps, and patterns of other rates take other times."
        );
    }
    text
}

/// Rows from the largest y down.
fn write_plane(text: &mut String, map: &StabilityMap, y: &Sweep) {
    let (xs, ys) = (map.x.values.values(), y.values.values());
    let (columns, rows) = (xs.len().min(COLUMNS), ys.len().min(ROWS));
    let _ = writeln!(text, "{:>12}  {}", "", y.key);
    let rising = ys.first() <= ys.last();
    for row in 0..rows {
        let row_of_map = if rising { rows - 1 - row } else { row };
        let within = share_of(row_of_map, rows, ys.len());
        let label = match row {
            0 => number(ys.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            _ if row + 1 == rows => number(ys.iter().copied().fold(f64::INFINITY, f64::min)),
            _ => String::new(),
        };
        let line: String =
            (0..columns)
                .map(|column| {
                    let across = share_of(column, columns, xs.len());
                    let block = map.stable[within.clone()].iter().flat_map(|row| &row[across.clone()]);
                    let (stable, unstable) = block.fold((0, 0), |(stable, unstable), &point| {
                        if point { (stable + 1, unstable) } else { (stable, unstable + 1) }
                    });
                    match (stable, unstable) {
                        (_, 0) => '#',
                        (0, _) => '.',
                        _ => '+',
                    }
                })
                .collect();
        let _ = writeln!(text, "{label:>12} |{line}");
    }
    let (first, last) = (number(xs[0]), number(xs[xs.len() - 1]));
    let gap = columns.saturating_sub(first.len()).max(last.len() + 1);
    let _ = writeln!(text, "{:>12}  {}{:>gap$}  {}", "", first, last, map.x.key);
    let _ = writeln!(text, "{:>12}  # stable  . unstable  + both\n", "");
}

/// The places that one of `pieces` of `count` places has.
fn share_of(piece: usize, pieces: usize, count: usize) -> std::ops::Range<usize> {
    piece * count / pieces..(piece + 1) * count / pieces
}

fn write_line(text: &mut String, map: &StabilityMap) {
    let xs = map.x.values.values();
    let columns = xs.len().min(COLUMNS);
    let line: String = (0..columns)
        .map(|column| {
            let block = &map.stable[0][share_of(column, columns, xs.len())];
            match block.iter().filter(|&&stable| stable).count() {
                0 => '.',
                stable if stable == block.len() => '#',
                _ => '+',
            }
        })
        .collect();
    let _ = writeln!(text, "{}: {} to {}", map.x.key, number(xs[0]), number(xs[xs.len() - 1]));
    let _ = writeln!(text, "  {line}\n  # stable  . unstable  + both\n");
    for point in map.boundary.iter().flatten().take(MAX_CROSSINGS) {
        let next = xs.windows(2).position(|pair| (pair[0] - point[0]) * (pair[1] - point[0]) <= 0.0);
        let turns = match next.map(|place| map.stable[0][place]) {
            Some(true) => "turns unstable",
            _ => "turns stable",
        };
        let _ = writeln!(text, "{turns} at {}", number(point[0]));
    }
    if map.boundary.len() > MAX_CROSSINGS {
        let _ = writeln!(text, "and {} more; --json has all of them", map.boundary.len() - MAX_CROSSINGS);
    }
}

/// Six digits are enough for people.
fn number(value: f64) -> String {
    let digits = if value == 0.0 { 0 } else { (5 - value.abs().log10().floor() as i32).clamp(0, 9) };
    let text = format!("{value:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// One line a point.
pub(crate) fn csv(map: &StabilityMap) -> String {
    let mut text = map.x.key.clone();
    if let Some(y) = &map.y {
        let _ = write!(text, ",{}", y.key);
    }
    text.push_str(if map.spectral_radius.is_some() { ",stable,spectral_radius\n" } else { ",stable\n" });
    for (row, verdicts) in map.stable.iter().enumerate() {
        for (column, stable) in verdicts.iter().enumerate() {
            let _ = write!(text, "{:?}", map.x.values.values()[column]);
            if let Some(y) = &map.y {
                let _ = write!(text, ",{:?}", y.values.values()[row]);
            }
            let _ = write!(text, ",{stable}");
            if let Some(radii) = &map.spectral_radius {
                let _ = write!(text, ",{:?}", radii[row][column]);
            }
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn a_map(y: Option<&str>) -> StabilityMap {
        let scene = cotouch_scene::load("single-axis-centralized", &[]).unwrap();
        let x = "coupling.remote_hand_object.stiffness_n_per_m=10..3010:7".parse().unwrap();
        let y = y.map(|y| y.parse().unwrap());
        stability_map(&scene, &x, y.as_ref(), false, &|_| ()).unwrap()
    }

    #[test]
    fn a_map_is_drawn_with_its_largest_row_on_top() {
        let map = a_map(Some("coupling.hand_object.stiffness_n_per_m=100..8100:5"));
        let text = text("title", &map);
        let rows: Vec<&str> = text.lines().filter(|line| line.contains('|')).collect();
        assert_eq!(rows.len(), 5);
        assert!(
            rows[0].trim_start().starts_with("8100") && rows[4].trim_start().starts_with("100"),
            "{text}"
        );
        let row = |index: usize| -> String {
            map.stable[index].iter().map(|&stable| if stable { '#' } else { '.' }).collect()
        };
        assert!(rows[0].ends_with(&row(4)) && rows[4].ends_with(&row(0)), "{text}");
        assert!(text.contains("of 35 points") && text.contains("boundary curve"), "{text}");
        assert_eq!(csv(&map).lines().count(), 36);
    }

    #[test]
    fn one_key_has_a_list_of_crossings() {
        let text = text("title", &a_map(None));
        assert!(text.contains("turns unstable at") && text.contains("1 crossing"), "{text}");
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [(0.0, "0"), (10_000.0, "10000"), (0.123_456_789, "0.123457"), (-2.5, "-2.5")] {
            assert_eq!(number(value), text);
        }
    }
}
