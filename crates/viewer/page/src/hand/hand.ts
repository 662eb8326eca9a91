// A mouse, a touch or keys as one of the users: gestures on the view become targets for fingers.
import type { Send } from "../connection.ts";
import type { FingerPicture } from "../picture.ts";
import type { About, HostIndex, TakenMessage, Vector } from "../protocol.ts";
import type { Store } from "../store.ts";
import type { View } from "../view/view.ts";
import { HandBar } from "./bar.ts";
import { grip, leashed, moved, pull, takeHold, targets, turned, widened, width, type Hold } from "./gestures.ts";
import { listenToKeys, type Keys } from "./keys.ts";
import { listenToPointers } from "./pointers.ts";
import { Rumble } from "./rumble.ts";
import type { SteeredHand } from "./steered.ts";

/** Targets are sent no more often than this, and no more rarely than that, ms. */
const SOONEST_MS = 15;
const LATEST_MS = 200;
/** Of keys: hands that cross a scene in about two seconds, m/s per m of its reach; and a turn, rad/s. */
const KEY_SPEED_PER_S = 0.6;
const TURN_SPEED_RAD_PER_S = 1.2;
/** Fingers close and open at this speed, m/s. */
const GRIP_SPEED_M_PER_S = 0.08;
/** Closing stops where the springs press so hard, N; or at a fifth of what the session allows. */
const GRIP_N = 4;
/** Fingers that are pressed together so hard hold something, N. */
const HOLDS_N = 0.5;

export function createHand(view: View, store: Store, send: Send): void {
  new HandOfThisPage(view, store, send);
}

/** What the fingers are to do, besides where the hand is. */
type Grip = "as it is" | "closing" | "opening";

class HandOfThisPage implements SteeredHand {
  hold: Hold | null = null;
  #taken: TakenMessage | null = null;
  #grip: Grip = "as it is";
  #keys: Keys;
  #bar: HandBar;
  #rumble: Rumble;
  #frame_ms: number | null = null;
  #sent_ms = 0;
  #changed = false;

