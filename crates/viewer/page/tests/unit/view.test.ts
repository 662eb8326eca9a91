import { test } from "node:test";
import assert from "node:assert/strict";
import { type Color, Raycaster, Mesh, Vector3 } from "three";
import { exaggerated, meanPose } from "../../src/view/bodies.ts";
import { arrange, niceStep } from "../../src/view/layout.ts";
import { Pace, COARSEST, FULL_HZ, LOW_HZ } from "../../src/view/pace.ts";
import { bodyGeometry, clip, wallGeometry, wallPolygon } from "../../src/view/shapes.ts";
import type { BodyInfo, SoftInfo } from "../../src/protocol.ts";
import { ownSurface } from "../../src/view/soft.ts";
import { ColourScale, mapped, roundUp } from "../../src/view/colourmap.ts";
import { Skin, Weave } from "../../src/view/skin.ts";
import { length, pressure } from "../../src/view/tools.ts";
import type { SurfacePicture } from "../../src/picture.ts";
import { GRASP, LINE, picture } from "../examples.ts";
import { press, SOFT } from "../soft_example.ts";

const TETRAHEDRON: BodyInfo = {
  name: "soft", kind: "mesh", size_m: [0, 0, 0], radius_m: 0, length_m: 0, fixed: false,
  surface: { vertices_m: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3] },
};

const SKIN: SoftInfo = {
  ...SOFT.soft!, surface: { vertices_m: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3] },
};
/** The last vertex of four is drawn 2 m up, the one before it is stressed with 32 kPa. */
const DRAWN: SurfacePicture = {
  host: 0, ko_n_per_m: 1, step_m: 1e-3, step_pa: 0.5,
  packed: Int16Array.from([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1536, 0, 0, 2000, 0]),
};

test("a surface follows its vertices, in place, with normals that point out", () => {
  const skin = new Skin(new Weave(SKIN));
  const array = skin.geometry.getAttribute("position").array;
  assert.ok(skin.update(DRAWN));
  assert.equal(skin.geometry.getAttribute("position").array, array);
  const ray = new Raycaster(new Vector3(0.1, 0.1, 10), new Vector3(0, 0, -1));
  const [hit] = ray.intersectObject(new Mesh(skin.geometry));
  assert.ok(hit);
  assert.ok(Math.abs(hit.point.z - 2.4) < 1e-6, `${hit.point.z}`);
  assert.ok((hit.normal?.z ?? 0) > 0, "its upper side points up");
  assert.deepEqual([...skin.displacement_m], [0, 0, 0, 2]);
  assert.deepEqual([...skin.stress_pa], [0, 0, 32000, 0]);
  skin.update(null);
  assert.equal(skin.displacement_m[3], 0, "without a surface it rests");
});

test("faces that meet at a sharp edge are lit apart, those of a round surface together; every edge is there once", () => {
  const block = new Weave(SOFT.soft!);
  const vertices = SOFT.soft!.surface.vertices_m.length / 3;
  // Eight corners of three faces, and edges of two: 4 of each length less its ends.
  assert.equal(block.source.length - vertices, 8 * 2 + 4 * (13 + 3 + 2));
  // Of a closed surface: three edges a triangle, each in two.
  assert.equal(block.edges.length / 2, (block.triangles.length / 3) * 1.5);
  const round = new Weave({ ...SKIN, surface: { vertices_m: [0, 0, 0, 1, 0, 0, 1, 1, 0.2, 0, 1, 0], triangles: [0, 1, 2, 0, 2, 3] } });
  assert.equal(round.source.length, 4);
});

test("a surface of another object is not drawn", () => {
  const skin = new Skin(new Weave(SKIN));
  assert.equal(skin.update({ ...DRAWN, packed: new Int16Array(12) }), false);
  assert.equal(skin.displacement_m[3], 0);
});

test("the colour map goes from light to dark in even steps", () => {
  const lab = Array.from({ length: 17 }, (_, index) => toOklab(mapped(index / 16)));
  const steps = lab.slice(1).map((colour, index) => Math.hypot(...colour.map((value, axis) => value - (lab[index]?.[axis] ?? 0))));
  assert.ok(Math.max(...steps) < 1.1 * Math.min(...steps), steps.map((step) => step.toFixed(4)).join(" "));
  lab.slice(1).forEach(([lightness], index) => assert.ok(lightness < (lab[index]?.[0] ?? 0), `darker at ${index + 1}`));
  assert.ok(mapped(7).equals(mapped(1)) && mapped(-1).equals(mapped(0)) && mapped(NaN).equals(mapped(0)));
});

test("a colour scale is longer at once, and shorter when nothing has been large for a while", () => {
  const scale = new ColourScale(0.001);
  scale.follow(1e-6, 0);
  assert.equal(scale.limit, 0.001);
  scale.follow(0.013, 0.1);
  assert.equal(scale.limit, 0.02);
  for (let time_s = 0.2; time_s < 2; time_s += 0.1) scale.follow(0.003, time_s);
  assert.equal(scale.limit, 0.02);
  for (let time_s = 2; time_s < 3; time_s += 0.1) scale.follow(0.003, time_s);
  assert.equal(scale.limit, 0.005);
  scale.follow(Infinity, 4);
  assert.equal(scale.limit, 0.005);
  assert.deepEqual([0.013, 0.05, 1, 7.1, 300].map(roundUp), [0.02, 0.05, 1, 10, 500]);
  assert.deepEqual([pressure(200), pressure(5000), pressure(2e6), length(0.005)], ["200 Pa", "5 kPa", "2 MPa", "5 mm"]);
});

test("of several copies the one that is felt is the solid one", () => {
  const one = press(1, 0.01);
  assert.equal(ownSurface(one, 1)?.host, 1);
  assert.equal(ownSurface(one, null)?.host, 0);
  assert.equal(ownSurface({ ...one, surfaces: [] }, 1), null);
});

test("a soft object is within the picture, its hands are where they are, even on a line", () => {
  const layout = arrange({ ...SOFT, space: "line" }, null);
  assert.deepEqual(layout.beside, [[0, 0, 0], [0, 0, 0]]);
  assert.ok(layout.radius > 0.17 && layout.aslant_rad > 0);
  assert.ok(Math.abs(layout.centre[0] - 0.175) < 1e-9 && Math.abs(layout.ground) < 1e-9);
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

/** Lightness and two axes of colour, as they look (Ottosson 2020). */
function toOklab({ r, g, b }: Color): [number, number, number] {
  const l = Math.cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const m = Math.cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const s = Math.cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return [
    0.2104542553 * l + 0.793617785 * m - 0.0040720468 * s,
    1.9779984951 * l - 2.428592205 * m + 0.4505937099 * s,
    0.0259040371 * l + 0.7827717662 * m - 0.808675766 * s,
  ];
}
