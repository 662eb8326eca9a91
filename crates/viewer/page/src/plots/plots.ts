// Live plots of what the pictures say.
import type { Picture } from "../picture.ts";
import type { About } from "../protocol.ts";

export class Plots {
  constructor(element: HTMLElement) { void element; }
  /** Begins anew with another session. */
  introduce(about: About): void { void about; }
  add(picture: Picture): void { void picture; }
}
