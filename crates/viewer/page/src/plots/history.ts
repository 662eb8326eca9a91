// What has been plotted so far: rows in the order of time, kept in columns so that a chart takes any stretch of them
// without copying.

/** Rows that a chart can show. A value that there is none of is NaN. */
export interface Source {
  readonly length: number;
  /** Of every row, ascending, s. */
  times(): Float64Array;
  /** One value a row. */
  column(index: number): Float32Array;
}

/** After this many seconds without a row a line is not drawn on. */
const GAP_S = 1;

/** The last rows of a running session. */
export class History implements Source {
  length = 0;
  readonly #capacity: number;
  readonly #times: Float64Array;
  readonly #columns: Float32Array[];

  /** Keeps at least three quarters of `capacity` rows of `columns` values. */
  constructor(columns: number, capacity: number) {
    this.#capacity = capacity;
    this.#times = new Float64Array(capacity);
    this.#columns = Array.from({ length: columns }, () => new Float32Array(capacity));
  }

  times(): Float64Array {
    return this.#times.subarray(0, this.length);
  }

  column(index: number): Float32Array {
    const column = this.#columns[index];
    if (!column) throw new Error(`there is no column ${index}`);
    return column.subarray(0, this.length);
  }

  /** The time of the newest row; NaN when there is none. */
  get latest_s(): number {
    return this.#times[this.length - 1] ?? NaN;
  }

  /** Appends a row; one that is not newer than the newest is left out. */
  add(time_s: number, read: (column: number) => number): void {
    if (time_s <= this.latest_s) return;
    if (time_s > this.latest_s + GAP_S) this.#append(this.latest_s + 1e-3, () => NaN);
    this.#append(time_s, read);
  }

  clear(): void {
    this.length = 0;
  }

  #append(time_s: number, read: (column: number) => number): void {
    if (this.length === this.#capacity) this.#forget();
    this.#times[this.length] = time_s;
    this.#columns.forEach((column, index) => { column[this.length] = read(index); });
    this.length += 1;
  }

  /** The oldest quarter goes at once: moving the rest costs little when it is done seldom. */
  #forget(): void {
    const forgotten = Math.max(1, Math.floor(this.#capacity / 4));
    for (const column of [this.#times, ...this.#columns]) column.copyWithin(0, forgotten);
    this.length -= forgotten;
  }
}

/** Rows [first, end) that reach over `from_s` to `to_s`, one more at either side so that lines go to the edges. */
export function rowsBetween(times: Float64Array, from_s: number, to_s: number): [first: number, end: number] {
  const first = Math.max(0, firstAtLeast(times, from_s) - 1);
  return [first, Math.min(times.length, firstAtLeast(times, to_s) + 1)];
}

/** The first index whose time is at least `time_s`; the length when there is none. */
export function firstAtLeast(times: Float64Array, time_s: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] as number) < time_s) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The values as a chart takes them: null where there is none, and the same array where all are numbers. */
export function withGaps(values: Float32Array): Float32Array | (number | null)[] {
  if (!values.some(Number.isNaN)) return values;
  return Array.from(values, (value) => (Number.isNaN(value) ? null : value));
}
