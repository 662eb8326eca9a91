// What the running session does: quiet, shaking or diverging, how strongly, and which limits act.
import { colour, freshContext, make, say } from "../dom.ts";
import type { Picture } from "../picture.ts";
import { readable, share } from "./scale.ts";
import { lateness, limits, OBSERVED, observed, type Observed } from "./words.ts";

/** Of the trace of the force above 8 Hz, N rms. */
const SCALE = { low: 1e-5, high: 100, log: true };
/** More than this for half a second is shaking. */
const NOTICED_N = 0.05;
const TRACE_S = 20;
/** Ten readings a second are plenty for the eye. */
const PACE_S = 0.1;

const VERDICTS: Record<Observed, string> = {
  unknown: "unknown", quiet: "stable", shaking: "unstable", diverging: "unstable", lost: "unstable", over: "unknown",
};

export class Running {
  readonly element: HTMLElement;
  seen: Observed = "unknown";
  #word = make("strong", { class: "word" });
  #force = make("span", { class: "force" });
  #trace = make("canvas", { class: "trace", role: "img", "aria-label": "Force above 8 Hz over the last 20 seconds" });
  #limits = make("p", { class: "small limits" });
  #history: { time_s: number; force_n: number }[] = [];

  constructor() {
    this.element = make("div", { class: "running", "data-verdict": "unknown" },
      make("h3", {}, "The session"), this.#word, this.#trace, this.#force, this.#limits);
    this.clear();
  }

  clear(): void {
    this.#history = [];
    this.#setSeen("unknown");
    say(this.#force, "");
    say(this.#limits, "");
  }

  /** True when what is seen changed. */
  show(picture: Picture): boolean {
    const before = this.seen;
    this.#setSeen(observed(picture));
    const last = this.#history.at(-1);
    if (last && picture.time_s < last.time_s) this.#history = [];
    if (!last || picture.time_s - last.time_s >= PACE_S || before !== this.seen) {
      this.#history.push({ time_s: picture.time_s, force_n: picture.fast_force_n });
      while (picture.time_s - this.#history[0]!.time_s > TRACE_S) this.#history.shift();
      say(this.#force, `${forceText(picture.fast_force_n)} above 8 Hz`);
      say(this.#limits, [limits(picture), lateness(picture)].filter(Boolean).join(". "));
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
    const level = (force_n: number) => height - 2 - share(SCALE, force_n) * (height - 4);
    context.strokeStyle = colour("--line");
    context.setLineDash([4, 3]);
    context.beginPath();
    context.moveTo(0, level(NOTICED_N));
    context.lineTo(width, level(NOTICED_N));
    context.stroke();
    context.setLineDash([]);
    context.strokeStyle = colour(this.element.dataset["verdict"] === "unstable" ? "--bad" : "--good");
    context.lineWidth = 2;
    context.lineJoin = "round";
    context.beginPath();
    for (const { time_s, force_n } of this.#history) {
      context.lineTo(width * (1 - (now_s - time_s) / TRACE_S), level(force_n));
    }
    context.stroke();
  }
}

/** An rms force in the unit that fits. */
export function forceText(force_n: number): string {
  if (force_n >= 1) return `${readable(force_n)} N`;
  return force_n < 1e-5 ? "below 0.01 mN" : `${readable(force_n / 1e-3)} mN`;
}
