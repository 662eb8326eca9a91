// What was tried in this lesson, one row a set of settings: what was predicted of it, and what the session did.
import { make } from "../dom.ts";
import type { Control, Settings } from "../protocol.ts";
import { withUnit } from "./scale.ts";
import { label, OBSERVED, verdictWord, type Observed } from "./words.ts";

/** What shook before a change may take a second to die out, and what is said of a session is about the last second, s. */
const SETTLING_S = 2;
/** Settings that held for less, and under which nothing shook, are left out, s. */
const SHORTEST_S = 1.5;
const MOST = 30;

/** From the mildest to the worst. */
const ORDER: Observed[] = ["unknown", "over", "quiet", "shaking", "diverging", "lost"];

export interface Trial {
  settings: Settings;
  /** Undefined while nothing was predicted, null where it is left open. */
  predicted: boolean | null | undefined;
  seen: Observed;
  /** For how long it ran, s. */
  held_s: number;
}

function shakes(seen: Observed): boolean {
  return ORDER.indexOf(seen) > ORDER.indexOf("quiet");
}

/** Which trials there were; no drawing. */
export class Trials {
  all: Trial[] = [];
  #first: Settings | null = null;
  #last_s: number | null = null;
  #now: Observed = "unknown";
  /** What was seen when the present settings came. */
  #before: Observed = "unknown";

  /** The session runs with these settings. */
  run(settings: Settings): void {
    this.#first ??= settings;
    const last = this.all.at(-1);
    if (last && same(last.settings, settings)) return;
    if (last && this.all.length > 1 && last.held_s < SHORTEST_S && !shakes(last.seen)) this.all.pop();
    if (this.all.length >= MOST) this.all.splice(1, 1);
    this.#before = this.#now;
    this.all.push({ settings: { ...settings }, predicted: undefined, seen: "unknown", held_s: 0 });
  }

  predict(stable: boolean | null): void {
    const last = this.all.at(-1);
    if (last) last.predicted = stable;
  }

  /** At this time of the session; one that begins anew goes on from where the last one was. */
  see(time_s: number, seen: Observed): void {
    const last = this.all.at(-1);
    const step_s = this.#last_s === null ? 0 : Math.max(0, time_s - this.#last_s);
    this.#last_s = time_s;
    this.#now = seen;
    if (!last) return;
    last.held_s += Math.min(step_s, 1);
    // What was quiet before shakes because of the present settings.
    const settled = !shakes(this.#before) || last.held_s >= SETTLING_S;
    if (settled && ORDER.indexOf(seen) > ORDER.indexOf(last.seen)) last.seen = seen;
  }

  /** What differs from what the lesson began with. */
  differences(trial: Trial): [string, number | string][] {
    return Object.entries(trial.settings).filter(([key, value]) => this.#first?.[key] !== value);
  }
}

function same(one: Settings, other: Settings): boolean {
  const keys = new Set([...Object.keys(one), ...Object.keys(other)]);
  return [...keys].every((key) => one[key] === other[key]);
}

/** Whether the session did what was predicted; null where that cannot be told. */
export function agrees({ predicted, seen }: Trial): boolean | null {
  if (typeof predicted !== "boolean" || ORDER.indexOf(seen) < ORDER.indexOf("quiet")) return null;
  return predicted === (seen === "quiet");
}

export function listTrials(trials: Trials, controls: readonly Control[]): HTMLElement {
  const words = (trial: Trial) => trials.differences(trial).map(([key, value]) => {
    const unit = controls.find((control) => control.key === key)?.unit ?? "";
    return `${label(key, controls)} ${typeof value === "number" ? withUnit(value, unit) : value}`;
  });
  const rows = trials.all.map((trial) => make("tr", { "data-agrees": String(agrees(trial)) },
    make("td", {}, words(trial).join(", ") || "as at first"),
    make("td", {}, trial.predicted === undefined ? "–" : verdictWord(trial.predicted)),
    make("td", {}, trial.seen === "unknown" ? "–" : OBSERVED[trial.seen].toLowerCase())));
  return make("table", { class: "modes trials" },
    make("thead", {}, make("tr", {}, ...["Settings", "Predicted", "The session"].map((name) => make("th", { scope: "col" }, name)))),
    make("tbody", {}, ...rows));
}
