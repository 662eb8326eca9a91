// The lesson in a real browser, with a made-up server that answers its questions.
import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser } from "playwright-core";
import type { PageMessage } from "../../src/protocol.ts";
import { encodePicture } from "../encode.ts";
import { LINE, picture } from "../examples.ts";
import { answers, CONTROLS, K_OBJECTS, K_REMOTE, lesson, radiusAt, SETTINGS } from "../lesson_example.ts";
import { launch, openPage, pass, stopClock, type FakeServer } from "../harness.ts";

const SLIDER = "#control-coupling-object-object-stiffness-n-per-m";
const RADIUS = "#lesson .radius";
const AGREEMENT = "#lesson .agreement";
let browser: Browser;

before(async () => { browser = await launch(); });
after(() => browser.close());

type Kind = PageMessage["type"];
const said = <K extends Kind>(server: FakeServer, type: K) =>
  server.said.filter((message): message is Extract<PageMessage, { type: K }> => message.type === type);

/** A page with its lesson open, whose questions are answered. */
async function openLesson(mayChange = true): Promise<FakeServer> {
  const server = await openPage(browser);
  let running = { ...SETTINGS };
  server.hear = (message) => {
    if (message.type === "predict") answers(message, running).forEach((answer) => server.send(answer));
    if (message.type !== "set") return;
    running = { ...running, ...message.settings };
    server.send({ type: "settings", settings: running, note: "", paused: "" });
  };
  server.send(lesson(mayChange));
  server.send({ type: "settings", settings: SETTINGS, note: "", paused: "" });
  server.sendPicture(encodePicture(picture(LINE, 1)));
  await server.page.click("#tab-lesson");
  await server.page.waitForFunction((radius) => /^\d/.test(document.querySelector(radius)?.textContent ?? ""), RADIUS);
  return server;
}

const saying = (server: FakeServer, selector: string, words: string) =>
  server.page.waitForFunction(([where, what]) => document.querySelector(where!)?.textContent?.includes(what!), [selector, words]);

