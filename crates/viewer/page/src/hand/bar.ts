// Buttons for the hand that this page moves: for those who have no keys, and to show what there is.
import { make, makeButton, makeCheckbox } from "../view/element.ts";
import type { SteeredHand } from "./steered.ts";
import { Rumble } from "./rumble.ts";

const TURN_RAD = 0.15;

export class HandBar {
  readonly element = make("div", "view-hand");
  #close: HTMLButtonElement;
  #turns: HTMLButtonElement[];
  #rumble: HTMLElement;

  constructor(private hand: SteeredHand, rumble: Rumble) {
    this.#close = makeButton("Close", () => hand.setGrip(!hand.closed));
    this.#close.title = "Close or open the fingers (Space, or pinch)";
    const left = makeButton("⟲", () => hand.turn(TURN_RAD));
    const right = makeButton("⟳", () => hand.turn(-TURN_RAD));
    [left.title, right.title] = ["Turn left (Q)", "Turn right (E)"];
    left.setAttribute("aria-label", "Turn the hand left");
    right.setAttribute("aria-label", "Turn the hand right");
    this.#turns = [left, right];
    const leave = makeButton("Leave", () => hand.leave());
    leave.title = "Give the hand back (Escape)";
    this.#rumble = makeCheckbox("Vibrate", rumble.on, (on) => { rumble.on = on; });
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Your hand");
    this.element.append(this.#close, left, right, this.#rumble, leave);
    addEventListener("gamepadconnected", () => this.update());
    this.update();
  }

  update(): void {
    const { hand } = this;
    this.element.hidden = hand.hold === null;
    if (hand.hold === null) return;
    this.#close.hidden = !hand.hasGrip;
    const words = hand.closed ? "Open" : "Close";
    if (this.#close.textContent !== words) this.#close.textContent = words;
    this.#turns.forEach((button) => { button.hidden = !hand.hasGrip; });
    this.#rumble.hidden = !Rumble.possible();
  }
}
