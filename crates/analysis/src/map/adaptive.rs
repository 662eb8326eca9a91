//! All verdicts of a map from few points.
//!
//! A coarse grid is evaluated first. Between its points ln ρ is expected to be what its corners say, give or take a
//! doubt: how far neighbours on the grid are from lying on straight lines (where eigenvalues change places or meet, they
//! are far from it). A cell is filled only where its corners agree and all of them are further from 0 than twice that
//! doubt; else it is divided, the doubt of its parts being what the new points then show, and in the end every point is
//! evaluated. After that the line between different verdicts is walked along: whatever touches it is evaluated, so
//! that an area that was found at one point is found as a whole.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::axis::{Span, spans};
use super::plane::{Plane, Point, height};
use crate::sweep::SweepError;

/// How many times the doubt must fit between a corner and the boundary.
const SAFETY: f64 = 2.0;
/// A part of a cell is doubted at least this much of how the whole was.
const INHERITED: f64 = 0.25;
/// The share of the work that the coarse grid is taken to be.
const AFTER_COARSE: f64 = 0.4;
/// Nearer to 0 than this rounding may decide, so such points are evaluated one by one.
const HAIR: f64 = 1e-9;

/// Part of the plane: the points on its rim belong to it.
#[derive(Clone, Copy, Debug)]
struct Cell {
    x: Span,
    y: Span,
    /// How far ln ρ may be from what the corners say.
    doubt: f64,
}

/// The verdict at every point, row after row.
pub(super) fn verdicts(
    plane: &mut Plane<'_>,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Vec<bool>>, SweepError> {
    let (x_runs, y_runs) = (plane.x.coarse_runs(), plane.y.coarse_runs());
    let places = |runs: &[Vec<usize>]| runs.concat();
    let coarse = places(&y_runs)
        .into_iter()
        .flat_map(|y| places(&x_runs).into_iter().map(move |x| Point { x, y }).collect::<Vec<_>>());
    let coarse: Vec<Point> = coarse.collect();
    let (count, done) = (coarse.len(), AtomicUsize::new(0));
    plane.evaluate(coarse, &|| {
        progress(AFTER_COARSE * (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
    })?;
    let mut cells = coarse_cells(plane, &x_runs, &y_runs);
    let mut stable = vec![vec![false; plane.x.len()]; plane.y.len()];
    let mut share = AFTER_COARSE;
    while !cells.is_empty() {
        progress(share);
        share += 0.5 * (0.8 - share);
        cells = divide(plane, &mut stable, cells)?;
    }
    for point in plane.points() {
        if let Some(verdict) = plane.known(point) {
            stable[point.y][point.x] = verdict.stable;
        }
    }
    progress(share);
    walk_along(plane, &mut stable)?;
    Ok(stable)
}

/// The cells between the points of the coarse grid.
fn coarse_cells(plane: &Plane<'_>, x_runs: &[Vec<usize>], y_runs: &[Vec<usize>]) -> Vec<Cell> {
    let mut cells = Vec::new();
    for x_run in x_runs {
        for y_run in y_runs {
            let doubts: Vec<Vec<f64>> = (0..y_run.len())
                .map(|y| (0..x_run.len()).map(|x| doubt_at(plane, x_run, y_run, x, y)).collect())
                .collect();
            for (i, &x) in spans(x_run).iter().enumerate() {
                for (j, &y) in spans(y_run).iter().enumerate() {
                    let doubt = doubt_around(&doubts, i, j).max(unexplored(plane, x_run, y_run, x, y));
                    cells.push(Cell { x, y, doubt });
                }
            }
        }
    }
    cells
}

/// How far the point in column `x` of the run and row `y` is from straight lines through its neighbours.
fn doubt_at(plane: &Plane<'_>, x_run: &[usize], y_run: &[usize], x: usize, y: usize) -> f64 {
    let at = |x: usize, y: usize| height_at(plane, x_run[x], y_run[y]);
    let bend = |places: &[usize], middle: usize, value: &dyn Fn(usize) -> f64| {
        if middle == 0 || middle + 1 >= places.len() {
            return 0.0;
        }
        let (before, here, after) = (places[middle - 1], places[middle], places[middle + 1]);
        let share = (here - before) as f64 / (after - before) as f64;
        (value(middle) - (1.0 - share) * value(middle - 1) - share * value(middle + 1)).abs()
    };
    bend(x_run, x, &|place| at(place, y)).max(bend(y_run, y, &|place| at(x, place)))
}

/// The largest doubt at the corners of a cell and of its neighbours.
fn doubt_around(doubts: &[Vec<f64>], i: usize, j: usize) -> f64 {
    let near = |place: usize, count: usize| place.saturating_sub(1)..(place + 3).min(count);
    let rows = near(j, doubts.len());
    rows.flat_map(|row| near(i, doubts[row].len()).map(move |column| doubts[row][column])).fold(0.0, f64::max)
}

/// Where a run is too short to show how it bends: how much ln ρ varies over the cell.
fn unexplored(plane: &Plane<'_>, x_run: &[usize], y_run: &[usize], x: Span, y: Span) -> f64 {
    let wide = |span: Span| span.1 - span.0 > 1;
    if wide(x) && x_run.len() < 4 || wide(y) && y_run.len() < 4 {
        let (least, largest) = range(corners(x, y).map(|point| height_at(plane, point.x, point.y)));
        largest - least
    } else {
        0.0
    }
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, largest), value| {
        (least.min(value), largest.max(value))
    })
}

