// The lesson: controls, what the analysis predicts for them, and beside it what the running session does.
import "./lesson.css";
import type { Send } from "../connection.ts";
import { make, say } from "../dom.ts";
import type { Control, FailedMessage, SessionMessage, Settings, VerdictMessage } from "../protocol.ts";
import type { Store } from "../store.ts";
import { listMargins, listModes, listWarnings } from "./answers.ts";
import { Asking } from "./asking.ts";
import { AxesChoice, axisOf } from "./axes.ts";
import { Contact } from "./contact.ts";
import { Controls, followHelp } from "./controls.ts";
import { Gauge } from "./gauge.ts";
import { StabilityMap } from "./map.ts";
import { Running } from "./running.ts";
import { Setting } from "./setting.ts";
import { listTrials, Trials } from "./tried.ts";
import { agreement, growth } from "./words.ts";

const CLOCK = {
  now: () => performance.now(),
  later: (run: () => void, delay_ms: number) => setTimeout(run, delay_ms),
};
/** After a move, the session is given this long to follow. */
const SETTLED_MS = 1500;
const MAY_CHANGE = "↻ begins the session anew. Point at a control to read what it is.";
const MAY_ASK = "Settings can be changed where all users run in one program (`cotouch run`), by a browser on that "
  + "computer. Here the controls ask: what if?";

export function createLesson(element: HTMLElement, store: Store, send: Send): void {
  new Lesson(element, store, send);
}

class Lesson {
  #element: HTMLElement;
  #store: Store;
  #send: Send;
  #asking: Asking;
  #setting: Setting;
  #gauge = new Gauge();
  #running = new Running();
  #contact = new Contact();
  #trials = new Trials();
  #tried = make("div");
  #controls: Controls;
  #axes = new AxesChoice(() => this.#axesChanged());
  #map = new StabilityMap((values) => this.#pick(values), () => this.#picked());
  #verdict: VerdictMessage | null = null;
  /** What the controls show. */
  #wanted: Settings = {};
  /** Keys that this page has moved in this session, and when: every question names them, whatever the server knows. */
  #touched = new Map<string, number>();
  #agreement = make("p", { class: "agreement", role: "status" });
  #growth = make("p", { class: "small muted" });
  #note = make("p", { class: "small note", role: "status" });
  #help = make("p", { class: "small muted help-line" });
  #modes = make("div");
  #margins = make("div");
  #mapState = make("p", { class: "small muted map-state" });
  #again = make("button", { type: "button" }, "Begin again");

