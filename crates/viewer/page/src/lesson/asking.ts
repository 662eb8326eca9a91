// When to ask for a prediction: at once as a control moves, one question under way at a time, the newest wins.
import type { MapAxis, PageMessage, Settings } from "../protocol.ts";

type Question = Extract<PageMessage, { type: "predict" }>;

export interface Wish {
  settings: Settings;
  axes: { x: MapAxis; y: MapAxis } | null;
  /** What the map depends on: with the same key, an earlier map still holds. */
  mapKey: string;
  /** Margins take long: only once the controls rest. */
  margin: boolean;
}

/** At most this often. */
const PACE_MS = 50;
/** A question is given this long before a newer one ends it. */
const PATIENCE_MS = 300;
/** Without a move for this long, controls rest. */
const REST_MS = 350;

/** The world outside, so that tests can have one of their own. */
export interface Clock {
  now(): number;
  later(run: () => void, delay_ms: number): unknown;
}

const REAL: Clock = { now: () => performance.now(), later: (run, delay_ms) => setTimeout(run, delay_ms) };

export class Asking {
  #send: (question: Question) => void;
  #clock: Clock;
  #wish: Wish | null = null;
  #wished_at = 0;
  #id = 0;
  #asked_at = -Infinity;
  #waitsFor = new Set<string>();
  /** The key of the map that is shown, and of the one that was asked for last. */
  #mapShown: string | null = null;
  #mapAsked: string | null = null;
  /** Counts plans: only the latest one counts. */
  #plan = 0;
  #todo: "nothing" | "quick" | "thorough" = "nothing";
  /** Whether the last verdict was the last word. */
  #isWhole = false;

  constructor(send: (question: Question) => void, clock: Clock = REAL) {
    this.#send = send;
    this.#clock = clock;
  }

  /** The controls moved. */
  wish(wish: Wish): void {
    this.#wish = wish;
    this.#wished_at = this.#clock.now();
    this.#todo = "quick";
    this.#tick();
  }

  /**
   * A part of an answer came, or, where it is not complete, a rough one; a verdict that is not whole is asked for again once
   * the controls rest. False when it is to an older question.
   */
  answered(id: number, what: "verdict" | "margin" | "map", complete = true, whole = true): boolean {
    if (id !== this.#id) return false;
    if (what === "verdict") this.#isWhole = whole;
    if (!complete) return true;
    this.#waitsFor.delete(what);
    if (what === "map") this.#mapShown = this.#mapAsked;
    this.#tick();
    return true;
  }

  /** What is under way: "verdict", "margin", "map". */
  get waitsFor(): ReadonlySet<string> {
    return this.#waitsFor;
  }

  /** The server lost the question, or another session makes the answers void. */
  forget(): void {
    this.#waitsFor.clear();
    this.#mapShown = null;
    this.#asked_at = -Infinity;
    this.#id++;
  }

  #tick = (): void => {
    const plan = ++this.#plan;
    if (this.#todo === "nothing") return;
    const wait_ms = this.#wait();
    if (wait_ms > 0) {
      this.#clock.later(() => { if (plan === this.#plan) this.#tick(); }, wait_ms);
      return;
    }
    this.#ask();
    this.#tick();
  };

  #wait(): number {
    const now = this.#clock.now();
    if (this.#todo === "thorough") return this.#wished_at + REST_MS - now;
    const busy = this.#waitsFor.has("verdict") || this.#waitsFor.has("map");
    return this.#asked_at + (busy ? PATIENCE_MS : PACE_MS) - now;
  }

  #ask(): void {
    const wish = this.#wish!;
    const thorough = this.#todo === "thorough";
    const map = wish.axes !== null && this.#mapShown !== wish.mapKey ? wish.axes : null;
    const margin = thorough && wish.margin;
    this.#todo = thorough ? "nothing" : "thorough";
    // The quick question has been answered or is still worked at: nothing more is wanted.
    const answered = !this.#waitsFor.has("verdict") && !(map && !this.#waitsFor.has("map"));
    if (thorough && !margin && this.#isWhole && (answered || this.#waitsFor.size > 0)) return;
    this.#id++;
    this.#asked_at = this.#clock.now();
    this.#waitsFor = new Set(["verdict", ...(map ? ["map"] : []), ...(margin ? ["margin"] : [])]);
    if (map) this.#mapAsked = wish.mapKey;
    this.#send({ type: "predict", id: this.#id, settings: wish.settings, whole: thorough, margin, map });
  }
}
