// A made-up recording, answered in stretches as the server does.
import type { Picture } from "../src/picture.ts";
import type { About, RecordingInfo, SessionMessage } from "../src/protocol.ts";
import { encodePicture } from "./encode.ts";
import { picture, session } from "./examples.ts";

export interface Recording {
  info: RecordingInfo;
  pictures: Picture[];
}

/** Pictures at `rate_hz` from the session time `starts_s` on. */
export function recording(about: About, name: string, starts_s: number, duration_s: number, rate_hz = 60): Recording {
  const count = Math.round(duration_s * rate_hz) + 1;
  const pictures = Array.from({ length: count }, (_, index) => picture(about, starts_s + index / rate_hz));
  return { info: { name, duration_s, starts_s, about }, pictures };
}

export function replaySession(recordings: readonly Recording[]): SessionMessage {
  const infos = recordings.map(({ info }) => info);
  return { ...session((recordings[0] as Recording).info.about), mode: "replay", recordings: infos, may_change: false };
}

/** The pictures of [from_s, to_s), each behind its length. */
export function stretch(pictures: readonly Picture[], from_s: number, to_s: number): ArrayBuffer {
  const messages = pictures.filter(({ time_s }) => time_s >= from_s && time_s < to_s).map(encodePicture);
  const bytes = new Uint8Array(messages.reduce((sum, message) => sum + 4 + message.byteLength, 0));
  let at = 0;
  for (const message of messages) {
    new DataView(bytes.buffer).setUint32(at, message.byteLength, true);
    bytes.set(new Uint8Array(message), at + 4);
    at += 4 + message.byteLength;
  }
  return bytes.buffer;
}
