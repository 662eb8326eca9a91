import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser } from "playwright-core";
import { session } from "../examples.ts";
import { answers, SOFT_CONTROLS } from "../lesson_example.ts";
import { press, SOFT } from "../soft_example.ts";
import { draw, launch, openPage, openTools, pass, type FakeServer } from "../harness.ts";
import { findColours } from "./pixels.ts";

const BLUE: [number, number, number] = [0, 0, 255];
const RED: [number, number, number] = [255, 0, 0];
const PURE = ":root { --user-0: #0000ff !important; --user-1: #ff0000 !important; } .view-legend { display: none !important; }";

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

/** How many pixels of the scene have a dark, reddish colour: the far end of the colour map, however it is lit. */
async function strong(server: FakeServer): Promise<number> {
  const shot = await server.page.locator(".view-canvas").screenshot();
  return server.page.evaluate(async (base64) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d")!;
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) {
      const [r, g, b] = [data[at] ?? 0, data[at + 1] ?? 0, data[at + 2] ?? 0];
      if (r > 1.6 * g && r > 60 && b < r) count += 1;
    }
    return count;
  }, shot.toString("base64"));
}

for (const scheme of ["light", "dark"] as const) {
  test(`a soft object is drawn where it is, and coloured where it gives way (${scheme})`, async () => {
    const server = await openPage(browser);
    await server.page.emulateMedia({ colorScheme: scheme });
    // Hands are out of the way.
    await server.page.addStyleTag({ content: ":root { --user-0: #808080 !important; --user-1: #808080 !important; } .view-legend { display: none !important; }" });
    await server.page.evaluate(() => document.dispatchEvent(new Event("themechange")));
    server.send(session(SOFT));
    await draw(server, press(0, 0));
    const resting = await strong(server);
    await draw(server, press(0.1, 0.019));
    const pressed = await strong(server);
    assert.ok(pressed > resting + 400, `${resting} pixels at rest, ${pressed} when pressed`);
    await server.page.getByText("displacement", { exact: true }).and(server.page.locator(".view-scale span")).waitFor();
    await server.page.getByText("20 mm", { exact: true }).and(server.page.locator(".view-scale span")).waitFor();
    await openTools(server.page);
    await server.page.getByLabel("Colours show").selectOption("stress");
    await server.page.getByText("stress (von Mises)").waitFor();
    await server.page.getByText("5 kPa", { exact: true }).waitFor();
    await server.page.getByLabel("Colours show").selectOption("nothing");
    await server.page.locator(".view-scale").waitFor({ state: "hidden" });
    const plain = await strong(server);
    assert.ok(plain < resting + 50, `${plain} pixels without colours, ${resting} at rest`);
    assert.deepEqual(server.errors, []);
    await server.page.close();
  });
}

test("others' copies are drawn as nets when they are wanted", async () => {
  const server = await openPage(browser);
  await server.page.addStyleTag({ content: PURE });
  await server.page.evaluate(() => document.dispatchEvent(new Event("themechange")));
  server.send(session(SOFT));
  await draw(server, press(0, 0.01));
  const canvas = server.page.locator(".view-canvas");
  const [, without] = await findColours(server.page, canvas, [BLUE, RED]);
  await openTools(server.page);
  await server.page.getByLabel("Others as nets").check();
  await pass(server.page, 300);
  const [, withNet] = await findColours(server.page, canvas, [BLUE, RED]);
  assert.ok((withNet?.count ?? 0) > (without?.count ?? 0), `${without?.count} and ${withNet?.count} pixels`);
  await server.page.close();
});

test("a surface of another object, or none, is the object at rest", async () => {
  const server = await openPage(browser);
  server.send(session(SOFT));
  await draw(server, { ...press(0, 0), surfaces: [] });
  const odd = press(0.1, 0.01);
  odd.surfaces = odd.surfaces.map((surface) => ({ ...surface, packed: new Int16Array(8) }));
  await draw(server, odd);
  await draw(server, press(0.2, 0.01));
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("the lesson of a soft object says its stiffnesses, and its map is of the local model's gains", async () => {
  const server = await openPage(browser);
  server.send({ ...session(SOFT), controls: SOFT_CONTROLS });
  const settings = {
    "local_model.kind": "pi", "local_model.stiffness_ratio": 0.25, "local_model.integral_ratio": 0.1,
    "rates.simulation_hz": "64", "soft.young_pa": 60000, "link.delay_periods": 1,
  };
  server.send({ type: "settings", settings, note: "", paused: "" });
  await server.page.getByRole("tab", { name: "Lesson" }).click();
  await draw(server, press(1, 0.01));
  const numbers = server.page.locator(".gains dd");
  await server.page.getByText("800 N/m", { exact: true }).waitFor();
  assert.deepEqual(await numbers.allTextContents(), ["800 N/m", "200 N/m = 0.25 K_o", "80 N/m = 0.1 K_o"]);
  const asked = server.said.findLast((message) => message.type === "predict");
  assert.ok(asked?.type === "predict");
  assert.deepEqual([asked.map?.x.key, asked.map?.y.key], ["local_model.stiffness_ratio", "local_model.integral_ratio"]);
  answers(asked).filter((answer) => answer.type === "verdict").forEach((answer) => server.send(answer));
  await server.page.getByRole("combobox", { name: /^local model/i }).selectOption("p");
  await pass(server.page, 200);
  const set = server.said.findLast((message) => message.type === "set");
  assert.deepEqual(set, { type: "set", settings: { "local_model.kind": "p" } });
  server.send({ type: "settings", settings: { ...settings, "local_model.kind": "p" }, note: "", paused: "" });
  await draw(server, press(2, 0.01));
  await server.page.getByText("none", { exact: true }).waitFor();
  await server.page.close();
});
