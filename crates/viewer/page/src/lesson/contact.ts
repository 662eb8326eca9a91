// The stiffnesses that are at work where a soft object is touched: the object's own, and those of its local model.
import { make, say } from "../dom.ts";
import type { Picture } from "../picture.ts";
import type { About, HostIndex, Settings, SoftInfo } from "../protocol.ts";
import { ownSurface } from "../view/soft.ts";
import { readable } from "./scale.ts";

const STORY = "The object is simulated slowly. Between two results a hand feels its local model: a spring K_h to where the "
  + "surface was last, and with “pi” an integral INT that grows while the hand is inside. Both are safe up to shares of K_o, "
  + "how stiff the object itself is where it is touched, all contacts together.";

/** Numbers change this often at most, s. */
const PACE_S = 0.2;

export class Contact {
  readonly element = make("div", { class: "contact" });
  #soft: SoftInfo | null = null;
  #numbers = { ko: make("dd"), kh: make("dd"), int: make("dd") };
  #shown_s = -Infinity;

  constructor() {
    const { ko, kh, int } = this.#numbers;
    const row = (name: string, meaning: string, value: HTMLElement) => make("div", {}, make("dt", { title: meaning }, name), value);
    this.element.append(
      make("h3", {}, "Where it is touched"),
      make("dl", { class: "gains" },
        row("K_o", "How stiff the object is where it is touched, all contacts together", ko),
        row("K_h", "The spring of the local model", kh),
        row("INT", "What the integral of the local model gains in a period of the simulation", int)),
      make("p", { class: "small muted" }, STORY),
    );
    this.element.hidden = true;
  }

  introduce(about: About): void {
    this.#soft = about.soft;
    this.#shown_s = -Infinity;
    this.element.hidden = about.soft === null;
    Object.values(this.#numbers).forEach((value) => say(value, "–"));
  }

  /** `mine` is whose hand this browser moves. */
  show(picture: Picture, settings: Settings, mine: HostIndex | null): void {
    if (!this.#soft || Math.abs(picture.time_s - this.#shown_s) < PACE_S) return;
    const ko = ownSurface(picture, mine)?.ko_n_per_m;
    if (ko === undefined) return;
    this.#shown_s = picture.time_s;
    const { stiffness, integral } = gains(this.#soft, settings, ko);
    say(this.#numbers.ko, inWords(ko, null));
    say(this.#numbers.kh, inWords(stiffness, stiffness / ko));
    say(this.#numbers.int, integral === null ? "none" : inWords(integral, integral / ko));
  }
}

/** K_h and INT at this K_o, N/m; an INT of null where there is no integral. */
export function gains(soft: SoftInfo, settings: Settings, ko: number): { stiffness: number; integral: number | null } {
  const set = <K extends keyof SoftInfo["local_model"]>(name: K) => settings[`local_model.${name}`] ?? soft.local_model[name];
  const gain = (absolute: "stiffness_n_per_m" | "integral_n_per_m", ratio: "stiffness_ratio" | "integral_ratio") =>
    Number(set(absolute)) || Number(set(ratio)) * ko;
  return {
    stiffness: gain("stiffness_n_per_m", "stiffness_ratio"),
    integral: set("kind") === "pi" ? gain("integral_n_per_m", "integral_ratio") : null,
  };
}

function inWords(newtons_per_m: number, ratio: number | null): string {
  const share = ratio !== null && Number.isFinite(ratio) ? ` = ${readable(ratio)} K_o` : "";
  return `${readable(newtons_per_m)} N/m${share}`;
}
