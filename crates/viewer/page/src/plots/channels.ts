// What can be plotted of a session: its channels, each one number of a picture.
import type { HostPicture, Picture } from "../picture.ts";
import type { About, HostIndex, Vector } from "../protocol.ts";
import { LossShares } from "./loss.ts";

export type PanelKind = "forces" | "positions" | "energy" | "round-trip" | "jitter" | "loss" | "lateness";
export type Component = "size" | "x" | "y" | "z";

export interface PanelAbout {
  kind: PanelKind;
  /** In a choice of panels. */
  name: string;
  /** Over the chart. */
  title: string;
  /** Of the values as they are kept and saved. */
  unit: string;
  /** As they are shown: the unit, and what a value is multiplied with. */
  shown: { unit: string; factor: number };
  /** The vertical axis reaches over at least this much, so that noise does not fill the chart. */
  least_span: number;
  /** Whether nothing is below zero, and the axis begins there. */
  from_zero: boolean;
  /** In place of a chart that has nothing to show. */
  nothing: string;
}

export const PANELS: readonly PanelAbout[] = [
  {
    kind: "forces", name: "Forces", title: "Forces on the fingers", unit: "N", shown: { unit: "N", factor: 1 },
    least_span: 0.2, from_zero: false, nothing: "No forces yet.",
  },
  {
    kind: "positions", name: "Positions", title: "Positions", unit: "m", shown: { unit: "mm", factor: 1000 },
    least_span: 0.004, from_zero: false, nothing: "No positions yet.",
  },
  {
    kind: "energy", name: "Energy", title: "Energy put in at each port", unit: "J", shown: { unit: "mJ", factor: 1000 },
    least_span: 0.002, from_zero: false, nothing: "No energies yet.",
  },
  {
    kind: "round-trip", name: "Round trip", title: "Mean round trip to a peer and back", unit: "ms",
    shown: { unit: "ms", factor: 1 }, least_span: 0.1, from_zero: true, nothing: "No round trip was measured.",
  },
  {
    kind: "jitter", name: "Jitter", title: "Jitter of the round trip (standard deviation)", unit: "ms",
    shown: { unit: "ms", factor: 1 }, least_span: 0.05, from_zero: true, nothing: "No jitter was measured.",
  },
  {
    kind: "loss", name: "Loss", title: "Packets lost within a second", unit: "1", shown: { unit: "%", factor: 100 },
    least_span: 0.01, from_zero: true, nothing: "No packets were counted.",
  },
  {
    kind: "lateness", name: "Lateness", title: "Lateness of the haptic loop (latest tick)", unit: "µs",
    shown: { unit: "µs", factor: 1 }, least_span: 20, from_zero: true, nothing: "No lateness was measured.",
  },
];

export interface Channel {
  kind: PanelKind;
  /** Of a vector; null for a number by itself. */
  component: Component | null;
  label: string;
  /** Whose colour it has; null for what belongs to nobody. */
  user: HostIndex | null;
  /** 0 solid, then ever finer dashes: tells lines of one colour apart. */
  dash: number;
  /** Of the line, in pixels. */
  width: number;
  read(scan: Scan): number;
}

/** A picture, its hosts in order. */
export interface Scan {
  hosts: (HostPicture | undefined)[];
  losses: LossShares;
}

const COMPONENTS = ["x", "y", "z"] as const;
/** Components worth showing, by how much room the scene has. */
const ROOM = { line: 1, plane: 2, space: 3 } as const;

/** The components that a panel lets choose from; empty when there is no choice. */
export function componentsOf(about: About, kind: PanelKind): Component[] {
  if (kind !== "forces" && kind !== "positions") return [];
  const axes = COMPONENTS.slice(0, ROOM[about.space]);
  if (axes.length === 1) return axes;
  return kind === "forces" ? ["size", ...axes] : axes;
}

