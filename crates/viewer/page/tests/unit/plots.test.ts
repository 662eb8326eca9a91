import { test } from "node:test";
import assert from "node:assert/strict";
import { channelsOf, componentsOf, Reader, type Channel, type Scan } from "../../src/plots/channels.ts";
import { spread } from "../../src/plots/chart.ts";
import { firstAtLeast, History, rowsBetween, withGaps } from "../../src/plots/history.ts";
import { LossShares } from "../../src/plots/loss.ts";
import { csvOf, fileName, placed } from "../../src/plots/save.ts";
import { calmRange, readable, tickLabels } from "../../src/plots/scale.ts";
import { GRASP, LINE, picture } from "../examples.ts";

test("a history keeps its newest rows in order, at least three quarters of what fits", () => {
  const history = new History(2, 100);
  for (let row = 0; row < 1000; row++) history.add(row / 60, (column) => 10 * row + column);
  assert.ok(history.length >= 75 && history.length <= 100, `${history.length} rows`);
  const [times, first, second] = [history.times(), history.column(0), history.column(1)];
  for (let row = 0; row < history.length; row++) {
    const number = 1000 - history.length + row;
    assert.equal(times[row], number / 60);
    assert.equal(first[row], 10 * number);
    assert.equal(second[row], 10 * number + 1);
  }
});

test("a history leaves out what is not newer and breaks its lines where nothing came", () => {
  const history = new History(1, 10);
  history.add(1, () => 5);
  history.add(1, () => 6);
  history.add(0.5, () => 7);
  history.add(3, () => 8);
  assert.deepEqual([...history.column(0)], [5, NaN, 8]);
  assert.deepEqual(withGaps(history.column(0)), [5, null, 8]);
  const whole = Float32Array.of(1, 2);
  assert.equal(withGaps(whole), whole);
  history.clear();
  assert.equal(history.length, 0);
  assert.throws(() => history.column(1), /no column 1/);
});

test("rows of a stretch reach one beyond both of its ends", () => {
  const times = Float64Array.of(0, 1, 2, 3, 4);
  assert.equal(firstAtLeast(times, 2), 2);
  assert.equal(firstAtLeast(times, 9), 5);
  assert.deepEqual(rowsBetween(times, 1.5, 2.5), [1, 4]);
  assert.deepEqual(rowsBetween(times, -5, 9), [0, 5]);
  assert.deepEqual(rowsBetween(new Float64Array(0), 0, 1), [0, 0]);
});

const read = (channels: readonly Channel[], scan: Scan, kind: string, label: string, component: string | null) => {
  const found = channels.filter((each) => each.kind === kind && each.label === label && each.component === component);
  assert.equal(found.length, 1, `${kind} ${label} ${component}`);
  return (found[0] as Channel).read(scan);
};

test("every channel reads its number of a picture", () => {
  const shown = picture(GRASP, 0.7);
  const channels = channelsOf(GRASP);
  const scan = new Reader(GRASP).scan(shown);
  const finger = shown.hosts[1]?.fingers[1];
  assert.ok(finger);
  assert.equal(read(channels, scan, "forces", "ben 2", "y"), finger.force_n[1]);
  assert.equal(read(channels, scan, "forces", "ben 2", "size"), Math.hypot(...finger.force_n));
  assert.equal(read(channels, scan, "positions", "ben 2", "x"), finger.position_m[0]);
  assert.equal(read(channels, scan, "positions", "object at ben", "x"), shown.hosts[1]?.bodies[0]?.position_m[0]);
  assert.equal(read(channels, scan, "energy", "ben 2", null), finger.energy_j);
  assert.equal(read(channels, scan, "energy", "ben, all", null), shown.hosts[1]?.energy_j);
  assert.equal(read(channels, scan, "lateness", "anna", null), shown.hosts[0]?.lateness_us);
  assert.equal(read(channels, scan, "round-trip", "anna to ben", null), 0.2);
  assert.equal(read(channels, scan, "jitter", "ben to anna", null), 0.05);
});

test("what a picture does not have is no number", () => {
  const shown = picture(GRASP, 0.7);
  shown.hosts = shown.hosts.slice(0, 1);
  shown.hosts[0]?.links.splice(0);
  const scan = new Reader(GRASP).scan(shown);
  const channels = channelsOf(GRASP);
  assert.ok(Number.isNaN(read(channels, scan, "forces", "ben 1", "x")));
  assert.ok(Number.isNaN(read(channels, scan, "round-trip", "anna to ben", null)));
  assert.ok(Number.isNaN(read(channels, scan, "loss", "ben to anna", null)));
});

