// What the page knows, and who is told when that changes. One way: messages come in, listeners draw.
import type { Picture } from "./picture.ts";
import type {
  FailedMessage, HostIndex, MapMessage, MarginMessage, NewsMessage, RefusedMessage, SeatsMessage, ServerMessage, SessionMessage,
  SettingsMessage, TakenMessage, VerdictMessage,
} from "./protocol.ts";

/** Why there is no live connection, in words, and what helps; null while there is one. */
export type Trouble = {
  text: string;
  /** Loading the page again, or trying again: at that time of `performance.now()`, or at once by calling `now`. */
  remedy: "reload" | { again_at: number; now: () => void };
} | null;

export interface Events {
  session: SessionMessage;
  seats: SeatsMessage;
  taken: TakenMessage;
  refused: RefusedMessage;
  news: NewsMessage;
  settings: SettingsMessage;
  verdict: VerdictMessage;
  margin: MarginMessage;
  map: MapMessage;
  failed: FailedMessage;
  /** Of the live session; those of a replay do not pass through here. */
  picture: Picture;
  trouble: Trouble;
}

export class Store {
  session: SessionMessage | null = null;
  seats: SeatsMessage["seats"] = [];
  settings: SettingsMessage | null = null;
  /** The hand that this browser moves. */
  taken: TakenMessage | null = null;
  latest: Picture | null = null;
  trouble: Trouble = null;
  #listeners = new Map<keyof Events, ((event: never) => void)[]>();

  on<K extends keyof Events>(kind: K, listener: (event: Events[K]) => void): void {
    const listeners = this.#listeners.get(kind) ?? [];
    listeners.push(listener as (event: never) => void);
    this.#listeners.set(kind, listeners);
  }

  take(message: ServerMessage): void {
    switch (message.type) {
      case "session":
        this.session = message;
        this.latest = null;
        break;
      case "seats":
        this.seats = message.seats;
        break;
      case "settings":
        this.settings = message;
        break;
      case "taken":
        this.taken = message.user === null ? null : message;
        break;
    }
    this.#tell(message.type, message);
  }

  /** Whose hands pointers move. */
  pointers(): HostIndex[] {
    return this.seats.filter(({ by }) => by === "you" || by === "browser").map(({ user }) => user);
  }

  takePicture(picture: Picture): void {
    if (picture.generation !== this.session?.generation) return;
    this.latest = picture;
    this.#tell("picture", picture);
  }

  /** Without a connection this browser moves nobody's hand. */
  loseHand(): void {
    if (this.taken) this.take({ type: "taken", user: null, stiffness_n_per_m: 0, damping_n_s_per_m: 0 });
  }

  setTrouble(trouble: Trouble): void {
    if (trouble === this.trouble) return;
    this.trouble = trouble;
    this.#tell("trouble", trouble);
  }

  #tell(kind: keyof Events, event: unknown): void {
    for (const listener of this.#listeners.get(kind) ?? []) listener(event as never);
  }
}
