// What buttons, keys and pointers may do with the hand that this page moves.
import type { HostIndex, Vector, About } from "../protocol.ts";
import type { Store } from "../store.ts";
import type { View } from "../view/view.ts";
import type { Hold } from "./gestures.ts";

export interface SteeredHand {
  readonly view: View;
  readonly store: Store;
  /** Null while this page has no hand. */
  readonly hold: Hold | null;
  readonly user: HostIndex | null;
  readonly space: About["space"];
  readonly closed: boolean;
  /** Whether there is anything to close. */
  readonly hasGrip: boolean;
  /** Asks for a hand that nobody has. Says whether there was any sense in asking. */
  ask(user: HostIndex): boolean;
  leave(): void;
  /** Moves by what a pointer went, m. */
  move(by_m: Vector): void;
  /** Away from the reader or back, in space only, m. */
  push(by_m: number): void;
  turn(angle_rad: number): void;
  setGrip(closed: boolean): void;
  /** Fingers so far from their centre, as a pinch says, m; no harder than closing would press. */
  spread(to_m: number): void;
}
