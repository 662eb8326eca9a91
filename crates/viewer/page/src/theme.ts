// Light, dark, or as the system says. When the colours change, the document hears "themechange".
import { make } from "./dom.ts";

const CHOICES = ["auto", "light", "dark"] as const;
type Choice = (typeof CHOICES)[number];
const NAMES: Record<Choice, string> = { auto: "Automatic", light: "Light", dark: "Dark" };
const KEY = "cotouch-theme";

/** A control for the theme; sets the remembered one at once. */
export function createTheme(): HTMLElement {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let choice = remembered();
  const apply = () => {
    const theme = choice === "auto" ? (system.matches ? "dark" : "light") : choice;
    if (document.documentElement.dataset["theme"] === theme) return;
    document.documentElement.dataset["theme"] = theme;
    document.dispatchEvent(new Event("themechange"));
  };
  system.addEventListener("change", apply);
  apply();

  const select = make("select", { "aria-label": "Colours", title: "Colours", class: "theme" });
  select.append(...CHOICES.map((name) => make("option", { value: name }, NAMES[name])));
  select.value = choice;
  select.addEventListener("change", () => {
    choice = CHOICES.find((name) => name === select.value) ?? "auto";
    remember(choice);
    apply();
  });
  return select;
}

// A browser may refuse storage; then the choice lasts as long as the page.
function remembered(): Choice {
  try {
    return CHOICES.find((name) => name === localStorage.getItem(KEY)) ?? "auto";
  } catch {
    return "auto";
  }
}

function remember(choice: Choice): void {
  try {
    localStorage.setItem(KEY, choice);
  } catch {
    // Nothing is lost but the memory of it.
  }
}
