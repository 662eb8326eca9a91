// Words that stay beside what they name while it moves.
import type { Vector2 } from "three";
import { make } from "./element.ts";

export class Label {
  readonly element = make("span", "view-label");
  #text = "";

  /** `at` from -1 to 1, up and right positive; null hides it. `beside_px` is how far below it stands. */
  show(text: string, at: Vector2 | null, width: number, height: number, beside_px: number): void {
    const seen = text !== "" && at !== null && Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
    this.element.hidden = !seen;
    if (!seen) return;
    if (text !== this.#text) this.element.textContent = this.#text = text;
    const [x, y] = [((at.x + 1) / 2) * width, ((1 - at.y) / 2) * height + beside_px];
    this.element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, 0)`;
  }
}
