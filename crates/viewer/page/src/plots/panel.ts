// A chart with its choice of what to plot, its legend with values, and its files.
import { Chart, dashOf, type ChartEvents, type Line } from "./chart.ts";
import { componentsOf, PANELS, type Channel, type Component, type PanelAbout, type PanelKind } from "./channels.ts";
import { button, choice, make } from "./dom.ts";
import type { Source } from "./history.ts";
import { colour, userColour } from "./palette.ts";
import { csvOf, download, fileName, pictureOf } from "./save.ts";
import { readable, type Range } from "./scale.ts";
import type { About } from "../protocol.ts";

/** What a panel shows, whatever session it is of. */
export interface PanelChoice {
  kind: PanelKind;
  component: Component | null;
}

export interface PanelEvents extends Omit<ChartEvents, "onCursor"> {
  onChoice(choice: PanelChoice): void;
}

/** A saved picture of a chart, in pixels before it is enlarged. */
const SAVED = { width: 900, height: 380, enlarged: 2 };
const COMPONENT_NAMES: Record<Component, string> = { size: "size", x: "x", y: "y", z: "z" };

export class Panel {
  readonly element = make("figure", { className: "panel" });
  readonly #heading = make("figcaption", { className: "panel-heading" });
  readonly #frame = make("div", { className: "panel-chart", tabIndex: 0 });
  readonly #nothing = make("p", { className: "panel-nothing", hidden: true });
  /** Which time the values in the legend are of. */
  readonly #time = make("span", { className: "panel-time" });
  readonly #legend = make("div", { className: "panel-legend", attributes: { role: "group", "aria-label": "Lines" } });
  readonly #hidden = new Set<string>();
  #values: HTMLElement[] = [];
  #chart: Chart | null = null;
  #choice: PanelChoice;
  #about: About | null = null;
  #channels: readonly Channel[] = [];
  #source: Source | null = null;

