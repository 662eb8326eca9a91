import { test } from "node:test";
import assert from "node:assert/strict";
import { nextWait, whyClosed } from "../../src/connection.ts";
import { SOFT } from "../soft_example.ts";
import { describe, observe } from "../../src/people/header.ts";
import { waiting } from "../../src/people/notices.ts";
import { GRASP, picture } from "../examples.ts";

test("why a connection ended, in words", () => {
  assert.equal(whyClosed("the session is full: 32 browsers watch it", true, false), "The session is full: 32 browsers watch it.");
  assert.equal(whyClosed("", true, false), "The server is gone.");
  assert.equal(whyClosed("", true, true), "The session is over.");
  assert.equal(whyClosed("", false, false), "There is no server at this address.");
});

test("one asks again later and later, but not for ever later", () => {
  assert.equal(nextWait(500), 1000);
  assert.equal(nextWait(8000), 8000);
  const trouble = { text: "Gone.", remedy: { again_at: 3000, now: () => {} } };
  assert.equal(waiting(trouble, 100), "Asking again in 3 s.");
  assert.equal(waiting(trouble, 3001), "Asking again…");
  assert.equal(waiting({ text: "Old.", remedy: "reload" }, 0), "");
});

test("the header says what runs and what it does", () => {
  assert.equal(describe({ ...SOFT, users: ["anna"] }), "1 user · haptics 1024 Hz · simulation 60 Hz");
  assert.equal(describe(GRASP), "distributed · 2 users · haptics 1024 Hz · network 128 Hz · delay 1 period");
  const seen = picture(GRASP, 1);
  assert.deepEqual(observe(seen), ["good", "quiet"]);
  assert.deepEqual(observe({ ...seen, verdict_now: "shaking" }), ["bad", "shaking"]);
  assert.deepEqual(observe({ ...seen, ended: true }), ["unknown", "over"]);
});
