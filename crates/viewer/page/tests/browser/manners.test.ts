// The page's manners in a real browser: troubles in words, seats, keyboard, contrast, narrow screens.
import { after, before, test } from "node:test";
import assert from "node:assert/strict";
import type { Browser } from "playwright-core";
import { encodePicture } from "../encode.ts";
import { LINE, picture } from "../examples.ts";
import { answers, lesson, SETTINGS } from "../lesson_example.ts";
import { launch, openPage, pass, passUntil, type FakeServer } from "../harness.ts";

let browser: Browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

async function open(size?: { width: number; height: number }): Promise<FakeServer> {
  const server = await openPage(browser, size);
  server.send(lesson());
  server.send({ type: "seats", seats: [
    { user: 0, name: "anna", by: "script" }, { user: 1, name: "ben", by: "browser" }, { user: 2, name: "cleo", by: "free" },
  ] });
  server.send({ type: "settings", settings: SETTINGS, note: "", paused: "" });
  server.sendPicture(encodePicture(picture(LINE, 1)));
  await server.page.waitForSelector(".seats button");
  return server;
}

const saying = (server: FakeServer, selector: string, words: string) =>
  server.page.waitForFunction(([where, what]) => document.querySelector(where!)?.textContent?.includes(what!), [selector, words]);

test("a hand is taken and left, and the page says whose it is", async () => {
  const server = await open();
  const { page } = server;
  await page.click('button[data-user="2"]');
  assert.deepEqual(server.said.filter(({ type }) => type === "take"), [{ type: "take", user: 2 }]);
  server.send({ type: "taken", user: 2, stiffness_n_per_m: 150, damping_n_s_per_m: 3 });
  server.send({ type: "seats", seats: [{ user: 1, name: "ben", by: "browser" }, { user: 2, name: "cleo", by: "you" }] });
  await saying(server, ".mine", "You move cleo's hand.");
  assert.equal(await page.locator('button[data-user="1"]').count(), 0, "another's hand cannot be taken");
  await page.click(".seats >> text=Leave");
  await passUntil(page, () => server.said.some(({ type }) => type === "leave"));
  await pass(page, 100);
  assert.equal(server.said.filter(({ type }) => type === "leave").length, 1);
  server.send({ type: "refused", what: "take", why: "ben has it" });
  await saying(server, "#notices", "This hand cannot be taken: ben has it");
  assert.deepEqual(server.errors, []);
  await page.close();
});

test("when the server goes, the page says so, loses its hand and asks again", async () => {
  const server = await open();
  server.send({ type: "taken", user: 0, stiffness_n_per_m: 150, damping_n_s_per_m: 3 });
  await saying(server, ".mine", "You move anna's hand.");
  server.close(1001, "");
  await saying(server, "#trouble", "The server is gone.");
  await saying(server, "#trouble", "Asking again");
  await server.page.waitForFunction(() => document.querySelector(".mine")!.textContent === "");
  await saying(server, "#header", "Not connected");
  await server.page.close();
});

test("a full session and one that is over are said in the server's words, and the page's", async () => {
  const full = await openPage(browser);
  full.close(1013, "session full: 32 browsers look at it already");
  await saying(full, "#trouble", "Session full: 32 browsers look at it already.");
  await full.page.close();
  const over = await open();
  over.sendPicture(encodePicture({ ...picture(LINE, 2), ended: true }));
  await saying(over, "#header", "Running over");
  over.close(1000, "");
  await saying(over, "#trouble", "The session is over.");
  await over.page.close();
});

test("a server of another version asks for the page to be loaded again", async () => {
  const server = await open();
  server.send({ ...lesson(), version: "another" });
  await saying(server, "#trouble", "The server is another version of the program (another) than this page (test).");
  await Promise.all([server.page.waitForNavigation(), server.page.click("text=Load the page again")]);
  await server.page.close();
});

test("a message that cannot be read ends nothing", async () => {
  const server = await open();
  server.sendPicture(new ArrayBuffer(3));
  await saying(server, "#notices", "could not be read");
  server.sendPicture(encodePicture({ ...picture(LINE, 2), verdict_now: "shaking" }));
  await saying(server, "#header", "Running shaking");
  assert.deepEqual(server.errors, []);
  await server.page.close();
});

