import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser, BrowserContext } from "playwright-core";
import type { Picture } from "../../src/picture.ts";
import type { About, BodyInfo } from "../../src/protocol.ts";
import { encodePicture } from "../encode.ts";
import { GRASP, LINE, picture, session } from "../examples.ts";
import { draw, drawnSoFar, launch, openPage, openTools, pass, type FakeServer } from "../harness.ts";
import { findColours } from "./pixels.ts";

/** The legend has the users' colours too. */
const PURE = ":root { --user-0: #0000ff !important; --user-1: #ff0000 !important; } "
  + ".view-legend { display: none !important; }";
const BLUE: [number, number, number] = [0, 0, 255];
const LIME: [number, number, number] = [0, 255, 0];

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

async function recolour(server: FakeServer, css: string): Promise<void> {
  await server.page.addStyleTag({ content: css });
  await server.page.evaluate(() => document.dispatchEvent(new Event("themechange")));
  await pass(server.page, 200);
}

function moved(about: About, by_m: number): Picture {
  const one = picture(about, 0);
  for (const host of one.hosts) for (const body of host.bodies) body.position_m[0] += by_m;
  return one;
}

for (const scheme of ["light", "dark"] as const) {
  test(`the canvas shows copies in their users' colours, where they are (${scheme})`, async () => {
    const server = await openPage(browser);
    await server.page.emulateMedia({ colorScheme: scheme });
    await recolour(server, PURE);
    const canvas = server.page.locator("canvas").first();
    const [nothing] = await findColours(server.page, canvas, [BLUE]);
    server.send(session(GRASP));
    await draw(server, moved(GRASP, -0.02));
    const [left] = await findColours(server.page, canvas, [BLUE]);
    await draw(server, moved(GRASP, 0.02));
    const [right] = await findColours(server.page, canvas, [BLUE]);
    assert.ok(nothing && left && right);
    assert.equal(nothing.count, 0, "before the first picture");
    assert.ok(left.count > 100 && right.count > 100, `${left.count} and ${right.count} pixels`);
    assert.ok(right.x - left.x > 15, `from ${left.x} to ${right.x}`);
    assert.deepEqual(server.errors, []);
    await server.page.close();
  });
}

test("what swings far away stays in the picture", async () => {
  const server = await openPage(browser);
  await recolour(server, PURE);
  server.send(session(LINE));
  await draw(server, picture(LINE, 0));
  // Both hands and copies metres apart, metres away: within a scene of 20 cm.
  const far = picture(LINE, 0);
  far.hosts.forEach((host, index) => {
    const x = 5 + (index === 0 ? -2 : 2);
    for (const finger of host.fingers) finger.position_m = [x, 0, 0];
    for (const body of host.bodies) body.position_m = [x, 0, 0];
  });
  for (let i = 0; i < 20; i++) await draw(server, far);
  const [blue, red] = await findColours(server.page, server.page.locator("canvas").first(), [BLUE, [255, 0, 0]]);
  assert.ok((blue?.count ?? 0) > 10 && (red?.count ?? 0) > 10, `${blue?.count} and ${red?.count} pixels`);
  await server.page.close();
});

test("the colours of another theme are taken over at once", async () => {
  const server = await openPage(browser);
  server.send(session(LINE));
  await draw(server, picture(LINE, 0));
  const canvas = server.page.locator("canvas").first();
  const [past] = await findColours(server.page, canvas, [LIME]);
  await recolour(server, ":root { --user-0: #00ff00 !important; }");
  const [now] = await findColours(server.page, canvas, [LIME]);
  assert.ok((past?.count ?? 1) === 0 && (now?.count ?? 0) > 50, `${past?.count} and ${now?.count} pixels`);
  await server.page.close();
});

test("copies can be hidden, and shown further apart than they are", async () => {
  const server = await openPage(browser);
  await recolour(server, PURE);
  server.send(session(GRASP));
  await draw(server, moved(GRASP, 0));
  const canvas = server.page.locator("canvas").first();
  const outlines = async (words: string) => {
    await openTools(server.page);
    await server.page.getByLabel("Copies").selectOption({ label: words });
    await pass(server.page, 200);
    return (await findColours(server.page, canvas, [BLUE]))[0] ?? { count: NaN, x: NaN, left: NaN };
  };
  const asTheyAre = await outlines("as they are");
  const apart = await outlines("10 × as far apart");
  const hidden = await outlines("hidden");
  // Anna's copy is 2 mm to the left of the mean.
  assert.ok(apart.left < asTheyAre.left - 8, `${apart.left} is not far from ${asTheyAre.left}`);
  // Her fingers, in the middle, have her colour too.
  assert.ok(hidden.left > asTheyAre.left + 20, `${hidden.left} and ${asTheyAre.left}`);
  await server.page.close();
});