/** All that can be plotted of this session. */
export function channelsOf(about: About): Channel[] {
  const users = about.users.map((name, user) => ({ name, user }));
  return [
    ...users.flatMap(({ name, user }) => fingerChannels(about, name, user)),
    ...bodyChannels(about),
    ...users.map(({ name, user }): Channel => ({
      kind: "lateness", component: null, label: name, user, dash: 0, width: 1.5,
      read: ({ hosts }) => hosts[user]?.lateness_us ?? NaN,
    })),
    ...users.flatMap(({ name, user }) => linkChannels(about, name, user)),
  ];
}

function fingerChannels(about: About, name: string, user: HostIndex): Channel[] {
  const count = about.fingers_m[user]?.length ?? 0;
  const each = Array.from({ length: count }, (_, index): Channel[] => {
    const label = count === 1 ? name : `${name} ${index + 1}`;
    const finger = ({ hosts }: Scan) => hosts[user]?.fingers[index];
    const line = { label, user, dash: index, width: 1.5 };
    return [
      ...componentsOf(about, "forces").map((component): Channel => ({
        kind: "forces", component, ...line, read: (scan) => componentOf(finger(scan)?.force_n, component),
      })),
      ...componentsOf(about, "positions").map((component): Channel => ({
        kind: "positions", component, ...line, read: (scan) => componentOf(finger(scan)?.position_m, component),
      })),
      { kind: "energy", component: null, ...line, read: (scan) => finger(scan)?.energy_j ?? NaN },
    ];
  }).flat();
  if (count <= 1) return each;
  return [...each, {
    kind: "energy", component: null, label: `${name}, all`, user, dash: 0, width: 2.75,
    read: ({ hosts }) => hosts[user]?.energy_j ?? NaN,
  }];
}

/** Every host's copy of every body, or the one that the server has. */
function bodyChannels(about: About): Channel[] {
  const keepers = about.copies ? about.users.map((name, user) => ({ name, user })) : [null];
  return about.bodies.flatMap((body, index) => keepers.flatMap((keeper) =>
    componentsOf(about, "positions").map((component): Channel => ({
      kind: "positions",
      component,
      label: keeper ? `${body.name} at ${keeper.name}` : body.name,
      user: keeper?.user ?? null,
      dash: index,
      width: 2.75,
      read: ({ hosts }) => {
        const host = keeper ? hosts[keeper.user] : hosts.find((each) => each !== undefined && each.bodies.length > 0);
        return componentOf(host?.bodies[index]?.position_m, component);
      },
    })),
  ));
}

function linkChannels(about: About, name: string, user: HostIndex): Channel[] {
  return about.users.flatMap((peerName, peer) => {
    if (peer === user) return [];
    const link = ({ hosts }: Scan) => hosts[user]?.links.find((each) => each.peer === peer && each.present);
    const line = { component: null, user, dash: peer > user ? peer - 1 : peer, width: 1.5 };
    return [
      {
        kind: "round-trip", label: `${name} to ${peerName}`, ...line,
        read: (scan) => link(scan)?.round_trip_ms ?? NaN,
      },
      {
        kind: "jitter", label: `${name} to ${peerName}`, ...line,
        read: (scan) => link(scan)?.jitter_ms ?? NaN,
      },
      {
        kind: "loss", label: `${peerName} to ${name}`, ...line,
        read: ({ losses }) => losses.share(user, peer),
      },
    ] satisfies Channel[];
  });
}

function componentOf(vector: Vector | undefined, component: Component): number {
  if (!vector) return NaN;
  return component === "size" ? Math.hypot(...vector) : vector[COMPONENTS.indexOf(component)] as number;
}

/** Reads pictures in the order of time; remembers what shares of the last second need. */
export class Reader {
  readonly #users: number;
  readonly #losses = new LossShares();

  constructor(about: About) {
    this.#users = about.users.length;
  }

  scan(picture: Picture): Scan {
    const hosts: Scan["hosts"] = Array.from({ length: this.#users });
    for (const host of picture.hosts) hosts[host.host] = host;
    this.#losses.add(picture);
    return { hosts, losses: this.#losses };
  }
}
