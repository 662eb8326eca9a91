import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser, CDPSession, Page } from "playwright-core";
import type { Picture } from "../../src/picture.ts";
import type { About, SeatsMessage, Vector } from "../../src/protocol.ts";
import { encodePicture } from "../encode.ts";
import { GRASP, LINE, picture, session } from "../examples.ts";
import { draw, launch, openPage, openTools, pass, passUntil, stopClock, type FakeServer } from "../harness.ts";

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

function seats(about: About, mine: boolean): SeatsMessage {
  const by = (user: number) => (mine && user === 0 ? "you" : "script");
  return { type: "seats", seats: about.users.map((name, user) => ({ user, name, by: by(user) })) };
}

/** A page with a scene that stands still, and with Anna's hand unless `free`. */
async function open(about: About, free = false): Promise<FakeServer> {
  const server = await openPage(browser);
  server.send(session(about));
  server.send(seats(about, !free));
  await draw(server, picture(about, 0));
  // From here on keys and pointers act at instants that the test chooses.
  await stopClock(server.page);
  if (!free) await take(server);
  return server;
}

async function take(server: FakeServer): Promise<void> {
  server.send({ type: "taken", user: 0, stiffness_n_per_m: 150, damping_n_s_per_m: 3 });
  await passUntil(server.page, () => points(server).length > 0);
}

/** The scene at rest, with anna's fingers drawn to these places. */
function drawnTo(about: About, targets_m: Vector[]): Picture {
  const still = picture(about, 0);
  still.hosts[0]?.fingers.forEach((finger, index) => { finger.target_m = targets_m[index] ?? null; });
  return still;
}

function points(server: FakeServer): Vector[][] {
  return server.said.flatMap((message) => (message.type === "point" ? [message.targets_m] : []));
}

function last(server: FakeServer): Vector[] {
  const found = points(server).at(-1);
  assert.ok(found, "no targets were sent");
  return found;
}

/** How far apart the two fingers are drawn, m. */
function width(server: FakeServer): number {
  const [one, two] = last(server);
  return Math.hypot(...[0, 1, 2].map((axis) => (one?.[axis] ?? 0) - (two?.[axis] ?? 0)));
}

