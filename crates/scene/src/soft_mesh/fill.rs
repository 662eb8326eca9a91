//! What is inside a closed surface, as tetrahedra: isosurface stuffing (Labelle & Shewchuk 2007).
//!
//! A body-centred cubic lattice is laid over the object. Points of the lattice that are close to the surface are moved onto it;
//! tetrahedra that it still cuts are cut. All come out well shaped, and the surface is closed; edges and corners of the object
//! are cut off within about half an edge length.

use std::collections::HashMap;

use glam::DVec3;

use super::body::SoftMesh;
use super::error::SoftMeshError;

/// Most cubes of the lattice.
const MAX_CUBES: f64 = 400_000.0;
/// A point of the lattice moves onto the surface when that is nearer than this part of an edge of the cubes, or of an edge to a
/// cube's centre: the paper's values for the best shapes.
const NEAR: (f64, f64) = (0.249_99, 0.411_89);
/// Where a lattice makes a surface that touches itself, finer ones are tried.
const FINER: [f64; 4] = [1.0, 0.93, 0.86, 0.8];
/// Mean length of the edges of the lattice, in edges of its cubes.
const MEAN_EDGE: f64 = 0.92;

/// A solid: how deep a point is inside, m, negative outside; a distance near the surface, but for a factor. And the corners
/// of a box around it, m.
pub(super) struct Solid<F: Fn(DVec3) -> f64> {
    pub(super) depth: F,
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

/// Fills a solid with tetrahedra whose edges are about `edge_m` long.
pub(super) fn fill<F: Fn(DVec3) -> f64>(solid: &Solid<F>, edge_m: f64) -> Result<SoftMesh, SoftMeshError> {
    let mut told = SoftMeshError::Empty;
    for finer in FINER {
        let (nodes, tetrahedra) = Lattice::over(solid, edge_m * finer / MEAN_EDGE)?.stuff();
        match SoftMesh::from_tetrahedra(nodes, tetrahedra) {
            Err(error @ (SoftMeshError::Hinge { .. } | SoftMeshError::Empty)) => told = error,
            done => return done,
        }
    }
    Err(SoftMeshError::NotFilled { edge_m, problem: told.to_string() })
}

/// A point of the lattice or of the cut edge between two of them, the lower first.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Corner {
    /// On an edge of a cube, or between the centres of two.
    CutLong(u32, u32),
    /// On an edge from a cube's corner to its centre.
    CutShort(u32, u32),
    Point(u32),
}

struct Lattice<'a, F: Fn(DVec3) -> f64> {
    solid: &'a Solid<F>,
    low: DVec3,
    /// Edge of a cube, m.
    cube_m: f64,
    /// Cubes along x, y and z.
    cubes: [u32; 3],
    /// Of every point: the corners of the cubes first, then their centres; x running fastest.
    points: Vec<DVec3>,
    /// How deep each is, m; 0 once it lies on the surface.
    depths: Vec<f64>,
    cuts: HashMap<(u32, u32), DVec3>,
}

impl<'a, F: Fn(DVec3) -> f64> Lattice<'a, F> {
    /// A lattice that reaches beyond the solid by a cube and more on every side, in its middle.
    fn over(solid: &'a Solid<F>, cube_m: f64) -> Result<Self, SoftMeshError> {
        let counts = ((solid.high - solid.low) / cube_m).ceil() + DVec3::splat(3.0);
        let all = counts.element_product();
        if all > MAX_CUBES {
            return Err(SoftMeshError::TooLarge { found: (12.0 * all) as usize });
        }
        let low = (solid.low + solid.high) / 2.0 - counts * cube_m / 2.0;
        let cubes = counts.to_array().map(|count| count as u32);
        let corner = |at: [u32; 3]| low + DVec3::from(at.map(f64::from)) * cube_m;
        let mut points: Vec<DVec3> = steps(cubes.map(|count| count + 1)).map(corner).collect();
        points.extend(steps(cubes).map(|at| corner(at) + DVec3::splat(cube_m / 2.0)));
        let depths = points.iter().map(|&point| (solid.depth)(point)).collect();
        Ok(Self { solid, low, cube_m, cubes, points, depths, cuts: HashMap::new() })
    }

