// Controls, what the analysis predicts for them, and what the running session does.
import type { Send } from "../connection.ts";
import type { Store } from "../store.ts";

export function createLesson(element: HTMLElement, store: Store, send: Send): void { void element; void store; void send; }
