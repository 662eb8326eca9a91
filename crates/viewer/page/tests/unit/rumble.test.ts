import { test } from "node:test";
import assert from "node:assert/strict";
import { strengthOf } from "../../src/hand/rumble.ts";
import type { FingerPicture } from "../../src/picture.ts";

const FREE: FingerPicture = {
  position_m: [0, 0, 0], force_n: [0, 0, 0], proxy_m: null, target_m: null, phase: "free", governor_acted: 0,
  governor_gain: 1, energy_j: 0,
};

test("touching is felt, holding is not, and a jump of the force is as strong as it is large", () => {
  const touching: FingerPicture = { ...FREE, phase: "pre-slide", force_n: [0, 0.1, 0] };
  assert.equal(strengthOf([FREE], [touching]), 0.5);
  assert.equal(strengthOf([touching], [touching]), 0);
  assert.equal(strengthOf([touching], [{ ...touching, force_n: [0, 2.1, 0] }]), 0.5);
  assert.equal(strengthOf([touching], [{ ...touching, force_n: [0, 20, 0] }]), 1);
  assert.equal(strengthOf([], [touching]), 0);
});
