// Shapes of bodies and walls as triangles.
import { BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, SphereGeometry, Vector3 } from "three";
import { RoundedBoxGeometry } from "three/examples/jsm/geometries/RoundedBoxGeometry.js";
import type { BodyInfo, WallInfo } from "../protocol.ts";
import { halfSize, type Layout } from "./layout.ts";

export function bodyGeometry(body: BodyInfo): BufferGeometry {
  switch (body.kind) {
    case "ball":
      return new SphereGeometry(body.radius_m, 48, 32);
    case "capsule":
      return new CapsuleGeometry(body.radius_m, body.length_m, 16, 32);
    case "box":
    case "point": {
      const [x, y, z] = halfSize(body);
      // Barely rounded: the light on its edges shows its form, and its faces are where they feel to be.
      return new RoundedBoxGeometry(2 * x, 2 * y, 2 * z, 3, 0.05 * Math.min(x, y, z));
    }
    default:
      return surfaceGeometry(body) ?? new BoxGeometry(0.01, 0.01, 0.01);
  }
}

/** Sharp edges only: what is drawn around the copies of a body. */
export function outlineSource(body: BodyInfo): BufferGeometry {
  if (body.kind !== "box" && body.kind !== "point") return bodyGeometry(body);
  const [x, y, z] = halfSize(body);
  return new BoxGeometry(2 * x, 2 * y, 2 * z);
}

/** Null for a body without triangles. */
export function surfaceGeometry(body: BodyInfo): BufferGeometry | null {
  if (!body.surface) return null;
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(body.surface.vertices_m), 3));
  geometry.setIndex(body.surface.triangles);
  geometry.computeVertexNormals();
  return geometry;
}

/** How high walls stand over the table, and how thick they look, as shares of the scene's radius. */
const WALL_HEIGHT = 0.3;
const WALL_THICKNESS = 0.03;

/**
 * The part of a wall's plane that is worth showing: a square around the scene, cut off by the other walls, and by the
 * table and a height over it where things move in a plane or on a line.
 */
export function wallPolygon(wall: WallInfo, others: WallInfo[], layout: Layout, space: string): Vector3[] {
  const normal = new Vector3(...wall.normal);
  const along = new Vector3(0, 0, 1).cross(normal);
  if (along.lengthSq() < 1e-6) along.set(1, 0, 0);
  along.normalize();
  const up = normal.clone().cross(along);
  const point = new Vector3(...wall.point_m);
  const centre = new Vector3(...layout.centre);
  centre.addScaledVector(normal, point.clone().sub(centre).dot(normal));
  const reach = 1.5 * layout.radius;
  let polygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a = 0, b = 0]) =>
    centre.clone().addScaledVector(along, a * reach).addScaledVector(up, b * reach));
  const cut = (on: Vector3, inward: Vector3) => { polygon = clip(polygon, on, inward); };
  for (const other of others) {
    if (other !== wall) cut(new Vector3(...other.point_m), new Vector3(...other.normal));
  }
  if (space !== "space" || Math.abs(wall.normal[2]) < 0.5) {
    cut(new Vector3(0, 0, layout.ground), new Vector3(0, 0, 1));
    cut(new Vector3(0, 0, layout.ground + WALL_HEIGHT * layout.radius), new Vector3(0, 0, -1));
  }
  if (space === "line") {
    for (const side of [-1, 1]) cut(new Vector3(0, side * 0.6 * layout.radius, 0), new Vector3(0, -side, 0));
  }
  return polygon;
}

/** The part of a convex polygon on the side of a plane that `inward` points to. */
export function clip(polygon: Vector3[], on: Vector3, inward: Vector3): Vector3[] {
  const height = (point: Vector3) => point.clone().sub(on).dot(inward);
  return polygon.flatMap((point, index) => {
    const next = polygon[(index + 1) % polygon.length] ?? point;
    const [here, there] = [height(point), height(next)];
    const kept = here >= -1e-9 ? [point] : [];
    if (here * there < -1e-18) kept.push(point.clone().lerp(next, here / (here - there)));
    return kept;
  });
}

/** A slab behind a convex polygon; null where nothing of it is left. */
export function wallGeometry(polygon: Vector3[], wall: WallInfo, layout: Layout): BufferGeometry | null {
  if (polygon.length < 3) return null;
  const back = new Vector3(...wall.normal).multiplyScalar(-WALL_THICKNESS * layout.radius);
  const count = polygon.length;
  const vertices = [...polygon, ...polygon.map((point) => point.clone().add(back))];
  const triangles: number[] = [];
  for (let i = 1; i + 1 < count; i++) triangles.push(0, i, i + 1, count, count + i + 1, count + i);
  for (let i = 0; i < count; i++) {
    const next = (i + 1) % count;
    triangles.push(i, count + i, next, next, count + i, count + next);
  }
  const geometry = new BufferGeometry().setFromPoints(vertices);
  geometry.setIndex(triangles);
  const flat = geometry.toNonIndexed();
  flat.computeVertexNormals();
  geometry.dispose();
  return flat;
}
