// One canvas: draws a picture when something changed, and no more often.
import { PCFShadowMap, Scene, Vector3, WebGLRenderer, type Ray } from "three";
import type { Picture } from "../picture.ts";
import type { About, HostIndex, Vector } from "../protocol.ts";
import { Bodies } from "./bodies.ts";
import { readColours, type Colours } from "./colours.ts";
import { Eye } from "./eye.ts";
import { Hands } from "./hands.ts";
import { arrange, type Layout } from "./layout.ts";
import { COARSEST, Pace } from "./pace.ts";
import { type Shown, SoftObject } from "./soft.ts";
import { isSun, Stage } from "./stage.ts";

/** What a reader may choose to see. */
export interface Choices {
  forces: boolean;
  /** See `Bodies.apart`. */
  apart: number;
  /** See `SoftObject`. */
  shown: Shown;
  nets: boolean;
}

/** Everything that belongs to one scene. */
interface Contents {
  about: About;
  layout: Layout;
  stage: Stage;
  bodies: Bodies;
  soft: SoftObject | null;
  hands: Hands;
}

export class Drawing {
  readonly eye: Eye;
  readonly pace = new Pace();
  choices: Choices = { forces: true, apart: 1, shown: "displacement", nets: false };
  mine: HostIndex | null = null;
  /** See `View.setAims`. */
  aims_m: Vector[] = [];
  /** While a hand is dragged the camera stays where it is. */
  dragging = false;
  /** After every frame. */
  onDrawn: () => void = () => {};
  onPace: () => void = () => {};
  colours: Colours;
  #renderer: WebGLRenderer;
  #scene = new Scene();
  #contents: Contents | null = null;
  #about: About | null = null;
  #picture: Picture | null = null;
  #asked = 0;
  #drawnAt: number | null = null;
  #size = { width: 1, height: 1 };

  constructor(canvas: HTMLCanvasElement, context: WebGL2RenderingContext) {
    this.#renderer = new WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.#renderer.shadowMap.enabled = true;
    this.#renderer.shadowMap.type = PCFShadowMap;
    this.colours = readColours();
    this.eye = new Eye(canvas, () => this.ask());
  }

