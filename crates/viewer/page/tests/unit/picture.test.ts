import { test } from "node:test";
import assert from "node:assert/strict";
import { decodePicture } from "../../src/picture.ts";
import { encodePicture } from "../encode.ts";
import { GRASP, picture } from "../examples.ts";

test("a picture is read as it was written", () => {
  const written = picture(GRASP, 0.5);
  const packed = Int16Array.from([0, 1, -2, 3, -32767, 32767, 5, -1]);
  written.surfaces.push({ host: 1, ko_n_per_m: 800, step_m: 1e-6, step_pa: 0.5, packed });
  const read = decodePicture(encodePicture(written));
  const rounded = JSON.parse(JSON.stringify(written), (_, value) => (typeof value === "number" ? Math.fround(value) : value));
  rounded.time_s = written.time_s;
  assert.deepEqual(JSON.parse(JSON.stringify(read)), rounded);
});

test("what is cut off, too long or of another kind is refused", () => {
  const whole = encodePicture(picture(GRASP, 0.5));
  assert.throws(() => decodePicture(whole.slice(0, whole.byteLength - 1)));
  const longer = new Uint8Array(whole.byteLength + 4);
  longer.set(new Uint8Array(whole));
  assert.throws(() => decodePicture(longer.buffer), /a picture of/);
  longer[0] = 7;
  assert.throws(() => decodePicture(longer.buffer), /no picture/);
});
