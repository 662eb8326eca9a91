// Which share of the packets was lost lately, from counts since the start.
import type { Picture } from "../picture.ts";
import type { HostIndex } from "../protocol.ts";

const WINDOW_S = 1;

interface Counts {
  time_s: number;
  received: number;
  lost: number;
}

export class LossShares {
  /** By host and peer, oldest first: those of the last second and one before. */
  readonly #counts = new Map<string, Counts[]>();

  add(picture: Picture): void {
    for (const { host, links } of picture.hosts) {
      for (const { peer, present, received, lost } of links) {
        const key = `${host} ${peer}`;
        if (!present) {
          this.#counts.delete(key);
          continue;
        }
        const counts = this.#counts.get(key) ?? [];
        // Counts that fall are those of another session.
        if (received < (counts.at(-1)?.received ?? 0)) counts.length = 0;
        counts.push({ time_s: picture.time_s, received, lost });
        while ((counts[1]?.time_s ?? Infinity) <= picture.time_s - WINDOW_S) counts.shift();
        this.#counts.set(key, counts);
      }
    }
  }

  /** Of the packets that were due from `peer` at `host` within the last second, 0 to 1; NaN when none were. */
  share(host: HostIndex, peer: HostIndex): number {
    const counts = this.#counts.get(`${host} ${peer}`);
    const [first, last] = [counts?.[0], counts?.at(-1)];
    if (!first || !last) return NaN;
    // A packet that overtook another makes a loss good later on.
    const lost = Math.max(0, last.lost - first.lost);
    const due = last.received - first.received + lost;
    return due > 0 ? lost / due : NaN;
  }
}
