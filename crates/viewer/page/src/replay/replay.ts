// Recordings with a time line, one or two side by side.
import type { SessionMessage } from "../protocol.ts";

export function createReplay(element: HTMLElement, views: HTMLElement, session: SessionMessage): void { void element; void views; void session; }
