// The scene in three dimensions: a canvas, what stands over it, and what a hand has to know of both.
import "./view.css";
import { MOUSE, Vector3, type Ray } from "three";
import type { Picture } from "../picture.ts";
import type { About, HostIndex, Vector } from "../protocol.ts";
import { Drawing } from "./drawing.ts";
import { make } from "./element.ts";
import { Label } from "./labels.ts";
import type { Layout } from "./layout.ts";
import { ColourBar, Legend, Tools } from "./tools.ts";

/** Fingers are caught by a press this near, CSS pixels. */
const NEAR_PX = 22;
/** Names stand this far under hands, CSS pixels. */
const UNDER_PX = 14;

export class View {
  /** Everything of this view; presses and keys land here. */
  readonly element = make("div", "view");
  readonly canvas = make("canvas", "view-canvas");
  /** The view would like so many pictures a second. */
  onRate: (hz: number) => void = () => {};
  #drawing: Drawing | null;
  #legend = new Legend();
  #scale = new ColourBar();
  #tools: Tools | null = null;
  #labels: Label[] = [];
  #overlay = make("div", "view-labels");
  #sorry = make("p", "view-sorry");
  #about: About | null = null;
  #legendOf: Layout | null = null;
  #handForce = "";
  #drawn = 0;
  #onTheme = () => this.#recolour();
  #resizes: ResizeObserver;

