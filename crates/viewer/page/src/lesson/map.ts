// The stability map: a plane of two settings, where it is stable, where its boundary runs, and "you are here".
import { colour, freshContext, make } from "../dom.ts";
import type { Control, MapMessage } from "../protocol.ts";
import { axisMarks, readable, share, tidy, valueAt, type Scale } from "./scale.ts";

/** Room for the axes' numbers, CSS pixels. */
const ROOM = { left: 46, right: 10, top: 8, bottom: 24 };

export interface Place {
  x: number;
  y: number;
}

export interface Area {
  left: number;
  top: number;
  width: number;
  height: number;
}

export function areaOf(width: number, height: number): Area {
  return {
    left: ROOM.left, top: ROOM.top,
    width: Math.max(width - ROOM.left - ROOM.right, 1), height: Math.max(height - ROOM.top - ROOM.bottom, 1),
  };
}

/** Where a pair of values is on the canvas. */
export function placeOf(area: Area, x: Scale, y: Scale, values: Place): Place {
  return {
    x: area.left + share(x, values.x) * area.width,
    y: area.top + (1 - share(y, values.y)) * area.height,
  };
}

/** The pair of values at a place on the canvas. */
export function valuesAt(area: Area, x: Control, y: Control, place: Place): Place {
  return {
    x: tidy(x, valueAt(x, (place.x - area.left) / area.width)),
    y: tidy(y, valueAt(y, 1 - (place.y - area.top) / area.height)),
  };
}

export class StabilityMap {
  readonly canvas = make("canvas", { class: "map", role: "img", "aria-label": "Stability map" });
  #axes: { x: Control; y: Control } | null = null;
  #map: MapMessage | null = null;
  #cells: HTMLCanvasElement | null = null;
  #here: Place | null = null;
  #running: Place | null = null;
  #due = false;

