// A picture of the running session, as the server sends it 32 to 60 times a second: one binary message, little-endian.
// The other side is crates/viewer/src/picture.rs, which describes the layout; a change here is a change there.
import type { HostIndex, Vector } from "./protocol.ts";

/** What a run was, or is: see crates/runtime/src/observer.rs. */
export type Verdict = "quiet" | "shaking" | "diverging";

export interface Picture {
  /** Which session since the server started. */
  generation: number;
  time_s: number;
  ended: boolean;
  /** Of the whole run so far; null while it is too early to say. */
  verdict: Verdict | null;
  /** Of the last second; null while it is too early to say. */
  verdict_now: Verdict | null;
  /** The force above 8 Hz at the worst finger, N rms. */
  fast_force_n: number;
  hosts: HostPicture[];
  surfaces: SurfacePicture[];
}

export interface HostPicture {
  host: HostIndex;
  touches_wall: boolean;
  /** Whether the world left all bounds at this host. */
  diverged: boolean;
  ticks: number;
  missed: number;
  /** The latest tick since the last picture, µs. */
  lateness_us: number;
  /** What the user has put into the session so far, J. */
  energy_j: number;
  fingers: FingerPicture[];
  bodies: BodyPose[];
  links: LinkPicture[];
}

export const PHASES = ["free", "moment-cancellation", "pre-slide", "slide"] as const;
export type Phase = (typeof PHASES)[number];

export interface FingerPicture {
  position_m: Vector;
  /** On the hand, after the governor. */
  force_n: Vector;
  /** Where on the surface the finger is held; null when it touches nothing. */
  proxy_m: Vector | null;
  /** Where a pointer draws it; null when none does. */
  target_m: Vector | null;
  phase: Phase;
  /** Which limits of the governor acted, as bits. */
  governor_acted: number;
  /** 0 (released) to 1. */
  governor_gain: number;
  /** What the user has put in at this finger so far, J. */
  energy_j: number;
}

export interface BodyPose {
  position_m: Vector;
  orientation_xyzw: [number, number, number, number];
}

export interface LinkPicture {
  peer: HostIndex;
  present: boolean;
  /** NaN before the first. */
  round_trip_ms: number;
  jitter_ms: number;
  received: number;
  lost: number;
}

/** The surface of the soft object as the fingers of a host meet it; `About.soft` says where its vertices rest. */
export interface SurfacePicture {
  host: HostIndex;
  /** K_o: how stiff the object is where it is touched, all contacts together. */
  ko_n_per_m: number;
  /** Of `packed`. */
  step_m: number;
  step_pa: number;
  /** Four a vertex: its way from where it rests along x, y and z, in steps; and, unsigned, its stress. A view into the message. */
  packed: Int16Array;
}

const KIND = 1;
const VERDICTS = [null, "quiet", "shaking", "diverging"] as const;

/** Throws when the message is not a picture of this version. */
export function decodePicture(message: ArrayBuffer): Picture {
  const view = new DataView(message);
  let at = 0;
  const u8 = () => view.getUint8(at++);
  const u16 = () => { at += 2; return view.getUint16(at - 2, true); };
  const u32 = () => { at += 4; return view.getUint32(at - 4, true); };
  const f32 = () => { at += 4; return view.getFloat32(at - 4, true); };
  const f64 = () => { at += 8; return view.getFloat64(at - 8, true); };
  const vector = (): Vector => [f32(), f32(), f32()];
  const vectorOrNone = () => { const found = vector(); return Number.isNaN(found[0]) ? null : found; };
  const times = <T>(count: number, read: () => T) => Array.from({ length: count }, read);

  const finger = (): FingerPicture => ({
    position_m: vector(),
    force_n: vector(),
    proxy_m: vectorOrNone(),
    target_m: vectorOrNone(),
    governor_gain: f32(),
    energy_j: f32(),
    governor_acted: u16(),
    phase: PHASES[u16()] ?? "free",
  });
  const body = (): BodyPose => ({ position_m: vector(), orientation_xyzw: [f32(), f32(), f32(), f32()] });
  const link = (): LinkPicture => ({
    peer: u16(),
    present: u16() === 1,
    round_trip_ms: f32(),
    jitter_ms: f32(),
    received: u32(),
    lost: u32(),
  });
  const host = (): HostPicture => {
    const [index, flags, fingers, bodies, links] = [u8(), u8(), u8(), u8(), u32()];
    return {
      host: index,
      touches_wall: (flags & 1) !== 0,
      diverged: (flags & 2) !== 0,
      ticks: u32(),
      missed: u32(),
      lateness_us: f32(),
      energy_j: f32(),
      fingers: times(fingers, finger),
      bodies: times(bodies, body),
      links: times(links, link),
    };
  };
  const surface = (): SurfacePicture => {
    const [index, , vertices] = [u16(), u16(), u32()];
    const [ko_n_per_m, step_m, step_pa] = [f32(), f32(), f32()];
    const packed = new Int16Array(message, at, 4 * vertices);
    at += 8 * vertices;
    return { host: index, ko_n_per_m, step_m, step_pa, packed };
  };

  const [kind, flags, hosts, surfaces] = [u8(), u8(), u8(), u8()];
  if (kind !== KIND) throw new Error(`a message of kind ${kind} is no picture`);
  const picture: Picture = {
    ended: (flags & 1) !== 0,
    verdict: VERDICTS[(flags >> 1) & 3] ?? null,
    verdict_now: VERDICTS[(flags >> 3) & 3] ?? null,
    generation: u32(),
    time_s: f64(),
    fast_force_n: f32(),
    hosts: times(hosts, host),
    surfaces: times(surfaces, surface),
  };
  if (at !== message.byteLength) throw new Error(`a picture of ${at} bytes in a message of ${message.byteLength}`);
  return picture;
}