async function middle(server: FakeServer): Promise<{ x: number; y: number }> {
  const box = await server.page.locator(".view-canvas").boundingBox();
  assert.ok(box);
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Where Anna's hand is on the screen, by its name beneath it. */
async function handAt(server: FakeServer): Promise<{ x: number; y: number }> {
  const box = await server.page.locator(".view-label", { hasText: "anna" }).boundingBox();
  assert.ok(box);
  return { x: box.x + box.width / 2, y: box.y };
}

function withFingersAt(about: About, targets_m: Vector[]): Picture {
  const one = picture(about, 0);
  one.hosts[0]?.fingers.forEach((finger, index) => { finger.position_m = targets_m[index] ?? finger.position_m; });
  return one;
}

test("a hand begins where its fingers are", async () => {
  const server = await open(GRASP);
  const fingers = picture(GRASP, 0).hosts[0]?.fingers.map((finger) => finger.position_m) ?? [];
  points(server)[0]?.forEach((target, index) => target.forEach((part, axis) => {
    assert.ok(Math.abs(part - (fingers[index]?.[axis] ?? NaN)) < 1e-6, `${target} is not ${fingers[index]}`);
  }));
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("a drag moves all fingers as the mouse moves, and the hand stays under it", async () => {
  const server = await open(LINE);
  const start = await middle(server);
  const before = await handAt(server);
  await server.page.mouse.move(start.x, start.y);
  await server.page.mouse.down();
  await server.page.mouse.move(start.x + 100, start.y + 30, { steps: 10 });
  await passUntil(server.page, () => (last(server)[0]?.[0] ?? 0) > 0.01);
  await server.page.mouse.up();
  await pass(server.page, 300);
  const steps = points(server).map((targets) => targets[0]?.[0] ?? NaN);
  steps.forEach((x, index) => assert.ok(index === 0 || x >= (steps[index - 1] ?? 0) - 1e-9, `${steps} goes back`));
  assert.deepEqual(last(server)[0]?.slice(1), [0, 0], "a line is along x");
  server.sendPicture(encodePicture(withFingersAt(LINE, last(server))));
  await pass(server.page, 400);
  const after = await handAt(server);
  assert.ok(Math.abs(after.x - before.x - 100) < 8, `the hand went ${after.x - before.x} pixels, the mouse 100`);
  await server.page.close();
});

test("in a plane a drag moves both fingers alike, along x and y", async () => {
  const server = await open(GRASP);
  const [start, first] = [await middle(server), last(server)];
  await server.page.mouse.move(start.x, start.y);
  await server.page.mouse.down();
  await server.page.mouse.move(start.x + 40, start.y - 30, { steps: 5 });
  await passUntil(server.page, () => (last(server)[0]?.[1] ?? 0) > (first[0]?.[1] ?? 0) + 0.005);
  await server.page.mouse.up();
  await pass(server.page, 250);
  const ways = last(server).map((target, index) => target.map((part, axis) => part - (first[index]?.[axis] ?? 0)));
  const [dx = 0, dy = 0, dz = 1] = ways[0] ?? [];
  assert.ok(dx > 0.005 && dy > 0.005 && Math.abs(dz) < 1e-9, `${ways[0]}`);
  ways[0]?.forEach((part, axis) => assert.ok(Math.abs(part - (ways[1]?.[axis] ?? NaN)) < 1e-9, `${ways}`));
  await server.page.close();
});

test("a hand that rests is still heard of", async () => {
  const server = await open(GRASP);
  const past = points(server).length;
  await pass(server.page, 1500);
  const more = points(server).length - past;
  // Twice a second is what the server asks for.
  assert.ok(more >= 3, `${more} messages in 1.5 s`);
  assert.ok(more < 30, `${more} messages in 1.5 s of rest`);
  await server.page.close();
});

test("arrow keys move, Space closes until it presses, E turns, Escape leaves", async () => {
  const server = await open(GRASP);
  const first = last(server);
  await server.page.keyboard.down("ArrowRight");
  await passUntil(server.page, () => (last(server)[0]?.[0] ?? 0) > (first[0]?.[0] ?? 0) + 0.005);
  await server.page.keyboard.up("ArrowRight");
  const apart = () => width(server);
  const open_m = apart();
  // A server that draws the fingers, which something holds fast, to where the page says.
  const held = async (time_ms: number) => {
    for (let passed_ms = 0; passed_ms < time_ms; passed_ms += 30) {
      server.sendPicture(encodePicture(drawnTo(GRASP, last(server))));
      await pass(server.page, 30);
    }
  };
  await server.page.keyboard.press(" ");
  // 4 N of 150 N/m: each finger's target stops nearly 27 mm inside of the finger.
  await held(3000);
  assert.ok(apart() < open_m - 0.045 && apart() > open_m - 0.065, `closed from ${open_m} to ${apart()}`);
  await server.page.keyboard.press(" ");
  await passUntil(server.page, () => apart() > open_m);
  await server.page.keyboard.down("e");
  await passUntil(server.page, () => Math.abs((last(server)[0]?.[0] ?? 0) - (last(server)[1]?.[0] ?? 0)) > 0.02);
  await server.page.keyboard.up("e");
  await server.page.keyboard.press("Escape");
  await passUntil(server.page, () => server.said.some((message) => message.type === "leave"));
  await server.page.close();
});

test("keys that are meant for a field do not move the hand", async () => {
  const server = await open(GRASP);
  const first = last(server);
  await openTools(server.page);
  await server.page.getByLabel("Copies").focus();
  await server.page.keyboard.down("ArrowDown");
  await pass(server.page, 300);
  await server.page.keyboard.up("ArrowDown");
  await pass(server.page, 300);
  assert.deepEqual(last(server), first);
  await server.page.close();
});

test("a press on a finger that a script moves takes it, and the same press drags it", async () => {
  const server = await open(GRASP, true);
  // The name stands 14 pixels under the lowest finger.
  const { x, y } = await handAt(server);
  await server.page.mouse.move(x, y - 14);
  await server.page.mouse.down();
  await passUntil(server.page, () => server.said.some((message) => message.type === "take" && message.user === 0));
  await take(server);
  const first = last(server);
  await server.page.mouse.move(x + 60, y - 14, { steps: 6 });
  await passUntil(server.page, () => (last(server)[0]?.[0] ?? 0) > (first[0]?.[0] ?? 0) + 0.005);
  await server.page.mouse.up();
  await server.page.close();
});

test("a press beside all fingers takes nothing, and a hand that is lost is not moved any more", async () => {
  const server = await open(GRASP, true);
  const box = await server.page.locator(".view-canvas").boundingBox();
  assert.ok(box);
  await server.page.mouse.click(box.x + 0.6 * box.width, box.y + box.height - 8);
  await pass(server.page, 200);
  assert.equal(server.said.some((message) => message.type === "take"), false);
  await take(server);
  server.send({ type: "taken", user: null, stiffness_n_per_m: 0, damping_n_s_per_m: 0 });
  await pass(server.page, 300);
  const past = points(server).length;
  await pass(server.page, 600);
  assert.equal(points(server).length, past);
  await server.page.close();
});

test("one touch drags, a pinch closes and a twist turns", async () => {
  const server = await open(GRASP);
  const cdp = await server.page.context().newCDPSession(server.page);
  const { x, y } = await middle(server);
  const first = last(server);
  await touch(server.page, cdp, "touchStart", [[x, y]]);
  for (let i = 1; i <= 5; i++) await touch(server.page, cdp, "touchMove", [[x - 10 * i, y]]);
  await passUntil(server.page, () => (last(server)[0]?.[0] ?? 0) < (first[0]?.[0] ?? 0) - 0.005);
  await touch(server.page, cdp, "touchEnd", []);
  const dragged = last(server);
  const apart = () => width(server);
  const wide_m = apart();
  await touch(server.page, cdp, "touchStart", [[x - 50, y], [x + 50, y]]);
  for (let i = 1; i <= 5; i++) {
    await touch(server.page, cdp, "touchMove", [[x - 50 + 4 * i, y + 3 * i], [x + 50 - 4 * i, y - 3 * i]]);
  }
  await passUntil(server.page, () => apart() < 0.8 * wide_m);
  const [one, two] = last(server);
  // The second touch went up: counter-clockwise, so the finger in front, which is the first, goes to the right.
  assert.ok((one?.[0] ?? 0) > (two?.[0] ?? 0) + 0.01, `${one} and ${two} after ${dragged}`);
  await touch(server.page, cdp, "touchEnd", []);
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

type TouchKind = "touchStart" | "touchMove" | "touchEnd";

async function touch(page: Page, cdp: CDPSession, type: TouchKind, at: [number, number][]): Promise<void> {
  await cdp.send("Input.dispatchTouchEvent", { type, touchPoints: at.map(([x, y], id) => ({ x, y, id })) });
  await pass(page, 30);
}
