// What the lesson says: verdict, growth, margins, and whether the running session agrees.
import type { Picture } from "../picture.ts";
import type { Control, MarginMessage, VerdictMessage } from "../protocol.ts";
import { readable } from "./scale.ts";

/** What the running session does, as far as can be told. */
export type Observed = "unknown" | "quiet" | "shaking" | "diverging" | "lost" | "over";

export function observed(picture: Picture | null): Observed {
  if (!picture) return "unknown";
  if (picture.ended) return "over";
  if (picture.hosts.some((host) => host.diverged)) return "lost";
  return picture.verdict_now ?? "unknown";
}

export const OBSERVED: Record<Observed, string> = {
  unknown: "Too early to say",
  quiet: "Quiet",
  shaking: "Shaking",
  diverging: "Diverging",
  lost: "Left all bounds",
  over: "Over",
};

/**
 * Whether prediction and session agree; `predicted` is undefined while it is waited for, and null where it is left open.
 * `same` is whether the prediction is for the settings that run.
 */
export function agreement(predicted: boolean | null | undefined, seen: Observed, same: boolean): string {
  if (predicted === undefined) return "Waiting for the prediction.";
  const word = verdictWord(predicted);
  if (!same) return `What if: predicted ${word}. The session runs with other settings.`;
  if (seen === "over") return `Predicted ${word}; the session is over.`;
  if (seen === "unknown") return `Predicted ${word}; the session has only begun.`;
  if (predicted === null) return `Not proven: each analysed contact is stable. The session is ${OBSERVED[seen].toLowerCase()}.`;
  if (predicted) return seen === "quiet" ? "Predicted stable – and it is." : "Predicted stable – still settling.";
  if (seen === "lost") return "Predicted unstable – and it left all bounds.";
  if (seen === "diverging") return "Predicted unstable – and it diverges.";
  return seen === "shaking" ? "Predicted unstable – and it shakes." : "Predicted unstable – it has not shaken yet.";
}

/** What a verdict is called; one that is not whole may still change. */
export function verdictWord(stable: boolean | null, whole = true): string {
  return stable === null ? (whole ? "not proven" : "not proven yet") : stable ? "stable" : "unstable";
}

/** How fast an oscillation at the radius grows or fades. */
export function growth(verdict: Pick<VerdictMessage, "spectral_radius" | "period_s">): string {
  const rate = Math.log(verdict.spectral_radius);
  if (!Number.isFinite(rate)) return "What is stirred is gone after one pattern of ticks.";
  const seconds = (verdict.period_s * Math.LN2) / Math.abs(rate);
  if (!(seconds < 1000)) return "What is stirred neither fades nor grows.";
  return `Any disturbance ${rate > 0 ? "doubles" : "halves"} every ${duration(seconds)}.`;
}

function duration(seconds: number): string {
  return seconds < 1 ? `${readable(seconds * 1000)} ms` : `${readable(seconds)} s`;
}

/** How far each thing may go, one sentence each. */
export function margins(margin: MarginMessage, controls: readonly Control[]): string[] {
  const words: string[] = [];
  if (margin.delay_periods !== null) {
    words.push(`Delay: unstable from ${readable(margin.delay_periods)} network periods on.`);
  }
  if (margin.loss_rate !== null) {
    words.push(margin.loss_rate >= 1
      ? "Loss: any share of packets may be lost, short of all."
      : `Loss: unstable when ${readable(100 * margin.loss_rate)} % of the packets are lost.`);
  }
  for (const gain of margin.gains) {
    const at = (factor: number) => `${readable(gain.value * factor)} (× ${readable(factor)})`;
    const limits = [
      gain.factor === null ? null : `above ${at(gain.factor)}`,
      gain.lower_factor === null ? null : `below ${at(gain.lower_factor)}`,
    ].filter((limit) => limit !== null);
    if (limits.length > 0) words.push(`${label(gain.key, controls)}: unstable ${limits.join(" and ")}.`);
  }
  return words;
}

export function label(key: string, controls: readonly Control[]): string {
  return controls.find((control) => control.key === key)?.label ?? key;
}

const CAUSES: [number, string][] = [
  [1, "force limit"], [2, "torque limit"], [4, "slew limit"],
];
/** Soft start and release: limits that act meanwhile do not count. */
const FADING = 8 | 16;
const RELEASES: [number, string][] = [[32, "stopped"], [64, "link lost"], [128, "watchdog"], [256, "fault"]];

/** Which limits of the governors act, in words; "" when none does. */
export function limits(picture: Picture): string {
  let bits = 0;
  for (const host of picture.hosts) {
    for (const finger of host.fingers) {
      const acted = finger.governor_acted;
      bits |= acted & FADING ? acted & ~7 : acted;
    }
  }
  const acting = [...CAUSES, ...RELEASES].filter(([bit]) => bits & bit).map(([, words]) => words);
  if (acting.length > 0) return `Governor: ${acting.join(", ")}`;
  return bits & FADING ? "Forces fade in or out" : "";
}

/** Whether the computer is late, with figures; "" where it is not. What a late loop does says little about the predicted one. */
export function lateness(picture: Picture): string {
  const sum = (of: (host: Picture["hosts"][number]) => number) => picture.hosts.reduce((total, host) => total + of(host), 0);
  const missed = sum((host) => host.missed);
  if (missed === 0) return "";
  const worst_us = Math.max(...picture.hosts.map((host) => host.lateness_us));
  const due = missed + sum((host) => host.ticks);
  return `The computer is late: ${missed} of ${due} ticks left out, the last one began ${readable(worst_us / 1000)} ms late`;
}
