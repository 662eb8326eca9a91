// Ranges of axes, and numbers as people read them.

export type Range = [from: number, to: number];

/**
 * A vertical range for values from `low` to `high` that does not twitch: the one before stays as long as it holds the
 * values and is not much too large for them.
 */
export function calmRange(
  before: Range | null, low: number, high: number, leastSpan: number, fromZero: boolean,
): Range {
  const wanted = paddedRange(low, high, leastSpan, fromZero);
  if (!before) return wanted;
  const holds = before[0] <= low && before[1] >= high;
  const fits = wanted[1] - wanted[0] > 0.5 * (before[1] - before[0]);
  return holds && fits ? before : wanted;
}

function paddedRange(low: number, high: number, leastSpan: number, fromZero: boolean): Range {
  const begin = fromZero ? Math.min(0, low) : low;
  const span = Math.max(high - begin, leastSpan);
  const padding = 0.1 * span;
  if (fromZero && begin === 0) return [0, span + padding];
  const middle = (begin + high) / 2;
  return [middle - span / 2 - padding, middle + span / 2 + padding];
}

/** The values at the ticks of an axis, all with as many decimals as their distance needs. */
export function tickLabels(ticks: readonly number[], factor: number): string[] {
  const decimals = decimalsOf(((ticks[1] ?? 0) - (ticks[0] ?? 0)) * factor);
  return ticks.map((tick) => {
    const text = (tick * factor).toFixed(decimals);
    return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "\u2212");
  });
}

/** How many tell a step from one with a part in a hundred more: 2.5 has one, 0.05 has two. */
function decimalsOf(step: number): number {
  for (let decimals = 0; decimals < 9; decimals++) {
    if (Math.abs(Number(step.toFixed(decimals)) - step) <= 0.01 * Math.abs(step)) return decimals;
  }
  return 9;
}

/** Three digits, with a proper minus; a dash for what there is none of. */
export function readable(value: number | null | undefined): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const decimals = size < 0.0005 ? 0 : Math.max(0, 3 - Math.max(0, Math.floor(Math.log10(size)) + 1));
  return value.toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "\u2212");
}
