// What stands over a view: how it is seen, and what its colours and lengths mean.
import type { About } from "../protocol.ts";
import { userColour } from "./colours.ts";
import { phaseColour } from "./marks.ts";
import type { Choices, Drawing } from "./drawing.ts";
import { make, makeButton, makeCheckbox } from "./element.ts";
import type { Layout } from "./layout.ts";

/** Copies apart: what is shown, by what is said. */
const APART: [string, number][] = [
  ["hidden", 0], ["as they are", 1], ["10 × as far apart", 10], ["50 × as far apart", 50],
];

export function createTools(drawing: Drawing): HTMLDetailsElement {
  const element = make("details", "view-tools");
  const tools = make("div");
  element.append(make("summary", "", "View"), tools);
  const choose = (change: Partial<Choices>) => {
    drawing.choices = { ...drawing.choices, ...change };
    drawing.ask();
  };
  const copies = make("label", "view-check", "Copies ");
  const select = make("select");
  for (const [words, apart] of APART) select.append(new Option(words, String(apart), apart === 1, apart === 1));
  select.addEventListener("change", () => choose({ apart: Number(select.value) }));
  copies.title = "Every host's own copy of a body, as an outline in its user's colour";
  copies.append(select);
  tools.append(
    copies,
    makeCheckbox("Forces", true, (forces) => choose({ forces })),
    makeCheckbox("Follow", true, (follow) => { drawing.eye.follow = follow; drawing.ask(); }),
    makeButton("Reset view", () => { drawing.eye.reset(); drawing.ask(); }),
  );
  return element;
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
    const touches = about.space !== "line" && about.bodies.some((body) => body.kind !== "point");
    this.#list.replaceChildren(
      ...about.users.map((name, user) => entry("ball", userColour(colours, user).getStyle(), name)),
      ...(about.copies ? [entry("outline", colours.muted.getStyle(), "outline: that user's copy")] : []),
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
