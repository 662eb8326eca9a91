import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import type { Browser, Download, Locator, Page } from "playwright-core";
import { about as near, eventually } from "./eventually.ts";
import { encodePicture } from "../encode.ts";
import { GRASP, LINE, picture, session } from "../examples.ts";
import { launch, openPage, pass, type FakeServer } from "../harness.ts";

let browser: Browser;
before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

const WIDE = { width: 1280, height: 900 };
const RATE_HZ = 60;

/** Sends the pictures of [from_s, to_s) and waits until the last one is plotted. */
async function play(server: FakeServer, about: typeof GRASP, from_s: number, to_s: number): Promise<void> {
  const send = (number: number) => server.sendPicture(encodePicture(picture(about, number / RATE_HZ)));
  const last = to_s * RATE_HZ - 1;
  for (let number = from_s * RATE_HZ; number < last; number++) send(number);
  // Charts that took long to draw are drawn seldom: long enough after, the last one is due.
  await pass(server.page, 5000);
  send(last);
  await pass(server.page, 200);
}

/** Pixels of the chart in the colour of each of the first two users. */
function userPixels(chart: Locator): Promise<number[]> {
  return chart.locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
    const style = getComputedStyle(document.documentElement);
    const probe = document.createElement("canvas").getContext("2d") as CanvasRenderingContext2D;
    const colours = [["--user-0", "#2563eb"], ["--user-1", "#d97706"]].map(([variable = "", fallback = ""]) => {
      probe.fillStyle = style.getPropertyValue(variable).trim() || fallback;
      probe.fillRect(0, 0, 1, 1);
      return probe.getImageData(0, 0, 1, 1).data;
    });
    const context = canvas.getContext("2d") as CanvasRenderingContext2D;
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    const counts = colours.map(() => 0);
    for (let at = 0; at < data.length; at += 4) {
      colours.forEach((colour, user) => {
        const isClose = [0, 1, 2].every((part) => Math.abs((data[at + part] ?? 0) - (colour[part] ?? 0)) < 12);
        if ((data[at + 3] ?? 0) > 100 && isClose) counts[user] = (counts[user] ?? 0) + 1;
      });
    }
    return counts;
  });
}

const panel = (page: Page, number: number) => page.locator("#plots .panel").nth(number);
const timeOf = async (page: Page) =>
  Number(/[\d.]+/.exec(await panel(page, 0).locator(".panel-time").innerText())?.[0]);

async function saved(download: Promise<Download>, click: Promise<void>): Promise<{ name: string; bytes: Buffer }> {
  const [found] = await Promise.all([download, click]);
  return { name: found.suggestedFilename(), bytes: await readFile(await found.path()) };
}

test("panels draw every user's line in the user's colour, beside each other where there is room", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(GRASP));
  await play(server, GRASP, 0, 8);
  assert.ok(await server.page.locator("#plots .panel").count() >= 2);
  await eventually(() => userPixels(panel(server.page, 1)), (pixels) => pixels.every((count) => count > 200));
  await server.page.setViewportSize({ width: 360, height: 800 });
  await eventually(() => server.page.locator("#plots .panel").count(), (count) => count === 1);
  const box = await panel(server.page, 0).boundingBox();
  assert.ok(box && box.x >= 0 && box.x + box.width <= 360, JSON.stringify(box));
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("every panel can be chosen and says so where it has nothing to show", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(GRASP));
  await play(server, GRASP, 0, 3);
  const what = panel(server.page, 0).getByLabel("What to plot");
  for (const [name, item, value] of [
    ["Energy", "anna 1", /mJ/], ["Round trip", "anna to ben", /0\.200 ms/], ["Jitter", "ben to anna", /0\.050 ms/],
    ["Loss", "ben to anna", /0 %/], ["Lateness", "ben", /µs/],
  ] as const) {
    await what.selectOption({ label: name });
    const line = panel(server.page, 0).locator(".legend-item", { hasText: item });
    assert.match(await line.locator(".legend-value").innerText(), value);
    assert.ok(await panel(server.page, 0).locator(".panel-nothing").isHidden(), name);
  }
  server.send({ ...session({ ...LINE, users: ["anna"], fingers_m: [[[0, 0, 0]]] }), generation: 1 });
  await play(server, { ...LINE, users: ["anna"] }, 0, 1);
  await what.selectOption({ label: "Round trip" });
  assert.equal(await panel(server.page, 0).locator(".panel-nothing").innerText(), "No round trip was measured.");
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("pause stops the charts and continue goes on where the session is", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(LINE));
  await play(server, LINE, 0, 4);
  await server.page.getByRole("button", { name: "Pause" }).click();
  const stopped = await timeOf(server.page);
  const before = await panel(server.page, 0).locator("canvas").screenshot();
  await play(server, LINE, 4, 6);
  assert.equal(await timeOf(server.page), stopped);
  await server.page.mouse.move(5, 5);
  assert.ok(before.equals(await panel(server.page, 0).locator("canvas").screenshot()), "the chart stood still");
  await server.page.getByRole("button", { name: "Continue" }).click();
  await eventually(() => timeOf(server.page), near(6, 0.1));
  await server.page.close();
});

