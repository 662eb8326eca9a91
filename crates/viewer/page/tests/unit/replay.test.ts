import { test } from "node:test";
import assert from "node:assert/strict";
import { Buffer, CHUNK_S, wanted, type Load } from "../../src/replay/buffer.ts";
import { Chunk } from "../../src/replay/chunks.ts";
import { advanced, clock, lengthOf, spansOf, within } from "../../src/replay/timeline.ts";
import { Track } from "../../src/replay/track.ts";
import { channelsOf } from "../../src/plots/channels.ts";
import { GRASP, LINE } from "../examples.ts";
import { recording, stretch, type Recording } from "../recordings.ts";

test("a stretch gives its pictures one by one, with times from the recording's start", () => {
  const { pictures } = recording(GRASP, "a", 3, 0.1);
  const chunk = new Chunk(stretch(pictures, 0, 9), 3);
  assert.equal(chunk.count, pictures.length);
  assert.ok(Math.abs((chunk.times.at(-1) as number) - 0.1) < 1e-9);
  assert.equal(chunk.picture(2).time_s, pictures[2]?.time_s);
  assert.throws(() => chunk.picture(99), /no picture 99/);
  assert.equal(new Chunk(new ArrayBuffer(0), 0).count, 0);
});

test("a stretch that is cut off or out of order is refused in words", () => {
  const { pictures } = recording(LINE, "a", 0, 0.1);
  const whole = stretch(pictures, 0, 9);
  assert.throws(() => new Chunk(whole.slice(0, whole.byteLength - 1), 0), /cut off/);
  assert.throws(() => new Chunk(whole.slice(0, 2), 0), /within a length/);
  assert.throws(() => new Chunk(new ArrayBuffer(8), 0), /0 bytes are no picture/);
  assert.throws(() => new Chunk(stretch([...pictures].reverse(), 0, 9), 0), /order of time/);
});

test("recordings share one time, whichever begins first", () => {
  const spans = spansOf([10, 4], [0, -2]);
  assert.deepEqual(spans, [{ duration_s: 10, begins_s: 2 }, { duration_s: 4, begins_s: 0 }]);
  assert.equal(lengthOf(spans), 12);
  const first = { duration_s: 10, begins_s: 2 };
  assert.deepEqual([0, 2, 5, 99].map((time_s) => within(first, time_s)), [0, 0, 3, 10]);
  assert.deepEqual(spansOf([5], [3]), [{ duration_s: 5, begins_s: 0 }]);
});

test("playing follows the speed, stops at the end and does not jump after a sleep", () => {
  assert.equal(advanced(1, 0.1, 2, 10), 1.2);
  assert.equal(advanced(9.99, 0.1, 1, 10), 10);
  assert.equal(advanced(1, 60, 4, 10), 2);
});

test("a clock shows minutes, and hours where there are any", () => {
  assert.deepEqual([0, 62.3456, 3661.5, -1].map(clock), ["0:00.000", "1:02.346", "1:01:01.500", "0:00.000"]);
});

test("the present comes first, then what follows, then what was before", () => {
  assert.deepEqual(wanted(5, 2), [2, 3, 4, 1, 0]);
});

/** Answers from the recording, and keeps what was asked for. */
function server({ pictures }: Recording): { load: Load; asked: [number, number][] } {
  const asked: [number, number][] = [];
  const load: Load = async (from_s, to_s) => {
    asked.push([from_s, to_s]);
    return stretch(pictures, from_s, to_s);
  };
  return { asked, load };
}

async function filled(buffer: Buffer): Promise<void> {
  buffer.lookAt(0);
  for (let turn = 0; turn < 1000 && buffer.ranges()[0]?.[1] !== 12; turn++) await Promise.resolve();
}

test("a buffer fetches every picture once and finds the one that is shown at a time", async () => {
  const made = recording(LINE, "a", 7.3, 12, 10);
  const { load, asked } = server(made);
  const buffer = new Buffer(made.info, load);
  assert.equal(buffer.count, 3);
  assert.equal(buffer.placeAt(0), null);
  assert.equal(buffer.has(0), false);
  await filled(buffer);
  assert.deepEqual(buffer.ranges(), [[0, 12]]);
  assert.deepEqual(asked.map(([from_s]) => from_s), [7.3, 7.3 + CHUNK_S, 7.3 + 2 * CHUNK_S]);
  assert.deepEqual(asked.slice(0, 2).map(([, to_s]) => to_s), asked.slice(1).map(([from_s]) => from_s));
  let count = 0;
  for (let number = 0; number < buffer.count; number++) count += buffer.chunk(number)?.count ?? 0;
  assert.equal(count, made.pictures.length);
  const shownAt = (time_s: number) => {
    const place = buffer.placeAt(time_s);
    return place && buffer.chunk(place.chunk)?.picture(place.index).time_s;
  };
  assert.equal(shownAt(0), made.pictures[0]?.time_s);
  assert.equal(shownAt(6.05), made.pictures[60]?.time_s);
  assert.equal(shownAt(12), made.pictures[120]?.time_s);
});

test("steps go from picture to picture, over the edges of stretches", async () => {
  const made = recording(LINE, "a", 0, 12, 10);
  const buffer = new Buffer(made.info, server(made).load);
  await filled(buffer);
  const beside = (time_s: number, step: 1 | -1) => Number(buffer.timeBeside(time_s, step)?.toFixed(9));
  assert.deepEqual([4.95, 4.9, 5].map((time_s) => beside(time_s, 1)), [5, 5, 5.1]);
  assert.deepEqual([5.01, 5, 4.95].map((time_s) => beside(time_s, -1)), [5, 4.9, 4.9]);
  assert.equal(buffer.timeBeside(0, -1), null);
  assert.equal(buffer.timeBeside(12, 1), null);
});

test("trouble is told in words, and a stretch that cannot be read says where", async () => {
  const made = recording(LINE, "a", 2, 3);
  const told = (load: Load) => new Promise<string | null>((resolve) => {
    const buffer = new Buffer(made.info, load);
    buffer.onChange = () => { buffer.stop(); resolve(buffer.trouble); };
    buffer.lookAt(0);
  });
  assert.equal(await told(() => Promise.reject(new Error("the server does not answer"))), "the server does not answer");
  assert.match(await told(async () => new ArrayBuffer(3)) ?? "", /from 2 s on cannot be read: it ends within a length/);
});

test("a track joins what is here and leaves a gap where something is missing", async () => {
  const made = recording(LINE, "a", 1, 12, 10);
  const buffer = new Buffer(made.info, server(made).load);
  await filled(buffer);
  const channels = channelsOf(LINE);
  const whole = new Track(LINE, channels, buffer);
  assert.equal(whole.update(2), true);
  assert.equal(whole.length, made.pictures.length);
  assert.ok(Math.abs((whole.times()[10] as number) - 3) < 1e-9);
  const force = channels.findIndex(({ kind, label }) => kind === "forces" && label === "ben");
  const wanted_n = made.pictures[110]?.hosts[1]?.fingers[0]?.force_n[0] ?? NaN;
  assert.ok(Math.abs((whole.column(force)[110] as number) - wanted_n) < 1e-6);
  assert.equal(whole.update(2), false, "nothing changed");

  const holed = { count: 3, chunk: (number: number) => (number === 1 ? undefined : buffer.chunk(number)) } as Buffer;
  const track = new Track(LINE, channels, holed);
  track.update(0);
  const times = track.times();
  assert.ok(times.every((time_s, row) => row === 0 || time_s > (times[row - 1] as number)), "ascending");
  assert.equal([...track.column(force)].filter(Number.isNaN).length, 1);
});
