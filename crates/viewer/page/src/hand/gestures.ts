// What gestures mean, as plain functions: a hold on a hand, and how drags, keys and pinches change it.
import { Matrix4, Ray, Vector3 } from "three";
import type { About, Vector } from "../protocol.ts";

/** Where a hand is drawn to: the fingers keep their places around its centre, turned and moved apart or together. */
export interface Hold {
  centre: Vector;
  /** Of each finger from the centre, m. */
  offsets: Vector[];
  /** Mean distance of the fingers from the centre when the hand is open, m; 0 with one finger. */
  open_m: number;
}

/** The present distance of the fingers from their centre, m. */
export function width(hold: Hold): number {
  if (hold.offsets.length < 2) return 0;
  return hold.offsets.reduce((sum, offset) => sum + Math.hypot(...offset), 0) / hold.offsets.length;
}

/** Begins where the fingers are drawn to already, or where they are: nothing jumps. `rest_m`: the hand when open. */
export function takeHold(fingers_m: Vector[], rest_m: Vector[]): Hold {
  const [centre, offsets] = centred(fingers_m);
  const widest = { centre, offsets: centred(rest_m)[1], open_m: 0 };
  const held = { centre, offsets, open_m: 0 };
  return { ...held, open_m: Math.max(width(held), width(widest)) };
}

function centred(fingers_m: Vector[]): [Vector, Vector[]] {
  const centre = new Vector3();
  fingers_m.forEach((finger) => centre.addScaledVector(new Vector3(...finger), 1 / fingers_m.length));
  return [centre.toArray(), fingers_m.map((finger) => new Vector3(...finger).sub(centre).toArray())];
}

export function targets(hold: Hold): Vector[] {
  return hold.offsets.map((offset) => new Vector3(...hold.centre).add(new Vector3(...offset)).toArray());
}

/** Moves within what the space allows: a line is along x, a plane x and y. */
export function moved(hold: Hold, by_m: Vector, space: About["space"]): Hold {
  const [x, y, z] = hold.centre;
  const free = space === "line" ? [1, 0, 0] : space === "plane" ? [1, 1, 0] : [1, 1, 1];
  const part = (axis: number) => (free[axis] ?? 0) * (by_m[axis] ?? 0);
  return { ...hold, centre: [x + part(0), y + part(1), z + part(2)] };
}

export function turned(hold: Hold, angle_rad: number, axis: Vector): Hold {
  const turn = new Matrix4().makeRotationAxis(new Vector3(...axis).normalize(), angle_rad);
  return { ...hold, offsets: hold.offsets.map((offset) => new Vector3(...offset).applyMatrix4(turn).toArray()) };
}

/** Fingers so far from their centre, m, from closed on a point to open. */
export function widened(hold: Hold, to_m: number): Hold {
  const now = width(hold);
  if (now < 1e-6) return hold;
  // Not quite 0, so that the fingers know which way to open again.
  const factor = Math.max(1e-3 * hold.open_m, Math.min(hold.open_m, to_m)) / now;
  return { ...hold, offsets: hold.offsets.map((offset) => offset.map((part) => factor * part) as Vector) };
}

/** How hard springs that draw the fingers to `drawn` press them towards each other, on average, N. */
export function grip(hold: Hold, drawn: Vector[], fingers_m: Vector[], stiffness_n_per_m: number): number {
  let sum = 0;
  hold.offsets.forEach((offset, index) => {
    const inward = new Vector3(...offset).normalize().negate();
    const stretch = new Vector3(...(drawn[index] ?? [0, 0, 0])).sub(new Vector3(...(fingers_m[index] ?? [0, 0, 0])));
    sum += stretch.dot(inward);
  });
  return (stiffness_n_per_m * sum) / Math.max(1, hold.offsets.length);
}

/** The largest force of a spring, N. */
export function pull(targets_m: Vector[], fingers_m: Vector[], stiffness_n_per_m: number): number {
  const stretches = targets_m.map((target, index) => {
    const finger = fingers_m[index] ?? target;
    return Math.hypot(target[0] - finger[0], target[1] - finger[1], target[2] - finger[2]);
  });
  return stiffness_n_per_m * Math.max(0, ...stretches);
}

/** `hold` with its centre no further from where the fingers are than `reach_m`: no key pulls a spring without end. */
export function leashed(hold: Hold, fingers_m: Vector[], reach_m: number): Hold {
  const [centre] = centred(fingers_m);
  const off = new Vector3(...hold.centre).sub(new Vector3(...centre)).clampLength(0, reach_m);
  return { ...hold, centre: new Vector3(...centre).add(off).toArray() };
}

/**
 * Where the pointer is in a plane through a hand at `centre`: the one in which it moves, or the one that faces the
 * camera, for a line as far as a plane with the line in it can. Null where the pointer looks past it.
 */
export function grasped(ray: Ray, centre: Vector, forward: Vector, space: About["space"]): Vector | null {
  const through = new Vector3(...centre);
  const normal = space === "plane" ? new Vector3(0, 0, 1) : new Vector3(...forward);
  if (space === "line") normal.setX(0);
  if (normal.length() < 0.1) return null;
  normal.normalize();
  const slope = ray.direction.dot(normal);
  if (Math.abs(slope) < 0.05) return null;
  const far = through.sub(ray.origin).dot(normal) / slope;
  return far > 0 ? ray.at(far, new Vector3()).toArray() : null;
}

/** Where an arrow key moves a hand: along the camera's right and up, in the directions that the space has. */
export function keyDirection(
  key: string, right: Vector, up: Vector, forward: Vector, space: About["space"],
): Vector | null {
  const signs: Record<string, [Vector, number]> = {
    ArrowRight: [right, 1], ArrowLeft: [right, -1], ArrowUp: [up, 1], ArrowDown: [up, -1],
    PageUp: [forward, 1], PageDown: [forward, -1],
  };
  const found = signs[key];
  if (!found) return null;
  const [axis, sign] = found;
  if (space === "space") return scaled(axis, sign);
  // The nearest direction of the line or plane, so that a key moves along one axis.
  const axes = space === "line" ? 1 : 2;
  if (key.startsWith("Page") || (space === "line" && axis === up)) return null;
  const flat = axis === up && Math.hypot(up[0], up[1]) < 1e-6 ? forward : axis;
  const largest = axes === 1 || Math.abs(flat[0]) >= Math.abs(flat[1]) ? 0 : 1;
  const direction: Vector = [0, 0, 0];
  direction[largest] = sign * (Math.sign(flat[largest]) || 1);
  return direction;
}

function scaled([x, y, z]: Vector, by: number): Vector { return [by * x, by * y, by * z]; }

/** Two touches: where their middle is, how far they are apart, and how the line between them is turned. */
export interface Pinch {
  middle: [number, number];
  apart: number;
  angle_rad: number;
}

export function pinch([ax, ay]: [number, number], [bx, by]: [number, number]): Pinch {
  return {
    middle: [(ax + bx) / 2, (ay + by) / 2],
    apart: Math.max(1, Math.hypot(bx - ax, by - ay)),
    // Up is positive in space and negative on the screen.
    angle_rad: Math.atan2(ay - by, bx - ax),
  };
}

/** An angle as its equal between -π and π. */
export function nearAngle(angle_rad: number): number {
  return Math.atan2(Math.sin(angle_rad), Math.cos(angle_rad));
}
