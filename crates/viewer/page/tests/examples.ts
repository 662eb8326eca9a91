// A session and its pictures, made up: what a page shows in tests that have no server.
import type { HostPicture, Picture } from "../src/picture.ts";
import type { About, SessionMessage } from "../src/protocol.ts";

export const GRASP: About = {
  scene: "grasp",
  description: "Two users with two fingers each carry a box on a table, between walls.",
  architecture: "distributed",
  copies: true,
  users: ["anna", "ben"],
  fingers_m: [[[-0.03, -0.093, 0], [-0.03, 0.093, 0]], [[0.03, -0.093, 0], [0.03, 0.093, 0]]],
  space: "plane",
  control_hz: 1024,
  network_hz: 128,
  delay_periods: 1,
  max_force_n: 20,
  finger_radius_m: 0.008,
  bodies: [{ name: "object", kind: "box", size_m: [0.2, 0.12, 0.05], radius_m: 0, length_m: 0, fixed: false, surface: null }],
  soft: null,
  walls: [
    { name: "right", point_m: [0.14, 0, 0], normal: [-1, 0, 0] },
    { name: "left", point_m: [-0.14, 0, 0], normal: [1, 0, 0] },
    { name: "back", point_m: [0, 0.14, 0], normal: [0, -1, 0] },
    { name: "front", point_m: [0, -0.14, 0], normal: [0, 1, 0] },
  ],
};

export const LINE: About = {
  ...GRASP,
  scene: "single-axis",
  description: "Two hands move one object on a line; every host keeps a copy of it (distributed).",
  space: "line",
  fingers_m: [[[0, 0, 0]], [[0, 0, 0]]],
  bodies: [{ name: "object", kind: "point", size_m: [0.1, 0.1, 0.1], radius_m: 0.05, length_m: 0.1, fixed: false, surface: null }],
  walls: [],
};

export function session(about: About): SessionMessage {
  return {
    type: "session", version: "test", generation: 1, mode: "live", about, controls: [], may_change: true, recordings: [],
  };
}

/** The session after `time_s`: the object swings along x, the copies a little apart. */
export function picture(about: About, time_s: number): Picture {
  const swing = 0.03 * Math.sin(2 * time_s);
  const host = (index: number): HostPicture => ({
    host: index,
    touches_wall: false,
    diverged: false,
    ticks: Math.round(1024 * time_s),
    missed: 3,
    lateness_us: 40 + 10 * Math.sin(7 * time_s),
    energy_j: 0.01 * time_s,
    fingers: (about.fingers_m[index] ?? []).map(([x, y, z]) => ({
      position_m: [x + swing, 0.75 * y, z],
      force_n: [2 * Math.sin(2 * time_s), about.space === "line" ? 0 : -Math.sign(y) * 2, 0],
      proxy_m: about.space === "line" ? null : [x + swing, 0.73 * y, z],
      target_m: null,
      phase: about.space === "line" ? "free" : "pre-slide",
      governor_acted: 0,
      governor_gain: 1,
      energy_j: 0.005 * time_s,
    })),
    bodies: about.bodies.map(() => ({
      position_m: [swing + 0.004 * index, 0, 0],
      orientation_xyzw: [0, 0, Math.sin(0.1 * swing), Math.cos(0.1 * swing)],
    })),
    links: about.users.map((_, peer) => peer).filter((peer) => peer !== index).map((peer) => ({
      peer, present: true, round_trip_ms: 0.2, jitter_ms: 0.05, received: Math.round(128 * time_s), lost: 0,
    })),
  });
  return {
    generation: 1, time_s, ended: false, verdict: "quiet", verdict_now: "quiet", fast_force_n: 1e-3,
    hosts: about.users.map((_, index) => host(index)), surfaces: [],
  };
}
