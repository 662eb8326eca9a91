import { test } from "node:test";
import assert from "node:assert/strict";
import { Asking, type Clock, type Wish } from "../../src/lesson/asking.ts";
import { firstAxes } from "../../src/lesson/axes.ts";
import { needleAngle, radiusText } from "../../src/lesson/gauge.ts";
import { areaOf, placeOf, valuesAt } from "../../src/lesson/map.ts";
import { axisMarks, fromSlider, readable, share, tidy, toSlider, valueAt } from "../../src/lesson/scale.ts";
import { refusal } from "../../src/lesson/controls.ts";
import { Setting } from "../../src/lesson/setting.ts";
import { agrees, Trials } from "../../src/lesson/tried.ts";
import { agreement, growth, limits, margins, observed } from "../../src/lesson/words.ts";
import type { Control, PageMessage } from "../../src/protocol.ts";
import { LINE, picture } from "../examples.ts";
import { gains } from "../../src/lesson/contact.ts";
import { CONTROLS, K_OBJECTS, K_REMOTE, SOFT_CONTROLS } from "../lesson_example.ts";
import { SOFT } from "../soft_example.ts";

const control = (key: string): Control => CONTROLS.find((found) => found.key === key)!;
const stiffness = control(K_OBJECTS);
const delay = control("link.delay_periods");
const compensation = control("object.damping_n_s_per_m");

