// The scene in three dimensions.
import type { Picture } from "../picture.ts";
import type { About, HostIndex } from "../protocol.ts";

export class View {
  constructor(element: HTMLElement) { void element; }
  /** Begins anew with another scene. */
  introduce(about: About): void { void about; }
  /** Draws this picture at the next frame; only the newest counts. */
  show(picture: Picture): void { void picture; }
  /** Whose hand this browser moves: drawn with its spring. */
  setMine(user: HostIndex | null): void { void user; }
}
