// The WebSocket to the server: messages and pictures in, requests out; asks again when it breaks.
import { decodePicture } from "./picture.ts";
import type { PageMessage, ServerMessage } from "./protocol.ts";
import type { Store } from "./store.ts";

export type Send = (message: PageMessage) => void;

export function connect(store: Store): Send {
  let socket: WebSocket | null = null;
  const open = (delay_ms: number) => {
    socket = new WebSocket(`ws://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => store.setTrouble(null);
    socket.onmessage = ({ data }) => {
      delay_ms = 500;
      if (typeof data === "string") store.take(JSON.parse(data) as ServerMessage);
      else store.takePicture(decodePicture(data as ArrayBuffer));
    };
    socket.onclose = (event) => {
      const over = store.latest?.ended === true;
      store.setTrouble(event.reason || (over ? "The session is over." : "The server is gone; asking again."));
      setTimeout(() => open(Math.min(2 * delay_ms, 8000)), delay_ms);
    };
  };
  open(500);
  return (message) => {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  };
}
