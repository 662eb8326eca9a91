// What is here of a recording, and what is asked for next.
import { Chunk } from "./chunks.ts";
import { firstAtLeast } from "../plots/history.ts";
import type { RecordingInfo } from "../protocol.ts";

/** One request brings this much, s. */
export const CHUNK_S = 5;
/** Before anything else, this much after the present time is asked for, s. */
const AHEAD_S = 30;
/** What is furthest from the present time is given up beyond this. */
const MOST_BYTES = 192 * 1024 * 1024;
const RETRY_MS = 2000;

export interface Place {
  chunk: number;
  index: number;
}

/** Gets the bytes of a stretch of session time; throws in words. */
export type Load = (from_s: number, to_s: number) => Promise<ArrayBuffer>;

export function loadFrom(recording: number): Load {
  return async (from_s, to_s) => {
    const answer = await fetch(`/recordings/${recording}/pictures?from_s=${from_s}&to_s=${to_s}`).catch(() => {
      throw new Error("the server does not answer");
    });
    if (!answer.ok) throw new Error((await answer.text()).trim() || `the server answers ${answer.status}`);
    return answer.arrayBuffer();
  };
}

export class Buffer {
  readonly #info: RecordingInfo;
  readonly #load: Load;
  readonly #chunks = new Map<number, Chunk>();
  /** How many chunks the recording has. */
  readonly count: number;
  #loading: number | null = null;
  #bytes = 0;
  #present = 0;
  #stopped = false;
  /** What went wrong with the last request, in words. */
  trouble: string | null = null;
  /** A chunk came or went, or trouble did. */
  onChange: () => void = () => {};

  constructor(info: RecordingInfo, load: Load) {
    this.#info = info;
    this.#load = load;
    this.count = Math.max(1, Math.ceil((info.duration_s + 1e-6) / CHUNK_S));
  }

  chunk(index: number): Chunk | undefined {
    return this.#chunks.get(index);
  }

  /** The newest picture that is not after `time_s` (the first one before there is any); null while it is not here. */
  placeAt(time_s: number): Place | null {
    let number = this.#chunkOf(time_s);
    for (let chunk = this.#chunks.get(number); chunk; chunk = this.#chunks.get(--number)) {
      const index = firstAtLeast(chunk.times, time_s + 1e-9) - 1;
      if (index >= 0) return { chunk: number, index };
      if (number === 0) return chunk.count > 0 ? { chunk: 0, index: 0 } : null;
    }
    return null;
  }

  /** Whether what is to be shown at `time_s` is here. */
  has(time_s: number): boolean {
    return this.#chunks.has(this.#chunkOf(time_s));
  }

  /** When the nearest picture after `time_s`, or before it, is due; null where none is here. */
  timeBeside(time_s: number, step: 1 | -1): number | null {
    const place = this.placeAt(time_s);
    if (!place) return null;
    const shown_s = this.#chunks.get(place.chunk)?.times[place.index] as number;
    if (step * (shown_s - time_s) > 1e-9) return shown_s;
    let [number, at] = [place.chunk, place.index + step];
    for (let found = this.#chunks.get(number); found; found = this.#chunks.get(number)) {
      if (at >= 0 && at < found.count) return found.times[at] as number;
      number += step;
      at = step === 1 ? 0 : (this.#chunks.get(number)?.count ?? 0) - 1;
    }
    return null;
  }

  /** Which stretches are here, s. */
  ranges(): [from_s: number, to_s: number][] {
    const ranges: [number, number][] = [];
    for (const number of [...this.#chunks.keys()].sort((one, other) => one - other)) {
      const [from_s, to_s] = [number * CHUNK_S, Math.min((number + 1) * CHUNK_S, this.#info.duration_s)];
      const last = ranges.at(-1);
      if (last && last[1] === from_s) last[1] = to_s;
      else ranges.push([from_s, to_s]);
    }
    return ranges;
  }

  /** Tells what is shown; what is missing from there on is asked for. */
  lookAt(time_s: number): void {
    this.#present = this.#chunkOf(time_s);
    void this.#fill();
  }

  stop(): void {
    this.#stopped = true;
  }

  #chunkOf(time_s: number): number {
    return Math.min(this.count - 1, Math.max(0, Math.floor((time_s + 1e-9) / CHUNK_S)));
  }

  async #fill(): Promise<void> {
    if (this.#loading !== null) return;
    for (let next = this.#next(); next !== null && !this.#stopped; next = this.#next()) {
      this.#loading = next;
      try {
        this.#keep(next, await this.#request(next));
        this.trouble = null;
      } catch (error) {
        this.trouble = error instanceof Error ? error.message : String(error);
        this.onChange();
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      }
      this.onChange();
    }
    this.#loading = null;
  }

  async #request(number: number): Promise<Chunk> {
    // The end of one is to the last bit the beginning of the next, so that no picture comes twice or never.
    const [from_s, to_s] = [number, number + 1].map((edge) => this.#info.starts_s + edge * CHUNK_S) as [number, number];
    const message = await this.#load(from_s, to_s);
    try {
      return new Chunk(message, this.#info.starts_s);
    } catch (error) {
      throw new Error(`the pictures from ${from_s} s on cannot be read: ${(error as Error).message}`);
    }
  }

  #keep(number: number, chunk: Chunk): void {
    this.#chunks.set(number, chunk);
    this.#bytes += chunk.bytes;
    while (this.#bytes > MOST_BYTES) {
      const furthest = wanted(this.count, this.#present).reverse().find((each) => this.#chunks.has(each));
      if (furthest === undefined || furthest === number) break;
      this.#bytes -= this.#chunks.get(furthest)?.bytes ?? 0;
      this.#chunks.delete(furthest);
    }
  }

  #next(): number | null {
    const order = wanted(this.count, this.#present);
    const soon = order.slice(0, Math.ceil(AHEAD_S / CHUNK_S));
    // The rest comes while there is room: without the quarter that is left, the far end would come and go for ever.
    const list = this.#bytes > 0.75 * MOST_BYTES ? soon : order;
    return list.find((each) => !this.#chunks.has(each)) ?? null;
  }
}

/** All chunks in the order in which they are wanted: from the present one to the end, then back to the start. */
export function wanted(count: number, present: number): number[] {
  const after = Array.from({ length: count - present }, (_, index) => present + index);
  const before = Array.from({ length: present }, (_, index) => present - 1 - index);
  return [...after, ...before];
}
