// Who takes part, places to take, and news and errors in words.
import type { Send } from "../connection.ts";
import type { Store } from "../store.ts";

export function createPeople(header: HTMLElement, element: HTMLElement, store: Store, send: Send): void { void header; void element; void store; void send; }
