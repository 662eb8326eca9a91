// What the page and its server say to each other on /live, besides pictures (picture.ts): JSON, one object a message.
// The other side is crates/viewer/src/protocol.rs; a change here is a change there.

/** A user or host, from 0. */
export type HostIndex = number;
/** metres, world frame */
export type Vector = [number, number, number];

/** Sent on connecting, and again whenever another session takes this one's place. */
export interface SessionMessage {
  type: "session";
  /** Of the program; a page of another version says so and asks to be loaded again. */
  version: string;
  /** Which session since the server started, from 1; pictures of another one are not for this scene. */
  generation: number;
  mode: "live" | "replay";
  about: About;
  /** The lesson's controls; none where nothing can be changed or predicted. */
  controls: Control[];
  /** Whether this browser may change the running session: only one on the same computer may. */
  may_change: boolean;
  /** What can be replayed; empty in a live session. */
  recordings: RecordingInfo[];
}

export interface RecordingInfo {
  name: string;
  duration_s: number;
  /** Session time of its first picture, s. */
  starts_s: number;
  about: About;
}

/** What does not change during a session. */
export interface About {
  scene: string;
  description: string;
  architecture: "distributed" | "centralized";
  /** Whether every host keeps a copy of the bodies of its own. */
  copies: boolean;
  users: string[];
  /** Where each user's fingers rest at the start. */
  fingers_m: Vector[][];
  space: "line" | "plane" | "space";
  control_hz: number;
  network_hz: number;
  delay_periods: number;
  max_force_n: number;
  finger_radius_m: number;
  bodies: BodyInfo[];
  /** In a scene with a soft object there is no other body. */
  soft: SoftInfo | null;
  walls: WallInfo[];
}

export interface SoftInfo {
  model: "mass-spring" | "corotational" | "balloon";
  /** World frame, at rest: three numbers a vertex, three indices a triangle. */
  surface: { vertices_m: number[]; triangles: number[] };
  /** Of the whole mesh. */
  nodes: number;
  tetrahedra: number;
  /** How often it is simulated. */
  simulation_hz: number;
  /** What hands feel at the haptic rate. A gain in N/m counts where it is not 0, else its ratio to K_o. */
  local_model: {
    kind: string;
    stiffness_n_per_m: number;
    stiffness_ratio: number;
    integral_n_per_m: number;
    integral_ratio: number;
  };
}

export interface BodyInfo {
  name: string;
  /** A "point" has no surface: hands are coupled to its centre. */
  kind: "point" | "ball" | "box" | "capsule" | "hull" | "mesh";
  size_m: Vector;
  radius_m: number;
  length_m: number;
  fixed: boolean;
  /** Of a hull or a mesh: body frame, three numbers a vertex, three indices a triangle. */
  surface: { vertices_m: number[]; triangles: number[] } | null;
}

export interface WallInfo {
  name: string;
  point_m: Vector;
  /** Where it pushes to; a unit vector. */
  normal: Vector;
}

/** Who moves a user's hand. */
export type HeldBy = "script" | "you" | "browser" | "elsewhere" | "free";

export interface SeatsMessage {
  type: "seats";
  seats: { user: HostIndex; name: string; by: HeldBy }[];
}

/** This browser now moves `user`'s hand, or, with null, no hand any more. */
export interface TakenMessage {
  type: "taken";
  user: HostIndex | null;
  /** Of the spring from the pointer to each finger. */
  stiffness_n_per_m: number;
  damping_n_s_per_m: number;
}

/** A request was turned down. */
export interface RefusedMessage {
  type: "refused";
  what: "take" | "set" | "predict" | "message";
  why: string;
}

export interface NewsMessage {
  type: "news";
  text: string;
}

/** One control of the lesson: a key of the scene, or "scene" itself. */
export interface Control {
  key: string;
  label: string;
  /** "" where there is none */
  unit: string;
  /** One sentence: what it is. */
  help: string;
  kind: "number" | "whole" | "choice";
  low: number;
  high: number;
  /** Whether a slider should run over the logarithm. */
  log: boolean;
  choices: string[];
  /** Whether a change ends the running session and begins another. */
  restarts: boolean;
}

/** Values of controls, by key: a number, or a choice. */
export type Settings = Record<string, number | string>;

/** What the running session is set to; sent on connecting and after every change, whoever made it. */
export interface SettingsMessage {
  type: "settings";
  settings: Settings;
  /** What the session does differently from what was asked for, in words; "" when nothing. */
  note: string;
  /** Why the session was stopped and waits to be begun anew, in words; "" while it runs. */
  paused: string;
}

/** The answers to `predict`, with its id. All of them come, in this order, unless a newer question came meanwhile. */
export interface VerdictMessage {
  type: "verdict";
  id: number;
  /** Null where each analysed mode is stable and not all that can happen is proven to be. */
  stable: boolean | null;
  /** False where only a first look was taken, and a question with `whole` may say more. */
  whole: boolean;
  /** Without rigid-body poles, per pattern of ticks. */
  spectral_radius: number;
  period_s: number;
  modes: { contacts: string[]; spectral_radius: number; stable: boolean }[];
  warnings: string[];
}

export interface MarginMessage {
  type: "margin";
  id: number;
  /** Null where the loop is not stable, or there is no limit within what was looked at. */
  delay_periods: number | null;
  loss_rate: number | null;
  /** Factors up and down at which a gain's scene turns unstable. */
  gains: { key: string; value: number; factor: number | null; lower_factor: number | null }[];
  notes: string[];
}

export interface MapMessage {
  type: "map";
  id: number;
  x: { key: string; values: number[] };
  y: { key: string; values: number[] };
  /** One row a y, in the order of y.values. */
  stable: boolean[][];
  /** Curves of points [x, y]; none while the map is coarse. */
  boundary: [number, number][][];
  /** False while the map is coarse: a finer one follows. */
  complete: boolean;
}

/** A part of a prediction could not be had. */
export interface FailedMessage {
  type: "failed";
  id: number;
  what: "verdict" | "margin" | "map";
  why: string;
}

export type ServerMessage =
  | SessionMessage | SeatsMessage | TakenMessage | RefusedMessage | NewsMessage | SettingsMessage
  | VerdictMessage | MarginMessage | MapMessage | FailedMessage;

export interface MapAxis {
  key: string;
  from: number;
  to: number;
  count: number;
  log: boolean;
}

export type PageMessage =
  /** Move this user's hand. Answered by taken or refused. */
  | { type: "take"; user: HostIndex }
  | { type: "leave" }
  /** Where the pointer draws each finger of the hand that this browser moves; at least twice a second while it does. */
  | { type: "point"; targets_m: Vector[] }
  /** Pictures a second from now on: 32 to 60. */
  | { type: "rate"; hz: number }
  /** Change the running session. Only what is named changes. */
  | { type: "set"; settings: Settings }
  /** Begin the running session anew with its present settings. */
  | { type: "again" }
  /** What does the analysis say for the running session with these changes? A newer question ends an older one. */
  | { type: "predict"; id: number; settings: Settings; whole: boolean; margin: boolean; map: { x: MapAxis; y: MapAxis } | null };
