// Panels beside each other over the same stretch of time: as many as fit.
import { channelsOf, type Channel, type PanelKind } from "./channels.ts";
import { make } from "./dom.ts";
import type { Source } from "./history.ts";
import { Panel, type PanelChoice } from "./panel.ts";
import type { Range } from "./scale.ts";
import type { About } from "../protocol.ts";

export interface DashboardEvents {
  onZoom(range: Range): void;
  onBack(): void;
  onPick(time_s: number): void;
  /** The panel at this place shows something else, or a panel came: what is drawn is out of date. */
  onChoice(place: number, choice: PanelChoice): void;
}

/** A panel narrower than this is hard to read, px. */
const LEAST_WIDTH = 340;

let dashboards = 0;

export class Dashboard {
  readonly element = make("div", { className: "dashboard" });
  readonly #panels: Panel[] = [];
  readonly #choices: PanelChoice[];
  readonly #sync = `cotouch-plots-${dashboards++}`;
  #session: { about: About; channels: readonly Channel[]; source: Source } | null = null;

  /** At most as many panels as `first` has, which they show at first from left to right. */
  constructor(first: readonly PanelKind[], readonly events: DashboardEvents, readonly sync?: string) {
    this.#choices = first.map((kind) => ({ kind, component: null }));
    new ResizeObserver(() => this.#fit()).observe(this.element);
    document.addEventListener("themechange", () => this.#panels.forEach((panel) => panel.recolour()));
  }

  introduce(about: About, source: Source, channels: readonly Channel[] = channelsOf(about)): void {
    this.#session = { about, channels, source };
    this.#panels.forEach((panel) => panel.introduce(about, channels, source));
    this.#fit();
  }

  draw(range: Range): void {
    this.#panels.forEach((panel) => panel.draw(range));
  }

  mark(time_s: number): void {
    this.#panels.forEach((panel) => panel.mark(time_s));
  }

  choose(place: number, choice: PanelChoice): void {
    this.#choices[place] = choice;
    this.#panels[place]?.choose(choice);
  }

  #fit(): void {
    const width = this.element.clientWidth;
    if (width === 0 || !this.#session) return;
    const wanted = Math.min(this.#choices.length, Math.max(1, Math.floor(width / LEAST_WIDTH)));
    while (this.#panels.length > wanted) this.#panels.pop()?.remove();
    while (this.#panels.length < wanted) this.#addPanel(this.#panels.length);
  }

  #addPanel(place: number): void {
    const choice = this.#choices[place];
    if (!choice) return;
    const panel = new Panel(choice, this.sync ?? this.#sync, {
      onZoom: (range) => this.events.onZoom(range),
      onBack: () => this.events.onBack(),
      onPick: (time_s) => this.events.onPick(time_s),
      onChoice: (changed) => {
        this.choose(place, changed);
        this.events.onChoice(place, changed);
      },
    });
    this.#panels.push(panel);
    this.element.append(panel.element);
    if (!this.#session) return;
    panel.introduce(this.#session.about, this.#session.channels, this.#session.source);
    this.events.onChoice(place, choice);
  }
}
