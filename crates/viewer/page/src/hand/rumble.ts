// What the hand feels, as a vibration: of a gamepad, or of a phone. Only where the browser has them.
import type { FingerPicture } from "../picture.ts";

/** Changes of the force that are felt: the least, and the one that is felt in full, N. */
const LEAST_N = 0.4;
const FULL_N = 4;
/** A pulse, ms. */
const PULSE_MS = 40;
/** Pulses come no more often than this, ms. */
const PAUSE_MS = 60;

/** Touching and letting go, and jumps of the force, since the picture before: 0 for nothing, to 1. */
export function strengthOf(before: FingerPicture[], after: FingerPicture[]): number {
  let most = 0;
  after.forEach((finger, index) => {
    const past = before[index];
    if (!past) return;
    const touched = past.phase === "free" && finger.phase !== "free";
    const jump = Math.hypot(...finger.force_n.map((part, axis) => part - (past.force_n[axis] ?? 0)));
    const felt = jump < LEAST_N ? 0 : Math.min(1, jump / FULL_N);
    most = Math.max(most, touched ? Math.max(0.5, felt) : felt);
  });
  return most;
}

export class Rumble {
  /** Off from the start for readers who asked for less motion. */
  on = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  #before: FingerPicture[] = [];
  #last_ms = 0;

  /** Whether there is anything here that can vibrate. */
  static possible(): boolean {
    return gamepads().length > 0 || ("vibrate" in navigator && navigator.maxTouchPoints > 0);
  }

  feel(fingers: FingerPicture[]): void {
    const strength = strengthOf(this.#before, fingers);
    this.#before = fingers;
    const now_ms = performance.now();
    if (!this.on || strength === 0 || now_ms - this.#last_ms < PAUSE_MS) return;
    this.#last_ms = now_ms;
    for (const gamepad of gamepads()) {
      const effect = { duration: PULSE_MS, weakMagnitude: strength, strongMagnitude: 0.5 * strength };
      // One that cannot do this is as good as none.
      gamepad.vibrationActuator.playEffect("dual-rumble", effect).catch(() => {});
    }
    // A phone's motor knows only for how long. Without a touch before, browsers say no, which is no error.
    if ("vibrate" in navigator && navigator.maxTouchPoints > 0) navigator.vibrate(Math.round(PULSE_MS * strength));
  }
}

function gamepads(): Gamepad[] {
  return (navigator.getGamepads?.() ?? []).filter((gamepad) => gamepad !== null)
    .filter((gamepad) => "vibrationActuator" in gamepad && Boolean(gamepad.vibrationActuator));
}