test("every shape and a world out of all bounds are drawn without an error", async () => {
  const server = await openPage(browser);
  const body = GRASP.bodies[0];
  assert.ok(body);
  const vertices_m = [0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1];
  const surface = { vertices_m, triangles: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3] };
  const ofKind = (kind: BodyInfo["kind"]) => (kind === "hull" || kind === "mesh" ? surface : null);
  const kinds = ["point", "ball", "box", "capsule", "hull", "mesh"] as const;
  const about: About = {
    ...GRASP, space: "space",
    bodies: kinds.map((kind) => ({ ...body, kind, radius_m: 0.03, length_m: 0.05, surface: ofKind(kind) })),
  };
  await recolour(server, PURE);
  const one = picture(about, 0);
  server.send(session(about));
  await draw(server, one);
  one.hosts.forEach((host) => host.bodies.forEach((pose) => { pose.position_m = [NaN, Infinity, 1e30]; }));
  await draw(server, one);
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("nothing is drawn while nothing changes", async () => {
  const server = await openPage(browser);
  server.send(session(GRASP));
  await draw(server, picture(GRASP, 0));
  await pass(server.page, 1500);
  const past = await drawnSoFar(server.page);
  await pass(server.page, 700);
  assert.equal(await drawnSoFar(server.page), past);
  await server.page.close();
});

test("arrow keys turn a view that has the focus, and the view can be reset", async () => {
  const server = await openPage(browser);
  await recolour(server, PURE);
  server.send(session(GRASP));
  await draw(server, picture(GRASP, 0));
  const canvas = server.page.locator("canvas").first();
  const where = async () => (await findColours(server.page, canvas, [BLUE]))[0]?.left ?? NaN;
  const first = await where();
  await canvas.focus();
  for (let i = 0; i < 6; i++) await server.page.keyboard.press("ArrowRight");
  await pass(server.page, 200);
  const turned = await where();
  await openTools(server.page);
  await server.page.getByRole("button", { name: "Reset view" }).click();
  await pass(server.page, 200);
  const reset = await where();
  assert.ok(Math.abs(turned - first) > 8, `${first} and ${turned}`);
  assert.ok(Math.abs(reset - first) < 3, `${first} and ${reset}`);
  await server.page.close();
});

test("a browser that draws slowly asks for fewer pictures", async () => {
  const server = await openPage(browser);
  await server.page.evaluate(() => {
    const quick = window.requestAnimationFrame.bind(window);
    window.requestAnimationFrame = (draw) => quick(() => setTimeout(() => draw(performance.now()), 60));
  });
  server.send(session(LINE));
  await draw(server, picture(LINE, 0));
  for (let i = 1; i < 200 && !server.said.some((message) => message.type === "rate"); i++) {
    server.sendPicture(encodePicture(picture(LINE, i / 60)));
    await pass(server.page, 50);
  }
  assert.deepEqual(server.said.find((message) => message.type === "rate"), { type: "rate", hz: 32 });
  await server.page.close();
});

test("without WebGL there are words in place of the scene, and no error", async () => {
  const context = await browser.newContext();
  await context.addInitScript(() => {
    const any = HTMLCanvasElement.prototype.getContext as (kind: string, ...rest: unknown[]) => RenderingContext | null;
    HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, ...rest: unknown[]) {
      return kind.startsWith("webgl") ? null : any.call(this, kind, ...rest);
    } as typeof HTMLCanvasElement.prototype.getContext;
  });
  const server = await openPage(withPagesOf(context));
  server.send(session(GRASP));
  server.sendPicture(encodePicture(picture(GRASP, 0)));
  await server.page.getByText("WebGL 2 is missing").waitFor();
  assert.equal(await server.page.locator(".view-canvas").isVisible(), false);
  server.send({ type: "taken", user: 0, stiffness_n_per_m: 150, damping_n_s_per_m: 3 });
  await server.page.keyboard.down("ArrowRight");
  // The keys go on working.
  await pass(server.page, 500);
  const last = server.said.findLast((message) => message.type === "point");
  assert.ok(last && (last.targets_m[0]?.[0] ?? 0) > -0.03, JSON.stringify(last));
  assert.deepEqual(server.errors, []);
  await context.close();
});

function withPagesOf(context: BrowserContext): Browser {
  return { newPage: () => context.newPage() } as unknown as Browser;
}
