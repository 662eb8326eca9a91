// Keys: arrows and Page Up and Down move the hand, Space closes and opens it, Q and E turn it, Escape leaves.
// Without a hand, arrows turn a view that has the focus, plus and minus zoom.
import type { Vector } from "../protocol.ts";
import { keyDirection } from "./gestures.ts";
import type { SteeredHand } from "./steered.ts";

/** A shorter press is a switch; a longer one closes for as long as it lasts, ms. */
const TAP_MS = 250;
const TURN_RAD = 0.08;

export interface Keys {
  /** The directions of all keys that are down. */
  directions(): Vector[];
  /** 1: counter-clockwise; -1: clockwise; 0: neither or both. */
  turns(): number;
}

export function listenToKeys(hand: SteeredHand): Keys {
  const down = new Set<string>();
  let closedAt_ms: number | null = null;

  const press = (key: string): boolean => {
    if (key === "Escape") hand.leave();
    else if (isGrip(key) && hand.hasGrip) {
      closedAt_ms = hand.closed ? null : performance.now();
      hand.setGrip(!hand.closed);
    } else if (isHandKey(key)) down.add(key);
    else return false;
    return true;
  };
  document.addEventListener("keydown", (event) => {
    const key = nameOf(event);
    if (event.ctrlKey || event.metaKey || event.altKey || isTaken(event.target, key)) return;
    if (event.repeat && down.has(key)) return event.preventDefault();
    if (event.repeat && isGrip(key) && hand.hold) return event.preventDefault();
    const used = hand.hold ? press(key) : event.target === hand.view.canvas && look(hand, key);
    if (used) event.preventDefault();
  });
  document.addEventListener("keyup", (event) => {
    const key = nameOf(event);
    down.delete(key);
    if (!isGrip(key) || closedAt_ms === null) return;
    if (performance.now() - closedAt_ms > TAP_MS) hand.setGrip(false);
    closedAt_ms = null;
  });
  window.addEventListener("blur", () => down.clear());

  const directions = () => {
    const { right, up, forward } = hand.view.axes();
    return [...down].map((key) => keyDirection(key, right, up, forward, hand.space)).filter((found) => found !== null);
  };
  const turns = () => Number(down.has("q")) - Number(down.has("e"));
  return { directions, turns };
}

/** Turns the view. Says whether the key meant anything. */
function look({ view }: SteeredHand, key: string): boolean {
  switch (key) {
    case "ArrowLeft": view.turn(-TURN_RAD, 0); return true;
    case "ArrowRight": view.turn(TURN_RAD, 0); return true;
    case "ArrowUp": view.turn(0, TURN_RAD); return true;
    case "ArrowDown": view.turn(0, -TURN_RAD); return true;
    case "+": case "=": view.zoom(0.9); return true;
    case "-": view.zoom(1 / 0.9); return true;
    default: return false;
  }
}

function nameOf(event: KeyboardEvent): string {
  return event.key.length === 1 ? event.key.toLowerCase() : event.key;
}

function isGrip(key: string): boolean { return key === " " || key === "c"; }

function isHandKey(key: string): boolean {
  return key.startsWith("Arrow") || key === "PageUp" || key === "PageDown" || key === "q" || key === "e";
}

/** Whether what has the focus needs this key itself. */
function isTaken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName)) return key !== "Escape";
  const role = target.getAttribute("role") ?? "";
  if (/^(tab|slider|listbox|option|menuitem|radio)$/.test(role)) return key !== "Escape";
  return key === " " && /^(BUTTON|A|SUMMARY)$/.test(target.tagName);
}
