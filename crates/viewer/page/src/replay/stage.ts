// One recording on the page: its scene, its plots, and what is here of it.
import { describe } from "../people/header.ts";
import { channelsOf } from "../plots/channels.ts";
import { Dashboard, type DashboardEvents } from "../plots/dashboard.ts";
import { make } from "../plots/dom.ts";
import type { Picture } from "../picture.ts";
import type { RecordingInfo } from "../protocol.ts";
import { View } from "../view/view.ts";
import { Buffer, loadFrom, type Place } from "./buffer.ts";
import { clock, within, type Span } from "./timeline.ts";
import { Track } from "./track.ts";

/** A recording has no round trips, so they are not among what is shown first. */
const PLOTTED = ["forces", "positions", "energy"] as const;

export class Stage {
  /** The scene with its caption. */
  readonly figure: HTMLElement;
  readonly dashboard: Dashboard;
  readonly buffer: Buffer;
  readonly #info: RecordingInfo;
  readonly #scene = make("div", { className: "replay-scene" });
  #view: View | null = null;
  readonly #state = make("span", { className: "replay-state" });
  readonly #track: Track;
  #shown: Place | null = null;
  #wasOutside = false;
  #trouble: string | null = null;

  constructor(info: RecordingInfo, index: number, events: DashboardEvents) {
    this.#info = info;
    this.buffer = new Buffer(info, loadFrom(index));
    this.figure = make("figure", { className: "replay-view", attributes: { "aria-label": info.name } },
      make("figcaption", {}, make("strong", {}, info.name), make("span", {}, detailsOf(info)), this.#state),
      this.#scene);
    const channels = channelsOf(info.about);
    this.#track = new Track(info.about, channels, this.buffer);
    this.dashboard = new Dashboard(PLOTTED, events, "cotouch-replay");
    this.dashboard.introduce(info.about, this.#track, channels);
  }

  /** Draws the scene from now on. A view measures its place: all figures must be on the page first. */
  begin(): void {
    this.#view = new View(this.#scene);
    this.#view.introduce(this.#info.about);
  }

  /** What went wrong, in words. */
  get trouble(): string | null {
    const trouble = this.#trouble ?? this.buffer.trouble;
    return trouble === null ? null : `${this.#info.name}: ${trouble}`;
  }

  isHere(span: Span, time_s: number): boolean {
    return this.buffer.has(within(span, time_s));
  }

  /** Takes in what came since, for the plots. */
  update(span: Span): boolean {
    try {
      return this.#track.update(span.begins_s);
    } catch (error) {
      this.#trouble = `a picture cannot be read: ${(error as Error).message}`;
      return false;
    }
  }

  show(span: Span, time_s: number): void {
    const own_s = within(span, time_s);
    this.buffer.lookAt(own_s);
    const place = this.buffer.placeAt(own_s);
    const isOutside = time_s < span.begins_s - 1e-9 || time_s > span.begins_s + span.duration_s + 1e-9;
    this.figure.classList.toggle("is-outside", isOutside);
    if (place && (place.chunk !== this.#shown?.chunk || place.index !== this.#shown.index)) this.#draw(place);
    const early = time_s < span.begins_s - 1e-9;
    if (isOutside) this.#say(early ? `begins in ${clock(span.begins_s - time_s)}` : "is over");
    else if (!place) this.#say("loading…");
    else if (this.#wasOutside) this.#draw(place);
    this.#wasOutside = isOutside || !place;
  }

  /** When the nearest picture before or after `time_s` is due, in shared time. */
  beside(span: Span, time_s: number, step: 1 | -1): number | null {
    const beside_s = this.buffer.timeBeside(within(span, time_s), step);
    return beside_s === null ? null : span.begins_s + beside_s;
  }

  #say(text: string, colour = "--muted"): void {
    if (this.#state.textContent === text) return;
    this.#state.textContent = text;
    this.#state.style.color = `var(${colour})`;
  }

  #draw(place: Place): void {
    this.#shown = place;
    try {
      const picture = this.buffer.chunk(place.chunk)?.picture(place.index);
      if (!picture) return;
      this.#view?.show(picture);
      this.#say(...stateOf(picture));
      this.#trouble = null;
    } catch (error) {
      this.#trouble = `a picture cannot be read: ${(error as Error).message}`;
    }
  }
}

function detailsOf({ about }: RecordingInfo): string {
  return [about.scene, describe(about)].join(" · ");
}

/** In words, and in which colour. */
function stateOf(picture: Picture): [text: string, colour: string] {
  if (picture.hosts.some(({ diverged }) => diverged)) return ["left all bounds", "--bad"];
  const verdict = picture.verdict_now ?? picture.verdict;
  if (verdict === null) return ["", "--muted"];
  return [verdict, verdict === "quiet" ? "--good" : "--bad"];
}