  constructor(element: HTMLElement, store: Store, send: Send) {
    this.#element = element;
    this.#store = store;
    this.#send = send;
    this.#asking = new Asking(send, CLOCK);
    this.#setting = new Setting((settings) => send({ type: "set", settings }), CLOCK);
    this.#controls = new Controls({
      moved: (control, value) => this.#moved(control, value),
      released: (control, value) => this.#released(control, value),
      refused: (_, why) => say(this.#help, why),
    });
    this.#layOut();
    this.#listen();
  }

  #layOut(): void {
    this.#again.addEventListener("click", () => this.#beginAgain());
    this.#element.append(
      make("div", { class: "verdicts" },
        make("div", { class: "pair" },
          make("div", { class: "predicted" }, make("h3", {}, "Predicted"), this.#gauge.element),
          this.#running.element),
        this.#agreement, this.#growth),
      this.#contact.element,
      make("div", { class: "map-part" },
        make("h3", {}, "Where it is stable"), this.#axes.element, this.#map.canvas, this.#mapState),
      make("div", { class: "controls-head" }, make("h3", {}, "Settings"), this.#again),
      this.#note, this.#controls.element, this.#help,
      make("h3", {}, "What was tried"), this.#tried,
      make("h3", {}, "Contact modes, worst first"), this.#modes,
      make("h3", {}, "Margins"), this.#margins,
    );
  }

  #listen(): void {
    const store = this.#store;
    store.on("session", (session) => this.#begin(session));
    store.on("settings", ({ settings, note }) => this.#settings(settings, note));
    store.on("picture", (picture) => {
      if (this.#running.show(picture)) this.#showAgreement();
      this.#trials.see(picture.time_s, this.#running.seen);
      this.#showTrials();
      this.#contact.show(picture, store.settings?.settings ?? {}, store.taken?.user ?? null);
    });
    store.on("refused", ({ what }) => { if (what === "set") this.#revert(); });
    store.on("verdict", (verdict) =>
      this.#answered(verdict.id, "verdict", () => this.#showVerdict(verdict), true, verdict.whole));
    store.on("margin", (margin) => this.#answered(margin.id, "margin", () =>
      this.#margins.replaceChildren(listMargins(margin, this.#known()))));
    store.on("map", (map) => this.#answered(map.id, "map", () => this.#map.show(map), map.complete));
    // A hand that a pointer moves is held by another spring than its script's: another loop.
    store.on("seats", () => this.#ask());
    store.on("failed", (failed) => this.#answered(failed.id, failed.what, () => this.#failed(failed)));
    store.on("trouble", (trouble) => { if (trouble) this.#asking.forget(); });
    this.#element.addEventListener("tabshown", () => { this.#running.redraw(); this.#ask(); });
    document.addEventListener("visibilitychange", () => this.#ask());
  }

  #known(): Control[] {
    return this.#store.session?.controls ?? [];
  }

  #begin(session: SessionMessage): void {
    this.#asking.forget();
    this.#touched.clear();
    this.#wanted = {};
    this.#verdict = null;
    this.#gauge.clear();
    this.#running.clear();
    this.#contact.introduce(session.about);
    this.#controls.build(session.controls);
    followHelp(this.#controls.element, this.#help, session.may_change ? MAY_CHANGE : MAY_ASK);
    this.#axes.build(session.controls, session.about.soft?.local_model.kind === "pi");
    this.#again.hidden = !session.may_change;
    this.#setAxes();
    this.#showAgreement();
  }

  #settings(settings: Settings, note: string): void {
    say(this.#note, note);
    this.#trials.run(settings);
    const before = JSON.stringify(this.#wanted);
    for (const [key, value] of Object.entries(settings)) {
      if (this.#takesOver(key, value)) this.#wanted[key] = value;
    }
    if (this.#store.session?.may_change && this.#touched.size > 0) {
      setTimeout(() => this.#settings(this.#store.settings!.settings, this.#store.settings!.note), SETTLED_MS);
    }
    this.#controls.show(this.#wanted);
    this.#mark();
    this.#showAgreement();
    if (JSON.stringify(this.#wanted) !== before) this.#ask();
  }

  /** Whether a control follows the session: not while this page asks "what if?", nor just after it was moved. */
  #takesOver(key: string, value: number | string): boolean {
    const moved_at = this.#touched.get(key);
    if (moved_at === undefined) return true;
    if (!this.#store.session?.may_change) return false;
    if (this.#wanted[key] !== value && performance.now() - moved_at < SETTLED_MS) return false;
    this.#touched.delete(key);
    return true;
  }

  /** The session does not do what was asked for: show what it does. */
  #revert(): void {
    this.#touched.clear();
    this.#controls.release();
    const settings = this.#store.settings;
    if (settings) this.#settings(settings.settings, settings.note);
  }

  #beginAgain(): void {
    this.#running.clear();
    this.#showAgreement();
    this.#send({ type: "again" });
  }

  #moved(control: Control, value: number | string): void {
    this.#wanted[control.key] = value;
    this.#touched.set(control.key, performance.now());
    if (this.#store.session?.may_change) this.#setting.moved(control, value);
    this.#mark();
    this.#showAgreement();
    this.#ask();
  }

  #released(control: Control, value: number | string): void {
    if (this.#store.session?.may_change) this.#setting.released(control, value);
  }

  #pick(values: { x: number; y: number }): void {
    const axes = this.#axes.axes;
    if (!axes) return;
    for (const axis of ["x", "y"] as const) {
      if (this.#wanted[axes[axis].key] === values[axis]) continue;
      this.#controls.put(axes[axis].key, values[axis]);
      this.#moved(axes[axis], values[axis]);
    }
  }

  #picked(): void {
    const axes = this.#axes.axes;
    if (!axes) return;
    for (const control of [axes.x, axes.y]) {
      const value = this.#wanted[control.key];
      if (value !== undefined && this.#touched.has(control.key)) this.#released(control, value);
    }
  }

  #axesChanged(): void {
    this.#setAxes();
    this.#ask();
  }

  #setAxes(): void {
    const axes = this.#axes.axes;
    this.#map.canvas.parentElement!.hidden = axes === null;
    if (axes) this.#map.setAxes(axes.x, axes.y);
    this.#mark();
  }

  #mark(): void {
    this.#map.mark(this.#placeIn(this.#wanted), this.#placeIn(this.#store.settings?.settings ?? {}));
  }

  #placeIn(settings: Settings): { x: number; y: number } | null {
    const axes = this.#axes.axes;
    if (!axes) return null;
    const [x, y] = [settings[axes.x.key], settings[axes.y.key]];
    return typeof x === "number" && typeof y === "number" ? { x, y } : null;
  }

  /** Asks for what is shown: the verdict always, since the header has it too. */
  #ask(): void {
    const session = this.#store.session;
    if (!session || session.mode !== "live" || session.controls.length === 0 || document.hidden) return;
    if (Object.keys(this.#wanted).length === 0) return;
    const shown = !this.#element.hidden;
    const axes = this.#axes.axes;
    const settings = Object.fromEntries([...this.#touched.keys()].map((key) => [key, this.#wanted[key]!]));
    const others = Object.entries(this.#wanted).filter(([key]) => key !== axes?.x.key && key !== axes?.y.key);
    this.#asking.wish({
      settings,
      axes: shown && axes ? { x: axisOf(axes.x), y: axisOf(axes.y) } : null,
      mapKey: JSON.stringify([session.generation, axes?.x.key, axes?.y.key, others.sort(), this.#store.pointers()]),
      margin: shown,
    });
    this.#showBusy();
  }

  #answered(id: number, what: "verdict" | "margin" | "map", show: () => void, complete = true, whole = true): void {
    if (!this.#asking.answered(id, what, complete, whole)) return;
    show();
    this.#showBusy();
  }

  #showVerdict(verdict: VerdictMessage): void {
    this.#verdict = verdict;
    if (this.#isWhatRuns()) this.#trials.predict(verdict.stable);
    this.#gauge.show(verdict.spectral_radius, verdict.stable);
    this.#growth.textContent = growth(verdict);
    const warnings = listWarnings(verdict.warnings);
    this.#modes.replaceChildren(listModes(verdict), ...(warnings ? [warnings] : []));
    this.#showAgreement();
  }

  #failed({ what, why }: FailedMessage): void {
    if (what === "margin") this.#margins.replaceChildren(make("p", { class: "small" }, `No margins: ${why}`));
    if (what === "map") this.#map.show(null);
    if (what !== "margin") say(this.#mapState, `No ${what === "map" ? "map" : "verdict"}: ${why}`);
    if (what !== "verdict") return;
    this.#verdict = null;
    this.#gauge.clear();
    say(this.#growth, "");
    say(this.#agreement, `No prediction: ${why}`);
  }

  #showBusy(): void {
    const waits = this.#asking.waitsFor;
    this.#gauge.setBusy(waits.has("verdict"));
    this.#map.canvas.classList.toggle("busy", waits.has("map"));
    const legend = this.#store.session?.may_change
      ? "Cross: these settings. Ring: what runs. Click to go there."
      : "Cross: what if. Ring: what runs. Click to ask about a place.";
    if (!this.#mapState.textContent?.startsWith("No ") || waits.has("map")) {
      say(this.#mapState, waits.has("map") ? "Computing the map…" : legend);
    }
    if (waits.has("margin")) this.#margins.replaceChildren(make("p", { class: "small muted" }, "Computing…"));
  }

  /** Whether the controls show what the session is set to. */
  #isWhatRuns(): boolean {
    const running = this.#store.settings?.settings ?? {};
    return Object.entries(this.#wanted).every(([key, value]) => running[key] === value);
  }

  /** Drawn anew only where it changed: pictures come sixty times a second. */
  #showTrials(): void {
    const table = listTrials(this.#trials, this.#known());
    if (table.innerHTML !== this.#tried.firstElementChild?.innerHTML) this.#tried.replaceChildren(table);
  }

  #showAgreement(): void {
    const same = this.#isWhatRuns();
    const predicted = this.#verdict?.stable;
    const seen = predicted ? ["quiet"] : ["shaking", "diverging", "lost"];
    const agrees = typeof predicted === "boolean" && same && seen.includes(this.#running.seen);
    this.#agreement.dataset["agrees"] = String(agrees);
    say(this.#agreement, agreement(predicted, this.#running.seen, same));
  }
}
