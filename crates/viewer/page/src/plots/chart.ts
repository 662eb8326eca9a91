// One chart over time: lines, axes and gestures, drawn by uPlot in the page's colours.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { firstAtLeast, rowsBetween, withGaps, type Source } from "./history.ts";
import { colour, userColour } from "./palette.ts";
import { calmRange, tickLabels, type Range } from "./scale.ts";
import type { Channel, PanelAbout } from "./channels.ts";

/** A line of a chart: which column, and how it is told from others. */
export interface Line {
  channel: Channel;
  /** Its column in the source. */
  index: number;
}

export interface ChartEvents {
  /** A stretch of time was chosen by dragging. */
  onZoom(range: Range): void;
  /** A double click, or Escape: back to what was shown first. */
  onBack(): void;
  /** A click at this time. */
  onPick(time_s: number): void;
  /** The cursor moved to another row, or away. */
  onCursor(): void;
}

const DASHES: readonly number[][] = [[], [7, 4], [2, 3], [9, 3, 2, 3], [4, 2], [1, 2], [12, 4], [6, 2, 2, 2]];

export interface ChartOptions {
  about: PanelAbout;
  lines: readonly Line[];
  /** Labels of lines that are not drawn. */
  hidden: ReadonlySet<string>;
  /** Charts with the same key share the cursor. */
  sync: string | null;
  width: number;
  height: number;
  /** Letters and lines are this many times as large as on the page. */
  enlarged: number;
}

export function dashOf(channel: Channel): number[] {
  return DASHES[channel.dash % DASHES.length] ?? [];
}

export class Chart {
  readonly #plot: uPlot;
  readonly #lines: readonly Line[];
  readonly #about: PanelAbout;
  readonly #enlarged: number;
  readonly #pointers = new Map<number, number>();
  #range: Range | null = null;
  #marker_s: number | null = null;
  #hidden: ReadonlySet<string>;

  constructor(element: HTMLElement, options: ChartOptions, readonly events: ChartEvents) {
    this.#lines = options.lines;
    this.#about = options.about;
    this.#enlarged = options.enlarged;
    this.#hidden = options.hidden;
    const nothing = [[], ...options.lines.map(() => [])] as uPlot.AlignedData;
    this.#plot = new uPlot(this.#plotOptions(options), nothing, element);
    this.#plot.over.addEventListener("click", (event) => this.#click(event));
    this.#bindTouch();
  }

  get canvas(): HTMLCanvasElement {
    return this.#plot.ctx.canvas;
  }

  /** Pixels of the canvas a CSS pixel of the page. */
  get ratio(): number {
    return uPlot.pxRatio * this.#enlarged;
  }

  /** The times at the left and right edge; null before something was drawn. */
  get range(): Range | null {
    const { min, max } = this.#plot.scales["x"] ?? {};
    return min === undefined || max === undefined ? null : [min, max];
  }

  /** The row under the cursor, of those last drawn; null when the cursor is elsewhere. */
  get cursor(): number | null {
    return this.#plot.cursor.idx ?? null;
  }

