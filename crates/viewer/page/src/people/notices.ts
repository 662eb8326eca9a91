// Troubles, news and refusals, in words: a line under the header while there is no connection, and notes that pass.
import "./notices.css";
import { make, say } from "../dom.ts";
import type { Send } from "../connection.ts";
import type { Store, Trouble } from "../store.ts";

const SHOWN_MS = 9000;
const MOST = 4;
const REFUSALS = {
  take: "This hand cannot be taken",
  set: "This cannot be set",
  predict: "This cannot be predicted",
  message: "The server turned down a message",
} as const;

export interface NoticeElements {
  trouble: HTMLElement;
  paused: HTMLElement;
  notices: HTMLElement;
}

export function createNotices({ trouble, paused, notices }: NoticeElements, store: Store, send: Send): void {
  createTroubleLine(trouble, store);
  createPausedLine(paused, store, send);
  store.on("news", ({ text }) => note(notices, "news", text));
  store.on("refused", ({ what, why }) => note(notices, "refused", `${REFUSALS[what] ?? "Refused"}: ${why}`));
}

/** A session that was stopped is offered to be begun anew, by whom it may be. */
function createPausedLine(element: HTMLElement, store: Store, send: Send): void {
  const text = make("span");
  const again = make("button", { type: "button", class: "primary" }, "Begin again");
  again.addEventListener("click", () => send({ type: "again" }));
  element.append(text, again);
  store.on("settings", ({ paused }) => {
    element.hidden = paused === "";
    again.hidden = !store.session?.may_change;
    say(text, paused && `${paused[0]!.toUpperCase()}${paused.slice(1)}.`);
  });
}

function createTroubleLine(element: HTMLElement, store: Store): void {
  const text = make("span");
  // Counts down for the eye only: whoever hears the page is told once.
  const countdown = make("span", { "aria-hidden": "true" });
  const button = make("button", { type: "button" });
  element.append(text, countdown, button);
  let ticking: ReturnType<typeof setInterval> | undefined;
  const count = () => say(countdown, waiting(store.trouble, performance.now()));
  store.on("trouble", (trouble) => {
    element.hidden = trouble === null;
    clearInterval(ticking);
    if (!trouble) return;
    say(text, trouble.text);
    say(button, trouble.remedy === "reload" ? "Load the page again" : "Try now");
    ticking = setInterval(count, 250);
    count();
  });
  button.addEventListener("click", () => {
    const remedy = store.trouble?.remedy;
    if (remedy === "reload") location.reload();
    else remedy?.now();
  });
}

/** How long until the next try, in words. */
export function waiting(trouble: Trouble, now_ms: number): string {
  if (!trouble || trouble.remedy === "reload") return "";
  const seconds = Math.ceil((trouble.remedy.again_at - now_ms) / 1000);
  return seconds > 0 ? `Asking again in ${seconds} s.` : "Asking again…";
}

function note(element: HTMLElement, kind: string, text: string): void {
  const last = element.lastElementChild;
  if (last?.firstChild?.textContent === text) last.remove();
  while (element.childElementCount >= MOST) element.firstElementChild!.remove();
  const close = make("button", { type: "button", "aria-label": "Dismiss" }, "×");
  const notice = make("div", { class: "notice", "data-kind": kind }, make("span", {}, text), close);
  close.addEventListener("click", () => notice.remove());
  const leave = () => {
    // Not while it is being read.
    if (notice.matches(":hover, :focus-within")) setTimeout(leave, 1000);
    else notice.remove();
  };
  setTimeout(leave, SHOWN_MS);
  element.append(notice);
}
