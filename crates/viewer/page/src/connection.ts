// The WebSocket to the server: messages and pictures in, requests out; asks again when it breaks, and says so in words.
import { decodePicture } from "./picture.ts";
import type { PageMessage, ServerMessage } from "./protocol.ts";
import type { Store } from "./store.ts";

export type Send = (message: PageMessage) => void;

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 8000;

export function connect(store: Store): Send {
  return new Connection(store).send;
}

/** How long to wait before the next try after one that waited `last_ms`. */
export function nextWait(last_ms: number): number {
  return Math.min(2 * last_ms, LONGEST_WAIT_MS);
}

/** Why a connection ended, in words: the server's own where it gave some. */
export function whyClosed(reason: string, everOpen: boolean, over: boolean): string {
  if (reason) return sentence(reason);
  if (over) return "The session is over.";
  return everOpen ? "The server is gone." : "There is no server at this address.";
}

function sentence(words: string): string {
  const first = words.charAt(0).toUpperCase() + words.slice(1);
  return /[.!?]$/.test(first) ? first : `${first}.`;
}

class Connection {
  #store: Store;
  #socket: WebSocket | null = null;
  #wait_ms = FIRST_WAIT_MS;
  #everOpen = false;
  /** Of the program that this page came from. */
  #version: string | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #complained = false;

  constructor(store: Store) {
    this.#store = store;
    this.#open();
  }

  readonly send: Send = (message) => {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  };

  #open = (): void => {
    clearTimeout(this.#timer);
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => {
      try {
        this.#heard(data as string | ArrayBuffer);
      } catch (error) {
        this.#complain(error);
      }
    };
    socket.onclose = (event) => this.#closed(event.reason);
    this.#socket = socket;
  };

  #heard(data: string | ArrayBuffer): void {
    if (typeof data !== "string") {
      this.#store.takePicture(decodePicture(data));
      return;
    }
    const message = JSON.parse(data) as ServerMessage;
    if (message.type === "session") {
      // A server that turns pages away opens the socket too: only a session says that all is well.
      this.#everOpen = true;
      this.#wait_ms = FIRST_WAIT_MS;
      this.#version ??= message.version;
      if (message.version !== this.#version) {
        this.#otherVersion(message.version);
        return;
      }
      this.#store.setTrouble(null);
    }
    this.#store.take(message);
  }

  /** What this page cannot read ends nothing; it is said once. */
  #complain(error: unknown): void {
    if (this.#complained) return;
    this.#complained = true;
    const why = error instanceof Error ? error.message : String(error);
    this.#store.take({ type: "news", text: `A message of the server could not be read: ${why}` });
  }

  #otherVersion(found: string): void {
    this.#socket!.onclose = null;
    this.#socket!.onmessage = null;
    this.#socket!.close();
    this.#store.loseHand();
    this.#store.setTrouble({
      text: `The server is another version of the program (${found}) than this page (${this.#version}).`,
      remedy: "reload",
    });
  }

  #closed(reason: string): void {
    this.#store.loseHand();
    const wait_ms = this.#wait_ms;
    this.#wait_ms = nextWait(wait_ms);
    this.#store.setTrouble({
      text: whyClosed(reason, this.#everOpen, this.#store.latest?.ended === true),
      remedy: { again_at: performance.now() + wait_ms, now: this.#open },
    });
    this.#timer = setTimeout(this.#open, wait_ms);
  }
}
