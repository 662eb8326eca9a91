// A dial of the spectral radius: its needle stands upright at 1, where stability ends.
import { make, makeSvg, say } from "../dom.ts";

const CENTRE = { x: 100, y: 92 };
const REACH = 74;
/** From this far from 1 on, the dial has turned half of its side. */
const HALF_TURN = 0.04;
const MARKS = [0.5, 0.9, 0.97, 1, 1.03, 1.1, 2];

/** The needle's angle from upright, degrees: left of it stable, right of it not. */
export function needleAngle(radius: number): number {
  if (Number.isNaN(radius)) return 0;
  const beyond = radius - 1;
  const turned = Number.isFinite(radius) ? beyond / (Math.abs(beyond) + HALF_TURN) : 1;
  return 84 * turned;
}

export class Gauge {
  readonly element: HTMLElement;
  #needle = makeSvg("path", {
    class: "needle",
    d: `M ${CENTRE.x - 3} ${CENTRE.y} L ${CENTRE.x} ${CENTRE.y - REACH + 6} L ${CENTRE.x + 3} ${CENTRE.y} Z`,
  });
  #number = make("output", { class: "radius" }, "…");

  constructor() {
    const dial = makeSvg("svg", { viewBox: "0 0 200 100", class: "dial", "aria-hidden": "true" },
      arc(-88, -1.5, "stable"), arc(1.5, 88, "unstable"),
      ...MARKS.flatMap((mark) => drawMark(mark)),
      this.#needle, makeSvg("circle", { cx: CENTRE.x, cy: CENTRE.y, r: 5, class: "hub" }));
    this.element = make("div", { class: "gauge", "data-verdict": "unknown" }, dial,
      this.#number, make("span", { class: "small muted" }, "spectral radius"));
  }

  show(radius: number, stable: boolean | null): void {
    this.element.dataset["verdict"] = stable === null ? "open" : stable ? "stable" : "unstable";
    say(this.#number, radiusText(radius));
    this.#needle.style.transform = `rotate(${needleAngle(radius).toFixed(2)}deg)`;
  }

  clear(): void {
    this.element.dataset["verdict"] = "unknown";
    say(this.#number, "…");
    this.#needle.style.transform = "rotate(0deg)";
  }

  setBusy(busy: boolean): void {
    this.element.classList.toggle("busy", busy);
  }
}

/** Enough digits to tell it from 1. */
export function radiusText(radius: number): string {
  if (!Number.isFinite(radius)) return "–";
  const gap = Math.abs(radius - 1);
  // Nothing grows and nothing fades, but for rounding.
  if (gap < 1e-11) return "1";
  const digits = gap >= 1e-3 ? 4 : gap >= 1e-5 ? 6 : 9;
  return radius >= 100 ? radius.toPrecision(3) : radius.toFixed(digits);
}

function point(angle: number, distance: number): string {
  const turn = (angle * Math.PI) / 180;
  return `${(CENTRE.x + distance * Math.sin(turn)).toFixed(2)} ${(CENTRE.y - distance * Math.cos(turn)).toFixed(2)}`;
}

function arc(from: number, to: number, kind: string): SVGElement {
  const d = `M ${point(from, REACH)} A ${REACH} ${REACH} 0 0 1 ${point(to, REACH)}`;
  return makeSvg("path", { class: `arc ${kind}`, d });
}

function drawMark(mark: number): SVGElement[] {
  const angle = needleAngle(mark);
  const [x, y] = point(angle, REACH + 12).split(" ");
  const [from, to] = [point(angle, REACH - 7), point(angle, REACH + 5)];
  return [
    makeSvg("path", { class: mark === 1 ? "mark limit" : "mark", d: `M ${from} L ${to}` }),
    makeSvg("text", { class: "mark-text", x: x ?? 0, y: Number(y) + 3, "text-anchor": "middle" }, String(mark)),
  ];
}
