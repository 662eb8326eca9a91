// What is known about the loop besides its radius: contact modes, margins, warnings, as lists of words.
import { make } from "../dom.ts";
import type { Control, MarginMessage, VerdictMessage } from "../protocol.ts";
import { radiusText } from "./gauge.ts";
import { margins } from "./words.ts";

/** Contact modes, worst first. */
export function listModes(verdict: VerdictMessage): HTMLElement {
  const modes = verdict.modes.toSorted((a, b) => b.spectral_radius - a.spectral_radius);
  const rows = modes.map(({ contacts, spectral_radius, stable }) => make("tr",
    { "data-verdict": stable ? "stable" : "unstable" },
    make("td", {}, contacts.length === 0 ? "no contact" : contacts.join(", ")),
    make("td", { class: "figure" }, radiusText(spectral_radius)),
    make("td", { class: "verdict" }, stable ? "stable" : "unstable")));
  return make("table", { class: "modes" },
    make("thead", {}, make("tr", {}, ...["Contact", "Radius", ""].map((name) => make("th", { scope: "col" }, name)))),
    make("tbody", {}, ...rows));
}

export function listMargins(margin: MarginMessage, controls: readonly Control[]): HTMLElement {
  const words = margins(margin, controls);
  if (words.length === 0 && margin.notes.length === 0) words.push("No limit was found within what was looked at.");
  return make("ul", { class: "words" }, ...[...words, ...margin.notes].map((text) => make("li", {}, text)));
}

export function listWarnings(warnings: readonly string[]): HTMLElement | null {
  if (warnings.length === 0) return null;
  return make("ul", { class: "words warnings" }, ...warnings.map((text) => make("li", {}, text)));
}
