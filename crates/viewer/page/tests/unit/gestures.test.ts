import { test } from "node:test";
import assert from "node:assert/strict";
import { Ray, Vector3 } from "three";
import {
  grasped, grip, keyDirection, leashed, moved, nearAngle, pinch, pull, takeHold, targets, turned, widened, width,
} from "../../src/hand/gestures.ts";
import type { Vector } from "../../src/protocol.ts";

const PAIR: Vector[] = [[0.1, -0.05, 0.2], [0.1, 0.05, 0.2]];
const REST: Vector[] = [[0, -0.09, 0], [0, 0.09, 0]];

function near(actual: readonly number[] | null | undefined, expected: readonly number[]): void {
  assert.ok(actual, `nothing where ${expected} is expected`);
  assert.equal(actual.length, expected.length);
  actual.forEach((value, index) => {
    const wanted = expected[index] ?? NaN;
    assert.ok(Math.abs(value - wanted) < 1e-9, `${actual} is not ${expected}`);
  });
}

test("a hold begins where the fingers are, and is as wide as the hand at rest when open", () => {
  const hold = takeHold(PAIR, REST);
  targets(hold).forEach((target, index) => near(target, PAIR[index] ?? []));
  near([width(hold), hold.open_m], [0.05, 0.09]);
});

test("a hand moves only where its space lets it", () => {
  const by: Vector = [0.01, 0.02, 0.03];
  const hold = takeHold(PAIR, REST);
  near(moved(hold, by, "line").centre, [0.11, 0, 0.2]);
  near(moved(hold, by, "plane").centre, [0.11, 0.02, 0.2]);
  near(moved(hold, by, "space").centre, [0.11, 0.02, 0.23]);
});

test("a turn keeps the centre and the width", () => {
  const hold = turned(takeHold(PAIR, REST), Math.PI / 2, [0, 0, 1]);
  near(targets(hold)[0], [0.15, 0, 0.2]);
  near(targets(hold)[1], [0.05, 0, 0.2]);
});

test("fingers close along the line between them, open no wider than the hand, and know the way back", () => {
  const open = takeHold(PAIR, REST);
  near(targets(widened(open, 0.03))[0], [0.1, -0.03, 0.2]);
  near([width(widened(open, 1))], [0.09]);
  const closed = widened(open, 0);
  assert.ok(width(closed) > 0 && width(closed) < 1e-4);
  near(targets(widened(closed, 0.05))[1], [0.1, 0.05, 0.2]);
});

test("one finger has nothing to close", () => {
  const hold = takeHold([[1, 2, 3]], [[0, 0, 0]]);
  assert.equal(widened(hold, 0.1), hold);
  assert.equal(grip(hold, targets(hold), [[1, 2, 3]], 150), 0);
});

test("grip and pull are the springs' forces", () => {
  const hold = widened(takeHold(PAIR, REST), 0.03);
  // Each finger is 20 mm outside of its target.
  near([grip(hold, targets(hold), PAIR, 150), pull(targets(hold), PAIR, 150)], [3, 3]);
  // Drawn outwards, nothing is gripped.
  near([grip(takeHold(PAIR, REST), targets(takeHold(PAIR, REST)), [[0.1, 0, 0.2], [0.1, 0, 0.2]], 100)], [-5]);
});

test("a leash keeps a hold near the fingers", () => {
  const far = moved(takeHold(PAIR, REST), [1, 0, 0], "plane");
  near(leashed(far, PAIR, 0.1).centre, [0.2, 0, 0.2]);
  const close = moved(takeHold(PAIR, REST), [0.05, 0, 0], "plane");
  near(leashed(close, PAIR, 0.1).centre, close.centre);
});

test("a pointer is measured on the line, in the plane, or in the plane that faces the camera", () => {
  const ray = new Ray(new Vector3(0, -1, 1), new Vector3(0.1, 1, -1).normalize());
  near(grasped(ray, [0.5, 0, 0.2], [0, 0, -1], "plane"), [0.08, -0.2, 0.2]);
  const facing = new Vector3(0, 1, -1).normalize().toArray();
  near(grasped(ray, [0, 0, 0], facing, "space"), [0.1, 0, 0]);
  const line = grasped(ray, [0.5, 0, 0], facing, "line");
  near(line, [0.1, 0, 0]);
});

test("a pointer that looks past the plane or along the line moves nothing", () => {
  assert.equal(grasped(new Ray(new Vector3(0, 0, 1), new Vector3(1, 0, 0)), [0, 0, 0], [1, 0, 0], "plane"), null);
  assert.equal(grasped(new Ray(new Vector3(0, 0, 1), new Vector3(0, 0, 1)), [0, 0, 0], [1, 0, 0], "plane"), null);
  assert.equal(grasped(new Ray(new Vector3(0, 1, 0), new Vector3(1, 0, 0)), [0, 0, 0], [1, 0, 0], "line"), null);
  assert.equal(grasped(new Ray(new Vector3(0, 0, 1), new Vector3(0, 0, -1)), [0, 0, 0], [1, 0, 0], "line"), null);
});

test("arrow keys go along the axis that is nearest to where they point on the screen", () => {
  const [right, up, forward]: Vector[] = [[0.9, 0.1, 0], [-0.1, 0.6, 0.7], [0.1, 0.7, -0.6]];
  const key = (name: string, space: "line" | "plane" | "space") =>
    keyDirection(name, right as Vector, up as Vector, forward as Vector, space);
  near(key("ArrowRight", "line"), [1, 0, 0]);
  assert.equal(key("ArrowUp", "line"), null);
  near(key("ArrowUp", "plane"), [0, 1, 0]);
  near(key("ArrowDown", "plane"), [0, -1, 0]);
  assert.equal(key("PageUp", "plane"), null);
  near(key("PageUp", "space"), forward as Vector);
  near(key("ArrowLeft", "space"), [-0.9, -0.1, 0]);
  assert.equal(key("x", "space"), null);
});

test("a pinch has a middle, a width and an angle that grows counter-clockwise", () => {
  const flat = pinch([0, 0], [100, 0]);
  assert.deepEqual(flat.middle, [50, 0]);
  assert.equal(flat.apart, 100);
  near([pinch([0, 100], [100, 0]).angle_rad - flat.angle_rad], [Math.PI / 4]);
  near([nearAngle(1.5 * Math.PI)], [-Math.PI / 2]);
});
