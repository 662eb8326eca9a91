// A mouse, a touch or keys as one of the users: gestures on the view become targets for fingers.
import type { Send } from "../connection.ts";
import type { Store } from "../store.ts";
import type { View } from "../view/view.ts";

export function createHand(view: View, store: Store, send: Send): void { void view; void store; void send; }