test("a line has signed forces, a plane a choice; one copy belongs to nobody", () => {
  assert.deepEqual(componentsOf(LINE, "forces"), ["x"]);
  assert.deepEqual(componentsOf(GRASP, "forces"), ["size", "x", "y"]);
  assert.deepEqual(componentsOf({ ...GRASP, space: "space" }, "positions"), ["x", "y", "z"]);
  assert.deepEqual(componentsOf(GRASP, "loss"), []);
  const bodies = channelsOf({ ...GRASP, copies: false }).filter(({ label }) => label.startsWith("object"));
  assert.deepEqual(bodies.map(({ label, user }) => [label, user]), [["object", null], ["object", null]]);
});

const counted = (time_s: number, received: number, lost: number, present = true) => {
  const shown = picture(GRASP, time_s);
  shown.hosts.forEach(({ links }) => links.forEach((link) => Object.assign(link, { received, lost, present })));
  return shown;
};

test("the share of packets lost is that of the last second", () => {
  const losses = new LossShares();
  assert.ok(Number.isNaN(losses.share(0, 1)));
  losses.add(counted(0, 0, 0));
  assert.ok(Number.isNaN(losses.share(0, 1)), "nothing was due yet");
  losses.add(counted(0.5, 50, 50));
  assert.equal(losses.share(0, 1), 0.5);
  losses.add(counted(1.5, 140, 60));
  assert.equal(losses.share(0, 1), 0.1);
  losses.add(counted(2.5, 240, 60));
  assert.equal(losses.share(0, 1), 0);
});

test("losses begin anew after a peer left and when counts fall", () => {
  const losses = new LossShares();
  losses.add(counted(0, 100, 0));
  losses.add(counted(0.5, 150, 50));
  losses.add(counted(0.6, 10, 0));
  assert.ok(Number.isNaN(losses.share(0, 1)));
  losses.add(counted(0.7, 20, 0));
  assert.equal(losses.share(0, 1), 0);
  losses.add(counted(0.8, 20, 10, false));
  assert.ok(Number.isNaN(losses.share(0, 1)));
});

test("a table has units in its header, quotes where needed, and nothing for what there is none of", () => {
  const history = new History(2, 10);
  history.add(0.5, (column) => [0.1, -2][column] as number);
  history.add(0.75, (column) => [NaN, 1e-7][column] as number);
  history.add(1, () => NaN);
  const [first] = channelsOf(GRASP).filter(({ kind }) => kind === "forces") as [Channel];
  const channels = [
    { channel: { ...first, label: 'say "a, b"', component: null }, index: 0 },
    { channel: { ...first, label: "ben", component: "x" as const }, index: 1 },
  ];
  assert.equal(csvOf(history, channels, "N"), [
    'time [s],"say ""a, b"" [N]",ben x [N]',
    "0.500000,0.1,-2",
    "0.750000,,1e-7",
    "",
  ].join("\n"));
});

test("an axis stays as long as it fits", () => {
  const first = calmRange(null, -1, 1, 0.2, false);
  assert.deepEqual(first, [-1.2, 1.2]);
  assert.equal(calmRange(first, -0.9, 1.1, 0.2, false), first);
  assert.notEqual(calmRange(first, -0.9, 1.3, 0.2, false), first);
  assert.notEqual(calmRange(first, -0.1, 0.1, 0.2, false), first, "much too large");
  assert.deepEqual(calmRange(null, 5, 5, 2, false), [3.8, 6.2]);
  assert.deepEqual(calmRange(null, 3, 10, 2, true), [0, 11]);
});

test("ticks have the decimals that their distance needs, and zero has no sign", () => {
  assert.deepEqual(tickLabels([-0.025, 0, 0.025], 1000), ["\u221225", "0", "25"]);
  assert.deepEqual(tickLabels([5, 7.5, 10], 1), ["5.0", "7.5", "10.0"]);
  assert.deepEqual(tickLabels([0.05, 0.1, 0.15000000000000002], 1), ["0.05", "0.10", "0.15"]);
  assert.deepEqual(tickLabels([3], 1), ["3"]);
});

test("numbers are read at a glance", () => {
  assert.deepEqual([1234.5, 12.345, 0.12345, -1.5, -0.00001, NaN, null].map(readable),
    ["1235", "12.3", "0.123", "\u22121.50", "0", "–", "–"]);
});

test("legend items fill rows; names of files are plain", () => {
  assert.deepEqual(placed([50, 50, 50], 120), [{ x: 0, row: 0 }, { x: 50, row: 0 }, { x: 0, row: 1 }]);
  assert.equal(fileName("cotouch", "my scene/é", "Round trip"), "cotouch-my-scene-é-round-trip");
});

test("fingers that spread keep their times under them", () => {
  assert.deepEqual(spread([10, 20], [100, 200], 300), [0, 30]);
  assert.deepEqual(spread([10, 20], [50, 250], 300), [7.5, 22.5]);
});
