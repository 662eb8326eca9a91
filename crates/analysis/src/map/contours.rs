//! From verdicts at points to curves around what is stable (marching squares).
//!
//! Every grid line between different verdicts has its crossing; in every cell the crossings are joined so that what is
//! stable lies to the left (with x to the right and y up). Where a cell's corners are stable and unstable in turn, the
//! verdict in its middle says which two belong together.

use std::collections::BTreeMap;

/// The line between two neighbouring points: from the given one to the right, or up. Places are one more than those of
/// the map, so that there is room around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Edge {
    pub(super) x: usize,
    pub(super) y: usize,
    pub(super) upward: bool,
}

/// The verdicts of a map, or of a map that nothing stable surrounds.
pub(super) struct Verdicts<'a> {
    /// Row after row.
    pub(super) stable: &'a [Vec<bool>],
    /// Whether there is a rim of unstable points around the map.
    pub(super) rim: bool,
}

impl Verdicts<'_> {
    fn size(&self) -> (usize, usize) {
        (self.stable.first().map_or(0, Vec::len), self.stable.len())
    }

    /// At a place, counted from 1 within the map.
    fn at(&self, x: usize, y: usize) -> bool {
        let (columns, rows) = self.size();
        (1..=columns).contains(&x) && (1..=rows).contains(&y) && self.stable[y - 1][x - 1]
    }

    /// All lines between points of different verdicts.
    pub(super) fn changes(&self) -> Vec<Edge> {
        let (xs, ys) = self.places();
        let mut edges = Vec::new();
        for y in ys.clone() {
            for x in xs.clone() {
                let mut add = |upward, other: (usize, usize)| {
                    let is_there = xs.contains(&other.0) && ys.contains(&other.1);
                    if is_there && self.at(x, y) != self.at(other.0, other.1) {
                        edges.push(Edge { x, y, upward });
                    }
                };
                add(false, (x + 1, y));
                add(true, (x, y + 1));
            }
        }
        edges
    }

    fn places(&self) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let (columns, rows) = self.size();
        if self.rim { (0..columns + 2, 0..rows + 2) } else { (1..columns + 1, 1..rows + 1) }
    }

    /// Cells whose corners are stable and unstable in turn, by their first corner.
    pub(super) fn saddles(&self) -> Vec<(usize, usize)> {
        let cells = self.cells();
        cells.filter(|&(x, y)| self.exits(x, y).len() > 1).collect()
    }

    fn cells(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (xs, ys) = self.places();
        let (columns, rows) =
            (xs.start..xs.end.max(xs.start + 1) - 1, ys.start..ys.end.max(ys.start + 1) - 1);
        rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    /// Around a cell, counter-clockwise: where one leaves what is stable.
    fn exits(&self, x: usize, y: usize) -> Vec<usize> {
        let corner = |number: usize| {
            let (across, up) = [(0, 0), (1, 0), (1, 1), (0, 1)][number % 4];
            self.at(x + across, y + up)
        };
        (0..4).filter(|&side| corner(side) && !corner(side + 1)).collect()
    }

    /// For each crossing, the next one along the boundary.
    fn links(&self, middle_is_stable: &dyn Fn(usize, usize) -> bool) -> BTreeMap<Edge, Edge> {
        let mut links = BTreeMap::new();
        for (x, y) in self.cells() {
            let exits = self.exits(x, y);
            let side = |number: usize| match number % 4 {
                0 => Edge { x, y, upward: false },
                1 => Edge { x: x + 1, y, upward: true },
                2 => Edge { x, y: y + 1, upward: false },
                _ => Edge { x, y, upward: true },
            };
            let entries: Vec<usize> = (0..4).filter(|&number| self.enters(x, y, number)).collect();
            // Around a stable middle the unstable corners are cut off: on to the next entry; else back to the last one.
            let forward = exits.len() > 1 && middle_is_stable(x, y);
            for exit in exits {
                let distance =
                    |&entry: &usize| if forward { (entry + 4 - exit) % 4 } else { (exit + 4 - entry) % 4 };
                if let Some(entry) = entries.iter().copied().min_by_key(distance) {
                    links.insert(side(exit), side(entry));
                }
            }
        }
        links
    }

    fn enters(&self, x: usize, y: usize, side: usize) -> bool {
        let corner = |number: usize| {
            let (across, up) = [(0, 0), (1, 0), (1, 1), (0, 1)][number % 4];
            self.at(x + across, y + up)
        };
        !corner(side) && corner(side + 1)
    }

    /// The crossings in order, curve after curve; a closed curve ends where it began.
    pub(super) fn curves(&self, middle_is_stable: &dyn Fn(usize, usize) -> bool) -> Vec<Vec<Edge>> {
        let mut links = self.links(middle_is_stable);
        let targets: std::collections::BTreeSet<Edge> = links.values().copied().collect();
        let open: Vec<Edge> = links.keys().copied().filter(|edge| !targets.contains(edge)).collect();
        let mut curves: Vec<Vec<Edge>> = open.into_iter().map(|first| walk(&mut links, first)).collect();
        while let Some(&first) = links.keys().next() {
            curves.push(walk(&mut links, first));
        }
        // Where there are no cells, every crossing stands alone.
        if self.cells().next().is_none() {
            curves.extend(self.changes().into_iter().map(|edge| vec![edge]));
        }
        curves
    }
}

