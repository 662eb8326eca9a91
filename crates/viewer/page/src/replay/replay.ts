// Recordings with a time line, one or several side by side.
import { make } from "../plots/dom.ts";
import "../plots/plots.css";
import type { Range } from "../plots/scale.ts";
import type { SessionMessage } from "../protocol.ts";
import { Bar } from "./bar.ts";
import "./replay.css";
import { Stage } from "./stage.ts";
import { advanced, lengthOf, spansOf, type Span } from "./timeline.ts";

/** Shows the session's recordings: their scenes in `views`, the time line and the plots in `element`. */
export function createReplay(element: HTMLElement, views: HTMLElement, session: SessionMessage): void {
  element.hidden = false;
  if (session.recordings.length === 0) {
    element.replaceChildren(make("p", { className: "replay-status is-trouble" }, "There is no recording to show."));
    return;
  }
  new Replay(element, views, session);
}

/** Plots take in what came this often, and their mark moves this often. */
const PLOTS_MS = 300;
const MARK_MS = 40;

class Replay {
  readonly #session: SessionMessage;
  readonly #bar: Bar;
  readonly #stages: Stage[];
  readonly #offsets_s: number[];
  #spans: Span[] = [];
  #length_s = 0;
  #time_s = 0;
  #playing = false;
  #speed = 1;
  #repeat = false;
  #zoom: Range | null = null;
  #frame_ms = 0;
  #plots_ms = -Infinity;
  #mark_ms = -Infinity;
  /** What is here of the recordings changed since it was last shown. */
  #changed = true;

