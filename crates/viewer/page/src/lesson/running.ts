// What the running session does: stable lately or shaking, how much it oscillates, which limits act.
import { colour, freshContext, make, say } from "../dom.ts";
import type { Picture } from "../picture.ts";
import { readable, share } from "./scale.ts";
import { limits, OBSERVED, observed, type Observed } from "./words.ts";

/** Of the oscillation's bar and trace, J. */
const SCALE = { low: 1e-10, high: 10, log: true };
/** More than this counts as shaking when it grows. */
const NOTICED_J = 1e-6;
const TRACE_S = 20;
/** Ten readings a second are plenty for the eye. */
const PACE_S = 0.1;

const VERDICTS: Record<Observed, string> = {
  unknown: "unknown", settled: "stable", shaking: "unstable", lost: "unstable", over: "unknown",
};

export class Running {
  readonly element: HTMLElement;
  seen: Observed = "unknown";
  #word = make("strong", { class: "word" });
  #energy = make("span", { class: "energy" });
  #trace = make("canvas", { class: "trace", role: "img", "aria-label": "Oscillation energy over the last 20 seconds" });
  #limits = make("p", { class: "small limits" });
  #history: { time_s: number; energy_j: number }[] = [];

  constructor() {
    this.element = make("div", { class: "running", "data-verdict": "unknown" },
      make("h3", {}, "The session"), this.#word, this.#trace, this.#energy, this.#limits);
    this.clear();
  }

  clear(): void {
    this.#history = [];
    this.#setSeen("unknown");
    say(this.#energy, "");
    say(this.#limits, "");
  }

  /** True when what is seen changed. */
  show(picture: Picture): boolean {
    const before = this.seen;
    this.#setSeen(observed(picture));
    const last = this.#history.at(-1);
    if (last && picture.time_s < last.time_s) this.#history = [];
    if (!last || picture.time_s - last.time_s >= PACE_S || before !== this.seen) {
      this.#history.push({ time_s: picture.time_s, energy_j: picture.oscillation_j });
      while (picture.time_s - this.#history[0]!.time_s > TRACE_S) this.#history.shift();
      say(this.#energy, `oscillation ${energyText(picture.oscillation_j)}`);
      say(this.#limits, limits(picture));
      this.#draw(picture.time_s);
    }
    return before !== this.seen;
  }

  #setSeen(seen: Observed): void {
    this.seen = seen;
    this.element.dataset["verdict"] = VERDICTS[seen];
    say(this.#word, OBSERVED[seen]);
  }

  /** Draws what was kept while nobody looked. */
  redraw(): void {
    const last = this.#history.at(-1);
    if (last) this.#draw(last.time_s);
  }

  #draw(now_s: number): void {
    const context = freshContext(this.#trace);
    if (!context) return;
    const [width, height] = [this.#trace.clientWidth, this.#trace.clientHeight];
    const level = (energy_j: number) => height - 2 - share(SCALE, energy_j) * (height - 4);
    context.strokeStyle = colour("--line");
    context.setLineDash([4, 3]);
    context.beginPath();
    context.moveTo(0, level(NOTICED_J));
    context.lineTo(width, level(NOTICED_J));
    context.stroke();
    context.setLineDash([]);
    context.strokeStyle = colour(this.element.dataset["verdict"] === "unstable" ? "--bad" : "--good");
    context.lineWidth = 2;
    context.lineJoin = "round";
    context.beginPath();
    for (const { time_s, energy_j } of this.#history) {
      context.lineTo(width * (1 - (now_s - time_s) / TRACE_S), level(energy_j));
    }
    context.stroke();
  }
}

/** Energy in the unit that fits. */
export function energyText(energy_j: number): string {
  if (!Number.isFinite(energy_j)) return "beyond all bounds";
  for (const [unit, size] of [["J", 1], ["mJ", 1e-3], ["µJ", 1e-6]] as const) {
    if (energy_j >= size) return `${readable(energy_j / size)} ${unit}`;
  }
  return energy_j < 1e-9 ? "below 1 nJ" : `${readable(energy_j / 1e-9)} nJ`;
}