test("a slider past the line: the session is set, the question asked, the gauge turns, the session shakes; and back", async () => {
  const server = await openLesson();
  const { page } = server;
  await saying(server, AGREEMENT, "Predicted stable – and it is.");
  await page.focus(SLIDER);
  await page.keyboard.press("End");
  await page.waitForSelector('.gauge[data-verdict="unstable"]');
  await page.waitForFunction(() => document.querySelector(".gauge .needle")!.getAttribute("style")!.includes("rotate(6"));
  assert.deepEqual(said(server, "set").at(-1)!.settings, { [K_OBJECTS]: 10000 });
  assert.equal(said(server, "predict").at(-1)!.settings[K_OBJECTS] ?? 10000, 10000);
  assert.equal(await page.textContent(RADIUS), radiusAt(10000, 400).toFixed(4));
  await saying(server, AGREEMENT, "it has not shaken yet");
  server.sendPicture(encodePicture({ ...picture(LINE, 2), verdict_now: "shaking", fast_force_n: 2 }));
  await saying(server, AGREEMENT, "Predicted unstable – and it shakes.");
  await saying(server, "#lesson .force", "2 N above 8 Hz");
  await saying(server, "#header", "Running shaking");

  await page.keyboard.press("Home");
  await page.waitForSelector('.gauge[data-verdict="stable"]');
  server.sendPicture(encodePicture(picture(LINE, 3)));
  await saying(server, AGREEMENT, "Predicted stable – and it is.");
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("what begins the session anew is set when it is let go; the others at once", async () => {
  const server = await openLesson();
  await server.page.selectOption("#control-session-architecture", "centralized");
  await pass(server.page, 200);
  assert.deepEqual(said(server, "set").map(({ settings }) => settings), [{ "session.architecture": "centralized" }]);
  // Three presses are one move of the control, however long the machine takes for them.
  await stopClock(server.page);
  await server.page.focus("#control-link-delay-periods");
  for (let press = 0; press < 3; press++) await server.page.keyboard.press("ArrowRight");
  assert.equal(said(server, "set").length, 1);
  await pass(server.page, 900);
  assert.deepEqual(said(server, "set").at(-1)!.settings, { "link.delay_periods": 4 });
  await server.page.locator("#lesson").getByText("Begin again").click();
  await pass(server.page, 100);
  assert.equal(said(server, "again").length, 1);
  await server.page.close();
});

test("the map shows where the settings are; a click sets both", async () => {
  const server = await openLesson();
  const box = (await server.page.locator("#lesson .map").boundingBox())!;
  const pixel = (x: number, y: number) => server.page.locator("#lesson .map").evaluate((canvas, place) => {
    const map = canvas as HTMLCanvasElement;
    const scale = map.width / map.clientWidth;
    return [...map.getContext("2d")!.getImageData(Math.round(place.x * scale), Math.round(place.y * scale), 1, 1).data];
  }, { x, y });
  await pass(server.page, 400);
  const [stable, unstable] = [await pixel(60, box.height - 40), await pixel(box.width - 20, 20)];
  assert.ok(stable[1]! > stable[0]! + 10, `green below: ${stable}`);
  assert.ok(unstable[0]! > unstable[1]! + 10, `red above: ${unstable}`);

  await server.page.mouse.click(box.x + box.width - 30, box.y + 30);
  await server.page.waitForSelector('.gauge[data-verdict="unstable"]');
  // The second of the two is set a tenth of a second later.
  await pass(server.page, 300);
  const sent = Object.assign({}, ...said(server, "set").map(({ settings }) => settings)) as Record<string, number>;
  assert.ok(sent[K_OBJECTS]! > 5000 && sent[K_REMOTE]! > 1000, JSON.stringify(sent));
  const label = await server.page.getAttribute("#lesson .map", "aria-label");
  assert.ok(label?.includes(`you are at ${sent[K_OBJECTS]}`), label ?? "");
  const cross = await pixel(box.width - 30, 30);
  assert.ok(cross[2]! > cross[0]! + 60, `the cross's blue: ${cross}`);
  await server.page.close();
});

test("who may not change the session asks what if; nothing is set, and the session's own changes still show", async () => {
  const server = await openLesson(false);
  await server.page.focus(SLIDER);
  await server.page.keyboard.press("End");
  await saying(server, AGREEMENT, "What if: predicted unstable.");
  server.send({ type: "settings", settings: { ...SETTINGS, [K_OBJECTS]: 500, [K_REMOTE]: 77 }, note: "", paused: "" });
  await server.page.waitForFunction(() =>
    document.querySelector<HTMLInputElement>("#control-coupling-remote-hand-object-stiffness-n-per-m-number")!.value === "77");
  assert.equal(await server.page.inputValue(`${SLIDER}-number`), "10000");
  assert.equal(said(server, "set").length, 0);
  assert.ok(await server.page.locator("#lesson").getByText("Begin again").isHidden());
  await server.page.close();
});

test("what another browser sets moves the controls; what is refused is said and taken back", async () => {
  const server = await openLesson();
  server.send({ type: "settings", settings: { ...SETTINGS, [K_OBJECTS]: 5000 }, note: "The delay is 2 periods, as the link needs.", paused: "" });
  await saying(server, "#lesson .note", "as the link needs");
  assert.equal(await server.page.inputValue(`${SLIDER}-number`), "5000");
  server.send({ type: "settings", settings: SETTINGS, note: "", paused: "" });
  await server.page.fill("#control-object-damping-n-s-per-m-number", "5");
  server.send({ type: "refused", what: "set", why: "the object is fixed" });
  await saying(server, "#notices", "This cannot be set: the object is fixed");
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("answers to older questions change nothing, and what failed is said", async () => {
  const server = await openLesson();
  const before = await server.page.textContent(RADIUS);
  server.send({ type: "verdict", id: 0, stable: false, whole: true, spectral_radius: 3, period_s: 1, modes: [], warnings: [] });
  await pass(server.page, 150);
  assert.equal(await server.page.textContent(RADIUS), before);
  const id = said(server, "predict").at(-1)!.id;
  server.send({ type: "failed", id, what: "margin", why: "it would take too long" });
  await saying(server, "#lesson", "No margins: it would take too long");
  server.send({ type: "failed", id, what: "verdict", why: "the scene has no loop" });
  await saying(server, AGREEMENT, "No prediction: the scene has no loop");
  await server.page.close();
});

test("every control has a name, and its words of help", async () => {
  const server = await openLesson();
  for (const control of CONTROLS) {
    const field = server.page.locator(`[data-key="${control.key}"]`);
    assert.ok((await field.locator("label").textContent())?.startsWith(control.label));
    assert.ok((await field.locator(".unseen").textContent())?.includes(control.help));
  }
  await server.page.close();
});

test("a number that a control does not allow is refused with what it allows", async () => {
  const server = await openLesson();
  const field = `${SLIDER}-number`;
  await server.page.fill(field, "20000");
  await server.page.press(field, "Enter");
  await saying(server, "#lesson .help-line", "cannot be 20000: it goes from 10 to 10000 N/m.");
  assert.equal(await server.page.inputValue(field), "300");
  assert.equal(await server.page.getAttribute(field, "aria-invalid"), "true");
  await server.page.fill("#control-session-users-number", "2.5");
  await server.page.press("#control-session-users-number", "Enter");
  await saying(server, "#lesson .help-line", "whole number from 2 to 8");
  assert.equal(said(server, "set").length, 0);
  await server.page.fill(field, "500");
  await server.page.press(field, "Enter");
  await server.page.waitForFunction((id) => document.querySelector(id)!.getAttribute("aria-invalid") === "false", field);
  assert.deepEqual(said(server, "set").at(-1)!.settings, { [K_OBJECTS]: 500 });
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("what was tried is told setting by setting: what was predicted, and what the session did", async () => {
  const server = await openLesson();
  const { page } = server;
  const show = (time_s: number, verdict: "quiet" | "shaking") =>
    server.sendPicture(encodePicture({ ...picture(LINE, time_s), verdict_now: verdict }));
  for (let time_s = 1; time_s <= 3; time_s += 0.5) show(time_s, "quiet");
  await page.focus(SLIDER);
  await page.keyboard.press("End");
  await page.waitForSelector('.gauge[data-verdict="unstable"]');
  for (let time_s = 3.5; time_s <= 6; time_s += 0.5) show(time_s, "shaking");
  await page.keyboard.press("Home");
  await page.waitForSelector('.gauge[data-verdict="stable"]');
  // What shook before has a second in which to die out.
  show(6.5, "shaking");
  for (let time_s = 7.5; time_s <= 9; time_s += 0.5) show(time_s, "quiet");
  await page.waitForFunction(() => document.querySelectorAll(".trials tbody tr").length === 3
    && document.querySelector(".trials tbody tr:last-child")!.textContent!.endsWith("quiet"));
  const rows = await page.locator(".trials tbody tr").allTextContents();
  assert.deepEqual(rows, [
    "as at firststablequiet", "Copy to copy, stiffness 10000 N/munstableshaking", "Copy to copy, stiffness 10 N/mstablequiet",
  ]);
  assert.deepEqual(server.errors, []);
  await page.close();
});

test("a session that was stopped says why and offers to begin again", async () => {
  const server = await openLesson();
  const line = server.page.locator("#paused");
  assert.ok(await line.isHidden());
  server.send({ type: "settings", settings: SETTINGS, note: "", paused: "the session shook against its force limits" });
  await saying(server, "#paused", "The session shook against its force limits.");
  await line.getByRole("button", { name: "Begin again" }).click();
  await pass(server.page, 100);
  assert.equal(said(server, "again").length, 1);
  server.send({ type: "settings", settings: SETTINGS, note: "", paused: "" });
  await line.waitFor({ state: "hidden" });
  await server.page.close();
});
