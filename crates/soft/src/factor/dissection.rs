//! The order of elimination: nested dissection by the nodes' places.
//!
//! A set of nodes is cut in two across one axis; those of one side that touch the other are the separator, which is
//! eliminated after both. Of several cuts along all three axes the one with the least separator is taken (uneven halves count
//! against it).

use glam::DVec3;

/// Sets of at most so many nodes are not cut.
const LEAF: usize = 6;

/// Cuts are tried at these fractions of a set, along each axis.
const FRACTIONS: [f64; 9] = [0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7];

/// The nodes of a graph in the order of elimination. `neighbours[n]` are the nodes joined to n.
pub(super) fn nested_dissection(places: &[DVec3], neighbours: &[Vec<u32>]) -> Vec<u32> {
    let mut dissection =
        Dissection { places, neighbours, side: vec![Half::Elsewhere; places.len()], order: Vec::new() };
    dissection.order.reserve(places.len());
    dissection.dissect((0..places.len() as u32).collect());
    dissection.order
}

#[derive(Clone, Copy, PartialEq)]
enum Half {
    Elsewhere,
    Low,
    High,
}

struct Dissection<'a> {
    places: &'a [DVec3],
    neighbours: &'a [Vec<u32>],
    side: Vec<Half>,
    order: Vec<u32>,
}

/// A way to cut a set: along which axis, how many nodes are low, which side gives the separator.
struct Bisection {
    cost: f64,
    axis: usize,
    low: usize,
    separator: Half,
}

impl Dissection<'_> {
    fn dissect(&mut self, mut set: Vec<u32>) {
        let cut = if set.len() <= LEAF { None } else { self.best_cut(&mut set) };
        let Some(cut) = cut else {
            self.order.extend(set);
            return;
        };
        self.sort_along(&mut set, cut.axis);
        self.mark(&set, cut.low);
        let belongs = |node: &u32, side: Half| self.side[*node as usize] == side;
        let separates = |node: &u32| belongs(node, cut.separator) && self.touches_other_side(*node);
        let (separator, rest): (Vec<u32>, Vec<u32>) = set.iter().partition(|node| separates(node));
        let (low, high): (Vec<u32>, Vec<u32>) = rest.iter().partition(|node| belongs(node, Half::Low));
        self.unmark(&set);
        drop(set);
        self.dissect(low);
        self.dissect(high);
        self.order.extend(separator);
    }

    fn best_cut(&mut self, set: &mut [u32]) -> Option<Bisection> {
        let mut best: Option<Bisection> = None;
        for axis in 0..3 {
            self.sort_along(set, axis);
            let mut last = 0;
            for fraction in FRACTIONS {
                let low = self.layer_end(set, axis, (fraction * set.len() as f64) as usize);
                if low == last || low == 0 || low == set.len() {
                    continue;
                }
                last = low;
                let cut = self.judge(set, axis, low);
                if best.as_ref().is_none_or(|known| cut.cost < known.cost) {
                    best = Some(cut);
                }
            }
        }
        best
    }

    /// Nodes of regular meshes stand in layers; a cut goes between two of them if one ends soon.
    fn layer_end(&self, set: &[u32], axis: usize, wanted: usize) -> usize {
        let along = |i: usize| self.places[set[i] as usize][axis];
        let slack = 1e-6 * (along(set.len() - 1) - along(0));
        let limit = (wanted + set.len() / 5).min(set.len() - 1);
        (wanted.max(1)..=limit).find(|&i| along(i) - along(i - 1) > slack).unwrap_or(wanted)
    }

    fn judge(&mut self, set: &[u32], axis: usize, low: usize) -> Bisection {
        self.mark(set, low);
        let borders = |nodes: &[u32]| nodes.iter().filter(|&&node| self.touches_other_side(node)).count();
        let (low_border, high_border) = (borders(&set[..low]), borders(&set[low..]));
        self.unmark(set);
        let (separator, size) =
            if low_border <= high_border { (Half::Low, low_border) } else { (Half::High, high_border) };
        let uneven = (2.0 * low as f64 / set.len() as f64 - 1.0).abs();
        Bisection { cost: size as f64 * (1.0 + uneven), axis, low, separator }
    }

    fn sort_along(&self, set: &mut [u32], axis: usize) {
        let place = |node: u32| self.places[node as usize];
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        set.sort_unstable_by(|&a, &b| {
            let compare = |axis: usize| place(a)[axis].total_cmp(&place(b)[axis]);
            compare(axis).then_with(|| compare(second)).then_with(|| compare(third)).then(a.cmp(&b))
        });
    }

    fn mark(&mut self, set: &[u32], low: usize) {
        for (i, &node) in set.iter().enumerate() {
            self.side[node as usize] = if i < low { Half::Low } else { Half::High };
        }
    }

    fn unmark(&mut self, set: &[u32]) {
        for &node in set {
            self.side[node as usize] = Half::Elsewhere;
        }
    }

    fn touches_other_side(&self, node: u32) -> bool {
        let other = match self.side[node as usize] {
            Half::Low => Half::High,
            Half::High => Half::Low,
            Half::Elsewhere => return false,
        };
        self.neighbours[node as usize].iter().any(|&neighbour| self.side[neighbour as usize] == other)
    }
}
