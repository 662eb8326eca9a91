//! Which nodes a matrix joins, and in which order they are eliminated.

use glam::DVec3;

use super::dissection::nested_dissection;

/// Where the 3 × 3 block of a pair of nodes is in a [`super::BlockMatrix`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSlot {
    /// The block's place in the matrix's list.
    pub(super) block: u32,
    /// Whether it is kept transposed, because only one of (a, b) and (b, a) is.
    pub(super) turned: bool,
}

/// The pattern of a symmetric matrix of 3 × 3 blocks, one row of blocks for each node that is not fixed, and the order of
/// elimination.
#[derive(Clone, Debug)]
pub struct Symbolic {
    /// Of every node: its place in the order of elimination.
    position: Vec<Option<u32>>,
    /// The free nodes in the order of elimination.
    order: Vec<u32>,
    /// Where the blocks below the diagonal of every column begin, in `rows`; and where the last one ends.
    pub(super) column_start: Vec<u32>,
    /// In which row each block below the diagonal is; ascending in a column.
    pub(super) rows: Vec<u32>,
}

impl Symbolic {
    /// The pattern of a mesh: nodes at `rest_m`, of which some are `fixed`, joined by `edges` (in either direction; repeated
    /// ones count once).
    ///
    /// # Panics
    /// When an edge names a node that does not exist, or `fixed` is not as long as `rest_m`.
    #[must_use]
    pub fn new(rest_m: &[DVec3], fixed: &[bool], edges: &[[u32; 2]]) -> Self {
        assert_eq!(rest_m.len(), fixed.len());
        let free: Vec<u32> = (0..rest_m.len() as u32).filter(|&node| !fixed[node as usize]).collect();
        let mut number = vec![None; rest_m.len()];
        for (index, &node) in free.iter().enumerate() {
            number[node as usize] = Some(index as u32);
        }
        let neighbours = neighbours(free.len(), edges, &number);
        let places: Vec<DVec3> = free.iter().map(|&node| rest_m[node as usize]).collect();
        let dissected = nested_dissection(&places, &neighbours);
        let sequence = postordered(&dissected, &neighbours);
        let order = sequence.iter().map(|&index| free[index as usize]).collect();
        Self::ordered(order, &sequence, &neighbours, rest_m.len())
    }

    fn ordered(order: Vec<u32>, sequence: &[u32], neighbours: &[Vec<u32>], nodes: usize) -> Self {
        let mut position = vec![None; nodes];
        for (place, &node) in order.iter().enumerate() {
            position[node as usize] = Some(place as u32);
        }
        let place = inverse(sequence);
        let (mut column_start, mut rows) = (vec![0], Vec::new());
        for (column, &index) in sequence.iter().enumerate() {
            let begin = rows.len();
            let below = neighbours[index as usize].iter().map(|&other| place[other as usize]);
            rows.extend(below.filter(|&row| row as usize > column));
            rows[begin..].sort_unstable();
            column_start.push(rows.len() as u32);
        }
        Self { position, order, column_start, rows }
    }

    /// How many nodes are free.
    #[must_use]
    pub fn free_nodes(&self) -> usize {
        self.order.len()
    }

    /// How many coordinates are free: the length of vectors.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        3 * self.order.len()
    }

    /// The free nodes in the order of elimination.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Where a node is in the order of elimination (its coordinates begin at three times this); `None` if it is fixed.
    #[must_use]
    pub fn position(&self, node: u32) -> Option<usize> {
        self.position[node as usize].map(|position| position as usize)
    }

    /// Where the block (row, column) of two nodes is. `None` if one of them is fixed, or if they are not joined.
    #[must_use]
    pub fn slot(&self, row: u32, column: u32) -> Option<BlockSlot> {
        let (row, column) = (self.position(row)?, self.position(column)?);
        let (later, earlier) = (row.max(column), row.min(column));
        if later == earlier {
            return Some(BlockSlot { block: later as u32, turned: false });
        }
        let below = self.below(earlier);
        let found = self.rows[below.clone()].binary_search(&(later as u32)).ok()?;
        Some(BlockSlot { block: (self.order.len() + below.start + found) as u32, turned: row < column })
    }

    /// The coordinates of the free nodes of a vector per node.
    #[must_use]
    pub fn gather(&self, of_nodes: &[DVec3]) -> Vec<f64> {
        let mut vector = vec![0.0; self.coordinates()];
        self.gather_into(of_nodes, &mut vector);
        vector
    }

    /// As [`Symbolic::gather`], into a vector that exists.
    pub fn gather_into(&self, of_nodes: &[DVec3], vector: &mut [f64]) {
        for (three, &node) in vector.as_chunks_mut::<3>().0.iter_mut().zip(&self.order) {
            *three = of_nodes[node as usize].to_array();
        }
    }

    /// The other way round; fixed nodes are left as they are.
    pub fn scatter(&self, vector: &[f64], of_nodes: &mut [DVec3]) {
        for (three, &node) in vector.as_chunks::<3>().0.iter().zip(&self.order) {
            of_nodes[node as usize] = DVec3::from_array(*three);
        }
    }

    /// The blocks below the diagonal of a column, as a range of `rows`.
    pub(super) fn below(&self, column: usize) -> std::ops::Range<usize> {
        self.column_start[column] as usize..self.column_start[column + 1] as usize
    }

    /// Bytes on the heap.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        8 * self.position.len() + 4 * (self.order.len() + self.column_start.len() + self.rows.len())
    }
}

/// The free neighbours of every free node, by their numbers among the free ones.
fn neighbours(count: usize, edges: &[[u32; 2]], number: &[Option<u32>]) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); count];
    for &[a, b] in edges {
        if let (Some(a), Some(b)) = (number[a as usize], number[b as usize])
            && a != b
        {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}

/// An equivalent order in which every subtree of the elimination tree stands together, so that columns of like pattern are
/// neighbours and make supernodes.
fn postordered(order: &[u32], neighbours: &[Vec<u32>]) -> Vec<u32> {
    let parents = elimination_tree(order, neighbours);
    let mut children = vec![Vec::new(); order.len()];
    let mut stack = Vec::new();
    for (column, parent) in parents.iter().enumerate().rev() {
        match parent {
            Some(parent) => children[*parent].push(column),
            None => stack.push((column, false)),
        }
    }
    let mut sequence = Vec::with_capacity(order.len());
    while let Some((column, done)) = stack.pop() {
        if done {
            sequence.push(order[column]);
        } else {
            stack.push((column, true));
            stack.extend(children[column].iter().map(|&child| (child, false)));
        }
    }
    sequence
}

/// The elimination tree (Liu 1990) of the columns in `order`: the first row below the diagonal of each column of the factor.
fn elimination_tree(order: &[u32], neighbours: &[Vec<u32>]) -> Vec<Option<usize>> {
    let place = inverse(order);
    let mut parents = vec![None; order.len()];
    let mut ancestors: Vec<Option<usize>> = vec![None; order.len()];
    for (row, &index) in order.iter().enumerate() {
        for &other in &neighbours[index as usize] {
            let mut column = place[other as usize] as usize;
            while column < row {
                match ancestors[column].replace(row) {
                    Some(ancestor) => column = ancestor,
                    None => {
                        parents[column] = Some(row);
                        break;
                    }
                }
            }
        }
    }
    parents
}

fn inverse(order: &[u32]) -> Vec<u32> {
    let mut place = vec![0; order.len()];
    for (position, &index) in order.iter().enumerate() {
        place[index as usize] = position as u32;
    }
    place
}