fn corners(x: Span, y: Span) -> impl Iterator<Item = Point> {
    [(x.0, y.0), (x.1, y.0), (x.0, y.1), (x.1, y.1)].into_iter().map(|(x, y)| Point { x, y })
}

/// ln ρ at a point that was evaluated.
fn height_at(plane: &Plane<'_>, x: usize, y: usize) -> f64 {
    plane.known(Point { x, y }).map_or(0.0, height)
}

/// Fills the cells of which the corners tell enough; gives the parts of the others.
fn divide(
    plane: &mut Plane<'_>,
    stable: &mut [Vec<bool>],
    cells: Vec<Cell>,
) -> Result<Vec<Cell>, SweepError> {
    let mut open = Vec::new();
    for cell in cells {
        if cell.x.1 - cell.x.0 <= 1 && cell.y.1 - cell.y.0 <= 1 {
            continue;
        }
        match settled(plane, &cell) {
            Some(verdict) => {
                stable[cell.y.0..=cell.y.1].iter_mut().for_each(|row| row[cell.x.0..=cell.x.1].fill(verdict))
            }
            None => open.push(cell),
        }
    }
    let new: Vec<Point> = open.iter().flat_map(grid_of).collect();
    plane.evaluate(new, &|| ())?;
    Ok(open.iter().flat_map(|cell| parts(plane, cell)).collect())
}

/// The verdict that all points of a cell must have, if there is one.
fn settled(plane: &Plane<'_>, cell: &Cell) -> Option<bool> {
    let mut verdicts = corners(cell.x, cell.y).map(|corner| plane.known(corner));
    let first = verdicts.next()??;
    let agree = verdicts.all(|verdict| verdict.is_some_and(|verdict| verdict.stable == first.stable));
    let nearest = corners(cell.x, cell.y)
        .map(|corner| height_at(plane, corner.x, corner.y).abs())
        .fold(f64::INFINITY, f64::min);
    (agree && nearest > SAFETY * cell.doubt + HAIR).then_some(first.stable)
}

/// The places at which a span is divided, with its ends.
fn halves(span: Span) -> Vec<usize> {
    let mut places = vec![span.0, usize::midpoint(span.0, span.1), span.1];
    places.dedup();
    places
}

/// The corners of the parts of a cell.
fn grid_of(cell: &Cell) -> Vec<Point> {
    let columns = halves(cell.x);
    halves(cell.y).into_iter().flat_map(|y| columns.iter().map(move |&x| Point { x, y })).collect()
}

fn parts(plane: &Plane<'_>, cell: &Cell) -> Vec<Cell> {
    let surprise = grid_of(cell)
        .into_iter()
        .map(|point| (height_at(plane, point.x, point.y) - expected(plane, cell, point)).abs())
        .fold(0.0, f64::max);
    let doubt = surprise.max(INHERITED * cell.doubt);
    let rows = spans(&halves(cell.y));
    spans(&halves(cell.x)).into_iter().flat_map(|x| rows.iter().map(move |&y| Cell { x, y, doubt })).collect()
}

/// What the corners of a cell say about ln ρ at a point of it.
fn expected(plane: &Plane<'_>, cell: &Cell, point: Point) -> f64 {
    let share = |place: usize, span: Span| (place - span.0) as f64 / (span.1 - span.0).max(1) as f64;
    let (across, up) = (share(point.x, cell.x), share(point.y, cell.y));
    let row =
        |y: usize| (1.0 - across) * height_at(plane, cell.x.0, y) + across * height_at(plane, cell.x.1, y);
    (1.0 - up) * row(cell.y.0) + up * row(cell.y.1)
}

/// Evaluates both ends wherever neighbours have different verdicts, until that changes nothing any more.
fn walk_along(plane: &mut Plane<'_>, stable: &mut [Vec<bool>]) -> Result<(), SweepError> {
    loop {
        let (columns, rows) = (plane.x.len(), plane.y.len());
        let mut doubtful = Vec::new();
        for Point { x, y } in plane.points() {
            let mut differs = |other: Point| {
                if stable[y][x] != stable[other.y][other.x] {
                    doubtful.extend([Point { x, y }, other]);
                }
            };
            if x + 1 < columns {
                differs(Point { x: x + 1, y });
            }
            if y + 1 < rows {
                differs(Point { x, y: y + 1 });
            }
        }
        doubtful.retain(|&point| plane.known(point).is_none());
        if doubtful.is_empty() {
            return Ok(());
        }
        plane.evaluate(doubtful.clone(), &|| ())?;
        for point in doubtful {
            if let Some(verdict) = plane.known(point) {
                stable[point.y][point.x] = verdict.stable;
            }
        }
    }
}