    /// Nodes, m, and tetrahedra of positive volume.
    fn stuff(mut self) -> (Vec<DVec3>, Vec<[u32; 4]>) {
        let lattice = self.tetrahedra();
        self.snap(&lattice);
        let mut pieces = Vec::new();
        for &four in &lattice {
            self.inside_of(four, &mut pieces);
        }
        let (mut nodes, mut numbers) = (Vec::new(), HashMap::new());
        let tetrahedra = pieces.iter().map(|&piece| {
            let mut four = piece.map(|corner| {
                *numbers.entry(corner).or_insert_with(|| {
                    nodes.push(self.place(corner));
                    nodes.len() as u32 - 1
                })
            });
            let [a, b, c, d] = four.map(|node| nodes[node as usize]);
            if (b - a).dot((c - a).cross(d - a)) < 0.0 {
                four.swap(2, 3);
            }
            four
        });
        let tetrahedra = tetrahedra.collect();
        (nodes, tetrahedra)
    }

    /// All tetrahedra of the lattice: the centres of two cubes side by side, and an edge of the square between them.
    fn tetrahedra(&self) -> Vec<[u32; 4]> {
        let mut all = Vec::new();
        for at in steps(self.cubes) {
            for axis in (0..3).filter(|&axis| at[axis] + 1 < self.cubes[axis]) {
                let next = ahead(at, axis);
                let (one, other) = ((axis + 1) % 3, (axis + 2) % 3);
                let square = [next, ahead(next, one), ahead(ahead(next, one), other), ahead(next, other)];
                let square = square.map(|at| self.corner(at));
                for side in 0..4 {
                    all.push([self.centre(at), self.centre(next), square[side], square[(side + 1) % 4]]);
                }
            }
        }
        all
    }

    fn corner(&self, [i, j, k]: [u32; 3]) -> u32 {
        let [nx, ny, _] = self.cubes;
        i + (nx + 1) * (j + (ny + 1) * k)
    }

    fn centre(&self, [i, j, k]: [u32; 3]) -> u32 {
        let [nx, ny, nz] = self.cubes;
        (nx + 1) * (ny + 1) * (nz + 1) + i + nx * (j + ny * k)
    }

    /// Both points are corners of cubes, or both are centres.
    fn is_long(&self, one: u32, other: u32) -> bool {
        let first_centre = self.centre([0; 3]);
        (one < first_centre) == (other < first_centre)
    }

    /// Moves points onto the surface that are near to it.
    fn snap(&mut self, lattice: &[[u32; 4]]) {
        let crossing =
            |&(one, other): &(u32, u32)| self.depths[one as usize] * self.depths[other as usize] < 0.0;
        let mut edges: Vec<(u32, u32)> =
            lattice.iter().flat_map(|&four| edges(four)).filter(crossing).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut from: Vec<(u32, u32)> =
            edges.iter().flat_map(|&(one, other)| [(one, other), (other, one)]).collect();
        from.sort_unstable();
        for of_point in from.chunk_by(|one, other| one.0 == other.0) {
            let point = of_point[0].0;
            let here = self.points[point as usize];
            let mut nearest: Option<(f64, DVec3)> = None;
            for &(_, other) in of_point {
                if self.depths[other as usize] == 0.0 {
                    continue;
                }
                let cut = self.cut(point, other);
                let far = here.distance(cut);
                let near = if self.is_long(point, other) { NEAR.0 } else { NEAR.1 * 0.75f64.sqrt() };
                if far < near * self.cube_m && nearest.is_none_or(|(least, _)| far < least) {
                    nearest = Some((far, cut));
                }
            }
            if let Some((_, cut)) = nearest {
                self.points[point as usize] = cut;
                self.depths[point as usize] = 0.0;
            }
        }
    }

    /// Where the surface cuts the edge between two points, neither of which has been moved.
    fn cut(&mut self, one: u32, other: u32) -> DVec3 {
        let key = (one.min(other), one.max(other));
        if let Some(&cut) = self.cuts.get(&key) {
            return cut;
        }
        let [a, b] = [key.0, key.1].map(|point| (self.points[point as usize], self.depths[point as usize]));
        let cut = crossing(&self.solid.depth, a, b);
        self.cuts.insert(key, cut);
        cut
    }

    fn place(&self, corner: Corner) -> DVec3 {
        match corner {
            Corner::Point(point) => self.points[point as usize],
            Corner::CutLong(one, other) | Corner::CutShort(one, other) => {
                self.cuts.get(&(one, other)).copied().unwrap_or(self.low)
            }
        }
    }

