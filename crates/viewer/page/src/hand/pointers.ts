// Mouse, pen and touch: one pointer drags the hand, a pinch closes and turns it, the wheel pushes it away in space.
import type { Ray } from "three";
import type { Vector } from "../protocol.ts";
import { grasped, nearAngle, pinch, width, type Pinch } from "./gestures.ts";
import type { HandOfThisPage } from "./hand.ts";

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

export function listenToPointers(hand: HandOfThisPage): void {
  const { view } = hand;
  const grabs = new Map<number, Grab>();
  let pinched: (Pinch & { width_m: number }) | null = null;

  const begin = (event: PointerEvent) => {
    if (event.target !== view.canvas || (event.pointerType === "mouse" && event.button !== 0)) return;
    const found = hand.hold ? null : view.fingerAt(event.clientX, event.clientY);
    if (!hand.hold && !(found && hand.ask(found.user)) && grabs.size === 0) return;
    // The camera does not turn with this press.
    event.stopPropagation();
    view.canvas.focus({ preventScroll: true });
    capture(view.canvas, event.pointerId);
    grabs.set(event.pointerId, { at: [event.clientX, event.clientY], through: null, last: null });
    pinched = null;
    again();
  };
  const go = (event: PointerEvent) => {
    const grab = grabs.get(event.pointerId);
    if (!grab) return hover(hand, event);
    event.stopPropagation();
    grab.at = [event.clientX, event.clientY];
    if (!hand.hold) return;
    if (grabs.size > 1) pinchOn();
    else drag(hand, grab);
  };
  const end = (event: PointerEvent) => {
    if (!grabs.delete(event.pointerId)) return;
    event.stopPropagation();
    pinched = null;
    again();
  };
  /** With another number of pointers, dragging begins anew from where they are. */
  const again = () => {
    for (const grab of grabs.values()) [grab.through, grab.last] = [null, null];
    for (const grab of grabs.values()) drag(hand, grab);
    view.setDragging(grabs.size > 0);
    view.canvas.style.cursor = grabs.size > 0 ? "grabbing" : "";
  };
  const pinchOn = () => {
    const [first, second] = [...grabs.values()];
    if (!first || !second || !hand.hold) return;
    const now = pinch(first.at, second.at);
    if (!pinched) pinched = { ...now, width_m: width(hand.hold) };
    else hand.turn(nearAngle(now.angle_rad - pinched.angle_rad));
    hand.spread((pinched.width_m * now.apart) / pinched.apart);
    pinched.angle_rad = now.angle_rad;
    const both: Grab = { ...first, at: now.middle };
    drag(hand, both);
    [first.through, first.last] = [both.through, both.last];
  };

  view.element.addEventListener("pointerdown", begin, { capture: true });
  view.element.addEventListener("pointermove", go, { capture: true });
  for (const kind of ["pointerup", "pointercancel"] as const) view.element.addEventListener(kind, end, { capture: true });
  view.element.addEventListener("wheel", (event) => wheel(hand, event), { capture: true, passive: false });
  view.canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  hand.store.on("taken", ({ user }) => {
    if (user !== null) return;
    grabs.clear();
    again();
  });
}

/** Moves the hand by what the pointer went since the last time. */
function drag(hand: HandOfThisPage, grab: Grab): void {
  if (hand.user === null) return;
  grab.through ??= hand.view.middleOf(hand.user);
  const ray = hand.view.ray(...grab.at);
  const at = ray && grab.through ? place(hand, ray, grab.through) : null;
  if (!at) return;
  if (grab.last) hand.move([at[0] - grab.last[0], at[1] - grab.last[1], at[2] - grab.last[2]]);
  grab.last = at;
}

function place(hand: HandOfThisPage, ray: Ray, through: Vector): Vector | null {
  return grasped(ray, through, hand.view.axes().forward, hand.space);
}

function wheel(hand: HandOfThisPage, event: WheelEvent): void {
  if (!hand.hold || event.target !== hand.view.canvas || !(event.shiftKey || hand.space === "space")) return;
  event.stopPropagation();
  event.preventDefault();
  // With Shift, some systems turn the wheel sideways.
  const steps = -Math.sign(event.deltaY || event.deltaX);
  if (event.shiftKey) hand.turn(steps * WHEEL_TURN_RAD);
  else hand.push(steps * WHEEL_SHARE * hand.view.reach_m);
}

/** Says by the pointer's form what a press would do. */
function hover(hand: HandOfThisPage, event: PointerEvent): void {
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