  constructor(wanted: PanelChoice, readonly sync: string, readonly events: PanelEvents) {
    this.#choice = wanted;
    this.element.append(this.#heading, this.#frame, this.#legend);
    this.#frame.append(this.#nothing, this.#time);
    this.#frame.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#resize()).observe(this.#frame);
  }

  /** Begins anew with another session. */
  introduce(about: About, channels: readonly Channel[], source: Source): void {
    this.#about = about;
    this.#channels = channels;
    this.#source = source;
    this.#build();
  }

  draw(range: Range): void {
    if (!this.#chart || !this.#source) return;
    this.#nothing.hidden = this.#chart.draw(this.#source, range);
    this.#tellValues();
  }

  /** A line at this time, and its values in the legend. */
  mark(time_s: number): void {
    if (!this.#chart?.mark(time_s)) return;
    this.#tellValues();
  }

  choose(wanted: PanelChoice): void {
    this.#choice = wanted;
    this.#build();
  }

  recolour(): void {
    this.#chart?.recolour();
    this.#buildLegend();
  }

  get #panel(): PanelAbout {
    return PANELS.find(({ kind }) => kind === this.#choice.kind) as PanelAbout;
  }

  /** The component that is shown: the chosen one where this scene has it. */
  get #component(): Component | null {
    if (!this.#about) return null;
    const possible = componentsOf(this.#about, this.#choice.kind);
    return possible.find((each) => each === this.#choice.component) ?? possible[0] ?? null;
  }

  get #lines(): Line[] {
    const component = this.#component;
    return this.#channels
      .map((channel, index) => ({ channel, index }))
      .filter(({ channel }) => channel.kind === this.#choice.kind && channel.component === component);
  }

  #build(): void {
    this.#chart?.destroy();
    this.#chart = new Chart(this.#frame, {
      about: this.#panel,
      lines: this.#lines,
      hidden: this.#hidden,
      sync: this.sync,
      width: this.#frame.clientWidth,
      height: this.#frame.clientHeight,
      enlarged: 1,
    }, {
      onZoom: (range) => this.events.onZoom(range),
      onBack: () => this.events.onBack(),
      onPick: (time_s) => this.events.onPick(time_s),
      onCursor: () => this.#tellValues(),
    });
    this.#nothing.textContent = this.#panel.nothing;
    this.#frame.setAttribute("role", "application");
    this.#frame.setAttribute("aria-roledescription", "chart");
    this.#frame.setAttribute("aria-label",
      `${this.#panel.title} over time. Left and right arrows move the cursor, plus and minus zoom, Escape goes back.`);
    this.#buildHeading();
    this.#buildLegend();
  }

  remove(): void {
    this.#chart?.destroy();
    this.element.remove();
  }

  #buildHeading(): void {
    const possible = this.#about ? componentsOf(this.#about, this.#choice.kind) : [];
    const components = possible.length < 2 ? [] : [
      choice("Which component", possible.map((value) => ({ value, text: COMPONENT_NAMES[value] })),
        this.#component ?? "x", (component) => this.events.onChoice({ ...this.#choice, component })),
    ];
    this.#heading.replaceChildren(
      choice("What to plot", PANELS.map(({ kind, name }) => ({ value: kind, text: name })), this.#choice.kind,
        (kind) => this.events.onChoice({ kind, component: null })),
      ...components,
      make("span", { className: "panel-space" }),
      button("PNG", "Save this chart as a picture", () => void this.#savePicture()),
      button("CSV", "Save all numbers of this chart as a table", () => this.#saveTable()),
    );
  }

  #buildLegend(): void {
    this.#values = [];
    const items = this.#lines.map(({ channel }) => {
      const swatch = make("span", { className: "legend-line" });
      swatch.style.borderTopColor = userColour(channel.user);
      swatch.style.borderTopStyle = channel.dash === 0 ? "solid" : channel.dash === 1 ? "dashed" : "dotted";
      swatch.style.borderTopWidth = channel.width > 2 ? "4px" : "2px";
      const value = make("span", { className: "legend-value" });
      this.#values.push(value);
      const item = make("button", {
        type: "button", className: "legend-item", title: "Show or hide this line",
        attributes: { "aria-pressed": String(!this.#hidden.has(channel.label)) },
      }, swatch, make("span", { className: "legend-label" }, channel.label), value);
      item.addEventListener("click", () => this.#toggle(channel.label, item));
      return item;
    });
    this.#legend.replaceChildren(...items);
    this.#tellValues();
  }

  #toggle(label: string, item: HTMLElement): void {
    if (!this.#hidden.delete(label)) this.#hidden.add(label);
    item.setAttribute("aria-pressed", String(!this.#hidden.has(label)));
    this.#chart?.show(this.#hidden);
  }

  #tellValues(): void {
    const chart = this.#chart;
    if (!chart) return;
    const { unit, factor } = this.#panel.shown;
    setText(this.#time, Number.isNaN(chart.time_s) ? "" : `at ${chart.time_s.toFixed(2)} s`);
    this.#values.forEach((element, line) => {
      const value = chart.value(line);
      setText(element, `${readable(typeof value === "number" ? value * factor : null)} ${unit}`);
    });
  }

  #key(event: KeyboardEvent): void {
    const chart = this.#chart;
    if (!chart || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? 30 : 1;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => chart.moveCursor(-step),
      ArrowRight: () => chart.moveCursor(step),
      "+": () => this.#zoomBy(0.5),
      "=": () => this.#zoomBy(0.5),
      "-": () => this.#zoomBy(2),
      Enter: () => this.events.onPick(chart.time_s),
      Escape: () => { chart.leaveCursor(); this.events.onBack(); },
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }

  /** About the cursor, or about the middle of what is shown. */
  #zoomBy(factor: number): void {
    const range = this.#chart?.range;
    if (!range || !this.#chart) return;
    const about = this.#chart.cursor === null ? (range[0] + range[1]) / 2 : this.#chart.time_s;
    this.events.onZoom([about - factor * (about - range[0]), about + factor * (range[1] - about)]);
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.#frame;
    if (clientWidth > 0 && clientHeight > 0) this.#chart?.resize(clientWidth, clientHeight);
  }

  /** Drawn anew and larger: what is saved is looked at elsewhere. */
  async #savePicture(): Promise<void> {
    const range = this.#chart?.range;
    if (!range || !this.#source || !this.#about) return;
    const component = this.#component;
    const detail = component === null || component === "size" ? "" : `, ${component}`;
    const shown = this.#lines.filter(({ channel }) => !this.#hidden.has(channel.label));
    const large = new Chart(document.createElement("div"), {
      about: this.#panel, lines: shown, hidden: new Set(), sync: null, enlarged: SAVED.enlarged,
      width: SAVED.width * SAVED.enlarged, height: SAVED.height * SAVED.enlarged,
    }, { onZoom: () => {}, onBack: () => {}, onPick: () => {}, onCursor: () => {} });
    large.draw(this.#source, range);
    // It draws when the present task is done.
    await new Promise((resolve) => setTimeout(resolve));
    const drawn = pictureOf({
      title: `${this.#panel.title}${detail}`,
      subtitle: `${this.#about.scene}, ${this.#about.architecture}, ${this.#about.users.join(", ")}`,
      chart: large.canvas,
      legend: shown.map(({ channel }) => ({
        label: channel.label, colour: userColour(channel.user), dash: dashOf(channel), width: channel.width,
      })),
      background: colour("--surface", "#ffffff"),
      text: colour("--text", "#222222"),
      ratio: large.ratio,
    });
    large.destroy();
    drawn.toBlob((blob) => { if (blob) download(`${this.#fileName()}.png`, blob); }, "image/png");
  }

  #saveTable(): void {
    if (!this.#source) return;
    const channels = this.#channels
      .map((channel, index) => ({ channel, index }))
      .filter(({ channel }) => channel.kind === this.#choice.kind);
    const text = csvOf(this.#source, channels, this.#panel.unit);
    download(`${this.#fileName()}.csv`, new Blob([text], { type: "text/csv" }));
  }

  #fileName(): string {
    return fileName("cotouch", this.#about?.scene ?? "", this.#panel.name);
  }
}

/** Only when it changed: that costs the browser less. */
function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
