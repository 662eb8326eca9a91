// The real program with its page in a real browser. What is asked of real time is only what a busy machine can promise.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { promisify } from "node:util";
import type { Browser, Page } from "playwright-core";
import { decodePicture, type Picture } from "../../src/picture.ts";
import type { ServerMessage } from "../../src/protocol.ts";
import { COTOUCH, launch, startProgram, type Program } from "../harness.ts";

const STIFFNESS = "coupling.remote_hand_object.stiffness_n_per_m";
/** The control's name on the page. */
const STIFFNESS_LABEL = /^distant hand to object: stiffness/i;
const PATIENCE_MS = 60_000;

let browser: Browser;
before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

/** A page of the program, and everything that it was told. */
interface Watching {
  page: Page;
  pictures: Picture[];
  messages: ServerMessage[];
  requests: string[];
  errors: string[];
}

async function watch(program: Program, size = { width: 800, height: 600 }): Promise<Watching> {
  // Everybody comes with a browser of their own.
  const page = await (await browser.newContext({ viewport: size })).newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const watching: Watching = { page, pictures: [], messages: [], requests: [], errors: [] };
  page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
    if (typeof payload === "string") watching.messages.push(JSON.parse(payload) as ServerMessage);
    else watching.pictures.push(decodePicture(Uint8Array.from(payload).buffer));
  }));
  page.on("request", (request) => watching.requests.push(request.url()));
  page.on("pageerror", (error) => watching.errors.push(error.message));
  await page.goto(program.url);
  await page.locator("canvas[data-drawn]").first().waitFor();
  return watching;
}