fn walk(links: &mut BTreeMap<Edge, Edge>, first: Edge) -> Vec<Edge> {
    let mut curve = vec![first];
    let mut last = first;
    while let Some(next) = links.remove(&last) {
        curve.push(next);
        last = next;
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(rows: &[&str]) -> Vec<Vec<bool>> {
        rows.iter().rev().map(|row| row.chars().map(|c| c == '#').collect()).collect()
    }

    /// Twice the area within closed curves of crossings that lie in the middle of their lines.
    fn twice_area(curves: &[Vec<Edge>]) -> f64 {
        let place = |edge: &Edge| {
            let (x, y) = (edge.x as f64, edge.y as f64);
            if edge.upward { (x, y + 0.5) } else { (x + 0.5, y) }
        };
        let cross = |pair: &[Edge]| {
            let (a, b) = (place(&pair[0]), place(&pair[1]));
            a.0 * b.1 - b.0 * a.1
        };
        curves.iter().flat_map(|curve| curve.windows(2)).map(cross).sum()
    }

    #[test]
    fn an_island_is_one_closed_curve_with_the_stable_side_left() {
        let stable = map(&[".....", ".##..", ".###.", "....."]);
        let curves = Verdicts { stable: &stable, rim: false }.curves(&|_, _| false);
        assert_eq!(curves.len(), 1);
        assert_eq!(curves[0].first(), curves[0].last());
        assert!(twice_area(&curves) > 0.0);
        let hole: Vec<Vec<bool>> =
            stable.iter().map(|row| row.iter().map(|point| !point).collect()).collect();
        assert!(twice_area(&Verdicts { stable: &hole, rim: false }.curves(&|_, _| false)) < 0.0);
        // With a rim, the map's own edge is part of the outline.
        assert!(twice_area(&Verdicts { stable: &hole, rim: true }.curves(&|_, _| false)) > 0.0);
    }

    #[test]
    fn a_boundary_that_leaves_the_map_is_open() {
        let stable = map(&["..##", "..##", ".###"]);
        let curves = Verdicts { stable: &stable, rim: false }.curves(&|_, _| false);
        assert_eq!((curves.len(), curves[0].len()), (1, 4));
        assert_ne!(curves[0].first(), curves[0].last());
    }

    #[test]
    fn a_saddle_is_joined_or_parted_by_its_middle() {
        let stable = map(&["....", ".#..", "..#.", "...."]);
        let verdicts = Verdicts { stable: &stable, rim: false };
        assert_eq!(verdicts.saddles(), [(2, 2)]);
        assert_eq!(verdicts.curves(&|_, _| true).len(), 1);
        assert_eq!(verdicts.curves(&|_, _| false).len(), 2);
    }

    #[test]
    fn thin_maps_have_crossings_only() {
        let row = map(&[".##..#"]);
        assert_eq!(Verdicts { stable: &row, rim: false }.curves(&|_, _| false).len(), 3);
        let column = map(&["#", ".", "."]);
        assert_eq!(Verdicts { stable: &column, rim: false }.curves(&|_, _| false).len(), 1);
        assert!(Verdicts { stable: &map(&["##"]), rim: false }.curves(&|_, _| false).is_empty());
    }
}
