// Stretches of a recording as the server sends them: each picture's length in four bytes, little-endian, then the
// picture.
import { decodePicture, type Picture } from "../picture.ts";

/** Offset of a picture's session time in its message; see picture.ts. */
const TIME_AT = 8;
const LEAST_PICTURE = 20;

/** Some pictures of a recording, in the order of time, decoded one by one when they are asked for. */
export class Chunk {
  readonly #message: ArrayBuffer;
  /** Where each picture begins and ends in the message. */
  readonly #places: [begin: number, end: number][] = [];
  /** Of every picture, from the start of the recording, s. */
  readonly times: Float64Array;

  /** Throws in words when the message is cut off or its pictures are not in order. */
  constructor(message: ArrayBuffer, starts_s: number) {
    this.#message = message;
    const view = new DataView(message);
    const times: number[] = [];
    for (let at = 0; at < message.byteLength;) {
      if (at + 4 > message.byteLength) throw new Error("it ends within a length");
      const end = at + 4 + view.getUint32(at, true);
      if (end > message.byteLength) throw new Error(`a picture of ${end - at - 4} bytes is cut off`);
      if (end < at + 4 + LEAST_PICTURE) throw new Error(`${end - at - 4} bytes are no picture`);
      const time_s = view.getFloat64(at + 4 + TIME_AT, true) - starts_s;
      if (!(time_s >= (times.at(-1) ?? -Infinity))) throw new Error("its pictures are not in the order of time");
      times.push(time_s);
      this.#places.push([at + 4, end]);
      at = end;
    }
    this.times = Float64Array.from(times);
  }

  get count(): number {
    return this.#places.length;
  }

  get bytes(): number {
    return this.#message.byteLength;
  }

  picture(index: number): Picture {
    const place = this.#places[index];
    if (!place) throw new Error(`there is no picture ${index}`);
    return decodePicture(this.#message.slice(...place));
  }
}
