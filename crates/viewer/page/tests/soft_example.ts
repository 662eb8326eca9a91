// A soft block that two hands press, made up.
import type { Picture, SurfacePicture } from "../src/picture.ts";
import type { About, HostIndex, SoftInfo, Vector } from "../src/protocol.ts";
import { GRASP, picture } from "./examples.ts";

const CELLS: Vector = [14, 4, 3];
const CELL_M = 0.025;

/** The surface of a block of cells, one corner at the origin. */
function block(): SoftInfo["surface"] {
  const vertices_m: number[] = [];
  const triangles: number[] = [];
  const known = new Map<string, number>();
  const vertex = (place: number[]) => {
    const key = place.join();
    const found = known.get(key) ?? vertices_m.push(...place.map((step) => step * CELL_M)) / 3 - 1;
    known.set(key, found);
    return found;
  };
  for (let axis = 0; axis < 3; axis++) {
    const [along, up] = [(axis + 1) % 3, (axis + 2) % 3] as [0 | 1 | 2, 0 | 1 | 2];
    for (const side of [0, CELLS[axis] ?? 0]) {
      for (let a = 0; a < CELLS[along]; a++) {
        for (let b = 0; b < CELLS[up]; b++) {
          const corner = (da: number, db: number) => {
            const place = [0, 0, 0];
            [place[axis], place[along], place[up]] = [side, a + da, b + db];
            return vertex(place);
          };
          const ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)] as [number, number, number, number];
          const [p, q, r, s] = side === 0 ? [ring[0], ring[3], ring[2], ring[1]] : ring;
          triangles.push(p, q, r, p, r, s);
        }
      }
    }
  }
  return { vertices_m, triangles };
}

const SURFACE = block();

export const SOFT: About = {
  ...GRASP,
  scene: "soft-block",
  description: "Two users press a soft block.",
  space: "space",
  fingers_m: [[[0.25, -0.02, 0.05]], [[0.25, 0.12, 0.05]]],
  bodies: [],
  soft: {
    model: "corotational", surface: SURFACE, nodes: 300, tetrahedra: 1008, simulation_hz: 60,
    local_model: { kind: "pi", stiffness_n_per_m: 0, stiffness_ratio: 0.5, integral_n_per_m: 0, integral_ratio: 0.2 },
  },
  walls: [],
};

/** How deep both fingers press, m: the block gives way around them. */
export function pressed(host: HostIndex, depth_m: number): SurfacePicture {
  const step_m = 1e-6;
  const packed: number[] = [];
  for (let at = 0; at < SURFACE.vertices_m.length; at += 3) {
    const [x, y, z] = SURFACE.vertices_m.slice(at, at + 3) as Vector;
    const near = (side: number) => Math.exp(-(((x - 0.25) ** 2 + (y - side) ** 2 + (z - 0.05) ** 2) / 0.035 ** 2));
    const in_m = depth_m * (near(0) - near(0.1));
    packed.push(0, in_m / step_m, (-0.3 * depth_m * x) / step_m, 1000 * (near(0) + near(0.1)) * Math.min(1, 50 * depth_m));
  }
  // As in the message: stress is unsigned.
  return { host, ko_n_per_m: 800 - 100 * host, step_m, step_pa: 4, packed: Int16Array.from(packed, Math.round) };
}

/** Both fingers press by so much; every host has a copy of its own, a little further in at the second. */
export function press(time_s: number, depth_m: number): Picture {
  const one = picture(SOFT, time_s);
  one.hosts.forEach((host, user) => {
    const side = user === 0 ? -1 : 1;
    const at: Vector = [0.25, user === 0 ? depth_m - 0.004 : 0.104 - depth_m, 0.05];
    Object.assign(host.fingers[0]!, {
      position_m: at, force_n: [0, side * 120 * depth_m, 0],
      proxy_m: [at[0], at[1] + side * 0.004, at[2]], phase: user === 0 ? "pre-slide" : "slide",
    });
  });
  one.surfaces = [pressed(0, depth_m), pressed(1, 1.2 * depth_m)];
  return one;
}
