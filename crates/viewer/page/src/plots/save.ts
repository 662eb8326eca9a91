// Charts and their numbers as files.
import type { Channel } from "./channels.ts";
import type { Source } from "./history.ts";

/** All rows of these channels; times and values in the units that the first line names. */
export function csvOf(source: Source, channels: readonly { channel: Channel; index: number }[], unit: string): string {
  const names = channels.map(({ channel: { label, component } }) =>
    component === null ? `${label} [${unit}]` : `${label} ${component} [${unit}]`);
  const columns = channels.map(({ index }) => source.column(index));
  const lines = [["time [s]", ...names].map(quoted).join(",")];
  source.times().forEach((time_s, row) => {
    const values = columns.map((column) => digits(column[row] as number));
    if (values.some((value) => value !== "")) lines.push([time_s.toFixed(6), ...values].join(","));
  });
  return lines.join("\n") + "\n";
}

function quoted(field: string): string {
  return /[",\n\r]/.test(field) ? `"${field.replaceAll('"', '""')}"` : field;
}

/** As many as a number of four bytes has; nothing for what there is none of. */
function digits(value: number): string {
  return Number.isFinite(value) ? String(Number(value.toPrecision(7))) : "";
}

export interface Drawing {
  title: string;
  subtitle: string;
  chart: HTMLCanvasElement;
  legend: { label: string; colour: string; dash: number[]; width: number }[];
  background: string;
  text: string;
  /** Pixels of the canvas a CSS pixel. */
  ratio: number;
}

const MARGIN = 16;
const LINE = 20;

/** The chart with its title and legend on a background. */
export function pictureOf(drawing: Drawing): HTMLCanvasElement {
  const { chart, ratio } = drawing;
  const canvas = document.createElement("canvas");
  const measure = canvas.getContext("2d");
  if (!measure) throw new Error("this browser draws no canvas");
  const width = chart.width / ratio + 2 * MARGIN;
  measure.font = LEGEND_FONT;
  const items = placed(drawing.legend.map(({ label }) => measure.measureText(label).width + 44), width - 2 * MARGIN);
  const top = MARGIN + 2 * LINE + 8;
  const below = top + chart.height / ratio + 12;
  const rows = (items.at(-1)?.row ?? -1) + 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round((below + rows * LINE + MARGIN) * ratio);
  const context = canvas.getContext("2d") as CanvasRenderingContext2D;
  context.scale(ratio, ratio);
  context.fillStyle = drawing.background;
  context.fillRect(0, 0, width, canvas.height / ratio);
  drawTitle(context, drawing);
  context.drawImage(chart, MARGIN, top, chart.width / ratio, chart.height / ratio);
  drawing.legend.forEach((item, index) => {
    const place = items[index];
    if (place) drawItem(context, item, drawing.text, MARGIN + place.x, below + place.row * LINE + LINE / 2);
  });
  return canvas;
}

const LEGEND_FONT = "13px system-ui, sans-serif";

function drawTitle(context: CanvasRenderingContext2D, { title, subtitle, text }: Drawing): void {
  context.fillStyle = text;
  context.textBaseline = "middle";
  context.font = "600 16px system-ui, sans-serif";
  context.fillText(title, MARGIN, MARGIN + LINE / 2);
  context.font = LEGEND_FONT;
  context.globalAlpha = 0.75;
  context.fillText(subtitle, MARGIN, MARGIN + 1.5 * LINE);
  context.globalAlpha = 1;
}

function drawItem(
  context: CanvasRenderingContext2D, item: Drawing["legend"][number], text: string, x: number, y: number,
): void {
  context.strokeStyle = item.colour;
  context.lineWidth = item.width;
  context.setLineDash(item.dash);
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + 22, y);
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = text;
  context.font = LEGEND_FONT;
  context.textBaseline = "middle";
  context.fillText(item.label, x + 28, y);
}

/** Items of these widths one after the other, in rows of at most `width`. */
export function placed(widths: readonly number[], width: number): { x: number; row: number }[] {
  let [x, row] = [0, 0];
  return widths.map((each) => {
    if (x > 0 && x + each > width) [x, row] = [0, row + 1];
    const place = { x, row };
    x += each;
    return place;
  });
}

/** Hands `blob` to the person who looks at the page. */
export function download(name: string, blob: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  document.body.append(link);
  link.click();
  link.remove();
  // Some browsers read it only after the click was dealt with.
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** A name for a file from words: `grasp round trip` becomes `grasp-round-trip`. */
export function fileName(...words: string[]): string {
  return words.join(" ").toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
}