test("on a narrow screen nothing is wider than it", async () => {
  const server = await open({ width: 360, height: 700 });
  for (const tab of ["#tab-people", "#tab-lesson"]) {
    await server.page.click(tab);
    await pass(server.page, 100);
    const wide = await server.page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(wide <= 360, `${tab}: ${wide} pixels`);
  }
  await server.page.close();
});

test("everything can be reached by Tab, in the order in which it is seen, with focus to be seen", async () => {
  const server = await open();
  const { page } = server;
  await page.click("#tab-lesson");
  await page.evaluate(() => (document.activeElement as HTMLElement).blur());
  const wanted = await page.evaluate(() => [...document.querySelectorAll<HTMLElement>("button, input, select, a[href]")]
    .filter((found) => found.checkVisibility() && found.tabIndex >= 0 && !(found as HTMLButtonElement).disabled)
    .map((found, index) => { found.dataset["order"] = String(index); return index; }));
  const met = new Set<number>();
  for (let press = 0; press < wanted.length + 20; press++) {
    await page.keyboard.press("Tab");
    const [order, outlined] = await page.evaluate(() => {
      const found = document.activeElement as HTMLElement;
      return [found.dataset["order"], found.matches(":focus-visible") && getComputedStyle(found).outlineStyle !== "none"] as const;
    });
    if (order === undefined) continue;
    assert.ok(outlined, `focus cannot be seen at ${order}`);
    met.add(Number(order));
  }
  assert.deepEqual(wanted.filter((order) => !met.has(order)), []);
  await page.focus("#tab-lesson");
  await page.keyboard.press("ArrowLeft");
  assert.ok(await page.isVisible("#people"));
  await page.close();
});

/** Words whose contrast against what is behind them is under 4.5, with it. Runs in the page. */
function lowContrasts(): string[] {
  const parse = (css: string) => (css.match(/[\d.]+/g) ?? []).map(Number);
  const luminance = ([r = 0, g = 0, b = 0]: number[]) => {
    const [red, green, blue] = [r, g, b].map((value) => value / 255)
      .map((value) => (value <= 0.03928 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4));
    return 0.2126 * red! + 0.7152 * green! + 0.0722 * blue!;
  };
  const behind = (element: Element | null): number[] => {
    if (!element) return [255, 255, 255];
    const found = parse(getComputedStyle(element).backgroundColor);
    return found.length === 4 && found[3] === 0 ? behind(element.parentElement) : found;
  };
  const low: string[] = [];
  for (const element of document.querySelectorAll("header *, #trouble *, #panel *, #notices *")) {
    const own = [...element.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent!.trim());
    if (!own || !(element as HTMLElement).checkVisibility() || element.closest(".unseen, :disabled")) continue;
    const style = getComputedStyle(element);
    const [one, other] = [luminance(parse(element instanceof SVGElement ? style.fill : style.color)), luminance(behind(element))];
    const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    if (contrast < 4.5) low.push(`${contrast.toFixed(2)}: ${element.tagName} ${element.textContent}`);
  }
  return low;
}

test("words stand out from what is behind them, in the light and in the dark", async () => {
  const server = await open();
  const { page } = server;
  let changes = 0;
  await page.exposeFunction("changed", () => { changes++; });
  await page.evaluate(() => document.addEventListener("themechange", () => (window as unknown as { changed(): void }).changed()));
  server.send({ type: "taken", user: 0, stiffness_n_per_m: 150, damping_n_s_per_m: 3 });
  server.send({ type: "news", text: "Somebody came." });
  for (const theme of ["dark", "light"]) {
    await page.selectOption(".theme", theme);
    for (const [tab, stable] of [["#tab-people", true], ["#tab-lesson", true], ["#tab-lesson", false]] as const) {
      await page.click(tab);
      const question = server.said.findLast((message) => message.type === "predict");
      if (question?.type === "predict") {
        answers({ ...question, margin: true }, stable ? SETTINGS : { ...SETTINGS, "coupling.object_object.stiffness_n_per_m": 9000 }).forEach(server.send);
      }
      server.sendPicture(encodePicture({ ...picture(LINE, 2), verdict_now: stable ? "quiet" : "shaking" }));
      await pass(page, 250);
      // Colours fade in the browser's own time.
      await page.waitForFunction(() => document.getAnimations().every(({ playState }) => playState === "finished"));
      assert.deepEqual(await page.evaluate(lowContrasts), [], `${theme} ${tab}`);
    }
  }
  assert.equal(changes, 2);
  await page.close();
});
