// What is plotted of a recording: rows from every chunk that is here.
import { Reader, type Channel } from "../plots/channels.ts";
import { firstAtLeast, type Source } from "../plots/history.ts";
import type { About } from "../protocol.ts";
import type { Buffer } from "./buffer.ts";
import type { Chunk } from "./chunks.ts";

interface Rows {
  times: Float64Array;
  columns: Float32Array[];
}

export class Track implements Source {
  length = 0;
  readonly #about: About;
  readonly #channels: readonly Channel[];
  readonly #buffer: Buffer;
  /** Kept when their chunk goes: they are small beside it. */
  readonly #rows = new Map<number, Rows>();
  #times = new Float64Array(0);
  #columns: Float32Array[];
  #begins_s = 0;

  constructor(about: About, channels: readonly Channel[], buffer: Buffer) {
    this.#about = about;
    this.#channels = channels;
    this.#buffer = buffer;
    this.#columns = channels.map(() => new Float32Array(0));
  }

  /** In the time that recordings share. */
  times(): Float64Array {
    return this.#times;
  }

  column(index: number): Float32Array {
    return this.#columns[index] ?? new Float32Array(0);
  }

  /** Takes in what came since; the recording begins at `begins_s`. Says whether anything changed. */
  update(begins_s: number): boolean {
    const fresh = Array.from({ length: this.#buffer.count }, (_, number) => number)
      .filter((number) => !this.#rows.has(number) && this.#buffer.chunk(number));
    if (fresh.length === 0 && begins_s === this.#begins_s) return false;
    fresh.forEach((number) => this.#read(number));
    this.#begins_s = begins_s;
    this.#join();
    return true;
  }

  #read(number: number): void {
    const chunk = this.#buffer.chunk(number) as Chunk;
    const columns = this.#channels.map(() => new Float32Array(chunk.count));
    const reader = this.#primed(number);
    for (let row = 0; row < chunk.count; row++) {
      const scan = reader.scan(chunk.picture(row));
      this.#channels.forEach((channel, index) => { (columns[index] as Float32Array)[row] = channel.read(scan); });
    }
    this.#rows.set(number, { times: chunk.times, columns });
  }

  /** A reader that has seen the second before this chunk, if that is here: shares of the last second need it. */
  #primed(number: number): Reader {
    const reader = new Reader(this.#about);
    const before = this.#buffer.chunk(number - 1);
    if (!before) return reader;
    const from = firstAtLeast(before.times, (before.times.at(-1) ?? 0) - 1.1);
    for (let row = from; row < before.count; row++) reader.scan(before.picture(row));
    return reader;
  }

  /** One after the other, with a row of nothing where a chunk is missing between them. */
  #join(): void {
    const numbers = [...this.#rows.keys()].sort((one, other) => one - other);
    const gaps = numbers.filter((number, index) => index > 0 && number !== (numbers[index - 1] as number) + 1);
    const all = numbers.map((number) => this.#rows.get(number) as Rows);
    this.length = all.reduce((sum, { times }) => sum + times.length, gaps.length);
    this.#times = new Float64Array(this.length);
    this.#columns = this.#channels.map(() => new Float32Array(this.length));
    let at = 0;
    all.forEach(({ times, columns }, index) => {
      if (gaps.includes(numbers[index] as number)) {
        this.#times[at] = (this.#times[at - 1] ?? 0) + 1e-3;
        this.#columns.forEach((column) => { column[at] = NaN; });
        at += 1;
      }
      times.forEach((time_s, row) => { this.#times[at + row] = time_s + this.#begins_s; });
      this.#columns.forEach((column, channel) => column.set(columns[channel] as Float32Array, at));
      at += times.length;
    });
  }
}