  constructor(element: HTMLElement, views: HTMLElement, session: SessionMessage) {
    this.#session = session;
    this.#offsets_s = session.recordings.map(() => 0);
    this.#bar = new Bar(session.recordings.map(({ name }) => name), {
      onSeek: (time_s) => this.#seek(time_s),
      onPlay: () => this.#togglePlaying(),
      onStep: (step) => this.#step(step),
      onSpeed: (speed) => { this.#speed = speed; },
      onRepeat: (repeat) => { this.#repeat = repeat; },
      onOffset: (index, offset_s) => this.#moveRecording(index, offset_s),
    });
    const scenes = make("div", { className: "replay-views" });
    views.replaceChildren(scenes);
    this.#stages = session.recordings.map((info, index) => this.#stage(info, index));
    scenes.append(...this.#stages.map(({ figure }) => figure));
    this.#stages.forEach((stage) => stage.begin());
    element.replaceChildren(this.#bar.element,
      make("div", { className: "replay-plots card" }, ...this.#stages.map(({ dashboard }) => dashboard.element)));
    document.addEventListener("keydown", (event) => this.#key(event));
    this.#arrange();
    requestAnimationFrame((now_ms) => this.#frame(now_ms));
  }

  #stage(info: SessionMessage["recordings"][number], index: number): Stage {
    const stage = new Stage(info, index, {
      onZoom: (range) => this.#zoomTo(range),
      onBack: () => this.#zoomTo(null),
      onPick: (time_s) => this.#seek(time_s),
      // Side by side, the same is compared: all recordings show it.
      onChoice: (place, choice) => {
        for (const other of this.#stages) if (other !== stage) other.dashboard.choose(place, choice);
        this.#plots_ms = -Infinity;
      },
    });
    stage.buffer.onChange = () => { this.#changed = true; };
    return stage;
  }

  #arrange(): void {
    this.#spans = spansOf(this.#session.recordings.map(({ duration_s }) => duration_s), this.#offsets_s);
    this.#length_s = lengthOf(this.#spans);
    this.#time_s = Math.min(this.#time_s, this.#length_s);
    this.#zoom = null;
    this.#changed = true;
    this.#plots_ms = -Infinity;
  }

  #frame(now_ms: number): void {
    const elapsed_s = (now_ms - this.#frame_ms) / 1000;
    this.#frame_ms = now_ms;
    if (this.#playing) this.#play(elapsed_s);
    this.#each((stage, span) => stage.show(span, this.#time_s));
    this.#showPlots(now_ms);
    if (this.#changed) {
      this.#changed = false;
      this.#bar.showRanges(this.#length_s, this.#spans, this.#stages.map(({ buffer }) => buffer.ranges()));
    }
    this.#bar.showTime(this.#time_s, this.#playing);
    this.#tell();
    requestAnimationFrame((next_ms) => this.#frame(next_ms));
  }

  #play(elapsed_s: number): void {
    const next_s = advanced(this.#time_s, elapsed_s, this.#speed, this.#length_s);
    if (!this.#isHere(next_s)) return;
    this.#time_s = next_s;
    if (next_s < this.#length_s) return;
    if (this.#repeat) this.#time_s = 0;
    else this.#playing = false;
  }

  #isHere(time_s: number): boolean {
    return this.#stages.every((stage, index) => stage.isHere(this.#spans[index] as Span, time_s));
  }

  #showPlots(now_ms: number): void {
    if (now_ms - this.#plots_ms >= PLOTS_MS) {
      const isFirst = this.#plots_ms === -Infinity;
      this.#plots_ms = now_ms;
      this.#each((stage, span) => {
        if (stage.update(span) || isFirst) stage.dashboard.draw(this.#zoom ?? [0, this.#length_s]);
      });
    }
    if (now_ms - this.#mark_ms < MARK_MS) return;
    this.#mark_ms = now_ms;
    this.#stages.forEach(({ dashboard }) => dashboard.mark(this.#time_s));
  }

  #tell(): void {
    const troubles = this.#stages.map(({ trouble }) => trouble).filter((trouble) => trouble !== null);
    if (troubles.length > 0) this.#bar.say(`${troubles.join("; ")}. Asking again.`, true);
    else this.#bar.say(this.#isHere(this.#time_s) ? "" : "Loading…", false);
  }

  #seek(time_s: number): void {
    this.#time_s = Math.min(this.#length_s, Math.max(0, time_s));
  }

  #togglePlaying(): void {
    this.#playing = !this.#playing;
    if (this.#playing && this.#time_s >= this.#length_s) this.#time_s = 0;
  }

  /** To the nearest picture of any recording on that side. */
  #step(step: 1 | -1): void {
    this.#playing = false;
    const times = this.#stages
      .map((stage, index) => stage.beside(this.#spans[index] as Span, this.#time_s, step))
      .filter((time_s) => time_s !== null && step * (time_s - this.#time_s) > 1e-9) as number[];
    if (times.length > 0) this.#seek(step === 1 ? Math.min(...times) : Math.max(...times));
  }

  #zoomTo(range: Range | null): void {
    this.#zoom = range;
    this.#plots_ms = -Infinity;
  }

  #moveRecording(index: number, offset_s: number): void {
    this.#offsets_s[index] = offset_s;
    this.#arrange();
  }

  #key(event: KeyboardEvent): void {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target instanceof HTMLElement ? event.target : document.body;
    const isSlider = target.classList.contains("replay-slider");
    if (!isSlider && target.closest("input, select, textarea")) return;
    if (event.key === " " && target.closest("button, summary, a")) return;
    const actions: Record<string, () => void> = {
      " ": () => this.#togglePlaying(),
      ArrowLeft: () => (event.shiftKey ? this.#seek(this.#time_s - 1) : this.#step(-1)),
      ArrowRight: () => (event.shiftKey ? this.#seek(this.#time_s + 1) : this.#step(1)),
      PageDown: () => this.#seek(this.#time_s - 5),
      PageUp: () => this.#seek(this.#time_s + 5),
      Home: () => this.#seek(0),
      End: () => this.#seek(this.#length_s),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  #each(act: (stage: Stage, span: Span) => void): void {
    this.#stages.forEach((stage, index) => act(stage, this.#spans[index] as Span));
  }
}
