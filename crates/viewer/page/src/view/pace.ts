// How much a browser can draw: how many pictures a second to ask for, and how fine they are.

/** Frames that are looked at before anything changes. */
const FRAMES = 20;
/** Longer ones come from a tab that slept. */
const SLEPT_MS = 1000;
/** A frame that takes longer than two of a 60 Hz display's is slow. */
const SLOW_MS = 36;
const FAST_MS = 22;
export const FULL_HZ = 60;
export const LOW_HZ = 32;

/** 0: everything; 1: no finer than one pixel per CSS pixel; 2: no shadows either; 3: half as many pixels. */
export const COARSEST = 3;

export class Pace {
  hz = FULL_HZ;
  /** How much is left out, 0 to `COARSEST`; never taken back, so that the picture does not flicker between two. */
  coarseness = 0;
  /** Of the last frames, ms. */
  frame_ms = 0;
  #frames: number[] = [];
  #calm = 0;

  /** A drawn frame took this long until the next one could begin. Says whether something changed. */
  frame(took_ms: number): boolean {
    if (took_ms > SLEPT_MS) return false;
    this.#frames.push(took_ms);
    if (this.#frames.length < FRAMES) return false;
    this.frame_ms = median(this.#frames);
    this.#frames = [];
    return this.#judge();
  }

  #judge(): boolean {
    const before = [this.hz, this.coarseness];
    if (this.frame_ms > SLOW_MS) {
      this.#calm = 0;
      if (this.hz > LOW_HZ) this.hz = LOW_HZ;
      else this.coarseness = Math.min(this.coarseness + 1, COARSEST);
    } else if (this.frame_ms < FAST_MS) {
      this.#calm += 1;
      // A few seconds of quick frames.
      if (this.#calm >= 6) this.hz = FULL_HZ;
    }
    return this.hz !== before[0] || this.coarseness !== before[1];
  }
}

function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}
