// Which two controls span the map.
import { make } from "../dom.ts";
import type { Control, MapAxis } from "../protocol.ts";

const FIRST_CHOICE = {
  x: ["local_model.stiffness_ratio", "local_model.stiffness_n_per_m", "coupling.object_object.stiffness_n_per_m", "coupling.hand_object.stiffness_n_per_m"],
  y: [
    "local_model.integral_ratio", "local_model.integral_n_per_m", "soft.mesh.stiffness_n_per_m",
    "coupling.remote_hand_object.stiffness_n_per_m", "coupling.hand_object.stiffness_n_per_m",
    "coupling.object_object.damping_n_s_per_m", "link.delay_periods",
  ],
};
/** Cells along an axis; the boundary between them is exact. */
const CELLS = 48;

/** What the network does to packets at random is no part of the loop that is mapped. */
const canSpan = (control: Control) => control.kind !== "choice" && !control.key.startsWith("link.impairment.");

/** The controls that can be an axis. */
export function spanning(controls: readonly Control[]): Control[] {
  return controls.filter(canSpan);
}

/** Two controls to begin with; null where there are not two. Without an integral its gain changes nothing. */
export function firstAxes(controls: readonly Control[], hasIntegral = false): { x: Control; y: Control } | null {
  const able = spanning(controls).filter(({ key }) => hasIntegral || !key.startsWith("local_model.integral"));
  const find = (keys: string[], not?: Control) =>
    keys.map((key) => able.find((control) => control.key === key)).find((control) => control && control !== not);
  const x = find(FIRST_CHOICE.x) ?? able[0];
  const y = find(FIRST_CHOICE.y, x) ?? able.find((control) => control !== x);
  return x && y ? { x, y } : null;
}

export function axisOf(control: Control): MapAxis {
  const whole = control.kind === "whole";
  return {
    key: control.key,
    from: control.low,
    to: control.high,
    count: whole ? control.high - control.low + 1 : CELLS,
    log: control.log && !whole && control.low > 0,
  };
}

/** Two lists to choose the axes from; choosing the other one's control swaps them. */
export class AxesChoice {
  readonly element: HTMLElement;
  #selects = { x: make("select", { id: "map-x" }), y: make("select", { id: "map-y" }) };
  #controls: Control[] = [];
  #axes: { x: Control; y: Control } | null = null;

  constructor(changed: () => void) {
    const row = (axis: "x" | "y", arrow: string) =>
      make("span", { class: "axis" },
        make("label", { for: `map-${axis}` }, arrow, make("span", { class: "unseen" }, ` axis ${axis}`)),
        this.#selects[axis]);
    this.element = make("div", { class: "axes" }, row("y", "↑"), row("x", "→"));
    for (const axis of ["x", "y"] as const) {
      this.#selects[axis].addEventListener("change", () => { this.#choose(axis); changed(); });
    }
  }

  get axes(): { x: Control; y: Control } | null {
    return this.#axes;
  }

  /** Keeps the chosen axes where the controls still have them. */
  build(controls: readonly Control[], hasIntegral = false): void {
    this.#controls = spanning(controls);
    const kept = (axis: "x" | "y") => this.#controls.find((control) => control.key === this.#axes?.[axis].key);
    const [x, y] = [kept("x"), kept("y")];
    this.#axes = x && y ? { x, y } : firstAxes(controls, hasIntegral);
    for (const select of Object.values(this.#selects)) {
      select.replaceChildren(...this.#controls.map(({ key, label, unit }) =>
        make("option", { value: key }, unit ? `${label}, ${unit}` : label)));
    }
    this.#show();
  }

  #choose(axis: "x" | "y"): void {
    const chosen = this.#controls.find((control) => control.key === this.#selects[axis].value);
    if (!chosen || !this.#axes) return;
    const other = axis === "x" ? "y" : "x";
    if (this.#axes[other] === chosen) this.#axes[other] = this.#axes[axis];
    this.#axes[axis] = chosen;
    this.#show();
  }

  #show(): void {
    if (!this.#axes) return;
    this.#selects.x.value = this.#axes.x.key;
    this.#selects.y.value = this.#axes.y.key;
  }
}