/** A clock that goes when the test says. */
class FakeClock implements Clock {
  #now = 0;
  #due: { at: number; run: () => void }[] = [];
  now(): number { return this.#now; }
  later(run: () => void, delay_ms: number): void { this.#due.push({ at: this.#now + delay_ms, run }); }
  go(by_ms: number): void {
    const until = this.#now + by_ms;
    for (;;) {
      const next = this.#due.filter(({ at }) => at <= until).sort((a, b) => a.at - b.at)[0];
      if (!next) break;
      this.#due.splice(this.#due.indexOf(next), 1);
      this.#now = Math.max(this.#now, next.at);
      next.run();
    }
    this.#now = until;
  }
}

test("a slider's places and values belong together", () => {
  assert.equal(fromSlider(stiffness, 0), 10);
  assert.equal(fromSlider(stiffness, 1000), 10000);
  assert.equal(fromSlider(stiffness, 500), 316);
  for (const value of [10, 300, 4250, 10000]) assert.equal(toSlider(stiffness, fromSlider(stiffness, toSlider(stiffness, value))), toSlider(stiffness, value));
  assert.equal(fromSlider(delay, 3), 3);
  assert.equal(toSlider(delay, 99), 8);
  assert.equal(fromSlider(compensation, 500), 0);
  assert.equal(toSlider(compensation, -20), 0);
});

test("values stay within a control's ends, and are what people would type", () => {
  assert.equal(tidy(stiffness, 1234.567), 1230);
  assert.equal(tidy(stiffness, 1e9), 10000);
  assert.equal(tidy(delay, 2.4), 2);
  assert.equal(tidy(compensation, -0.30000000004), -0.3);
  assert.equal(readable(0.123456), "0.123");
  assert.equal(readable(12345.6), "12350");
  assert.equal(readable(0), "0");
  assert.equal(readable(NaN), "–");
});

test("a share of the way and back, evenly and by ratios; a logarithm from zero is even", () => {
  const scales = [{ low: -20, high: 20, log: false }, { low: 10, high: 1e4, log: true }, { low: 0, high: 5, log: true }];
  for (const scale of scales) {
    for (const at of [0, 0.25, 0.7, 1]) assert.ok(Math.abs(share(scale, valueAt(scale, at)) - at) < 1e-12);
  }
  assert.equal(valueAt(scales[2]!, 0.5), 2.5);
  assert.equal(share(scales[1]!, -5), 0);
  assert.deepEqual(axisMarks(scales[1]!), [10, 100, 1000, 10000]);
  assert.deepEqual(axisMarks({ low: 0, high: 8, log: false }), [0, 2, 4, 6, 8]);
});

test("a place on the map is a pair of values, and back", () => {
  const area = areaOf(400, 210);
  const [x, y] = [stiffness, control(K_REMOTE)];
  const place = placeOf(area, x, y, { x: 300, y: 400 });
  assert.deepEqual(valuesAt(area, x, y, place), { x: 300, y: 400 });
  assert.deepEqual(valuesAt(area, x, y, { x: -50, y: 1000 }), { x: 10, y: 10 });
  assert.ok(placeOf(area, x, y, { x: 300, y: 500 }).y < place.y, "larger is higher");
});

test("the map's first axes are the stiffnesses between users, else what there is", () => {
  assert.deepEqual([firstAxes(CONTROLS)?.x.key, firstAxes(CONTROLS)?.y.key], [K_OBJECTS, K_REMOTE]);
  assert.deepEqual([firstAxes([delay, compensation])?.x.key, firstAxes([delay, compensation])?.y.key], [delay.key, compensation.key]);
  assert.equal(firstAxes([delay, control("session.architecture"), control("link.impairment.loss_rate")]), null);
});

test("of a soft object the map's first axes are the gains of its local model, as far as it has them", () => {
  const keys = (hasIntegral: boolean) => Object.values(firstAxes(SOFT_CONTROLS, hasIntegral) ?? {}).map(({ key }) => key);
  assert.deepEqual(keys(true), ["local_model.stiffness_ratio", "local_model.integral_ratio"]);
  assert.deepEqual(keys(false), ["local_model.stiffness_ratio", "link.delay_periods"]);
});

test("gains are what is set, in newtons per metre or as shares of K_o", () => {
  assert.deepEqual(gains(SOFT.soft!, {}, 800), { stiffness: 400, integral: 160 });
  const set = { "local_model.stiffness_ratio": 0.25, "local_model.integral_n_per_m": 30 };
  assert.deepEqual(gains(SOFT.soft!, set, 800), { stiffness: 200, integral: 30 });
  assert.deepEqual(gains(SOFT.soft!, { "local_model.kind": "p" }, 800), { stiffness: 400, integral: null });
});

test("the needle stands upright at 1 and leans to the side of the verdict", () => {
  assert.equal(needleAngle(1), 0);
  assert.ok(needleAngle(0.999) < 0 && needleAngle(1.001) > 0);
  assert.ok(needleAngle(Infinity) <= 90 && needleAngle(0) >= -90);
  assert.equal(radiusText(0.99999912), "0.999999120");
  assert.equal(radiusText(1.05), "1.0500");
});

test("prediction and session agree, or not yet, in words", () => {
  assert.match(agreement(true, "quiet", true), /stable – and it is/);
  assert.match(agreement(false, "shaking", true), /unstable – and it shakes/);
  assert.match(agreement(false, "diverging", true), /unstable – and it diverges/);
  assert.match(agreement(true, "shaking", true), /still settling/);
  assert.match(agreement(false, "quiet", true), /not shaken yet/);
  assert.match(agreement(false, "quiet", false), /^What if/);
  assert.match(agreement(undefined, "quiet", true), /Waiting/);
  assert.equal(agreement(null, "quiet", true), "Not proven: each analysed contact is stable. The session is quiet.");
  assert.match(agreement(null, "shaking", false), /predicted not proven/);
});

test("what the session does is read from its pictures", () => {
  const calm = picture(LINE, 1);
  assert.equal(observed(calm), "quiet");
  assert.equal(observed({ ...calm, verdict_now: null }), "unknown");
  assert.equal(observed({ ...calm, verdict_now: "shaking" }), "shaking");
  assert.equal(limits(calm), "");
  calm.hosts[1]!.fingers[0]!.governor_acted = 5;
  assert.equal(limits(calm), "Governor: force limit, slew limit");
  calm.hosts[1]!.fingers[0]!.governor_acted = 5 | 8;
  assert.equal(limits(calm), "Forces fade in or out");
  calm.hosts[0]!.diverged = true;
  assert.equal(observed(calm), "lost");
});

test("growth and margins in words", () => {
  assert.equal(growth({ spectral_radius: 2, period_s: 0.01 }), "Any disturbance doubles every 10 ms.");
  assert.equal(growth({ spectral_radius: 0.5, period_s: 2 }), "Any disturbance halves every 2 s.");
  assert.match(growth({ spectral_radius: 1, period_s: 0.01 }), /neither/);
  assert.match(growth({ spectral_radius: 0, period_s: 0.01 }), /gone/);
  const words = margins({
    type: "margin", id: 1, delay_periods: 3.5, loss_rate: 0.25, notes: [],
    gains: [{ key: K_OBJECTS, value: 300, factor: 2, lower_factor: 0.5 }, { key: K_REMOTE, value: 4, factor: null, lower_factor: null }],
  }, CONTROLS);
  assert.deepEqual(words, [
    "Delay: unstable from 3.5 network periods on.",
    "Loss: unstable when 25 % of the packets are lost.",
    "Copy to copy, stiffness: unstable above 600 (× 2) and below 150 (× 0.5).",
  ]);
});

const AXIS = { key: "x", from: 0, to: 1, count: 2, log: false };
const wish = (value: number, mapKey = "same"): Wish => ({ settings: { k: value }, axes: { x: AXIS, y: { ...AXIS, key: "y" } }, mapKey, margin: true });
type Question = Extract<PageMessage, { type: "predict" }>;

test("the first question goes out at once; while it is answered the newest wish waits, and margins wait for rest", () => {
  const clock = new FakeClock();
  const asked: Question[] = [];
  const asking = new Asking((question) => asked.push(question), clock);
  asking.wish(wish(1));
  assert.equal(asked.length, 1);
  assert.ok(asked[0]!.map !== null && !asked[0]!.margin);
  for (const value of [2, 3, 4]) { clock.go(10); asking.wish(wish(value)); }
  assert.equal(asked.length, 1);
  assert.ok(asking.answered(asked[0]!.id, "verdict") && asking.answered(asked[0]!.id, "map"));
  clock.go(60);
  assert.deepEqual(asked.at(-1)!.settings, { k: 4 });
  assert.equal(asked.length, 2);
  assert.equal(asked[1]!.map, null, "the map does not depend on what moved");
  assert.equal(asking.answered(asked[0]!.id, "verdict"), false, "an answer to an older question is none");
  clock.go(1000);
  assert.equal(asked.length, 3);
  assert.ok(asked[2]!.margin);
  clock.go(5000);
  assert.equal(asked.length, 3, "at rest, nothing more is asked");
});

test("a verdict that is not whole is asked for again at rest, and only then", () => {
  const clock = new FakeClock();
  const asked: Question[] = [];
  const asking = new Asking((question) => asked.push(question), clock);
  asking.wish({ ...wish(1), axes: null, margin: false });
  assert.equal(asked[0]!.whole, false);
  asking.answered(asked[0]!.id, "verdict", true, false);
  clock.go(1000);
  assert.equal(asked.length, 2);
  assert.ok(asked[1]!.whole && !asked[1]!.margin);
  asking.answered(asked[1]!.id, "verdict", true, true);
  clock.go(5000);
  assert.equal(asked.length, 2);
  // Of a quick scene the first verdict is the last word.
  asking.wish({ ...wish(2), axes: null, margin: false });
  asking.answered(asked[2]!.id, "verdict", true, true);
  clock.go(5000);
  assert.equal(asked.length, 3);
});

test("a map that was ended by a newer question is asked for again; a question without an answer does not block", () => {
  const clock = new FakeClock();
  const asked: Question[] = [];
  const asking = new Asking((question) => asked.push(question), clock);
  asking.wish(wish(1));
  clock.go(20);
  asking.wish(wish(2, "other"));
  clock.go(400);
  assert.ok(asked.length >= 2 && asked[1]!.map !== null);
  asking.forget();
  asking.wish(wish(3, "other"));
  clock.go(1);
  assert.ok(asked.at(-1)!.map !== null);
  assert.equal(asking.answered(asked[0]!.id, "map"), false);
});

test("a drag sets the session ten times a second, and ends at the last value", () => {
  const clock = new FakeClock();
  const sent: Record<string, unknown>[] = [];
  const setting = new Setting((settings) => sent.push(settings), clock);
  for (let value = 1; value <= 50; value++) { setting.moved(stiffness, value); clock.go(10); }
  clock.go(200);
  assert.ok(sent.length >= 5 && sent.length <= 7, `${sent.length} times in half a second`);
  assert.deepEqual(sent.at(-1), { [K_OBJECTS]: 50 });
});

test("what begins the session anew is set once, when it is let go", () => {
  const clock = new FakeClock();
  const sent: Record<string, unknown>[] = [];
  const setting = new Setting((settings) => sent.push(settings), clock);
  for (const value of [2, 3, 4]) { setting.moved(delay, value); setting.released(delay, value); clock.go(100); }
  assert.deepEqual(sent, []);
  clock.go(1000);
  assert.deepEqual(sent, [{ "link.delay_periods": 4 }]);
});

test("a number that a control does not allow is refused with what it allows", () => {
  assert.equal(refusal(stiffness, 500), null);
  assert.equal(refusal(delay, 3), null);
  assert.match(refusal(stiffness, 1)!, /cannot be 1: it goes from 10 to 10000 N\/m/);
  assert.match(refusal(stiffness, NaN)!, /is a number from 10 to 10000 N\/m/);
  assert.match(refusal(delay, 2.5)!, /whole number from 0 to 8/);
});

test("trials have what was predicted and the worst that was seen once it could settle; short ones are left out", () => {
  const trials = new Trials();
  const set = (value: number) => trials.run({ [K_OBJECTS]: value, "session.users": 2 });
  const see = (from_s: number, to_s: number, seen: "quiet" | "shaking") => {
    for (let time_s = from_s; time_s <= to_s; time_s += 0.25) trials.see(time_s, seen);
  };
  set(300);
  trials.predict(true);
  see(0, 3, "quiet");
  for (const value of [400, 900, 2000]) { set(value); see(3, 3.25, "quiet"); }
  set(3000);
  trials.predict(false);
  see(3.5, 8, "shaking");
  set(300);
  trials.predict(true);
  see(8.25, 8.75, "shaking");
  see(9.5, 12, "quiet");
  assert.deepEqual(trials.all.map(({ predicted, seen }) => [predicted, seen]), [[true, "quiet"], [false, "shaking"], [true, "quiet"]]);
  assert.deepEqual(trials.all.map((trial) => trials.differences(trial)), [[], [[K_OBJECTS, 3000]], []]);
  assert.deepEqual(trials.all.map(agrees), [true, true, true]);
  // Settings under which it shakes at once are told, however soon they are taken back; what dies out afterwards is theirs.
  set(4000);
  trials.predict(false);
  see(12.25, 13, "shaking");
  set(300);
  trials.predict(true);
  see(13.25, 14.75, "shaking");
  see(15, 18, "quiet");
  assert.deepEqual(trials.all.slice(2).map(({ seen }) => seen), ["quiet", "shaking", "quiet"]);
  assert.deepEqual(trials.all.map(agrees), [true, true, true, true, true]);
  assert.equal(agrees({ settings: {}, predicted: null, seen: "quiet", held_s: 9 }), null);
});