  constructor(readonly view: View, readonly store: Store, private send: Send) {
    this.#rumble = new Rumble();
    this.#bar = new HandBar(this, this.#rumble);
    view.element.append(this.#bar.element);
    this.#keys = listenToKeys(this);
    listenToPointers(this);
    store.on("taken", (message) => this.#take(message));
    store.on("session", () => this.#drop());
    store.on("trouble", (trouble) => { if (trouble !== null) this.#drop(); });
    store.on("picture", () => this.#look());
    // Frames stop in a tab that nobody sees; the hand goes on being held there.
    setInterval(() => this.#sendIfDue(LATEST_MS), LATEST_MS / 2);
  }

  get about(): About | null { return this.store.session?.about ?? null; }
  get space(): About["space"] { return this.about?.space ?? "space"; }
  get user(): HostIndex | null { return this.#taken?.user ?? null; }
  get closed(): boolean { return this.#grip === "closing" || (this.#grip === "as it is" && this.#pressed() > HOLDS_N); }
  get hasGrip(): boolean { return (this.hold?.offsets.length ?? 0) > 1; }

  ask(user: HostIndex): boolean {
    const by = this.store.seats.find((seat) => seat.user === user)?.by;
    if (this.#taken || (by !== "script" && by !== "free")) return false;
    this.send({ type: "take", user });
    return true;
  }

  leave(): void {
    if (this.#taken) this.send({ type: "leave" });
  }

  change(change: (hold: Hold) => Hold): void {
    if (!this.hold) return;
    this.hold = change(this.hold);
    this.#changed = true;
  }

  move(by_m: [number, number, number]): void {
    this.change((hold) => moved(hold, by_m, this.space));
  }

  push(by_m: number): void {
    const forward = this.view.axes().forward;
    this.#nudge([by_m * forward[0], by_m * forward[1], by_m * forward[2]]);
  }

  turn(angle_rad: number): void {
    if (this.space === "line") return;
    const axis = this.space === "plane" ? [0, 0, 1] as [number, number, number] : away(this.view.axes().forward);
    this.change((hold) => turned(hold, angle_rad, axis));
  }

  setGrip(closed: boolean): void {
    if (!this.hasGrip) return;
    this.#grip = closed ? "closing" : "opening";
  }

  spread(to_m: number): void {
    this.#grip = "as it is";
    this.change((hold) => (to_m < width(hold) && this.#pressed() >= this.#strongest() ? hold : widened(hold, to_m)));
  }

  #take(message: TakenMessage): void {
    this.#drop();
    if (message.user === null) return;
    this.#taken = message;
    this.view.setMine(message.user);
    this.view.canvas.focus({ preventScroll: true });
    this.#look();
  }

  #drop(): void {
    this.#taken = null;
    this.hold = null;
    this.#grip = "as it is";
    this.#frame_ms = null;
    this.view.setMine(null);
    this.#bar.update();
  }

  #fingers(): FingerPicture[] {
    return this.store.latest?.hosts.find((host) => host.host === this.user)?.fingers ?? [];
  }

  /** Both ends of each finger's spring: the server lets a pointer draw no faster and no further than is good. */
  #springs(): { drawn_m: Vector[]; fingers_m: Vector[] } {
    const fingers = this.#fingers();
    return {
      drawn_m: fingers.map((finger) => finger.target_m ?? finger.position_m),
      fingers_m: fingers.map((finger) => finger.position_m),
    };
  }

  /** The first picture after taking says where the hand begins. */
  #look(): void {
    const fingers = this.#fingers();
    if (!this.#taken || fingers.length === 0) return;
    this.#rumble.feel(fingers);
    if (this.hold) return;
    const rest_m = this.about?.fingers_m[this.user ?? 0] ?? [];
    this.hold = takeHold(fingers.map((finger) => finger.target_m ?? finger.position_m), rest_m);
    this.#changed = true;
    this.#bar.update();
    requestAnimationFrame((now_ms) => this.#frame(now_ms));
  }

  #frame(now_ms: number): void {
    if (!this.hold) return;
    const step_s = Math.min(0.05, (now_ms - (this.#frame_ms ?? now_ms)) / 1000);
    this.#frame_ms = now_ms;
    this.#followKeys(step_s);
    this.#followGrip(step_s);
    this.#sendIfDue(this.#changed ? SOONEST_MS : LATEST_MS);
    this.#showForce();
    requestAnimationFrame((next_ms) => this.#frame(next_ms));
  }

  #followKeys(step_s: number): void {
    const far = KEY_SPEED_PER_S * this.view.reach_m * step_s;
    for (const direction of this.#keys.directions()) {
      this.#nudge([far * direction[0], far * direction[1], far * direction[2]]);
    }
    const turns = this.#keys.turns();
    if (turns !== 0) this.turn(turns * TURN_SPEED_RAD_PER_S * step_s);
  }

  #nudge(by_m: [number, number, number]): void {
    const fingers_m = this.#fingers().map((finger) => finger.position_m);
    const leash_m = Math.max(0.02, (0.5 * (this.about?.max_force_n ?? 10)) / (this.#taken?.stiffness_n_per_m || 150));
    this.change((hold) => leashed(moved(hold, by_m, this.space), fingers_m, leash_m));
  }

  #followGrip(step_s: number): void {
    const hold = this.hold;
    if (!hold || this.#grip === "as it is") return;
    const step_m = GRIP_SPEED_M_PER_S * step_s;
    if (this.#grip === "opening") {
      if (width(hold) < hold.open_m) this.change((now) => widened(now, width(now) + step_m));
    } else if (this.#pressed() < this.#strongest() && width(hold) > 2e-3 * hold.open_m) {
      this.change((now) => widened(now, width(now) - step_m));
    }
  }

  #pressed(): number {
    if (!this.hold || !this.#taken || !this.hasGrip) return 0;
    const { drawn_m, fingers_m } = this.#springs();
    return grip(this.hold, drawn_m, fingers_m, this.#taken.stiffness_n_per_m);
  }

  #strongest(): number {
    return Math.min(GRIP_N, 0.2 * (this.about?.max_force_n ?? 20));
  }

  #sendIfDue(after_ms: number): void {
    const now_ms = performance.now();
    if (!this.hold || now_ms - this.#sent_ms < after_ms) return;
    this.send({ type: "point", targets_m: targets(this.hold) });
    this.#sent_ms = now_ms;
    this.#changed = false;
  }

  #showForce(): void {
    if (!this.hold || !this.#taken) return;
    const { drawn_m, fingers_m } = this.#springs();
    const force_n = pull(drawn_m, fingers_m, this.#taken.stiffness_n_per_m);
    this.view.setAims(targets(this.hold), `${force_n.toFixed(1)} N`);
    this.#bar.update();
  }
}

function away([x, y, z]: [number, number, number]): [number, number, number] { return [-x, -y, -z]; }
