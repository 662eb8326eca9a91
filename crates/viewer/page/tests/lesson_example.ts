// A lesson made up: controls of a line scene, and a server that answers questions with a boundary of its own.
import type { Control, MapAxis, MapMessage, PageMessage, ServerMessage, SessionMessage, Settings } from "../src/protocol.ts";
import { LINE, session } from "./examples.ts";

const slider = (key: string, label: string, unit: string, low: number, high: number, log: boolean): Control => ({
  key, label, unit, help: `${label}: what a test says about it.`, kind: "number", low, high, log, choices: [], restarts: false,
});

export const K_OBJECTS = "coupling.object_object.stiffness_n_per_m";
export const K_REMOTE = "coupling.remote_hand_object.stiffness_n_per_m";

export const CONTROLS: Control[] = [
  { ...slider("session.architecture", "Architecture", "", 0, 0, false), kind: "choice", choices: ["distributed", "centralized"], restarts: true },
  { ...slider("session.users", "Users", "", 2, 8, false), kind: "whole", restarts: true },
  { ...slider("link.delay_periods", "Delay", "periods", 0, 8, false), kind: "whole", restarts: true },
  slider("link.impairment.jitter_s", "Jitter", "s", 0, 0.05, false),
  slider("link.impairment.loss_rate", "Packets lost", "", 0, 0.5, false),
  { ...slider("rates.network_hz", "Packet rate", "Hz", 0, 0, false), kind: "choice", choices: ["32", "64", "128", "256"], restarts: true },
  slider(K_OBJECTS, "Copy to copy, stiffness", "N/m", 10, 10000, true),
  slider("coupling.object_object.damping_n_s_per_m", "Copy to copy, damping", "N·s/m", 0, 100, false),
  slider("coupling.hand_object.stiffness_n_per_m", "Hand to own copy, stiffness", "N/m", 100, 20000, true),
  slider("coupling.hand_object.damping_n_s_per_m", "Hand to own copy, damping", "N·s/m", 0, 100, false),
  slider(K_REMOTE, "Hand to other copy, stiffness", "N/m", 10, 5000, true),
  slider("object.damping_n_s_per_m", "Compensation", "N·s/m", -20, 20, false),
];

export const SETTINGS: Settings = {
  "session.architecture": "distributed", "session.users": 2, "link.delay_periods": 1, "link.impairment.jitter_s": 0,
  "link.impairment.loss_rate": 0, "rates.network_hz": "128", [K_OBJECTS]: 300, "coupling.object_object.damping_n_s_per_m": 10,
  "coupling.hand_object.stiffness_n_per_m": 3000, "coupling.hand_object.damping_n_s_per_m": 20, [K_REMOTE]: 400,
  "object.damping_n_s_per_m": 0,
};

/** Of a soft object. */
export const SOFT_CONTROLS: Control[] = [
  { ...slider("local_model.kind", "Local model", "", 0, 0, false), kind: "choice", choices: ["hold", "p", "pi", "compliance"] },
  slider("local_model.stiffness_ratio", "Local model: stiffness K_h", "K_o", 0, 2.5, false),
  slider("local_model.integral_ratio", "Local model: integral INT", "K_o", 0, 2.5, false),
  { ...slider("rates.simulation_hz", "Simulation rate", "Hz", 0, 0, false), kind: "choice", choices: ["32", "64"], restarts: true },
  { ...slider("soft.young_pa", "Young's modulus", "Pa", 3000, 1.2e6, true), restarts: true },
  { ...slider("link.delay_periods", "Delay", "periods", 0, 8, false), kind: "whole", restarts: true },
];

/** The running session has this lesson. */
export function lesson(mayChange = true): SessionMessage {
  return { ...session(LINE), controls: CONTROLS, may_change: mayChange };
}

/** The made-up law: unstable where both stiffnesses together are over 2000 N/m. */
export const radiusAt = (x: number, y: number) => ((x + y) / 2000) ** 0.1;

type Question = Extract<PageMessage, { type: "predict" }>;

/** All answers to a question about a session with `running` settings. */
export function answers({ id, settings, margin, map }: Question, running: Settings = SETTINGS): ServerMessage[] {
  const all = { ...running, ...settings };
  const radius = radiusAt(Number(all[K_OBJECTS]), Number(all[K_REMOTE]));
  const stable = radius < 1;
  const modes = [
    { contacts: [], spectral_radius: radius / 2, stable: true },
    { contacts: ["hand 1", "hand 2"], spectral_radius: radius, stable },
  ];
  return [
    { type: "verdict", id, stable, whole: true, spectral_radius: radius, period_s: 0.0078125, modes, warnings: [] },
    ...(map ? [mapOf(id, map)] : []),
    ...(margin ? [marginOf(id, Number(all[K_OBJECTS]), radius)] : []),
  ];
}

function marginOf(id: number, value: number, radius: number): ServerMessage {
  const factor = radius < 1 ? 4.25 : null;
  return {
    type: "margin", id, delay_periods: radius < 1 ? 3.5 : null, loss_rate: radius < 1 ? 0.25 : null,
    gains: [{ key: K_OBJECTS, value, factor, lower_factor: null }], notes: [],
  };
}

const along = ({ from, to, count, log }: MapAxis) => Array.from({ length: count }, (_, index) =>
  log ? from * (to / from) ** (index / (count - 1)) : from + (index * (to - from)) / (count - 1));

function mapOf(id: number, axes: { x: MapAxis; y: MapAxis }): MapMessage {
  const [x, y] = [along(axes.x), along(axes.y)];
  const curve = Array.from({ length: 100 }, (_, index): [number, number] => {
    const value = axes.x.from * ((2000 - axes.y.from) / axes.x.from) ** (index / 99);
    return [value, 2000 - value];
  });
  return {
    type: "map", id, x: { key: axes.x.key, values: x }, y: { key: axes.y.key, values: y },
    stable: y.map((b) => x.map((a) => radiusAt(a, b) < 1)), boundary: [curve], complete: true,
  };
}