  /** `pick` hears the values of a place that was clicked or dragged to; `done` that the pointer was let go. */
  constructor(pick: (values: Place) => void, done: () => void) {
    let picking = false;
    const pickAt = (event: PointerEvent) => {
      if (!this.#axes) return;
      const bounds = this.canvas.getBoundingClientRect();
      const area = areaOf(this.canvas.clientWidth, this.canvas.clientHeight);
      const place = { x: event.clientX - bounds.left, y: event.clientY - bounds.top };
      pick(valuesAt(area, this.#axes.x, this.#axes.y, place));
    };
    this.canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      picking = true;
      this.canvas.setPointerCapture(event.pointerId);
      pickAt(event);
    });
    this.canvas.addEventListener("pointermove", (event) => { if (picking) pickAt(event); });
    const end = () => { if (picking) { picking = false; done(); } };
    this.canvas.addEventListener("pointerup", end);
    this.canvas.addEventListener("pointercancel", end);
    new ResizeObserver(() => this.#later()).observe(this.canvas);
    document.addEventListener("themechange", () => { this.#cells = null; this.#later(); });
  }

  setAxes(x: Control, y: Control): void {
    this.#axes = { x, y };
    this.#map = null;
    this.#later();
  }

  /** Where the controls are, and where the running session is. */
  mark(here: Place | null, running: Place | null): void {
    this.#here = here;
    this.#running = running;
    this.canvas.setAttribute("aria-label", this.#inWords());
    this.#later();
  }

  show(map: MapMessage | null): void {
    this.#map = map;
    this.#cells = null;
    this.#later();
  }

  #inWords(): string {
    const [axes, here] = [this.#axes, this.#here];
    if (!axes || !here) return "Stability map";
    const place = `${readable(here.x)} and ${readable(here.y)}`;
    return `Stability map of ${axes.x.label} and ${axes.y.label}; you are at ${place}`;
  }

  #later(): void {
    if (this.#due) return;
    this.#due = true;
    requestAnimationFrame(() => { this.#due = false; this.#draw(); });
  }

  #draw(): void {
    const context = freshContext(this.canvas);
    if (!context || !this.#axes) return;
    const area = areaOf(this.canvas.clientWidth, this.canvas.clientHeight);
    const { x, y } = this.#axes;
    context.save();
    context.beginPath();
    context.rect(area.left, area.top, area.width, area.height);
    context.fillStyle = colour("--raised");
    context.fill();
    context.clip();
    this.#drawMap(context, area);
    context.restore();
    drawAxes(context, area, x, y);
    if (this.#running) drawRing(context, placeOf(area, x, y, this.#running));
    if (this.#here) drawCross(context, area, placeOf(area, x, y, this.#here));
  }

  #drawMap(context: CanvasRenderingContext2D, area: Area): void {
    const { x, y } = this.#axes!;
    const map = this.#map;
    // A map on its way: the old one is of other axes.
    if (!map || map.x.key !== x.key || map.y.key !== y.key || map.stable.length === 0) return;
    this.#cells ??= paintCells(map);
    const [wide, high] = [this.#cells.width, this.#cells.height];
    const from = placeOf(area, x, y, { x: map.x.values[0]!, y: map.y.values.at(-1)! });
    const to = placeOf(area, x, y, { x: map.x.values.at(-1)!, y: map.y.values[0]! });
    // Values are the middles of cells, so the outermost reach half a cell further.
    const [stepX, stepY] = [(to.x - from.x) / Math.max(wide - 1, 1), (to.y - from.y) / Math.max(high - 1, 1)];
    context.globalAlpha = 0.32;
    context.imageSmoothingEnabled = true;
    context.drawImage(this.#cells, from.x - stepX / 2, from.y - stepY / 2, stepX * wide, stepY * high);
    context.globalAlpha = 1;
    context.strokeStyle = colour("--text");
    context.lineWidth = 2;
    context.lineJoin = "round";
    for (const curve of map.boundary) {
      context.beginPath();
      for (const [valueX, valueY] of curve) {
        const place = placeOf(area, x, y, { x: valueX, y: valueY });
        context.lineTo(place.x, place.y);
      }
      context.stroke();
    }
  }
}

/** One pixel a cell; large y at the top. */
function paintCells(map: MapMessage): HTMLCanvasElement {
  const [wide, high] = [map.x.values.length, map.y.values.length];
  const canvas = make("canvas", { width: wide, height: high });
  const context = canvas.getContext("2d");
  if (!context) return canvas;
  const [good, bad] = [colour("--good"), colour("--bad")];
  map.stable.forEach((row, at) => row.forEach((stable, index) => {
    context.fillStyle = stable ? good : bad;
    context.fillRect(index, high - 1 - at, 1, 1);
  }));
  return canvas;
}

function drawAxes(context: CanvasRenderingContext2D, area: Area, x: Control, y: Control): void {
  context.strokeStyle = colour("--line");
  context.lineWidth = 1;
  context.strokeRect(area.left + 0.5, area.top + 0.5, area.width - 1, area.height - 1);
  context.fillStyle = colour("--muted");
  context.font = "11px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "top";
  const bottom = area.top + area.height;
  let free = -Infinity;
  for (const mark of axisMarks(x)) {
    const place = placeOf(area, x, y, { x: mark, y: y.low });
    const [text, half] = [readable(mark), context.measureText(readable(mark)).width / 2];
    context.fillRect(place.x, bottom, 1, 4);
    if (place.x - half < free) continue;
    free = place.x + half + 8;
    context.fillText(text, Math.min(place.x, area.left + area.width - half + 6), bottom + 7);
  }
  context.textAlign = "right";
  context.textBaseline = "middle";
  free = Infinity;
  for (const mark of axisMarks(y)) {
    const place = placeOf(area, x, y, { x: x.low, y: mark });
    context.fillRect(area.left - 4, place.y, 4, 1);
    if (place.y > free) continue;
    free = place.y - 15;
    context.fillText(readable(mark), area.left - 7, Math.max(place.y, area.top + 4));
  }
}

/** The running session. */
function drawRing(context: CanvasRenderingContext2D, place: Place): void {
  context.strokeStyle = colour("--text");
  context.lineWidth = 2;
  context.beginPath();
  context.arc(place.x, place.y, 9, 0, 2 * Math.PI);
  context.stroke();
}

/** You are here. */
function drawCross(context: CanvasRenderingContext2D, area: Area, place: Place): void {
  context.strokeStyle = colour("--accent");
  context.lineWidth = 1;
  context.setLineDash([3, 3]);
  context.beginPath();
  context.moveTo(area.left, place.y);
  context.lineTo(area.left + area.width, place.y);
  context.moveTo(place.x, area.top);
  context.lineTo(place.x, area.top + area.height);
  context.stroke();
  context.setLineDash([]);
  for (const [width, name] of [[6, "--surface"], [3, "--accent"]] as const) {
    context.strokeStyle = colour(name);
    context.lineWidth = width;
    context.beginPath();
    for (const [byX, byY] of [[7, 0], [0, 7]] as const) {
      context.moveTo(place.x - byX, place.y - byY);
      context.lineTo(place.x + byX, place.y + byY);
    }
    context.stroke();
  }
}
