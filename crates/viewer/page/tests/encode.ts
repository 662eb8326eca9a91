// Pictures as the server writes them: for tests that have no server.
import { PHASES, type Picture, type Verdict } from "../src/picture.ts";

export function encodePicture(picture: Picture): ArrayBuffer {
  const bytes: number[] = [];
  const scratch = new DataView(new ArrayBuffer(8));
  const put = (size: number) => { for (let i = 0; i < size; i++) bytes.push(scratch.getUint8(i)); };
  const u8 = (value: number) => bytes.push(value);
  const u16 = (value: number) => { scratch.setUint16(0, value, true); put(2); };
  const u32 = (value: number) => { scratch.setUint32(0, value, true); put(4); };
  const f32 = (value: number) => { scratch.setFloat32(0, value, true); put(4); };
  const f64 = (value: number) => { scratch.setFloat64(0, value, true); put(8); };
  const all = (values: readonly number[] | null) => (values ?? [NaN, NaN, NaN]).forEach(f32);
  const verdict = (verdict: Verdict | null) => (verdict === null ? 0 : 1 + ["quiet", "shaking", "diverging"].indexOf(verdict));

  u8(1);
  u8(Number(picture.ended) | (verdict(picture.verdict) << 1) | (verdict(picture.verdict_now) << 3));
  u8(picture.hosts.length);
  u8(picture.surfaces.length);
  u32(picture.generation);
  f64(picture.time_s);
  f32(picture.fast_force_n);
  for (const host of picture.hosts) {
    u8(host.host);
    u8(Number(host.touches_wall) | (Number(host.diverged) << 1));
    u8(host.fingers.length);
    u8(host.bodies.length);
    u32(host.links.length);
    u32(host.ticks);
    u32(host.missed);
    f32(host.lateness_us);
    f32(host.energy_j);
    for (const finger of host.fingers) {
      all(finger.position_m);
      all(finger.force_n);
      all(finger.proxy_m);
      all(finger.target_m);
      f32(finger.governor_gain);
      f32(finger.energy_j);
      u16(finger.governor_acted);
      u16(PHASES.indexOf(finger.phase));
    }
    for (const body of host.bodies) { all(body.position_m); all(body.orientation_xyzw); }
    for (const link of host.links) {
      u16(link.peer);
      u16(Number(link.present));
      f32(link.round_trip_ms);
      f32(link.jitter_ms);
      u32(link.received);
      u32(link.lost);
    }
  }
  for (const surface of picture.surfaces) {
    u16(surface.host);
    u16(0);
    u32(surface.packed.length / 4);
    f32(surface.ko_n_per_m);
    f32(surface.step_m);
    f32(surface.step_pa);
    surface.packed.forEach((value) => u16(value & 0xffff));
  }
  return Uint8Array.from(bytes).buffer;
}
