// Mouse, pen and touch: one pointer drags the hand, a pinch closes and turns it, the wheel pushes it away in space.
import type { Ray } from "three";
import type { Vector } from "../protocol.ts";
import { grasped, nearAngle, pinch, width, type Pinch } from "./gestures.ts";
import type { SteeredHand } from "./steered.ts";

/** A wheel's step, as a share of the scene's reach; and a turn, rad. */
const WHEEL_SHARE = 0.05;
const WHEEL_TURN_RAD = 0.1;

interface Grab {
  at: [number, number];
  /** Where the hand was drawn when this pointer came: where the pointer is measured. Null before the hand is taken. */
  through: Vector | null;
  /** In the space in which the hand moves. */
  last: Vector | null;
}

export function listenToPointers(hand: SteeredHand): void {
  const pointers = new Pointers(hand);
  const { element, canvas } = hand.view;
  // Before the camera's controls hear of them.
  const first = { capture: true, passive: false };
  element.addEventListener("pointerdown", (event) => pointers.begin(event), first);
  element.addEventListener("pointermove", (event) => pointers.go(event), first);
  element.addEventListener("pointerup", (event) => pointers.end(event), first);
  element.addEventListener("pointercancel", (event) => pointers.end(event), first);
  element.addEventListener("wheel", (event) => wheel(hand, event), first);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  hand.store.on("taken", ({ user }) => { if (user === null) pointers.drop(); });
}

class Pointers {
  #grabs = new Map<number, Grab>();
  #pinched: (Pinch & { width_m: number }) | null = null;
  /** Between two pointers. */
  #middle: Grab | null = null;

  constructor(private hand: SteeredHand) {}

  begin(event: PointerEvent): void {
    const { hand } = this;
    if (event.target !== hand.view.canvas || (event.pointerType === "mouse" && event.button !== 0)) return;
    const found = hand.hold ? null : hand.view.fingerAt(event.clientX, event.clientY);
    if (!hand.hold && !(found && hand.ask(found.user)) && this.#grabs.size === 0) return;
    // The camera does not turn with this press.
    event.stopPropagation();
    hand.view.canvas.focus({ preventScroll: true });
    capture(hand.view.canvas, event.pointerId);
    this.#grabs.set(event.pointerId, { at: [event.clientX, event.clientY], through: null, last: null });
    this.#again();
  }

  go(event: PointerEvent): void {
    const grab = this.#grabs.get(event.pointerId);
    if (!grab) return hover(this.hand, event);
    event.stopPropagation();
    grab.at = [event.clientX, event.clientY];
    if (!this.hand.hold) return;
    if (this.#grabs.size > 1) this.#pinch();
    else drag(this.hand, grab);
  }

  end(event: PointerEvent): void {
    if (!this.#grabs.delete(event.pointerId)) return;
    event.stopPropagation();
    this.#again();
  }

  /** The hand is gone. */
  drop(): void {
    this.#grabs.clear();
    this.#again();
  }

  /** With another number of pointers, dragging begins anew from where they are. */
  #again(): void {
    [this.#pinched, this.#middle] = [null, null];
    for (const grab of this.#grabs.values()) {
      [grab.through, grab.last] = [null, null];
      drag(this.hand, grab);
    }
    this.hand.view.setDragging(this.#grabs.size > 0);
    this.hand.view.canvas.style.cursor = this.#grabs.size > 0 ? "grabbing" : "";
  }

  /** The middle of two pointers drags the hand; what is between them closes and turns it. */
  #pinch(): void {
    const { hand } = this;
    const [first, second] = [...this.#grabs.values()];
    if (!first || !second || !hand.hold) return;
    const now = pinch(first.at, second.at);
    const before = (this.#pinched ??= { ...now, width_m: width(hand.hold) });
    hand.turn(nearAngle(now.angle_rad - before.angle_rad));
    hand.spread((before.width_m * now.apart) / before.apart);
    before.angle_rad = now.angle_rad;
    this.#middle ??= { at: now.middle, through: null, last: null };
    this.#middle.at = now.middle;
    drag(hand, this.#middle);
  }
}

/** Moves the hand by what the pointer went since the last time. */
function drag(hand: SteeredHand, grab: Grab): void {
  if (hand.user === null) return;
  grab.through ??= hand.view.middleOf(hand.user);
  const ray = hand.view.ray(...grab.at);
  const at = ray && grab.through ? place(hand, ray, grab.through) : null;
  if (!at) return;
  if (grab.last) hand.move([at[0] - grab.last[0], at[1] - grab.last[1], at[2] - grab.last[2]]);
  grab.last = at;
}

function place(hand: SteeredHand, ray: Ray, through: Vector): Vector | null {
  return grasped(ray, through, hand.view.axes().forward, hand.space);
}

function wheel(hand: SteeredHand, event: WheelEvent): void {
  if (!hand.hold || event.target !== hand.view.canvas || !(event.shiftKey || hand.space === "space")) return;
  event.stopPropagation();
  event.preventDefault();
  // With Shift, some systems turn the wheel sideways.
  const steps = -Math.sign(event.deltaY || event.deltaX);
  if (event.shiftKey) hand.turn(steps * WHEEL_TURN_RAD);
  else hand.push(steps * WHEEL_SHARE * hand.view.reach_m);
}

/** Says by the pointer's form what a press would do. */
function hover(hand: SteeredHand, event: PointerEvent): void {
  if (event.target !== hand.view.canvas || event.buttons !== 0) return;
  const found = hand.hold ? null : hand.view.fingerAt(event.clientX, event.clientY);
  const by = found && hand.store.seats.find((seat) => seat.user === found.user)?.by;
  hand.view.canvas.style.cursor = hand.hold || by === "script" || by === "free" ? "grab" : "";
}

function capture(canvas: HTMLCanvasElement, pointer: number): void {
  try {
    canvas.setPointerCapture(pointer);
  } catch {
    // The pointer is gone already; then its end was heard too.
  }
}
