// Where things are drawn: how large the scene is, where its table stands, and where hands on a line find room.
import type { BodyPose, Picture } from "../picture.ts";
import type { About, BodyInfo, Vector } from "../protocol.ts";

/** Half the side of the box that stands for a body without a surface, m. */
const POINT_HALF_M = 0.025;
/** How far things on a line are expected to move to each side, m. */
const LINE_REACH_M = 0.2;
/** Walls further away are not part of the picture, m. */
const FAR_M = 1.5;

export interface Layout {
  /** What the camera looks at, and how far from it the scene reaches. */
  centre: Vector;
  radius: number;
  /** Height of the table, m. */
  ground: number;
  /** Lines of the table are so far apart, m. */
  grid: number;
  /** Of fingers as drawn, m. */
  fingerRadius: number;
  /** Length of the arrow of one newton, m. */
  metresPerNewton: number;
  /** Where each user's hand is drawn, from where it is: on a line hands stand beside a rigid body. */
  beside: Vector[];
  /** How far the camera is turned to the side at first, radians: what gives way is seen better aslant. */
  aslant_rad: number;
}

/** Whether hands stand beside what they hold, on rails. */
export function standsBeside(about: About): boolean {
  return about.space === "line" && !about.soft;
}

export function arrange(about: About, picture: Picture | null): Layout {
  const bodies = picture?.hosts[0]?.bodies ?? [];
  const corners = reach(about, bodies);
  const low = [0, 1, 2].map((axis) => Math.min(...corners.map((corner) => corner[axis] ?? 0)));
  const high = [0, 1, 2].map((axis) => Math.max(...corners.map((corner) => corner[axis] ?? 0)));
  const centre = [0, 1, 2].map((axis) => ((low[axis] ?? 0) + (high[axis] ?? 0)) / 2) as Vector;
  const half = [0, 1, 2].map((axis) => ((high[axis] ?? 0) - (low[axis] ?? 0)) / 2);
  const radius = Math.max(0.05, Math.hypot(...half));
  return {
    centre,
    radius,
    ground: groundHeight(about, low[2] ?? 0),
    grid: niceStep(radius / 4),
    fingerRadius: standsBeside(about) ? Math.max(about.finger_radius_m, 0.012)
      : about.finger_radius_m || 0.03 * radius,
    // The largest force is twice as long as the scene is wide: hands mostly do with a tenth of it.
    metresPerNewton: niceStep((2.2 * radius) / Math.max(1, about.max_force_n)),
    beside: about.users.map((_, user) => (standsBeside(about) ? [0, besideLine(user), 0] : [0, 0, 0])),
    aslant_rad: about.soft ? 0.4 : 0,
  };
}

/** Hands stand in front of the line and behind it, in turn. */
function besideLine(user: number): number {
  const row = Math.floor(user / 2);
  return (user % 2 === 0 ? -1 : 1) * (POINT_HALF_M + 0.06 + 0.05 * row);
}

/** Half the size of the box around a body in its own frame, m. */
export function halfSize(body: BodyInfo): Vector {
  switch (body.kind) {
    case "point":
      return [POINT_HALF_M, POINT_HALF_M, POINT_HALF_M];
    case "ball":
      return [body.radius_m, body.radius_m, body.radius_m];
    case "capsule":
      return [body.radius_m, body.radius_m + body.length_m / 2, body.radius_m];
    case "box":
      return body.size_m.map((size) => size / 2) as Vector;
    default:
      return surfaceReach(body);
  }
}

function surfaceReach(body: BodyInfo): Vector {
  const most: Vector = [0, 0, 0];
  body.surface?.vertices_m.forEach((value, index) => {
    most[index % 3] = Math.max(most[index % 3] ?? 0, Math.abs(value));
  });
  return most;
}

/** Corners of everything that there is at the start. */
function reach(about: About, poses: BodyPose[]): Vector[] {
  const corners: Vector[] = [];
  about.bodies.forEach((body, index) => {
    const at = poses[index]?.position_m ?? [0, 0, 0];
    const half = halfSize(body);
    for (const side of [-1, 1]) corners.push(at.map((value, axis) => value + side * (half[axis] ?? 0)) as Vector);
  });
  if (about.soft) corners.push(...cornersOf(about.soft.surface.vertices_m));
  about.fingers_m.flat().forEach((finger) => corners.push(finger));
  for (const { point_m, normal } of about.walls) {
    if (Math.hypot(...point_m) < FAR_M && (about.space !== "line" || Math.abs(normal[0]) > 0.5)) corners.push(point_m);
  }
  if (standsBeside(about)) corners.push([-LINE_REACH_M, besideLine(0), 0], [LINE_REACH_M, besideLine(1), 0]);
  return corners.length > 0 ? corners : [[0, 0, 0]];
}

/** Two corners of the box around vertices. */
function cornersOf(vertices_m: number[]): Vector[] {
  if (vertices_m.length === 0) return [];
  const [low, high]: Vector[] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  vertices_m.forEach((value, index) => {
    const axis = index % 3;
    if (low) low[axis] = Math.min(low[axis] ?? value, value);
    if (high) high[axis] = Math.max(high[axis] ?? value, value);
  });
  return [low as Vector, high as Vector];
}

function groundHeight(about: About, lowest: number): number {
  const table = about.walls.find((wall) => wall.normal[2] > 0.99);
  return table ? table.point_m[2] : lowest;
}

/** The largest of …, 0.1, 0.2, 0.5, 1, 2, 5, … that is not over `value`. */
export function niceStep(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  const digit = value / power;
  const step = digit >= 4.999 ? 5 : digit >= 1.999 ? 2 : 1;
  return Number((step * power).toPrecision(1));
}
