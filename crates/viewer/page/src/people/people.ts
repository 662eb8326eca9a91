// Who takes part, hands to take and to leave, and how a pointer moves a hand.
import "./people.css";
import type { Send } from "../connection.ts";
import { make, say } from "../dom.ts";
import type { HeldBy, SeatsMessage } from "../protocol.ts";
import type { Store } from "../store.ts";

type Seat = SeatsMessage["seats"][number];

const WHO: Record<HeldBy, string> = {
  script: "moved by the program",
  you: "moved by you",
  browser: "moved by another browser",
  elsewhere: "moved on another machine",
  free: "nobody is here yet",
};

export function createPeople(element: HTMLElement, store: Store, send: Send): void {
  const intro = make("p", { class: "muted" });
  const list = make("ul", { class: "seats" });
  const mine = make("p", { class: "mine", role: "status" });
  const help = createHelp();
  const again = make("button", { type: "button" }, "Begin again");
  again.addEventListener("click", () => send({ type: "again" }));
  const script = make("div", { class: "script", hidden: true },
    make("p", { class: "muted small" }, "The program moves hands by a script; when all scripts are over, the session begins anew while somebody watches."), again);
  element.append(make("h2", {}, "Who takes part"), intro, list, mine, script, help);

  // The answer to a request may take a moment: until then the button says so.
  let asked: number | null = null;
  // A hand that was lost, by silence or with its session, is offered back; one that was left on purpose as well.
  let last: number | null = null;
  const show = () => showSeats(list, store.seats, { asked, last }, (seat) => {
    if (seat.by === "you") {
      send({ type: "leave" });
    } else {
      asked = seat.user;
      send({ type: "take", user: seat.user });
    }
    show();
  });
  const settle = () => { asked = null; show(); };
  store.on("seats", settle);
  store.on("refused", settle);
  store.on("trouble", (trouble) => {
    // Whose hand it was is no matter while nobody answers.
    if (trouble !== null && store.taken === null) say(mine, "");
    settle();
  });
  store.on("taken", ({ user }) => {
    const nameOf = (whose: number | null) => store.seats.find((seat) => seat.user === whose)?.name ?? "a user";
    const left = last === null || store.trouble !== null ? "" : `${nameOf(last)}'s hand is no longer yours; take it again when you like.`;
    say(mine, user === null ? left : `You move ${nameOf(user)}'s hand.`);
    last = user ?? last;
    settle();
  });
  store.on("session", ({ mode, about, may_change }) => {
    const replay = mode === "replay";
    script.hidden = replay || !may_change;
    say(intro, replay
      ? "This is a recording: its hands cannot be moved."
      : "Take a hand and move it with mouse, touch or keys.");
    help.hidden = replay;
    if (!replay) return;
    list.replaceChildren(...about.users.map((name, user) =>
      make("li", {}, swatch(user), make("span", { class: "name" }, name))));
  });
}

/** Whose hand this page has asked for, and whose it had last. */
interface Wanted {
  asked: number | null;
  last: number | null;
}

function showSeats(list: HTMLElement, seats: readonly Seat[], wanted: Wanted, act: (seat: Seat) => void): void {
  const active = document.activeElement as HTMLElement | null;
  const focused = list.contains(active) ? active?.dataset["user"] : undefined;
  list.replaceChildren(...seats.map((seat) => showSeat(seat, wanted, act)));
  if (focused !== undefined) list.querySelector<HTMLElement>(`button[data-user="${focused}"]`)?.focus();
}

function showSeat(seat: Seat, { asked: whose, last }: Wanted, act: (seat: Seat) => void): HTMLElement {
  const asked = whose === seat.user;
  const item = make("li", { "data-by": seat.by }, swatch(seat.user),
    make("span", { class: "who" },
      make("span", { class: "name" }, seat.name), make("span", { class: "by" }, WHO[seat.by])));
  if (seat.by === "browser" || seat.by === "elsewhere") return item;
  const verb = seat.by === "you" ? "Leave" : asked ? "Taking…" : last === seat.user ? "Take back" : "Take";
  const button = make("button", {
    type: "button",
    class: seat.by === "you" || asked ? null : "primary",
    disabled: asked,
    "data-user": seat.user,
    "aria-label": `${verb} ${seat.name}'s hand`,
  }, verb);
  button.addEventListener("click", () => act(seat));
  item.append(button);
  return item;
}

function swatch(user: number): HTMLElement {
  const element = make("span", { class: "swatch", "aria-hidden": "true" });
  element.style.background = `var(--user-${user % 8})`;
  return element;
}

function createHelp(): HTMLElement {
  const rows: [string[], string][] = [
    [["drag"], "moves the hand; a spring draws its fingers after the pointer, and its stretch is the force"],
    [["←", "→", "↑", "↓"], "move it in small steps"],
    [["wheel", "Page ↑", "Page ↓"], "nearer and farther, in scenes with depth"],
    [["Space"], "or a pinch closes a pair of fingers"],
    [["Q", "E"], "or a twist of two fingers turns the pair"],
    [["Esc"], "leaves the hand"],
  ];
  const list = make("dl", { class: "keys" });
  for (const [keys, what] of rows) {
    const term = make("dt");
    keys.forEach((key) => term.append(make("kbd", {}, key)));
    list.append(term, make("dd", {}, what));
  }
  return make("div", { class: "help" }, make("h3", {}, "With a hand taken"), list,
    make("p", { class: "muted small" }, "Without one, dragging turns the view. Several browsers may each take a hand."));
}