test("dragging zooms all panels, a double click goes back, keys move the cursor", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(LINE));
  await play(server, LINE, 0, 10);
  const plot = panel(server.page, 0).locator(".u-over");
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  assert.ok(box);
  const at = (share: number) => [box.x + share * box.width, box.y + box.height / 2] as const;
  await server.page.mouse.move(...at(0.4));
  await server.page.mouse.down();
  await server.page.mouse.move(...at(0.6), { steps: 4 });
  await server.page.mouse.up();
  const back = server.page.getByRole("button", { name: "Whole window" });
  await back.waitFor();
  await server.page.mouse.move(...at(0.01));
  await eventually(() => timeOf(server.page), near(4, 0.15));
  await server.page.mouse.dblclick(...at(0.5));
  await back.waitFor({ state: "hidden" });
  await server.page.mouse.move(2, 2);
  await panel(server.page, 0).locator(".panel-chart").focus();
  await server.page.keyboard.press("Shift+ArrowLeft");
  await eventually(() => timeOf(server.page), near(9.5, 0.05));
  await server.page.close();
});

test("a hidden line is not drawn", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(GRASP));
  await play(server, GRASP, 0, 8);
  for (const name of ["anna 1", "anna 2", "object at anna"]) {
    await panel(server.page, 1).locator(".legend-item", { hasText: name }).click();
  }
  await eventually(() => userPixels(panel(server.page, 1)), ([anna, ben = 0]) => anna === 0 && ben > 200);
  await server.page.close();
});

test("a table has all numbers, a saved chart is a picture of a good size", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(LINE));
  await play(server, LINE, 0, 20);
  const table = await saved(
    server.page.waitForEvent("download"), panel(server.page, 0).getByRole("button", { name: "CSV" }).click());
  assert.equal(table.name, "cotouch-single-axis-forces.csv");
  const lines = table.bytes.toString("utf8").trimEnd().split("\n");
  assert.equal(lines[0], "time [s],anna x [N],ben x [N]");
  assert.equal(lines.length - 1, 20 * RATE_HZ, "older ones than the window shows, too");
  for (const line of lines.slice(1)) {
    const [time_s = NaN, anna = NaN, ben = NaN] = line.split(",").map(Number);
    for (const force of [anna, ben]) assert.ok(Math.abs(force - 2 * Math.sin(2 * time_s)) < 1e-5, line);
  }
  const chart = await saved(
    server.page.waitForEvent("download"), panel(server.page, 1).getByRole("button", { name: "PNG" }).click());
  assert.equal(chart.name, "cotouch-single-axis-positions.png");
  assert.equal(chart.bytes.subarray(1, 4).toString(), "PNG");
  assert.ok(chart.bytes.readUInt32BE(16) >= 1800 && chart.bytes.readUInt32BE(20) >= 800);
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("a session that begins anew begins new charts; one that goes on keeps them", async () => {
  const server = await openPage(browser, WIDE);
  server.send(session(LINE));
  await play(server, LINE, 0, 5);
  server.send(session(LINE));
  await play(server, LINE, 5, 6);
  const rows = async () => {
    const table = await saved(
      server.page.waitForEvent("download"), panel(server.page, 0).getByRole("button", { name: "CSV" }).click());
    return table.bytes.toString("utf8").trimEnd().split("\n").length - 1;
  };
  assert.equal(await rows(), 6 * RATE_HZ);
  server.send(session(LINE));
  await play(server, LINE, 0, 1);
  assert.equal(await rows(), RATE_HZ);
  await server.page.close();
});
