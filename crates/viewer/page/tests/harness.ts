// A headless Chromium, with the page alone (a made-up server) or with the real program.
import assert from "node:assert/strict";
import { spawn, type ChildProcess } from "node:child_process";
import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium, type Browser, type Page, type WebSocketRoute } from "playwright-core";
import type { Picture } from "../src/picture.ts";
import type { PageMessage, ServerMessage } from "../src/protocol.ts";
import { encodePicture } from "./encode.ts";

/** Where the browser is; Debian's place unless CHROMIUM says otherwise. */
const CHROMIUM = process.env["CHROMIUM"] ?? "/usr/bin/chromium";
/** The program under test. */
export const COTOUCH = process.env["COTOUCH"] ?? join(process.cwd(), "../../../target/debug/cotouch");

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: CHROMIUM,
    args: [
      "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking", "--disable-component-update",
      "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    ],
  });
}

/** What a made-up server does with one page. */
export interface FakeServer {
  page: Page;
  /** Everything that the page said. */
  said: PageMessage[];
  /** Called with everything that the page says from now on. */
  hear: (message: PageMessage) => void;
  /** What went wrong in the page. */
  errors: string[];
  send(message: ServerMessage): void;
  sendPicture(bytes: ArrayBuffer): void;
  close(code: number, reason: string): void;
}

const ORIGIN = "http://127.0.0.1:7700";
let bundle: Promise<Map<string, { body: Buffer; contentType: string }>> | null = null;

async function bundled(): Promise<Map<string, { body: Buffer; contentType: string }>> {
  const folder = await mkdtemp(join(tmpdir(), "cotouch-page-"));
  const build = spawn(process.execPath, [join(process.cwd(), "build.mjs"), folder], { stdio: "inherit", cwd: "/" });
  const code = await new Promise((resolve) => build.on("exit", resolve));
  if (code !== 0) throw new Error("the page could not be bundled");
  const read = async (file: string, contentType: string) => ({ body: await readFile(join(folder, file)), contentType });
  const files = new Map([
    ["/", await read("index.html", "text/html")],
    ["/page.js", await read("page.js", "text/javascript")],
    ["/page.css", await read("page.css", "text/css")],
  ]);
  await rm(folder, { recursive: true });
  return files;
}

/** What a made-up server answers to other requests; null for what it does not know. */
export type Answer = (url: URL) => { status: number; body: Buffer | string } | null;

/** Opens the page with a server that says nothing by itself. */
export async function openPage(
  browser: Browser, size = { width: 1280, height: 800 }, answer: Answer = () => null,
): Promise<FakeServer> {
  const files = await (bundle ??= bundled());
  const page = await browser.newPage({ viewport: size });
  // The page's timers and frames are the test's to fire (`pass`), so that no busy machine decides what it sees.
  await page.clock.install();
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  await page.route(`${ORIGIN}/**`, (route) => {
    const url = new URL(route.request().url());
    return route.fulfill(files.get(url.pathname) ?? answer(url) ?? { status: 404, body: "no such file" });
  });
  const said: PageMessage[] = [];
  let server: FakeServer | null = null;
  const { promise: opened, resolve: open } = withResolvers<WebSocketRoute>();
  await page.routeWebSocket(/\/live$/, (socket) => {
    socket.onMessage((text) => {
      const message = JSON.parse(String(text)) as PageMessage;
      said.push(message);
      server?.hear(message);
    });
    open(socket);
  });
  await page.goto(ORIGIN);
  const socket = await opened;
  return server = {
    page, said, errors,
    hear: () => {},
    send: (message) => socket.send(JSON.stringify(message)),
    sendPicture: (bytes) => socket.send(Buffer.from(bytes)),
    close: (code, reason) => void socket.close({ code, reason }),
  };
}

/** Stops the page's time, which runs until then, soon: later where the machine is too busy to stop it sooner. */
export async function stopClock(page: Page): Promise<void> {
  for (let lead_ms = 100; ; lead_ms *= 3) {
    const at = await page.evaluate((lead_ms) => Date.now() + lead_ms, lead_ms);
    try {
      return await page.clock.pauseAt(at);
    } catch (error) {
      // The instant had passed before the page heard of it.
      if (lead_ms > 5000) throw error;
    }
  }
}

/** Lets so much of the page's time pass, with every timer and frame in order, whatever the machine has time for. */
export async function pass(page: Page, time_ms: number): Promise<void> {
  await page.clock.runFor(time_ms);
  // What the page said meanwhile has come when it answers.
  await page.evaluate(() => {});
}

/** Lets the page's time pass until `holds`, ten seconds of it at most. */
export async function passUntil(page: Page, holds: () => boolean): Promise<void> {
  for (let tries = 0; tries < 400 && !holds(); tries++) await pass(page, 25);
  assert.ok(holds(), holds.toString());
}

/** How often the view has been drawn. */
export const drawnSoFar = (page: Page): Promise<number> =>
  page.evaluate(() => Number(document.querySelector("canvas")?.dataset["drawn"] ?? 0));

/** Sends a picture and lets the page draw it, and follow it with the camera. */
export async function draw(server: FakeServer, picture: Picture): Promise<void> {
  const past = await drawnSoFar(server.page);
  server.sendPicture(encodePicture(picture));
  await server.page.waitForFunction((past) => Number(document.querySelector("canvas")?.dataset["drawn"] ?? 0) > past, past);
  await pass(server.page, 200);
}

function withResolvers<T>(): { promise: Promise<T>; resolve: (value: T) => void } {
  let resolve: (value: T) => void = () => {};
  const promise = new Promise<T>((settle) => { resolve = settle; });
  return { promise, resolve };
}

/** Opens what stands over a view, where there was no room for it. */
export async function openTools(page: Page): Promise<void> {
  await page.locator("details.view-tools").evaluateAll((all) => all.forEach((tools) => { (tools as HTMLDetailsElement).open = true; }));
}

/** The real program with its page. */
export interface Program {
  url: string;
  process: ChildProcess;
  /** Everything on standard error so far. */
  errors(): string;
  /** Asks it to end, and waits; gives the exit status and standard output. */
  stop(): Promise<{ status: number | null; output: string }>;
}

/** Starts `cotouch` with these arguments and a page on a free port; waits until it says where. */
export async function startProgram(...args: string[]): Promise<Program> {
  const child = spawn(COTOUCH, [...args, "--serve", "127.0.0.1:0"], { stdio: ["ignore", "pipe", "pipe"] });
  let [output, errors] = ["", ""];
  const ended = new Promise<number | null>((resolve) => child.on("exit", (code) => resolve(code)));
  const url = await new Promise<string>((resolve, reject) => {
    const look = () => {
      const found = /http:\/\/\S+/.exec(output + errors);
      if (found) resolve(found[0]);
    };
    child.stdout?.on("data", (text) => { output += text; look(); });
    child.stderr?.on("data", (text) => { errors += text; look(); });
    child.on("error", reject);
    void ended.then((status) => reject(new Error(`cotouch ended with ${status}: ${errors}`)));
  });
  return {
    url,
    process: child,
    errors: () => errors,
    stop: async () => {
      child.kill("SIGINT");
      return { status: await ended, output };
    },
  };
}