/** Waits until `holds`; says what was waited for when it does not come. */
async function until(what: string, holds: () => boolean | Promise<boolean>): Promise<void> {
  const end = Date.now() + PATIENCE_MS;
  while (!(await holds())) {
    assert.ok(Date.now() < end, `waited in vain: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

const latest = ({ pictures }: Watching): Picture => pictures.at(-1) ?? assert.fail("no picture yet");
/** Where each host's copy of the object is along x, m. */
const boxes = (watching: Watching): number[] => latest(watching).hosts.map((host) => host.bodies[0]?.position_m[0] ?? NaN);

async function withProgram(args: string[], body: (program: Program) => Promise<void>): Promise<void> {
  const program = await startProgram(...args);
  try {
    await body(program);
  } finally {
    await program.stop();
    for (const context of browser.contexts()) await context.close();
  }
}

/** Whether the page moves the hand of `name`; asks for it where it does not. A page that a busy machine keeps silent loses its hand. */
async function holds({ page }: Watching, name: string): Promise<boolean> {
  if ((await page.getByRole("button", { name: `Leave ${name}'s hand` }).count()) > 0) return true;
  // The button may be gone before it is reached: then the next look sees what came.
  const take = page.getByRole("button", { name: new RegExp(`^Take (back )?${name}'s hand$`) });
  if ((await take.count()) > 0) await take.click({ timeout: 5000 }).catch(() => {});
  return false;
}

async function openLesson({ page }: Watching): Promise<void> {
  await page.getByRole("tab", { name: "Lesson" }).click();
}

async function setNumber({ page }: Watching, label: RegExp, value: number): Promise<void> {
  const field = page.getByRole("spinbutton", { name: label });
  await field.fill(String(value));
  await field.press("Enter");
}

test("the page draws the scene, and asks nobody else for anything", async () => {
  await withProgram(["run", "grasp", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    // What is drawn is read from the screen: many colours where the scene is, not one.
    const shot = await watching.page.locator("canvas[data-drawn]").first().screenshot({ timeout: PATIENCE_MS });
    const colours = await watching.page.evaluate(async (base64) => {
      const image = new Image();
      image.src = `data:image/png;base64,${base64}`;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext("2d")!;
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      const seen = new Set<number>();
      for (let at = 0; at < data.length; at += 4) seen.add((data[at]! >> 4 << 8) | (data[at + 1]! >> 4 << 4) | data[at + 2]! >> 4);
      return seen.size;
    }, shot.toString("base64"));
    assert.ok(colours > 40, `${colours} colours`);
    await until("pictures go on", () => watching.pictures.length > 20);
    assert.equal(latest(watching).hosts.length, 2);
    assert.ok(watching.requests.every((url) => url.startsWith(program.url)), watching.requests.join("\n"));
    assert.deepEqual(watching.errors, []);
  });
});

test("a drag moves the object at every host, two browsers see each other, and leaving lets go", async () => {
  await withProgram(["run", "single-axis", "--no-record", "--duration", "600"], async (program) => {
    const [anna, ben] = [await watch(program), await watch(program)];
    // Each sees that the other's hand is somebody else's. A page that a busy machine keeps from speaking loses its hand.
    await until("each sees the other", async () => {
      const both = [await holds(anna, "anna"), await holds(ben, "ben")].every((held) => held);
      const others = [anna, ben].map(({ page }) => page.getByText("moved by another browser").count());
      return both && (await Promise.all(others)).every((count) => count === 1);
    });
    const from = Math.max(...boxes(anna));
    const box = (await anna.page.locator("canvas[data-drawn]").first().boundingBox()) ?? assert.fail("no canvas");
    const [x, y] = [box.x + 0.4 * box.width, box.y + 0.5 * box.height];
    let dragging = false;
    await until("both copies have moved with the pointer", async () => {
      const held = await holds(anna, "anna");
      if (!held) {
        await anna.page.mouse.up();
      } else if (!dragging) {
        await anna.page.mouse.move(x, y);
        await anna.page.mouse.down();
        await anna.page.mouse.move(x + 0.25 * box.width, y, { steps: 20 });
      }
      dragging = held;
      return boxes(anna).every((at) => at > from + 0.005);
    });
    assert.ok(latest(ben).hosts[0]?.fingers[0]?.target_m, "ben sees where anna's pointer draws her finger");
    await anna.page.mouse.up();
    await ben.page.close();
    await until("ben's hand is the program's again", async () => (await anna.page.getByRole("button", { name: "Take ben's hand" }).count()) === 1);
    await until("anna holds her hand", () => holds(anna, "anna"));
    await anna.page.getByRole("button", { name: "Leave anna's hand" }).click();
    await anna.page.getByRole("button", { name: "Take back anna's hand" }).waitFor();
    assert.ok(latest(anna).hosts.every((host) => !host.diverged));
    assert.deepEqual([...anna.errors, ...ben.errors], []);
  });
});

test("the gauge turns where the analysis says, the session agrees, and settles again", async () => {
  const analyze = async (stiffness: number): Promise<{ stable: boolean; spectral_radius: number }> => {
    const { stdout } = await promisify(execFile)(COTOUCH, ["analyze", "stability", "single-axis", "--set", `${STIFFNESS}=${stiffness}`, "--json"]);
    return JSON.parse(stdout);
  };
  await withProgram(["run", "single-axis", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    await openLesson(watching);
    const gauge = watching.page.locator(".gauge");
    const shows = (verdict: string) => until(`the gauge says ${verdict}`, async () => (await gauge.getAttribute("data-verdict")) === verdict);
    await shows("stable");
    const before = latest(watching).generation;
    // Just below and just above the line that the program's own map draws.
    const { stdout } = await promisify(execFile)(COTOUCH, ["analyze", "stability", "single-axis", "--sweep", `${STIFFNESS}=100..8000:50:log`, "--json"]);
    const line = (JSON.parse(stdout) as { boundary: number[][][] }).boundary.flat().map(([x]) => x ?? NaN).filter((x) => x > 400)[0] ?? assert.fail("no boundary");
    for (const [stiffness, verdict] of [[0.999 * line, "stable"], [1.001 * line, "unstable"]] as const) {
      const { stable, spectral_radius } = await analyze(stiffness);
      assert.equal(stable, verdict === "stable");
      await setNumber(watching, STIFFNESS_LABEL, stiffness);
      await until("the page is told what the command says", () => watching.messages.some((message) =>
        message.type === "verdict" && Math.abs(message.spectral_radius - spectral_radius) < 1e-9));
      await shows(verdict);
    }
    // Well past it, the running session shakes; back below, it settles: the same session all the time.
    await setNumber(watching, STIFFNESS_LABEL, 1.5 * line);
    await until("the session shakes", () => ["shaking", "diverging"].includes(latest(watching).verdict_now ?? ""));
    await setNumber(watching, STIFFNESS_LABEL, 400);
    await shows("stable");
    await until("the session settles", () => latest(watching).verdict_now === "quiet");
    const { generation } = latest(watching);
    assert.ok(generation >= before, `session ${before} became ${generation}`);
    await watching.page.getByText("here").first().waitFor({ state: "attached" });
    assert.deepEqual(watching.errors, []);
  });
});

test("with a hand taken, what is past the line shakes where it is; back, it settles there, and both are told apart", async () => {
  await withProgram(["run", "single-axis", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    await until("the hand is taken", () => holds(watching, "anna"));
    await openLesson(watching);
    const agreement = (words: string) => until(words, async () => (await watching.page.locator("#lesson .agreement").textContent())?.includes(words) ?? false);
    await agreement("Predicted stable – and it is.");
    const before = latest(watching);
    const from = boxes(watching)[0] ?? NaN;
    await setNumber(watching, STIFFNESS_LABEL, 4000);
    await until("it shakes or diverges", () => ["shaking", "diverging"].includes(latest(watching).verdict_now ?? ""));
    const shook = watching.pictures.length;
    await setNumber(watching, STIFFNESS_LABEL, 400);
    await until("it is quiet", () => latest(watching).verdict_now === "quiet");
    await agreement("Predicted stable – and it is.");
    assert.equal(latest(watching).generation, before.generation, "the same session goes on");
    const off = Math.abs((boxes(watching)[0] ?? NaN) - from);
    assert.ok(off < 0.1, `${off} m from where it was`);
    assert.ok(watching.pictures.slice(shook).every(({ hosts }) => hosts.every((host) => !host.diverged)));
    const rows = await watching.page.locator(".trials tbody tr").allTextContents();
    assert.equal(rows.length, 3, rows.join(" / "));
    assert.match(rows[0] ?? "", /^as at first.*stable.*quiet/);
    assert.match(rows[1] ?? "", /4000.*unstable.*(shaking|diverging)/);
    assert.deepEqual(watching.errors, []);
  });
});

test("a balloon gives way at both hosts while hands press it, and the lesson says how stiff it is", async () => {
  await withProgram(["run", "balloon", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    const furthest_m = () => latest(watching).surfaces.map(({ packed, step_m }) =>
      step_m * packed.reduce((most, value, index) => (index % 4 === 3 ? most : Math.max(most, Math.abs(value))), 0));
    await until("both hosts' surfaces give way", () => furthest_m().length === 2 && furthest_m().every((way_m) => way_m > 0.002));
    await until("a finger is held by the surface", () => latest(watching).hosts.some((host) => host.fingers[0]?.proxy_m));
    const scale = watching.page.locator(".view-scale");
    await scale.getByText(/^[0-9.]+ mm$/).waitFor();
    await openLesson(watching);
    await watching.page.locator(".gains dd").first().getByText(/^[0-9.]+ N\/m$/).waitFor();
    const { generation } = latest(watching);
    await watching.page.getByRole("combobox", { name: /^local model/i }).selectOption("p");
    await until("the session has the other local model", () => watching.messages.some((message) =>
      message.type === "settings" && message.settings["local_model.kind"] === "p"));
    assert.equal(latest(watching).generation, generation, "the same session goes on");
    assert.deepEqual(watching.errors, []);
  });
});

test("a setting that needs it begins a session of its own, and what cannot be is said in words", async () => {
  await withProgram(["run", "single-axis", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    await openLesson(watching);
    await watching.page.getByRole("combobox", { name: /^architecture/i }).selectOption("centralized");
    await until("another session has begun", () => latest(watching).generation >= 2);
    const about = () => watching.messages.filter((message) => message.type === "session").at(-1);
    await until("it is centralized", () => { const told = about(); return told?.type === "session" && told.about.architecture === "centralized"; });
    await setNumber(watching, /^users/i, 3);
    await until("it has three users", () => latest(watching).hosts.length === 3);
    const { generation } = latest(watching);
    await watching.page.locator("#lesson").getByRole("button", { name: "Begin again" }).click();
    await until("it has begun again", () => latest(watching).generation > generation);
    const fields = watching.page.locator("#lesson input[type=number]");
    const empty = async () => (await fields.evaluateAll((all) => all.filter((field) => (field as HTMLInputElement).value === ""))).length;
    await until("every control says what the session is set to", async () => (await fields.count()) > 5 && (await empty()) === 0);
    assert.deepEqual(watching.errors, []);
  });
});

test("a browser that does not listen holds up nobody, and nonsense is refused while the session goes on", async () => {
  await withProgram(["run", "single-axis", "--no-record", "--duration", "600"], async (program) => {
    const watching = await watch(program);
    const lateness = async (): Promise<number> => {
      const from = watching.pictures.length;
      await until("a hundred pictures", () => watching.pictures.length > from + 100);
      const late = watching.pictures.slice(from).map(({ hosts }) => hosts[0]?.lateness_us ?? NaN).sort((a, b) => a - b);
      return late[Math.floor(late.length / 2)] ?? NaN;
    };
    const alone = await lateness();
    // One that asks for everything and reads nothing.
    const { hostname, port } = new URL(program.url);
    const deaf = connect(Number(port), hostname);
    deaf.pause();
    deaf.on("error", () => {});
    deaf.write(`GET /live HTTP/1.1\r\nHost: ${hostname}:${port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n`);
    // Other work on the machine makes ticks late for a while; a browser that held the session up would do so for good.
    await until("the session keeps time beside it", async () => (await lateness()) < 20 * alone + 2000);
    deaf.destroy();
    // Nonsense, from a page of the same origin.
    const answers = await watching.page.evaluate(async () => {
      const socket = new WebSocket(`ws://${location.host}/live`);
      const heard: string[] = [];
      await new Promise((resolve) => { socket.onopen = resolve; });
      socket.onmessage = ({ data }) => { if (typeof data === "string" && data.includes("refused")) heard.push(data); };
      const closed = new Promise<{ code: number; reason: string }>((resolve) => { socket.onclose = resolve; });
      for (const text of ["", "{", "[]", '{"type":"take","user":99}', '{"type":"point","targets_m":[[1,2]]}', '{"type":"set","settings":{"object.mesh":"x"}}']) socket.send(text);
      socket.send(new Uint8Array(8));
      while (heard.length < 6) await new Promise((resolve) => socket.addEventListener("message", resolve, { once: true }));
      socket.send("x".repeat(5000));
      const { code, reason } = await closed;
      return { heard, closed: `${code} ${reason}` };
    });
    assert.ok(answers.heard.length >= 6, JSON.stringify(answers));
    // The close frame may be lost when the server goes before it has read all of a long message.
    assert.match(answers.closed, /^1009 .*too long|^1006 $/);
    const then = latest(watching).time_s;
    await until("the session goes on", () => latest(watching).time_s > then + 1);
  });
});

test("a recording replays, alone and beside another", async () => {
  const folder = await mkdtemp(join(tmpdir(), "cotouch-replay-"));
  try {
    const [one, two] = [join(folder, "one.mcap"), join(folder, "two.mcap")];
    for (const [file, scene] of [[one, "grasp"], [two, "single-axis"]] as const) {
      await promisify(execFile)(COTOUCH, ["run", scene, "--virtual", "--duration", "4", "--record", file]);
    }
    for (const files of [[one], [one, two]]) {
      await withProgram(["replay", ...files], async (program) => {
        const watching = await watch(program);
        const drawn = () => watching.page.locator("canvas[data-drawn]").count();
        await until("every recording is drawn", async () => (await drawn()) === files.length);
        const place = async () => Number(await watching.page.getByRole("slider", { name: /time/i }).first().inputValue());
        const play = watching.page.getByRole("button", { name: /^play/i });
        if (await play.count()) await play.first().click();
        const from = await place();
        await until("the time line moves", async () => (await place()) > from);
        assert.deepEqual(watching.errors, []);
        assert.ok(watching.requests.every((url) => url.startsWith(program.url)));
      });
    }
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
});
