// The time line of recordings: a slider over what is here of each one, buttons, speed and offsets.
import { button, choice, make } from "../plots/dom.ts";
import { icon, type Icon } from "./icons.ts";
import { clock, type Span } from "./timeline.ts";

export interface BarEvents {
  onSeek(time_s: number): void;
  onPlay(): void;
  onStep(step: 1 | -1): void;
  onSpeed(speed: number): void;
  onRepeat(repeat: boolean): void;
  /** The recording with this index begins so much later than its own time says. */
  onOffset(index: number, offset_s: number): void;
}

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

export class Bar {
  readonly element = make("div", {
    className: "replay-bar card", attributes: { role: "group", "aria-label": "Time line" },
  });
  readonly #play = this.#signed("play", "Play (space)", () => this.events.onPlay());
  readonly #slider = make("input", {
    type: "range", min: "0", step: "any", value: "0", className: "replay-slider", attributes: { "aria-label": "Time" },
  });
  readonly #time = make("output", { className: "replay-time" });
  readonly #status = make("p", { className: "replay-status", attributes: { role: "status" } });
  readonly #strips: HTMLElement[];
  #length_s = 0;

  constructor(names: readonly string[], readonly events: BarEvents) {
    this.#strips = names.map((name) => make("div", { className: "replay-strip", title: `What is here of ${name}` }));
    this.#slider.addEventListener("input", () => this.events.onSeek(this.#slider.valueAsNumber));
    const repeat = make("input", { type: "checkbox" });
    repeat.addEventListener("change", () => this.events.onRepeat(repeat.checked));
    this.element.append(
      make("div", { className: "replay-track" },
        make("div", { className: "replay-strips" }, ...this.#strips), this.#slider),
      make("div", { className: "replay-controls" },
        make("div", { className: "replay-buttons" },
          this.#signed("start", "To the start (Home)", () => this.events.onSeek(0)),
          this.#signed("back", "One picture back (left arrow)", () => this.events.onStep(-1)),
          this.#play,
          this.#signed("forward", "One picture on (right arrow)", () => this.events.onStep(1)),
          this.#signed("end", "To the end (End)", () => this.events.onSeek(this.#length_s))),
        this.#time,
        make("label", {}, "Speed ", choice("Speed", SPEEDS.map((value) => ({ value, text: `${value}×` })), 1,
          (speed) => this.events.onSpeed(speed))),
        make("label", {}, repeat, " Repeat"),
        ...names.slice(1).map((name, index) => this.#offset(name, index + 1))),
      this.#status,
    );
  }

  showTime(time_s: number, playing: boolean): void {
    if (document.activeElement !== this.#slider || playing || this.#slider.valueAsNumber !== time_s) {
      this.#slider.value = String(time_s);
    }
    const text = `${clock(time_s)} / ${clock(this.#length_s)}`;
    if (this.#time.textContent !== text) {
      this.#time.textContent = text;
      this.#slider.setAttribute("aria-valuetext", text);
    }
    const title = playing ? "Pause (space)" : "Play (space)";
    if (this.#play.title === title) return;
    this.#play.title = title;
    this.#play.setAttribute("aria-label", title);
    this.#play.replaceChildren(icon(playing ? "pause" : "play"));
  }

  /** Where each recording lies, and which parts of it are here (in its own time). */
  showRanges(length_s: number, spans: readonly Span[], ranges: readonly (readonly [number, number][])[]): void {
    this.#length_s = length_s;
    this.#slider.max = String(length_s);
    const share = (time_s: number) => `${length_s > 0 ? (100 * time_s) / length_s : 0}%`;
    this.#strips.forEach((strip, index) => {
      const span = spans[index];
      if (!span) return;
      strip.style.marginLeft = share(span.begins_s);
      strip.style.width = share(span.duration_s);
      strip.replaceChildren(...(ranges[index] ?? []).map(([from_s, to_s]) => {
        const part = make("div", { className: "replay-here" });
        part.style.left = `${(100 * from_s) / Math.max(1e-9, span.duration_s)}%`;
        part.style.width = `${(100 * (to_s - from_s)) / Math.max(1e-9, span.duration_s)}%`;
        return part;
      }));
    });
  }

  say(text: string, isTrouble: boolean): void {
    if (this.#status.textContent !== text) this.#status.textContent = text;
    this.#status.classList.toggle("is-trouble", isTrouble);
  }

  #signed(name: Icon, title: string, onClick: () => void): HTMLButtonElement {
    const made = button("", title, onClick);
    made.setAttribute("aria-label", title);
    made.append(icon(name));
    return made;
  }

  #offset(name: string, index: number): HTMLElement {
    const input = make("input", { type: "number", step: "0.01", value: "0", className: "replay-offset" });
    input.addEventListener("input", () => {
      if (Number.isFinite(input.valueAsNumber)) this.events.onOffset(index, input.valueAsNumber);
    });
    return make("label", {}, `${name} begins `, input, " s later");
  }
}
