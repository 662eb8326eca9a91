import { test } from "node:test";
import assert from "node:assert/strict";
import { Raycaster, Mesh, Vector3 } from "three";
import { DeformedSurface, exaggerated, meanPose } from "../../src/view/bodies.ts";
import { arrange, niceStep } from "../../src/view/layout.ts";
import { Pace, COARSEST, FULL_HZ, LOW_HZ } from "../../src/view/pace.ts";
import { bodyGeometry, clip, wallGeometry, wallPolygon } from "../../src/view/shapes.ts";
import type { BodyInfo } from "../../src/protocol.ts";
import { GRASP, LINE, picture } from "../examples.ts";

const TETRAHEDRON: BodyInfo = {
  name: "soft", kind: "mesh", size_m: [0, 0, 0], radius_m: 0, length_m: 0, fixed: false,
  surface: { vertices_m: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3] },
};

test("a surface follows its vertices, in place, with normals that point out", () => {
  const surface = new DeformedSurface(TETRAHEDRON);
  assert.ok(surface.update(Float32Array.from(TETRAHEDRON.surface?.vertices_m ?? [])));
  const array = surface.geometry.getAttribute("position").array;
  // The last vertex is drawn out to 3.
  assert.ok(surface.update(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 3])));
  assert.equal(surface.geometry.getAttribute("position").array, array);
  const ray = new Raycaster(new Vector3(0.1, 0.1, 10), new Vector3(0, 0, -1));
  const [hit] = ray.intersectObject(new Mesh(surface.geometry));
  assert.ok(hit);
  assert.ok(Math.abs(hit.point.z - 2.4) < 1e-6, `${hit.point.z}`);
  const normal = new Vector3().fromBufferAttribute(surface.geometry.getAttribute("normal"), 3);
  assert.ok(normal.z > 0, "the tip's normal points away from the body");
});

test("a surface that does not fit the body's triangles is not drawn", () => {
  assert.equal(new DeformedSurface(TETRAHEDRON).update(new Float32Array(9)), false);
  assert.equal(new DeformedSurface({ ...TETRAHEDRON, surface: null }).update(new Float32Array(12)), false);
});

test("the mean of copies does not care for the sign of a quaternion", () => {
  const half = Math.SQRT1_2;
  const mean = meanPose([
    { position_m: [0, 0, 0], orientation_xyzw: [0, 0, half, half] },
    { position_m: [0.2, 0, 0], orientation_xyzw: [0, 0, -half, -half] },
  ]);
  assert.ok(Math.abs(mean.position_m[0] - 0.1) < 1e-12);
  assert.ok(Math.abs(Math.abs(mean.orientation_xyzw[2]) - half) < 1e-12);
  const apart = exaggerated({ position_m: [0.2, 0, 0], orientation_xyzw: [0, 0, 0, 1] }, mean, 10);
  assert.ok(Math.abs(apart.position_m[0] - 1.1) < 1e-12);
});

test("bodies are as large as they say", () => {
  const size = (body: Partial<BodyInfo>) => {
    const geometry = bodyGeometry({ ...TETRAHEDRON, ...body });
    geometry.computeBoundingBox();
    return geometry.boundingBox?.getSize(new Vector3()).toArray().map((value) => Number(value.toFixed(3)));
  };
  assert.deepEqual(size({ kind: "box", size_m: [0.2, 0.12, 0.05] }), [0.2, 0.12, 0.05]);
  assert.deepEqual(size({ kind: "ball", radius_m: 0.04 }), [0.08, 0.08, 0.08]);
  assert.deepEqual(size({ kind: "capsule", radius_m: 0.03, length_m: 0.08 }), [0.06, 0.14, 0.06]);
  assert.deepEqual(size({}), [1, 1, 1]);
});

test("the table is under what stands on it, and hands on a line stand apart from each other and the body", () => {
  const grasp = arrange(GRASP, picture(GRASP, 0));
  assert.ok(Math.abs(grasp.ground + 0.025) < 1e-9, `${grasp.ground}`);
  assert.deepEqual(grasp.beside, [[0, 0, 0], [0, 0, 0]]);
  const four = arrange({ ...LINE, users: ["a", "b", "c", "d"] }, picture(LINE, 0));
  const rows = four.beside.map((beside) => beside[1]).sort((a, b) => a - b);
  rows.forEach((row, index) => {
    assert.ok(Math.abs(row) > 0.05);
    assert.ok(index === 0 || row - (rows[index - 1] ?? 0) > 0.03);
  });
});

test("steps of a grid are round", () => {
  assert.deepEqual([0.3, 0.019, 0.05, 7.3, 1].map(niceStep), [0.2, 0.01, 0.05, 5, 1]);
});

test("a wall ends where the others and the table begin", () => {
  const layout = arrange(GRASP, picture(GRASP, 0));
  const right = GRASP.walls[0];
  assert.ok(right);
  const polygon = wallPolygon(right, GRASP.walls, layout, "plane");
  assert.equal(polygon.length, 4);
  for (const { x, y, z } of polygon) {
    assert.ok(Math.abs(x - 0.14) < 1e-9 && Math.abs(y) < 0.1401 && z > layout.ground - 1e-9, `${x} ${y} ${z}`);
  }
  const slab = wallGeometry(polygon, right, layout);
  slab?.computeBoundingBox();
  assert.ok((slab?.boundingBox?.max.x ?? 0) > 0.1401, "it is behind the plane that pushes");
  assert.equal(slab?.boundingBox?.min.x.toFixed(6), "0.140000");
  assert.equal(clip(polygon, new Vector3(9, 0, 0), new Vector3(1, 0, 0)).length, 0);
  assert.equal(wallGeometry([], right, layout), null);
});

test("a slow browser asks for fewer pictures, then for coarser ones; a quick one goes back to all", () => {
  const pace = new Pace();
  const frames = (took_ms: number, count: number) => { for (let i = 0; i < count; i++) pace.frame(took_ms); };
  frames(50, 20);
  assert.deepEqual([pace.hz, pace.coarseness], [LOW_HZ, 0]);
  frames(50, 20);
  assert.deepEqual([pace.hz, pace.coarseness], [LOW_HZ, 1]);
  frames(50, 200);
  assert.equal(pace.coarseness, COARSEST);
  frames(5000, 100);
  frames(17, 120);
  assert.deepEqual([pace.hz, pace.coarseness], [FULL_HZ, COARSEST]);
});
