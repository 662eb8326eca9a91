// The lesson's controls as sliders, number fields and choices.
import { make, say } from "../dom.ts";
import type { Control, Settings } from "../protocol.ts";
import { fromSlider, readable, sliderSteps, toSlider, withUnit } from "./scale.ts";

type Value = number | string;

/** What the controls tell: while one moves, and when it has been let go. */
export interface Heard {
  moved(control: Control, value: Value): void;
  released(control: Control, value: Value): void;
  /** A number that the control does not allow; the control keeps the one that it had. */
  refused(control: Control, why: string): void;
}

/** After a move, what the server says about this control waits this long: it may be about an earlier move. */
const MINE_MS = 1000;

const GROUPS: { name: string; prefixes: string[] }[] = [
  { name: "Local model", prefixes: ["local_model."] },
  { name: "Soft object", prefixes: ["soft.", "rates.simulation_hz"] },
  { name: "Couplings", prefixes: ["coupling."] },
  { name: "Network", prefixes: ["link.", "rates."] },
  { name: "Object and wall", prefixes: ["object.", "wall.", "hand."] },
  { name: "Session", prefixes: [""] },
];

export class Controls {
  readonly element = make("div", { class: "controls" });
  #fields = new Map<string, Field>();
  #built = "";
  #heard: Heard;

  constructor(heard: Heard) {
    this.#heard = heard;
  }

  /** Begins anew with these controls. The same ones stay as they are, under the hands of whoever moves them. */
  build(controls: readonly Control[]): void {
    const built = JSON.stringify(controls);
    if (built === this.#built) return;
    this.#built = built;
    const focused = this.element.contains(document.activeElement) ? document.activeElement?.id : undefined;
    this.#fields = new Map(controls.map((control) => [control.key, makeField(control, this.#heard)]));
    this.element.replaceChildren(...inGroups(controls).map(({ name, members }) =>
      make("fieldset", {}, make("legend", {}, name),
        make("div", { class: "fields" }, ...members.map(({ key }) => this.#fields.get(key)!.element)))));
    if (focused) document.getElementById(focused)?.focus();
  }

  /** Shows these values, except where a control has just been moved. */
  show(settings: Settings): void {
    for (const [key, value] of Object.entries(settings)) {
      const field = this.#fields.get(key);
      if (field && performance.now() - field.moved_at > MINE_MS) field.show(value);
    }
  }

  /** Shows this value whatever was moved. */
  put(key: string, value: Value): void {
    const field = this.#fields.get(key);
    if (!field) return;
    field.moved_at = performance.now();
    field.show(value);
  }

  /** Lets go of what was moved. */
  release(): void {
    for (const field of this.#fields.values()) field.moved_at = -Infinity;
  }
}

interface Field {
  element: HTMLElement;
  moved_at: number;
  show(value: Value): void;
}

function inGroups(controls: readonly Control[]): { name: string; members: Control[] }[] {
  const groupOf = (control: Control) =>
    GROUPS.find(({ prefixes }) => prefixes.some((prefix) => control.key.startsWith(prefix)));
  return GROUPS
    .map((group) => ({ name: group.name, members: controls.filter((control) => groupOf(control) === group) }))
    .filter(({ members }) => members.length > 0);
}

function makeField(control: Control, heard: Heard): Field {
  return control.kind === "choice" ? makeChoice(control, heard) : makeNumber(control, heard);
}

const idOf = (control: Control) => `control-${control.key.replace(/[^a-z0-9]/gi, "-")}`;

function makeChoice(control: Control, heard: Heard): Field {
  const id = idOf(control);
  const select = make("select", { id, "aria-describedby": `${id}-help` });
  select.append(...control.choices.map((choice) => make("option", { value: choice }, choice)));
  const field: Field = {
    element: frame(control, id, select),
    moved_at: -Infinity,
    show: (value) => { select.value = String(value); },
  };
  select.addEventListener("change", () => {
    field.moved_at = performance.now();
    heard.moved(control, select.value);
    heard.released(control, select.value);
  });
  return field;
}

function makeNumber(control: Control, heard: Heard): Field {
  const id = idOf(control);
  const number = make("input", {
    id: `${id}-number`, type: "number", min: control.low, max: control.high, inputmode: "decimal",
    step: control.kind === "whole" ? 1 : "any", "aria-label": [control.label, control.unit].filter(Boolean).join(", "),
  });
  const slider = make("input", {
    id, type: "range", min: 0, max: sliderSteps(control), step: 1, "aria-describedby": `${id}-help`,
  });
  let shown = control.low;
  const show = (value: Value) => {
    shown = Number(value);
    slider.value = String(toSlider(control, Number(value)));
    slider.setAttribute("aria-valuetext", withUnit(Number(value), control.unit));
    if (document.activeElement !== number) number.value = readable(Number(value));
  };
  const field: Field = { element: frame(control, id, slider, number), moved_at: -Infinity, show };
  const moved = (value: number) => {
    field.moved_at = performance.now();
    show(value);
    heard.moved(control, value);
  };
  slider.addEventListener("input", () => moved(fromSlider(control, Number(slider.value))));
  slider.addEventListener("change", () => heard.released(control, fromSlider(control, Number(slider.value))));
  number.addEventListener("change", () => {
    const value = number.valueAsNumber;
    const why = refusal(control, value);
    number.setAttribute("aria-invalid", String(why !== null));
    if (why !== null) {
      number.value = readable(shown);
      heard.refused(control, why);
      return;
    }
    moved(value);
    number.value = readable(value);
    heard.released(control, value);
  });
  return field;
}

/** Why a control does not take this number, with what it allows; null where it does. */
export function refusal(control: Control, value: number): string | null {
  const allowed = `${readable(control.low)} to ${withUnit(control.high, control.unit)}`;
  if (!Number.isFinite(value)) return `${control.label} is a number from ${allowed}.`;
  if (value < control.low || value > control.high) return `${control.label} cannot be ${readable(value)}: it goes from ${allowed}.`;
  if (control.kind === "whole" && !Number.isInteger(value)) return `${control.label} cannot be ${readable(value)}: it is a whole number from ${allowed}.`;
  return null;
}

function frame(control: Control, id: string, ...inputs: HTMLElement[]): HTMLElement {
  const range = control.kind === "choice" ? "" : ` From ${readable(control.low)} to ${withUnit(control.high, control.unit)}.`;
  const help = control.help + range + (control.restarts ? " Begins the session anew." : "");
  const label = make("label", { for: id }, control.label);
  if (control.unit) label.append(make("span", { class: "unit" }, ` ${control.unit}`));
  if (control.restarts) label.append(make("span", { class: "restarts", "aria-hidden": "true" }, " ↻"));
  return make("div", { class: "field", title: help, "data-key": control.key },
    label, make("div", { class: "field-row" }, ...inputs), make("span", { id: `${id}-help`, class: "unseen" }, help));
}

/** A line for the help of whatever control is looked at. */
export function followHelp(controls: HTMLElement, line: HTMLElement, otherwise: string): void {
  const look = (event: Event) => {
    const field = (event.target as Element).closest?.(".field");
    say(line, field?.querySelector(".unseen")?.textContent || otherwise);
  };
  say(line, otherwise);
  controls.addEventListener("pointerover", look);
  controls.addEventListener("focusin", look);
}
