// Numbers as colours: from pale to dark in even steps to the eye, on a scale that follows what is seen.
import { Color } from "three";

/** Lightness, chroma and hue (degrees) in OKLab: sand, orange, crimson, plum. */
const STOPS: [lightness: number, chroma: number, hue: number][] = [
  [0.91, 0.04, 90], [0.77, 0.13, 62], [0.58, 0.18, 20], [0.36, 0.13, 330],
];
const COLOURS = 256;

type Lab = [number, number, number];

/** Colours of 0 to 1, as linear red, green, blue: three numbers each of `COLOURS`. */
export const TABLE: Float32Array = Float32Array.from(even(smooth(STOPS.map(toLab))).flatMap(linearRgb));

/** The colour of a share, 0 to 1; beyond them, of the end. */
export function mapped(share: number, into = new Color()): Color {
  const place = 3 * Math.round((COLOURS - 1) * Math.min(1, Math.max(0, share || 0)));
  return into.setRGB(TABLE[place] ?? 0, TABLE[place + 1] ?? 0, TABLE[place + 2] ?? 0);
}

function toLab([lightness, chroma, hue]: (typeof STOPS)[number]): Lab {
  const angle = (hue * Math.PI) / 180;
  return [lightness, chroma * Math.cos(angle), chroma * Math.sin(angle)];
}

/** A curve through the stops (Catmull-Rom), finely. */
function smooth(stops: Lab[]): Lab[] {
  const stop = (index: number) => stops[Math.min(stops.length - 1, Math.max(0, index))] as Lab;
  const fine = 64;
  return Array.from({ length: (stops.length - 1) * fine + 1 }, (_, index) => {
    const at = Math.min(stops.length - 2, Math.floor(index / fine));
    const t = index / fine - at;
    const [before, from, to, after] = [stop(at - 1), stop(at), stop(at + 1), stop(at + 2)];
    return from.map((p, axis) => {
      const [a, b, c] = [before[axis] ?? 0, to[axis] ?? 0, after[axis] ?? 0];
      return p + 0.5 * t * (b - a + t * (2 * a - 5 * p + 4 * b - c + t * (3 * (p - b) + c - a)));
    }) as Lab;
  });
}

/** Points of a curve at equal distances: in OKLab that is how different colours look. */
function even(curve: Lab[]): Lab[] {
  const lengths = [0];
  for (let i = 1; i < curve.length; i++) lengths.push((lengths[i - 1] ?? 0) + distance(curve[i] as Lab, curve[i - 1] as Lab));
  const whole = lengths.at(-1) ?? 1;
  let at = 1;
  return Array.from({ length: COLOURS }, (_, index) => {
    const wanted = (whole * index) / (COLOURS - 1);
    while (at < curve.length - 1 && (lengths[at] ?? 0) < wanted) at++;
    const [low, high] = [lengths[at - 1] ?? 0, lengths[at] ?? 1];
    const t = (wanted - low) / (high - low);
    const [from, to] = [curve[at - 1] as Lab, curve[at] as Lab];
    return from.map((value, axis) => value + t * ((to[axis] ?? 0) - value)) as Lab;
  });
}

function distance(one: Lab, other: Lab): number {
  return Math.hypot(...one.map((value, axis) => value - (other[axis] ?? 0)));
}

/** OKLab (Ottosson 2020) to linear sRGB. */
function linearRgb([lightness, a, b]: Lab): [number, number, number] {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const rgb = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  return rgb.map((part) => Math.min(1, Math.max(0, part))) as [number, number, number];
}

/** A scale that is much longer than what is shown becomes shorter after this time, s. */
const CALM_S = 2;
const SHORT_SHARE = 0.4;

/** From 0 to a round number: longer at once when something is larger, shorter when nothing has been for a while. */
export class ColourScale {
  limit: number;
  #least: number;
  /** Since when everything is small, and the largest since then. */
  #calm: { since_s: number; largest: number } | null = null;

  constructor(least: number) {
    this.limit = this.#least = least;
  }

  follow(largest: number, time_s: number): void {
    if (!Number.isFinite(largest)) return;
    if (largest > SHORT_SHARE * this.limit || this.limit <= this.#least) {
      this.#calm = null;
      if (largest > this.limit) this.limit = roundUp(largest);
      return;
    }
    if (!this.#calm || time_s < this.#calm.since_s) this.#calm = { since_s: time_s, largest };
    this.#calm.largest = Math.max(this.#calm.largest, largest);
    if (time_s - this.#calm.since_s < CALM_S) return;
    this.limit = Math.max(this.#least, roundUp(this.#calm.largest));
    this.#calm = null;
  }
}

/** The smallest of …, 0.1, 0.2, 0.5, 1, 2, 5, … that is not under `value`. */
export function roundUp(value: number): number {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  const digit = [1, 2, 5].find((step) => value <= step * power * (1 + 1e-9)) ?? 10;
  return Number((digit * power).toPrecision(1));
}
