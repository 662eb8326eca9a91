// The page's first line: what runs, whether it should be stable, whether it is, and whether this page is connected.
import "./header.css";
import { make, say } from "../dom.ts";
import type { Picture } from "../picture.ts";
import type { About } from "../protocol.ts";
import { verdictWord } from "../lesson/words.ts";
import type { Store } from "../store.ts";
import { createTheme } from "../theme.ts";

/** What a badge says: good, bad, or not known yet. */
type Mood = "good" | "bad" | "warning" | "unknown";

export function createHeader(element: HTMLElement, store: Store): void {
  const scene = make("h1", {}, "…");
  const facts = make("p", { class: "facts" });
  const predicted = new Badge("Predicted", "What the analysis says about these settings");
  const observed = new Badge("Running", "What the session did in the last seconds");
  const connection = new Badge("", "Connection to the server");
  connection.show("unknown", "Connecting");
  element.append(
    make("span", { class: "brand", "aria-hidden": "true" }, "cotouch"),
    make("div", { class: "title" }, scene, facts),
    make("div", { class: "badges" }, predicted.element, observed.element, connection.element, createTheme()),
  );

  store.on("session", ({ about, mode, recordings }) => {
    const replay = mode === "replay";
    const name = replay ? recordings.map((recording) => recording.name).join(" and ") : about.scene;
    say(scene, name);
    document.title = `${name} – cotouch`;
    say(facts, replay ? [...new Set(recordings.map((recording) => describe(recording.about)))].join(" | ") : describe(about));
    facts.title = replay ? recordings.map((recording) => recording.about.description).join(" ") : about.description;
    for (const badge of [predicted, observed]) {
      badge.element.hidden = replay;
      badge.show("unknown", "…");
    }
    connection.show("good", replay ? "Replay" : "Live");
  });
  store.on("verdict", ({ stable, whole }) => {
    predicted.show(stable === null ? "unknown" : stable ? "good" : "bad", verdictWord(stable, whole));
  });
  store.on("picture", (picture) => observed.show(...observe(picture)));
  store.on("trouble", (trouble) => {
    connection.show(trouble ? "bad" : "good", trouble ? "Not connected" : "Live");
    if (trouble) observed.show("unknown", "not seen");
  });
}

/** What runs, in one line. */
export function describe(about: About): string {
  const users = about.users.length;
  const network = [
    `network ${about.network_hz} Hz`,
    `delay ${about.delay_periods} ${about.delay_periods === 1 ? "period" : "periods"}`,
  ];
  return [
    // One user has no network.
    ...(users > 1 ? [about.architecture] : []),
    `${users} ${users === 1 ? "user" : "users"}`,
    `haptics ${about.control_hz} Hz`,
    ...(about.soft ? [`simulation ${about.soft.simulation_hz} Hz`] : []),
    ...(users > 1 ? network : []),
  ].join(" · ");
}

/** What the session does, as a badge. */
export function observe(picture: Picture): [Mood, string] {
  if (picture.ended) return ["unknown", "over"];
  if (picture.hosts.some((host) => host.diverged)) return ["bad", "left all bounds"];
  if (picture.verdict_now === null) return ["unknown", "starting"];
  return [picture.verdict_now === "quiet" ? "good" : "bad", picture.verdict_now];
}

class Badge {
  readonly element: HTMLElement;
  #value = make("strong");

  constructor(label: string, title: string) {
    this.element = make("span", { class: "badge", title, "data-mood": "unknown" },
      make("span", { class: "dot", "aria-hidden": "true" }), label ? make("span", {}, `${label} `) : null, this.#value);
    say(this.#value, "…");
  }

  show(mood: Mood, text: string): void {
    if (this.element.dataset["mood"] !== mood) this.element.dataset["mood"] = mood;
    say(this.#value, text);
  }
}