    /// The part of a tetrahedron that is inside, as tetrahedra.
    fn inside_of(&mut self, four: [u32; 4], pieces: &mut Vec<[Corner; 4]>) {
        let with = |wanted: fn(f64) -> bool| -> arrayvec::ArrayVec<u32, 4> {
            four.iter().copied().filter(|&point| wanted(self.depths[point as usize])).collect()
        };
        let (inside, on, outside) = (with(|d| d > 0.0), with(|d| d == 0.0), with(|d| d < 0.0));
        let point = Corner::Point;
        match (&inside[..], &on[..], &outside[..]) {
            ([], ..) => (),
            (.., []) => pieces.push(four.map(point)),
            (&[a], zeros, others) => {
                let cuts = others.iter().map(|&out| self.cut_corner(a, out));
                let corners: Vec<Corner> =
                    [point(a)].into_iter().chain(zeros.iter().map(|&zero| point(zero))).chain(cuts).collect();
                pieces.extend(<[Corner; 4]>::try_from(corners));
            }
            (&[a, b], &[zero], &[out]) => {
                let quad = [point(a), point(b), self.cut_corner(b, out), self.cut_corner(a, out)];
                pieces.extend(halves(quad).map(|[x, y, z]| [point(zero), x, y, z]));
            }
            (&[a, b], _, &[c, d]) => pieces.extend(thirds(
                [point(a), self.cut_corner(a, c), self.cut_corner(a, d)],
                [point(b), self.cut_corner(b, c), self.cut_corner(b, d)],
            )),
            (&[a, b, c], ..) => {
                let out = outside[0];
                let cuts = [a, b, c].map(|inside| self.cut_corner(inside, out));
                pieces.extend(thirds([a, b, c].map(point), cuts));
            }
            _ => (),
        }
    }

    fn cut_corner(&mut self, one: u32, other: u32) -> Corner {
        self.cut(one, other);
        let (one, other) = (one.min(other), one.max(other));
        if self.is_long(one, other) { Corner::CutLong(one, other) } else { Corner::CutShort(one, other) }
    }
}

/// All (i, j, k) below `counts`, i running fastest.
fn steps([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}

fn ahead(mut at: [u32; 3], axis: usize) -> [u32; 3] {
    at[axis] += 1;
    at
}

fn edges([a, b, c, d]: [u32; 4]) -> [(u32, u32); 6] {
    [(a, b), (a, c), (a, d), (b, c), (b, d), (c, d)].map(|(one, other)| (one.min(other), one.max(other)))
}

/// Where on the way between two points of opposite signs `depth` is 0, by regula falsi (Illinois).
fn crossing(depth: &impl Fn(DVec3) -> f64, one: (DVec3, f64), other: (DVec3, f64)) -> DVec3 {
    let ((from, mut at_low), (to, mut at_high)) = (one, other);
    let (mut low, mut high) = (0.0, 1.0);
    let small = 1e-9 * (at_low.abs() + at_high.abs());
    let mut part = 0.5;
    for _ in 0..40 {
        part = (low * at_high - high * at_low) / (at_high - at_low);
        let here = depth(from.lerp(to, part));
        if here.abs() <= small {
            break;
        }
        if here * at_high < 0.0 {
            (low, at_low) = (high, at_high);
        } else {
            at_low /= 2.0;
        }
        (high, at_high) = (part, here);
    }
    from.lerp(to, part)
}

/// A quadrilateral, by the diagonal at its first corner in the order of [`Corner`]: two tetrahedra that share it do the same.
fn halves(quad: [Corner; 4]) -> [[Corner; 3]; 2] {
    let first = (0..4).min_by_key(|&index| quad[index]).unwrap_or(0);
    let [a, b, c, d] = [0, 1, 2, 3].map(|step| quad[(first + step) % 4]);
    [[a, b, c], [a, c, d]]
}

/// A prism between two triangles, seen from its first corner: the far triangle, and the halves of the far side.
fn thirds(one: [Corner; 3], other: [Corner; 3]) -> [[Corner; 4]; 3] {
    let (near, far) = if one.iter().min() < other.iter().min() { (one, other) } else { (other, one) };
    let first = (0..3).min_by_key(|&index| near[index]).unwrap_or(0);
    let (next, last) = ((first + 1) % 3, (first + 2) % 3);
    let apex = near[first];
    let [[a, b, c], [d, e, f]] = halves([near[next], near[last], far[last], far[next]]);
    [[apex, far[0], far[1], far[2]], [apex, a, b, c], [apex, d, e, f]]
}
