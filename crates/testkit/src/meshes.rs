//! Meshes of known shapes, and slow sums over all their triangles.

use std::collections::HashMap;

use glam::DVec3;

/// A triangle mesh whose vertices are shared by their places, to 1 nm.
#[derive(Clone, Default)]
pub struct Mesh {
    /// Places, m.
    pub vertices: Vec<DVec3>,
    /// Three vertices each, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    known: HashMap<[i64; 3], u32>,
}

impl Mesh {
    fn vertex(&mut self, at: DVec3) -> u32 {
        let key = (at * 1e9).round().to_array().map(|value| value as i64);
        *self.known.entry(key).or_insert_with(|| {
            self.vertices.push(at);
            self.vertices.len() as u32 - 1
        })
    }

    fn triangle(&mut self, corners: [DVec3; 3]) {
        let corners = corners.map(|corner| self.vertex(corner));
        self.triangles.push(corners);
    }

    /// Every vertex moved.
    pub fn map(mut self, to: impl Fn(DVec3) -> DVec3) -> Self {
        self.vertices.iter_mut().for_each(|vertex| *vertex = to(*vertex));
        self
    }

    fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|vertex| self.vertices[vertex as usize]))
    }

    /// The distance (m) of `point` from the nearest triangle.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.corners().map(|corners| distance(corners, point)).fold(f64::INFINITY, f64::min)
    }

    /// How many times the surface goes around `point` (van Oosterom & Strackee 1983).
    pub fn winding_number(&self, point: DVec3) -> f64 {
        let solid_angle = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner - point);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * a.dot(b.cross(c)).atan2(below)
        };
        self.corners().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// The distance (m), negative inside.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        let distance = self.distance(point);
        if self.winding_number(point) > 0.5 { -distance } else { distance }
    }
}

/// Distance of a point from a triangle: of its plane where the foot is inside, else of its edges.
fn distance([a, b, c]: [DVec3; 3], point: DVec3) -> f64 {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let inside = |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return (point - a).dot(normal).abs();
    }
    let edge = |from: DVec3, to: DVec3| {
        let along = (to - from).dot(point - from) / (to - from).length_squared().max(1e-300);
        point.distance(from.lerp(to, along.clamp(0.0, 1.0)))
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

/// A ball of about `20·n²` triangles: an icosahedron with every edge in `n` parts.
pub fn ball(radius: f64, n: u32) -> Mesh {
    let golden = f64::midpoint(1.0, 5.0f64.sqrt());
    let mut corners = Vec::new();
    for (one, large) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([
            DVec3::new(0.0, one, large),
            DVec3::new(one, large, 0.0),
            DVec3::new(large, 0.0, one),
        ]);
    }
    let mut mesh = Mesh::default();
    let near = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1) {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    divide(&mut mesh, if outward { [a, b, c] } else { [a, c, b] }, n);
                }
            }
        }
    }
    mesh.map(|vertex| vertex.normalize() * radius)
}

/// Fills a triangle with `n²` small ones.
fn divide(mesh: &mut Mesh, [a, b, c]: [DVec3; 3], n: u32) {
    let at = |i: u32, j: u32| {
        a + (b - a) * (f64::from(i) / f64::from(n)) + (c - a) * (f64::from(j) / f64::from(n))
    };
    for i in 0..n {
        for j in 0..(n - i) {
            mesh.triangle([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 2 <= n {
                mesh.triangle([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
}

/// How far (m) the bumpy ball is from its centre in a direction.
pub fn bumpy_radius(direction: DVec3, radius: f64, height: f64, waves: f64) -> f64 {
    let DVec3 { x, y, z } = direction;
    radius + height * (waves * x).sin() * (waves * y).sin() * (waves * z).cos()
}

/// A ball with bumps and hollows.
pub fn bumpy_ball(radius: f64, height: f64, waves: f64, n: u32) -> Mesh {
    ball(1.0, n).map(|direction| direction * bumpy_radius(direction, radius, height, waves))
}

/// A sheet over (u, v) in the unit square in `n` by `m` cells; closed where `at` says so.
fn sheet(mesh: &mut Mesh, (n, m): (u32, u32), at: impl Fn(f64, f64) -> DVec3) {
    let point = |i: u32, j: u32| at(f64::from(i) / f64::from(n), f64::from(j) / f64::from(m));
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            mesh.triangle([a, b, c]);
            mesh.triangle([a, c, d]);
        }
    }
}

/// A ring around z: `2·n·m` triangles.
pub fn torus(large: f64, small: f64, n: u32, m: u32) -> Mesh {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, (n, m), |u, v| {
        let (u, v) = (u * std::f64::consts::TAU, v * std::f64::consts::TAU);
        let ring = large + small * v.cos();
        DVec3::new(ring * u.cos(), ring * u.sin(), small * v.sin())
    });
    mesh
}

/// An open sheet in the plane z = 0, its outside up, `2·n²` triangles.
pub fn grid(size: f64, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    sheet(&mut mesh, (n, n), |u, v| DVec3::new((u - 0.5) * size, (v - 0.5) * size, 0.0));
    mesh
}

/// A closed box with faces of `2·n²` triangles.
pub fn cuboid(size: DVec3, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-0.5, 0.5] {
            sheet(&mut mesh, (n, n), |u, v| {
                let (u, v) = if side > 0.0 { (u, v) } else { (v, u) };
                let mut at = DVec3::ZERO;
                at[axis] = side;
                at[(axis + 1) % 3] = u - 0.5;
                at[(axis + 2) % 3] = v - 0.5;
                at * size
            });
        }
    }
    mesh
}