  /** Of a line: under the cursor, else at the mark, else the last one drawn. */
  value(line: number): number | null | undefined {
    return (this.#plot.data[line + 1] as ArrayLike<number | null> | undefined)?.[this.#row];
  }

  /** The time that `value` speaks of; NaN when nothing was drawn. */
  get time_s(): number {
    return this.#plot.data[0][this.#row] ?? NaN;
  }

  get #row(): number {
    const times = this.#plot.data[0];
    if (this.cursor !== null) return this.cursor;
    if (this.#marker_s === null) return times.length - 1;
    return Math.max(0, firstAtLeast(times as Float64Array, this.#marker_s + 1e-9) - 1);
  }

  /** Draws these rows; says whether there was any value among them. */
  draw(source: Source, range: Range): boolean {
    const [first, end] = rowsBetween(source.times(), ...range);
    const columns = this.#lines.map(({ index }) => withGaps(source.column(index).subarray(first, end)));
    this.#plot.batch(() => {
      this.#plot.setData([source.times().subarray(first, end), ...columns] as uPlot.AlignedData, false);
      this.#plot.setScale("x", { min: range[0], max: range[1] });
    });
    return columns.some((column) => column.some((value) => value !== null));
  }

  /** Draws a line at this time; says whether it was elsewhere before. */
  mark(time_s: number): boolean {
    if (time_s === this.#marker_s) return false;
    this.#marker_s = time_s;
    this.#plot.redraw(false, false);
    return true;
  }

  show(hidden: ReadonlySet<string>): void {
    this.#hidden = hidden;
    this.#range = null;
    this.#lines.forEach(({ channel }, index) => {
      const show = !hidden.has(channel.label);
      if (this.#plot.series[index + 1]?.show !== show) this.#plot.setSeries(index + 1, { show });
    });
  }

  resize(width: number, height: number): void {
    if (width === this.#plot.width && height === this.#plot.height) return;
    this.#plot.setSize({ width, height });
  }

  /** Draws again in the colours of today's theme. */
  recolour(): void {
    this.#plot.redraw(false, false);
  }

  /** Moves the cursor by so many rows; from the row that values are told of when it was elsewhere. */
  moveCursor(rows: number): void {
    const times = this.#plot.data[0];
    if (times.length === 0) return;
    const at = Math.min(times.length - 1, Math.max(0, this.#row + rows));
    const left = this.#plot.valToPos(times[at] as number, "x");
    this.#plot.setCursor({ left, top: this.#plot.over.clientHeight / 2 });
  }

  leaveCursor(): void {
    this.#plot.setCursor({ left: -10, top: -10 });
  }

  destroy(): void {
    this.#plot.destroy();
  }

  #plotOptions({ sync, width, height }: ChartOptions): uPlot.Options {
    const { unit, factor } = this.#about.shown;
    const large = this.#enlarged;
    const font = `${12 * large}px system-ui, sans-serif`;
    const axis: uPlot.Axis = {
      font,
      labelFont: font,
      stroke: () => colour("--muted", "#666666"),
      grid: { stroke: () => colour("--line", "#dddddd"), width: large },
      ticks: { show: false },
      gap: 6 * large,
    };
    return {
      width: Math.max(100, width),
      height: Math.max(80, height),
      padding: [10 * large, 24 * large, 0, 0],
      legend: { show: false },
      scales: {
        x: { time: false },
        y: { range: (_, low, high) => this.#vertical(low, high) },
      },
      axes: [
        {
          ...axis, size: 26 * large, space: 64 * large,
          values: (_, ticks) => tickLabels(ticks, 1).map((text) => `${text} s`),
        },
        {
          ...axis, size: 46 * large, space: 28 * large, label: unit, labelSize: 18 * large,
          values: (_, ticks) => tickLabels(ticks, factor),
        },
      ],
      series: [{}, ...this.#lines.map(({ channel }) => this.#series(channel))],
      cursor: {
        y: false,
        points: { size: 7 },
        drag: { x: true, y: false, setScale: false, dist: 4 },
        bind: { dblclick: () => () => { this.events.onBack(); return null; } },
        ...(sync === null ? {} : { sync: this.#sync(sync) }),
      },
      hooks: {
        setSelect: [(plot) => this.#selected(plot)],
        setCursor: [() => this.events.onCursor()],
        draw: [(plot) => this.#drawMarker(plot)],
      },
    };
  }

  /** The cursor is shared; what is dragged is told by the chart where it was, once. */
  #sync(key: string): uPlot.Cursor.Sync {
    const pub = (kind: string) => kind === "mousemove" || kind === "mouseleave";
    return { key, setSeries: false, scales: ["x", null], filters: { pub } };
  }

  #series(channel: Channel): uPlot.Series {
    return {
      label: channel.label,
      scale: "y",
      show: !this.#hidden.has(channel.label),
      stroke: () => userColour(channel.user),
      width: channel.width * this.#enlarged,
      dash: dashOf(channel).map((length) => length * this.#enlarged),
      alpha: channel.width > 2 ? 0.7 : 1,
      points: { show: false },
    };
  }

  #vertical(low: number | null, high: number | null): Range {
    if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) {
      return this.#range ?? [0, this.#about.least_span];
    }
    this.#range = calmRange(this.#range, low, high, this.#about.least_span, this.#about.from_zero);
    return this.#range;
  }

  #selected(plot: uPlot): void {
    const { left, width } = plot.select;
    if (width < 4) return;
    const range: Range = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.events.onZoom(range);
  }

  #click(event: MouseEvent): void {
    this.events.onPick(this.#plot.posToVal(event.offsetX, "x"));
  }

  #drawMarker(plot: uPlot): void {
    if (this.#marker_s === null) return;
    const at = Math.round(plot.valToPos(this.#marker_s, "x", true));
    const { left, top, width, height } = plot.bbox;
    if (at < left || at > left + width) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = colour("--accent", "#2563eb");
    plot.ctx.lineWidth = 2 * this.#enlarged * uPlot.pxRatio;
    plot.ctx.setLineDash([]);
    plot.ctx.beginPath();
    plot.ctx.moveTo(at, top);
    plot.ctx.lineTo(at, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }

  /** A finger that moves sideways on the chart shows values; two that spread zoom. */
  #bindTouch(): void {
    const { over } = this.#plot;
    const place = (event: PointerEvent) => event.clientX - over.getBoundingClientRect().left;
    let begun: Range | null = null;
    over.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "touch") return;
      this.#pointers.set(event.pointerId, place(event));
      const spots = [...this.#pointers.values()].sort((one, other) => one - other);
      if (spots.length === 2) begun = spots.map((spot) => this.#plot.posToVal(spot, "x")) as Range;
    });
    over.addEventListener("pointermove", (event) => {
      if (!this.#pointers.has(event.pointerId)) return;
      this.#pointers.set(event.pointerId, place(event));
      const spots = [...this.#pointers.values()].sort((one, other) => one - other);
      if (begun && spots.length === 2) this.events.onZoom(spread(begun, spots as Range, over.clientWidth));
      else if (spots.length === 1) this.#plot.setCursor({ left: spots[0] ?? 0, top: 10 });
    });
    for (const kind of ["pointerup", "pointercancel"] as const) {
      over.addEventListener(kind, (event) => {
        this.#pointers.delete(event.pointerId);
        begun = null;
      });
    }
  }
}

/** The range of a chart `width` pixels wide that has the times `held` at the pixels `spots`. */
export function spread(held: Range, spots: Range, width: number): Range {
  const seconds_a_pixel = (held[1] - held[0]) / Math.max(8, spots[1] - spots[0]);
  const from = held[0] - spots[0] * seconds_a_pixel;
  return [from, from + width * seconds_a_pixel];
}