  constructor(element: HTMLElement) {
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", "The scene. Arrow keys turn it, plus and minus zoom; with a hand taken, "
      + "arrow keys move the hand.");
    this.element.append(this.canvas, this.#overlay, this.#sorry);
    element.append(this.element);
    this.#drawing = this.#start();
    this.#resizes = new ResizeObserver(() => this.#resize());
    this.#resizes.observe(this.element);
    this.#resize();
    document.addEventListener("themechange", this.#onTheme);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", this.#onTheme);
  }

  /** Begins anew with another scene. */
  introduce(about: About): void {
    this.#about = about;
    this.#labels = about.users.map(() => new Label());
    this.#overlay.replaceChildren(...this.#labels.map((label) => label.element));
    this.#drawing?.introduce(about);
    this.#tools?.introduce(about);
  }

  /** Draws this picture at the next frame; only the newest counts. */
  show(picture: Picture): void { this.#drawing?.show(picture); }

  /** Whose hand this browser moves; the copy that this user feels is the solid one. */
  setMine(user: HostIndex | null): void {
    if (!this.#drawing) return;
    this.#drawing.mine = user;
    this.#drawing.eye.controls.mouseButtons.RIGHT = user === null ? MOUSE.PAN : MOUSE.ROTATE;
    this.setAims([], "");
  }

  /** Where the pointer is for each finger of that hand, and how hard it draws, in words. */
  setAims(aims_m: Vector[], force: string): void {
    if (!this.#drawing) return;
    this.#drawing.aims_m = aims_m;
    this.#handForce = force;
    this.#drawing.ask();
  }

  /** While a hand is dragged the camera stays where it is. */
  setDragging(dragging: boolean): void {
    if (this.#drawing) this.#drawing.dragging = dragging;
  }

  /** The way that a place on the screen looks; null where nothing is drawn. */
  ray(clientX: number, clientY: number): Ray | null {
    const box = this.canvas.getBoundingClientRect();
    if (!this.#drawing || box.width < 1) return null;
    return this.#drawing.ray((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
  }

  /** The finger that is drawn nearest to a place on the screen, if one is near. */
  fingerAt(clientX: number, clientY: number): { user: HostIndex; finger: number } | null {
    const box = this.canvas.getBoundingClientRect();
    let found: { user: HostIndex; finger: number } | null = null;
    let nearest = NEAR_PX;
    this.#about?.users.forEach((_, user) => this.#drawing?.fingers(user).forEach((at, finger) => {
      const seen = this.#drawing?.eye.project(at);
      if (!seen) return;
      const x = box.left + ((seen.x + 1) / 2) * box.width;
      const y = box.top + ((1 - seen.y) / 2) * box.height;
      const far = Math.hypot(x - clientX, y - clientY);
      if (far < nearest) [found, nearest] = [{ user, finger }, far];
    }));
    return found;
  }

  /** The middle of where a user's fingers are drawn; null where they are not. */
  middleOf(user: HostIndex): Vector | null {
    const fingers = this.#drawing?.fingers(user) ?? [];
    const middle = new Vector3();
    fingers.forEach((at) => middle.addScaledVector(at, 1 / fingers.length));
    return fingers.length > 0 ? middle.toArray() : null;
  }

  /** To where the camera's right, up and forward are in the world. */
  axes(): { right: Vector; up: Vector; forward: Vector } {
    const camera = this.#drawing?.eye.camera;
    if (!camera) return { right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1] };
    const axis = (index: number) => new Vector3().setFromMatrixColumn(camera.matrixWorld, index);
    camera.updateMatrixWorld();
    return { right: axis(0).toArray(), up: axis(1).toArray(), forward: axis(2).negate().toArray() };
  }

  /** How far the scene reaches, m. */
  get reach_m(): number { return this.#drawing?.layout?.radius ?? 0.2; }

  /** Turns the camera, radians. */
  turn(around: number, over: number): void { this.#drawing?.eye.turn(around, over); }
  zoom(factor: number): void { this.#drawing?.eye.zoom(factor); }

  /** Frees what it holds; the view is of no use any more. */
  dispose(): void {
    document.removeEventListener("themechange", this.#onTheme);
    matchMedia("(prefers-color-scheme: dark)").removeEventListener("change", this.#onTheme);
    this.#resizes.disconnect();
    this.#drawing?.dispose();
    this.#drawing = null;
    this.element.remove();
  }

  #start(): Drawing | null {
    const wanted = { antialias: true, alpha: true, powerPreference: "high-performance" } as const;
    const context = this.canvas.getContext("webgl2", wanted) as WebGL2RenderingContext | null;
    if (!context) {
      this.#apologise("This browser does not draw in three dimensions (WebGL 2 is missing or switched off), so the "
        + "scene cannot be shown. Everything else on this page works.");
      this.canvas.hidden = true;
      return null;
    }
    const drawing = new Drawing(this.canvas, context);
    drawing.onDrawn = () => this.#afterFrame(drawing);
    drawing.onPace = () => this.onRate(drawing.pace.hz);
    this.#tools = new Tools(drawing);
    this.element.append(this.#tools.element, this.#legend.element, this.#scale.element);
    // Where there is little room, the scene comes first.
    this.#tools.element.open = this.element.clientWidth > 900;
    this.#legend.element.open = this.element.clientWidth > 1000;
    const sorry = "The graphics were lost; waiting for them.";
    this.canvas.addEventListener("webglcontextlost", () => this.#apologise(sorry));
    this.canvas.addEventListener("webglcontextrestored", () => { this.#apologise(""); drawing.ask(); });
    return drawing;
  }

  #apologise(words: string): void {
    this.#sorry.textContent = words;
    this.#sorry.hidden = words === "";
  }

  #afterFrame(drawing: Drawing): void {
    this.#drawn += 1;
    this.canvas.dataset["drawn"] = String(this.#drawn);
    this.#nameHands(drawing);
    this.#scale.show(drawing.soft);
    if (!this.#about || !drawing.layout || this.#legendOf === drawing.layout) return;
    this.#legendOf = drawing.layout;
    this.#legend.fill(this.#about, drawing.layout, drawing);
  }

  #nameHands(drawing: Drawing): void {
    const { clientWidth: width, clientHeight: height } = this.element;
    this.#labels.forEach((label, user) => {
      const lowest = drawing.fingers(user).map((at) => drawing.eye.project(at))
        .reduce((low, at) => (at && (!low || at.y < low.y) ? at : low), null);
      const name = this.#about?.users[user] ?? "";
      const words = user === drawing.mine && this.#handForce ? `${name} · ${this.#handForce}` : name;
      label.show(words, lowest, width, height, UNDER_PX);
    });
  }

  #resize(): void {
    this.#drawing?.resize(this.element.clientWidth, this.element.clientHeight);
  }

  #recolour(): void {
    this.#drawing?.recolour();
    this.#legendOf = null;
  }
}
