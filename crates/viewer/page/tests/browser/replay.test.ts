import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser, Page } from "playwright-core";
import { about, eventually } from "./eventually.ts";
import { GRASP, LINE } from "../examples.ts";
import { recording, replaySession, stretch, type Recording } from "../recordings.ts";
import { launch, openPage, pass, type Answer, type FakeServer } from "../harness.ts";

let browser: Browser;
before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

const SIZE = { width: 1280, height: 1000 };

/** Answers as the server does; keeps what was asked for. */
function answers(recordings: readonly Recording[], asked: URL[] = []): Answer {
  return (url) => {
    const found = recordings[Number(/^\/recordings\/(\d+)\/pictures$/.exec(url.pathname)?.[1])];
    if (!found) return null;
    asked.push(url);
    const [from_s, to_s] = ["from_s", "to_s"].map((name) => Number(url.searchParams.get(name))) as [number, number];
    return { status: 200, body: Buffer.from(stretch(found.pictures, from_s, to_s)) };
  };
}

async function open(recordings: readonly Recording[], answer: Answer = answers(recordings)): Promise<FakeServer> {
  const server = await openPage(browser, SIZE, answer);
  server.send(replaySession(recordings));
  await server.page.locator(".replay-bar").waitFor();
  return server;
}

const loaded = (page: Page) => page.waitForFunction(
  () => [...document.querySelectorAll(".replay-strip")].every((strip) =>
    [...strip.children].reduce((sum, part) => sum + parseFloat((part as HTMLElement).style.width), 0) > 99));

async function timeOf(page: Page): Promise<number> {
  const text = await page.locator(".replay-time").innerText();
  const [minutes = NaN, seconds = NaN] = (text.split(" / ")[0] ?? "").split(":").map(Number);
  return 60 * minutes + seconds;
}

/** What a chart's legend says of a line. */
async function value(page: Page, recordingNumber: number, line: string): Promise<number> {
  const item = page.locator(".replay-plots .dashboard").nth(recordingNumber).locator(".legend-item", { hasText: line });
  return parseFloat((await item.first().locator(".legend-value").innerText()).replace("\u2212", "-"));
}

test("a recording is fetched in stretches, plays and stops", async () => {
  const asked: URL[] = [];
  const made = recording(LINE, "line.mcap", 3, 12);
  const { page, errors } = await open([made], answers([made], asked));
  await loaded(page);
  assert.deepEqual(asked.map((url) => Number(url.searchParams.get("from_s"))), [3, 8, 13]);
  assert.equal(await timeOf(page), 0);
  await page.getByRole("button", { name: /^Play/ }).click();
  await eventually(() => timeOf(page), (time_s) => time_s > 0.1);
  await page.getByRole("button", { name: /^Pause/ }).click();
  const stopped = await timeOf(page);
  assert.ok(stopped < 12, `${stopped} s`);
  await pass(page, 200);
  assert.equal(await timeOf(page), stopped);
  assert.deepEqual(errors, []);
  await page.close();
});

test("it goes to any time, and the charts tell the values there", async () => {
  const { page } = await open([recording(LINE, "line.mcap", 3, 12)]);
  await loaded(page);
  await page.locator(".replay-slider").fill("4.5");
  await eventually(() => timeOf(page), about(4.5, 0));
  await eventually(() => value(page, 0, "anna"), about(2 * Math.sin(2 * 7.5), 0.01));
  await page.locator(".replay-slider").blur();
  for (const [keys, time_s] of [
    ["ArrowRight", 4.517], ["ArrowRight", 4.533], ["ArrowLeft", 4.517], ["Shift+ArrowRight", 5.517],
    ["PageDown", 0.517], ["End", 12], ["Home", 0],
  ] as const) {
    await page.keyboard.press(keys);
    await eventually(() => timeOf(page), about(time_s, 0.0015));
  }
  await page.close();
});

test("a click on a chart goes there, and the mark is drawn", async () => {
  const { page } = await open([recording(LINE, "line.mcap", 0, 10)]);
  await loaded(page);
  await eventually(() => page.locator(".replay-plots .panel-time").first().innerText(), (text) => text !== "");
  const plot = page.locator(".replay-plots .u-over").first();
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  assert.ok(box);
  await page.mouse.click(box.x + 0.5 * box.width, box.y + 20);
  await eventually(() => timeOf(page), about(5, 0.1));
  await page.close();
});

test("two recordings share the time line, one later than the other", async () => {
  const { page, errors } = await open([recording(GRASP, "one.mcap", 2, 6), recording(LINE, "two.mcap", 0, 4)]);
  await loaded(page);
  assert.equal(await page.locator(".replay-view").count(), 2);
  const boxes = await Promise.all([0, 1].map((number) => page.locator(".replay-view").nth(number).boundingBox()));
  assert.ok(boxes[0] && boxes[1] && boxes[1].x >= boxes[0].x + boxes[0].width, "side by side");
  assert.match(await page.locator(".replay-time").innerText(), /\/ 0:06\.000/);
  await page.getByLabel(/two.mcap begins/).fill("3");
  await eventually(() => page.locator(".replay-time").innerText(), (text) => text.endsWith("/ 0:07.000"));
  await page.locator(".replay-view").nth(1).getByText("begins in 0:03.000").waitFor();
  await page.locator(".replay-slider").fill("4");
  await eventually(() => value(page, 1, "anna"), about(2 * Math.sin(2 * 1), 0.01));
  await page.locator(".replay-plots").getByLabel("What to plot").first().selectOption({ label: "Lateness" });
  const other = page.locator(".replay-plots .dashboard").nth(1).getByLabel("What to plot").first();
  await eventually(() => other.inputValue(), (chosen) => chosen === "lateness");
  assert.deepEqual(errors, []);
  await page.close();
});

test("trouble is told in words, and playing goes on when it is over", async () => {
  const made = recording(LINE, "line.mcap", 0, 4);
  let broken = true;
  const { page } = await open([made], (url) =>
    (broken ? { status: 500, body: "the recording is cut off at 2 s" } : answers([made])(url)));
  const status = page.locator(".replay-bar .replay-status");
  await status.getByText("line.mcap: the recording is cut off at 2 s. Asking again.").waitFor();
  broken = false;
  await loaded(page);
  await eventually(() => status.innerText(), (text) => text === "");
  await page.close();
});

test("a server that sends something else is told of in words", async () => {
  const made = recording(LINE, "line.mcap", 0, 4);
  const { page } = await open([made], () => ({ status: 200, body: Buffer.from([9, 9]) }));
  await page.getByText("the pictures from 0 s on cannot be read: it ends within a length").waitFor();
  await page.close();
});

test("no recording, no time line, but a sentence", async () => {
  const server = await openPage(browser, SIZE);
  server.send({ ...replaySession([recording(LINE, "line.mcap", 0, 1)]), recordings: [] });
  await server.page.getByText("There is no recording to show.").waitFor();
  await server.page.close();
});
