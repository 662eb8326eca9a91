// Between values and places: of a slider, of an axis. Numbers as people read them.
import type { Control } from "../protocol.ts";

/** From `low` to `high`, evenly or with equal ratios. */
export interface Scale {
  low: number;
  high: number;
  log: boolean;
}

/** Steps of a slider over a continuous control. */
const STEPS = 1000;

/** Where `value` is between the ends, 0 to 1; beyond them, at the end. */
export function share({ low, high, log }: Scale, value: number): number {
  if (!(high > low)) return 0;
  const found = isLog({ low, high, log })
    ? Math.log(Math.max(value, low) / low) / Math.log(high / low)
    : (value - low) / (high - low);
  return Math.min(Math.max(found, 0), 1);
}

/** The value at a share of the way from low to high. */
export function valueAt({ low, high, log }: Scale, share: number): number {
  const at = Math.min(Math.max(share, 0), 1);
  if (at === 0) return low;
  if (at === 1) return high;
  return isLog({ low, high, log }) ? low * (high / low) ** at : low + at * (high - low);
}

/** A logarithm needs a positive low end; without one the scale is even. */
function isLog({ low, high, log }: Scale): boolean {
  return log && low > 0 && high > low;
}

export function sliderSteps(control: Control): number {
  return control.kind === "whole" ? Math.max(control.high - control.low, 1) : STEPS;
}

export function toSlider(control: Control, value: number): number {
  return Math.round(share(sliderScale(control), value) * sliderSteps(control));
}

/** A slider's place as a value, rounded to what people would type. */
export function fromSlider(control: Control, place: number): number {
  const value = valueAt(sliderScale(control), place / sliderSteps(control));
  return tidy(control, value);
}

function sliderScale(control: Control): Scale {
  return { low: control.low, high: control.high, log: control.log && control.kind !== "whole" };
}

/** Rounded as fits the control, and within its ends. */
export function tidy(control: Control, value: number): number {
  if (control.kind === "whole") return clamp(control, Math.round(value));
  const size = control.log ? Math.abs(value) : Math.max(Math.abs(control.low), Math.abs(control.high));
  if (size === 0) return clamp(control, 0);
  const unit = 10 ** (Math.floor(Math.log10(size)) - 2);
  // Multiplying by a negative power of ten would leave a tail of digits.
  return clamp(control, Number((Math.round(value / unit) * unit).toPrecision(12)));
}

function clamp({ low, high }: Control, value: number): number {
  return Math.min(Math.max(value, low), high);
}

/** Three or four digits, without an exponent where it can be read. */
export function readable(value: number): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(1).replace("e+", "e");
  return String(Number(value.toPrecision(size >= 1000 ? 4 : 3)));
}

export function withUnit(value: number, unit: string): string {
  return unit ? `${readable(value)} ${unit}` : readable(value);
}

/** Round values for an axis, a handful. */
export function axisMarks(scale: Scale): number[] {
  return isLog(scale) ? logMarks(scale) : evenMarks(scale);
}

function logMarks({ low, high }: Scale): number[] {
  const wide = high / low > 300;
  const marks: number[] = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++) {
    for (const digit of wide ? [1] : [1, 2, 5]) {
      const mark = Number((digit * 10 ** power).toPrecision(6));
      if (mark >= low * 0.999 && mark <= high * 1.001) marks.push(mark);
    }
  }
  return marks;
}

function evenMarks({ low, high }: Scale): number[] {
  const rough = (high - low) / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((size) => size >= rough * 0.999) ?? rough;
  const marks: number[] = [];
  for (let index = Math.ceil(low / step - 1e-9); index * step <= high + 1e-9 * step; index++) {
    marks.push(Number((index * step).toPrecision(6)));
  }
  return marks;
}
