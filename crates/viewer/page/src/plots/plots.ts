// Live plots of what the pictures say.
import { channelsOf, Reader, type Channel } from "./channels.ts";
import { Dashboard } from "./dashboard.ts";
import { button, choice, make } from "./dom.ts";
import { History } from "./history.ts";
import "./plots.css";
import type { Range } from "./scale.ts";
import type { Picture } from "../picture.ts";
import type { About } from "../protocol.ts";

const WINDOWS_S = [5, 10, 30, 120] as const;
/** Rows that are kept: at least five minutes at 60 pictures a second. */
const CAPACITY = 24_000;
/** Charts are drawn at most this often. */
const LEAST_INTERVAL_MS = 50;
/** Drawing takes at most this share of the time. */
const MOST_SHARE = 0.15;

export class Plots {
  readonly #dashboard: Dashboard;
  readonly #pause: HTMLButtonElement;
  readonly #back: HTMLButtonElement;
  #window_s: number = 10;
  /** The time that the charts stand still at; null while they run. */
  #paused_s: number | null = null;
  #zoom: Range | null = null;
  #about = "";
  #channels: readonly Channel[] = [];
  #history = new History(0, 1);
  #reader: Reader | null = null;
  #visible = true;
  #drawn_ms = 0;
  #interval_ms = LEAST_INTERVAL_MS;

  constructor(element: HTMLElement) {
    this.#dashboard = new Dashboard(["forces", "positions", "round-trip"], {
      onZoom: (range) => this.#zoomTo(range),
      onBack: () => this.#zoomTo(null),
      onPick: () => {},
      onChoice: () => this.#draw(),
    });
    this.#pause = button("Pause", "Let the charts stand still; numbers are kept on", () => this.#togglePause());
    this.#pause.setAttribute("aria-pressed", "false");
    this.#back = button("Whole window", "Back from the stretch that was zoomed to", () => this.#zoomTo(null));
    this.#back.hidden = true;
    const windows = choice("How much time the charts show",
      WINDOWS_S.map((value) => ({ value, text: value < 60 ? `${value} s` : `${value / 60} min` })), this.#window_s,
      (window_s) => { this.#window_s = window_s; this.#zoomTo(null); });
    element.classList.add("plots");
    element.append(
      make("div", { className: "plots-bar" },
        make("h2", {}, "Plots"), this.#pause, make("label", {}, "Last ", windows), this.#back,
        make("span", { className: "plots-hint" }, "Drag to zoom, double click to go back.")),
      this.#dashboard.element,
    );
    new IntersectionObserver((entries) => {
      this.#visible = entries.at(-1)?.isIntersecting ?? true;
      this.#draw();
    }).observe(element);
  }

  /** Begins anew with another session. */
  introduce(about: About): void {
    const same = JSON.stringify(about) === this.#about;
    if (same) return;
    this.#about = JSON.stringify(about);
    this.#channels = channelsOf(about);
    this.#history = new History(this.#channels.length, CAPACITY);
    this.#reader = new Reader(about);
    this.#runOn();
    this.#dashboard.introduce(about, this.#history, this.#channels);
  }

  add(picture: Picture): void {
    if (!this.#reader) return;
    // A session that began anew, maybe with other settings, begins at zero.
    if (picture.time_s < this.#history.latest_s - 0.5) this.#forget();
    const scan = this.#reader.scan(picture);
    this.#history.add(picture.time_s, (column) => this.#channels[column]?.read(scan) ?? NaN);
    const due = performance.now() - this.#drawn_ms >= this.#interval_ms || picture.ended;
    if (due && this.#paused_s === null && this.#zoom === null) this.#draw();
  }

  #forget(): void {
    this.#history.clear();
    this.#runOn();
  }

  #runOn(): void {
    this.#zoom = null;
    if (this.#paused_s !== null) this.#togglePause();
    this.#back.hidden = true;
  }

  #togglePause(): void {
    this.#paused_s = this.#paused_s === null ? this.#history.latest_s : null;
    if (this.#paused_s === null) this.#zoom = null;
    this.#pause.textContent = this.#paused_s === null ? "Pause" : "Continue";
    this.#pause.setAttribute("aria-pressed", String(this.#paused_s !== null));
    this.#back.hidden = this.#zoom === null;
    this.#draw();
  }

  #zoomTo(range: Range | null): void {
    this.#zoom = range;
    this.#back.hidden = range === null;
    this.#draw();
  }

  #draw(): void {
    if (!this.#visible || document.hidden || !this.#reader) return;
    const begun_ms = performance.now();
    this.#dashboard.draw(this.#range());
    this.#drawn_ms = performance.now();
    this.#interval_ms = Math.max(LEAST_INTERVAL_MS, (this.#drawn_ms - begun_ms) / MOST_SHARE);
  }

  #range(): Range {
    if (this.#zoom) return this.#zoom;
    const end_s = this.#paused_s ?? this.#history.latest_s;
    const shown_s = Number.isNaN(end_s) ? this.#window_s : Math.max(end_s, this.#window_s);
    return [shown_s - this.#window_s, shown_s];
  }
}
