// Hands: fingers, where they are held on a surface, the forces on them, and the springs that draw them.
import { Group, Vector3, type Quaternion } from "three";
import type { FingerPicture, Picture } from "../picture.ts";
import type { About, HostIndex, Vector } from "../protocol.ts";
import { type Colours, fingerColour, userColour } from "./colours.ts";
import { type Layout, standsBeside } from "./layout.ts";
import { Arrow, Ball, Halo, Proxy, Rail, Ring, Spring } from "./marks.ts";

/** Smaller forces have no arrow, N. */
const SMALL_N = 0.02;
/** Half of a point's box, as a share of the way to the hand beside it: where the coupler ends. */
const COUPLER_END = 0.3;

export class Hands {
  readonly group = new Group();
  #hands: Hand[];

  constructor(private about: About, private layout: Layout, colours: Colours) {
    this.#hands = about.users.map((_, user) => new Hand(about, layout, user));
    this.#hands.forEach((hand) => this.group.add(hand.group));
    this.colour(colours);
  }

  show(picture: Picture, forces: boolean): void {
    this.#hands.forEach((hand, user) => {
      const host = picture.hosts.find((one) => one.host === user);
      hand.group.visible = host !== undefined;
      host?.fingers.forEach((finger, index) => hand.show(index, finger, forces));
      const body = host?.bodies[0];
      if (body && standsBeside(this.about)) hand.couple(host.fingers, body.position_m);
    });
  }

  /** Keeps the rails of hands on a line where one looks. */
  follow(x: number): void {
    this.#hands.forEach((hand) => hand.follow(x));
  }

  /** Where the pointer itself is, for each finger of the hand that this browser moves. */
  showAims(user: HostIndex | null, aims_m: Vector[]): void {
    this.#hands.forEach((hand, index) => hand.showAims(index === user ? aims_m : []));
  }

  /** For this camera: rings face it, and nothing is smaller than a few pixels. `pixelAt`: how large one is, m. */
  face(camera: Quaternion, pixelAt: (position: Vector3) => number): void {
    this.#hands.forEach((hand) => hand.face(camera, pixelAt, this.layout.fingerRadius));
  }

  /** Where a user's fingers are drawn, world frame. */
  fingers(user: HostIndex): Vector3[] {
    const hand = this.#hands[user];
    return hand?.group.visible ? hand.fingers.map((finger) => finger.ball.mesh.position) : [];
  }

  colour(colours: Colours): void {
    this.#hands.forEach((hand, user) => hand.colour(colours, user));
  }

  dispose(): void {
    this.#hands.forEach((hand) => hand.dispose());
  }
}

interface FingerMarks {
  ball: Ball;
  halo: Halo;
  proxy: Proxy;
  arrow: Arrow;
  spring: Spring;
  aim: Ring;
}

class Hand {
  readonly group = new Group();
  readonly fingers: FingerMarks[];
  #coupler: Spring | null = null;
  #rail: Rail | null = null;
  #beside: Vector3;

  constructor(about: About, private layout: Layout, user: number) {
    const radius = layout.fingerRadius;
    this.#beside = new Vector3(...(layout.beside[user] ?? [0, 0, 0]));
    this.fingers = (about.fingers_m[user] ?? []).map(() => ({
      ball: new Ball(radius),
      halo: new Halo(radius),
      proxy: new Proxy(0.45 * radius),
      arrow: new Arrow(0.28 * radius),
      spring: new Spring(0.4 * radius, 10),
      aim: new Ring(1.25 * radius),
    }));
    for (const marks of this.fingers) this.group.add(...Object.values(marks).map((mark) => mark.object));
    if (!standsBeside(about)) return;
    this.#rail = new Rail(this.#beside, 2 * layout.radius, 0.12 * radius);
    this.#coupler = new Spring(0.45 * radius, 8);
    this.group.add(this.#rail.object, this.#coupler.object);
  }

  /** Keeps the rail where one looks. */
  follow(x: number): void {
    if (this.#rail) this.#rail.object.position.x = x;
  }

  show(index: number, finger: FingerPicture, forces: boolean): void {
    const marks = this.fingers[index];
    if (!marks) return;
    const at = this.#drawn(finger.position_m);
    const force = new Vector3(...finger.force_n);
    const target = finger.target_m ? this.#drawn(finger.target_m) : null;
    marks.ball.show(at);
    marks.halo.show(at, finger.phase);
    marks.proxy.show(finger.proxy_m ? this.#drawn(finger.proxy_m) : null, force);
    marks.arrow.show(at, force.length() > SMALL_N && forces ? force.multiplyScalar(this.layout.metresPerNewton) : null);
    // Full colour at a quarter of the scene: a spring that is a finger long is nearly slack.
    marks.spring.show(at, target, target ? at.distanceTo(target) / (0.4 * this.layout.radius) : 0);
  }

  /** On a line: the coupler between the hand and the body beside it. */
  couple(fingers: FingerPicture[], body_m: Vector): void {
    const first = fingers[0];
    if (!first) return;
    const hand = this.#drawn(first.position_m);
    const end = new Vector3(...body_m).addScaledVector(this.#beside, COUPLER_END);
    this.#coupler?.show(end, hand, 0);
  }

  showAims(aims_m: Vector[]): void {
    this.fingers.forEach((marks, index) => {
      const aim = aims_m[index];
      marks.aim.show(aim ? this.#drawn(aim) : null);
    });
  }

  face(camera: Quaternion, pixelAt: (position: Vector3) => number, radius: number): void {
    for (const { ball, halo, proxy, aim } of this.fingers) {
      const factor = Math.max(1, (6 * pixelAt(ball.mesh.position)) / radius);
      for (const mark of [ball, halo, proxy, aim]) mark.object.scale.setScalar(factor);
      aim.face(camera);
    }
  }

  colour(colours: Colours, user: number): void {
    const own = userColour(colours, user);
    this.fingers.forEach(({ ball, halo, proxy, arrow, spring, aim }, finger) => {
      const own = fingerColour(colours, user, finger);
      ball.colour(own);
      halo.colours(colours);
      proxy.colour(colours.text);
      arrow.colour(own.clone().lerp(colours.text, 0.25));
      spring.colours(colours.accent, colours.bad);
      aim.colour(colours.text);
    });
    this.#coupler?.colours(own.clone().lerp(colours.muted, 0.4), colours.bad);
    this.#rail?.colour(colours.line);
  }

  dispose(): void {
    for (const marks of this.fingers) Object.values(marks).forEach((mark) => mark.dispose());
    this.#coupler?.dispose();
    this.#rail?.dispose();
  }

  #drawn(position_m: Vector): Vector3 {
    return new Vector3(...position_m).add(this.#beside);
  }
}
