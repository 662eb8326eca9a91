// What stands over a view: how it is seen, and what its colours and lengths mean.
import type { About } from "../protocol.ts";
import { userColour } from "./colours.ts";
import { mapped } from "./colourmap.ts";
import { phaseColour } from "./marks.ts";
import type { Choices, Drawing } from "./drawing.ts";
import { make, makeButton, makeCheckbox } from "./element.ts";
import type { Layout } from "./layout.ts";
import type { Shown, SoftObject } from "./soft.ts";

/** Copies apart: what is shown, by what is said. */
const APART: [string, number][] = [
  ["hidden", 0], ["as they are", 1], ["10 × as far apart", 10], ["50 × as far apart", 50],
];

/** What a soft object's colours can say. */
const SHOWN: [string, Shown][] = [["displacement", "displacement"], ["stress", "stress"], ["nothing", "plain"]];

export class Tools {
  readonly element = make("details", "view-tools");
  #copies: HTMLElement;
  #nets: HTMLElement;
  #shown: HTMLElement;

  constructor(drawing: Drawing) {
    const choose = (change: Partial<Choices>) => {
      drawing.choices = { ...drawing.choices, ...change };
      drawing.ask();
    };
    this.#copies = makeSelect("Copies", APART, 1, (apart) => choose({ apart }));
    this.#copies.title = "Every host's own copy of a body, as an outline in its user's colour";
    this.#nets = makeCheckbox("Others as nets", false, (nets) => choose({ nets }));
    this.#nets.title = "Every host's own copy of the soft object, as a net in its user's colour";
    this.#shown = makeSelect("Colours show", SHOWN, "displacement", (shown) => choose({ shown }));
    const tools = make("div");
    tools.append(
      this.#shown, this.#copies, this.#nets,
      makeCheckbox("Forces", true, (forces) => choose({ forces })),
      makeCheckbox("Follow", true, (follow) => { drawing.eye.follow = follow; drawing.ask(); }),
      makeButton("Reset view", () => { drawing.eye.reset(); drawing.ask(); }),
    );
    this.element.append(make("summary", "", "View"), tools);
  }

  /** Offers what makes sense in this scene. */
  introduce(about: About): void {
    this.#copies.hidden = about.soft !== null;
    this.#nets.hidden = about.soft === null || !about.copies || about.users.length < 2;
    this.#shown.hidden = about.soft === null;
  }
}

function makeSelect<T extends string | number>(
  name: string, choices: [string, T][], first: T, onChange: (value: T) => void,
): HTMLLabelElement {
  const label = make("label", "view-check", `${name} `);
  const select = make("select");
  for (const [words, value] of choices) select.append(new Option(words, String(value), value === first, value === first));
  select.addEventListener("change", () => {
    const found = choices.find(([, value]) => String(value) === select.value);
    if (found) onChange(found[1]);
  });
  label.append(select);
  return label;
}

/** What a soft object's colours mean: a bar from 0 to the end of the scale. */
export class ColourBar {
  readonly element = make("div", "view-scale");
  #title = make("span");
  #bar = make("canvas", "view-scale-bar");
  #end = make("span");

  constructor() {
    this.#paint();
    this.#bar.setAttribute("aria-hidden", "true");
    const row = make("span", "view-scale-row");
    row.append(make("span", "", "0"), this.#bar, this.#end);
    this.element.append(this.#title, row);
    this.element.hidden = true;
  }

  show(soft: SoftObject | null): void {
    this.element.hidden = soft === null || soft.shown === "plain";
    if (!soft || soft.shown === "plain") return;
    const [title, end] = soft.shown === "stress"
      ? ["stress (von Mises)", pressure(soft.scales.stress.limit)]
      : ["displacement", length(soft.scales.displacement.limit)];
    if (this.#title.textContent !== title) this.#title.textContent = title;
    if (this.#end.textContent !== end) this.#end.textContent = end;
  }

  #paint(): void {
    [this.#bar.width, this.#bar.height] = [128, 1];
    const context = this.#bar.getContext("2d");
    for (let x = 0; context && x < 128; x++) {
      context.fillStyle = mapped(x / 127).getStyle();
      context.fillRect(x, 0, 1, 1);
    }
  }
}

/** What colours and lengths mean; filled anew with every scene and theme. */
export class Legend {
  readonly element = make("details", "view-legend");
  #list = make("ul");

  constructor() {
    this.element.append(make("summary", "", "Legend"), this.#list);
  }

  fill(about: About, layout: Layout, drawing: Drawing): void {
    const { colours } = drawing;
    const touches = about.soft !== null
      || (about.space !== "line" && about.bodies.some((body) => body.kind !== "point"));
    const copy = about.soft ? "net: another user's copy" : "outline: that user's copy";
    this.#list.replaceChildren(
      ...about.users.map((name, user) => entry("ball", userColour(colours, user).getStyle(), name)),
      ...(about.copies ? [entry("outline", colours.muted.getStyle(), copy)] : []),
      entry("arrow", colours.muted.getStyle(), `force on a hand, ${length(layout.metresPerNewton)} each newton`),
      ...(touches ? [
        entry("halo", phaseColour(colours, "moment-cancellation").getStyle(), "touches, being slowed down"),
        entry("halo", phaseColour(colours, "pre-slide").getStyle(), "touches and sticks"),
        entry("halo", phaseColour(colours, "slide").getStyle(), "touches and slides"),
        entry("dot", colours.text.getStyle(), "where the surface holds it"),
      ] : []),
      entry("spring", colours.accent.getStyle(), "spring to where a pointer draws it"),
      entry("grid", colours.line.getStyle(), `grid of ${length(layout.grid)}`),
    );
  }
}

function entry(kind: string, colour: string, text: string): HTMLLIElement {
  const item = make("li");
  const swatch = make("span", `view-swatch view-swatch-${kind}`);
  swatch.style.color = colour;
  item.append(swatch, text);
  return item;
}

/** In words: 0.02 m is "20 mm". */
export function length(metres: number): string {
  return metres < 1 ? `${Number((1000 * metres).toPrecision(3))} mm` : `${Number(metres.toPrecision(3))} m`;
}

/** In words: 2000 Pa is "2 kPa". */
export function pressure(pascals: number): string {
  const [unit, size] = pascals >= 1e6 ? ["MPa", 1e6] : pascals >= 1e3 ? ["kPa", 1e3] : ["Pa", 1];
  return `${Number((pascals / (size as number)).toPrecision(3))} ${unit}`;
}