  get layout(): Layout | null { return this.#contents?.layout ?? null; }

  /** The soft object; null where the scene has none, or before its first picture. */
  get soft(): SoftObject | null { return this.#contents?.soft ?? null; }

  introduce(about: About): void {
    this.#about = about;
    this.#picture = null;
    this.#drop();
    this.ask();
  }

  show(picture: Picture): void {
    this.#picture = picture;
    this.ask();
  }

  /** Draws at the next frame. */
  ask(): void {
    if (this.#asked === 0) this.#asked = requestAnimationFrame((now_ms) => this.#frame(now_ms));
    this.#dirty = true;
  }
  #dirty = false;

  resize(width: number, height: number): void {
    if (width < 1 || height < 1) return;
    this.#size = { width, height };
    this.#fit();
    this.eye.resize(width, height);
    this.ask();
  }

  recolour(): void {
    this.colours = readColours();
    this.#contents?.stage.colour(this.colours);
    this.#contents?.bodies.colour(this.colours);
    this.#contents?.soft?.colour(this.colours);
    this.#contents?.hands.colour(this.colours);
    this.ask();
  }

  ray(x: number, y: number): Ray { return this.eye.ray(x, y); }

  /** Where a user's fingers are drawn. */
  fingers(user: HostIndex): Vector3[] { return this.#contents?.hands.fingers(user) ?? []; }

  dispose(): void {
    cancelAnimationFrame(this.#asked);
    this.#asked = -1;
    this.#drop();
    this.eye.controls.dispose();
    this.#renderer.dispose();
  }

  /** A frame that follows a drawn one draws nothing new: it is there to see how long the drawn one took. */
  #frame(now_ms: number): void {
    this.#asked = 0;
    if (this.#drawnAt !== null && this.pace.frame(now_ms - this.#drawnAt)) this.#paceChanged();
    this.#drawnAt = null;
    if (!this.#dirty) return;
    this.#dirty = false;
    this.#draw();
    this.#drawnAt = now_ms;
    this.onDrawn();
    if (this.#asked === 0) this.#asked = requestAnimationFrame((next_ms) => this.#frame(next_ms));
  }

  #draw(): void {
    const contents = this.#build();
    if (contents && this.#picture) this.#update(contents, this.#picture);
    this.#renderer.render(this.#scene, this.eye.camera);
  }

  #update({ about, layout, stage, bodies, soft, hands }: Contents, picture: Picture): void {
    bodies.apart = this.choices.apart;
    bodies.show(picture, this.mine);
    if (soft) {
      soft.shown = this.choices.shown;
      soft.copies = this.choices.nets;
      soft.show(picture, this.mine);
    }
    hands.show(picture, this.choices.forces);
    hands.showAims(this.mine, this.aims_m);
    if (!this.dragging && this.#follow(about, layout, picture)) this.ask();
    stage.follow(this.eye.controls.target);
    hands.follow(this.eye.controls.target.x);
    this.eye.camera.updateMatrixWorld();
    hands.face(this.eye.camera.quaternion, (position) => this.eye.pixelAt(position, this.#size.height));
  }

  #follow(about: About, layout: Layout, picture: Picture): boolean {
    const now_ms = performance.now();
    const step_s = Math.min(0.5, Math.max(0, now_ms - this.#followed_ms) / 1e3);
    this.#followed_ms = now_ms;
    const { middle, spread } = extent(about, layout, picture);
    return this.eye.keep(middle, spread, step_s);
  }
  #followed_ms = 0;

  /** Waits for a scene's first picture, which says where its bodies are. */
  #build(): Contents | null {
    if (this.#contents || !this.#about || !this.#picture) return this.#contents;
    const about = this.#about;
    const layout = arrange(about, this.#picture);
    const stage = new Stage(about, layout, this.colours);
    const [bodies, hands] = [new Bodies(about, this.colours), new Hands(about, layout, this.colours)];
    const soft = about.soft && new SoftObject(about.soft, about, this.colours);
    this.#scene.add(stage.group, bodies.group, hands.group, ...(soft ? [soft.group] : []));
    this.#contents = { about, layout, stage, bodies, soft, hands };
    this.#coarsen();
    this.eye.frame(layout, about.space);
    return this.#contents;
  }

  #drop(): void {
    if (!this.#contents) return;
    const { stage, bodies, soft, hands } = this.#contents;
    for (const part of [stage, bodies, hands, ...(soft ? [soft] : [])]) {
      this.#scene.remove(part.group);
      part.dispose();
    }
    this.#contents = null;
  }

  #paceChanged(): void {
    this.#fit();
    this.#coarsen();
    this.ask();
    this.onPace();
  }

  #fit(): void {
    const { coarseness } = this.pace;
    const finest = coarseness === 0 ? 2 : coarseness < COARSEST ? 1 : 0.6;
    this.#renderer.setPixelRatio(Math.min(finest, devicePixelRatio));
    this.#renderer.setSize(this.#size.width, this.#size.height, false);
  }

  #coarsen(): void {
    this.#contents?.stage.group.traverse((part) => { if (isSun(part)) part.castShadow = this.pace.coarseness < 2; });
  }
}

/** The middle of everything that moves, and how far from it that reaches, m. */
function extent(about: About, layout: Layout, picture: Picture): { middle: Vector3; spread: number } {
  const moving = picture.hosts.flatMap((host) => [
    ...host.fingers.map((finger) => finger.position_m),
    ...host.bodies.filter((_, index) => !about.bodies[index]?.fixed).map((body) => body.position_m),
  ]);
  // A soft object is held somewhere: it stays in the picture.
  const places = [...moving, ...(about.soft ? [layout.centre] : [])].map((place) => new Vector3(...place));
  const middle = new Vector3();
  places.forEach((place) => middle.addScaledVector(place, 1 / places.length));
  return { middle, spread: Math.max(0, ...places.map((place) => place.distanceTo(middle))) };
}
