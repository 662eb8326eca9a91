// Moved controls change the running session: at once and at most ten times a second, or, where that begins it anew,
// once they are let go.
import type { Control, Settings } from "../protocol.ts";
import type { Clock } from "./asking.ts";

const PACE_MS = 100;
/** Keys of the keyboard let go of a slider at every step: wait for the last one. */
const RESTART_MS = 450;

export class Setting {
  #send: (settings: Settings) => void;
  #clock: Clock;
  #waiting: Settings = {};
  #sent_at = -Infinity;
  #due = false;
  #restart: Settings = {};
  #restarts = 0;

  constructor(send: (settings: Settings) => void, clock: Clock) {
    this.#send = send;
    this.#clock = clock;
  }

  moved(control: Control, value: number | string): void {
    if (control.restarts) return;
    this.#waiting[control.key] = value;
    this.#flushSoon();
  }

  released(control: Control, value: number | string): void {
    if (!control.restarts) return;
    this.#restart[control.key] = value;
    const turn = ++this.#restarts;
    this.#clock.later(() => {
      if (turn !== this.#restarts) return;
      const settings = { ...this.#waiting, ...this.#restart };
      this.#waiting = {};
      this.#restart = {};
      this.#send(settings);
    }, control.kind === "choice" ? 0 : RESTART_MS);
  }

  #flushSoon(): void {
    if (this.#due) return;
    const wait_ms = this.#sent_at + PACE_MS - this.#clock.now();
    if (wait_ms > 0) {
      this.#due = true;
      this.#clock.later(() => { this.#due = false; this.#flushSoon(); }, wait_ms);
    } else if (Object.keys(this.#waiting).length > 0) {
      const settings = this.#waiting;
      this.#waiting = {};
      this.#sent_at = this.#clock.now();
      this.#send(settings);
    }
  }
}
