// What a page costs. `COTOUCH=../../../target/release/cotouch npm run bench`; prints figures, asserts none of them.
import { readFile, readdir } from "node:fs/promises";
import { test } from "node:test";
import { launch, startProgram } from "../harness.ts";

const SECONDS = 10;
/** Of the kernel's clock, in which it counts processor time. */
const TICKS_PER_S = 100;

/** Processor time of the program's threads of this name, s. */
async function processorTime(pid: number, thread: string): Promise<number> {
  let ticks = 0;
  for (const task of await readdir(`/proc/${pid}/task`)) {
    const stat = await readFile(`/proc/${pid}/task/${task}/stat`, "utf8");
    const [, name, rest] = /\((.*)\) (.*)/.exec(stat) ?? [];
    if (name !== thread) continue;
    const fields = (rest ?? "").split(" ");
    ticks += Number(fields[11]) + Number(fields[12]);
  }
  return ticks / TICKS_PER_S;
}

/** Everything that a page at `url` was sent on its WebSocket, from now on. */
async function asPage(url: string, seconds: number): Promise<{ pictures: number; bytes: number }> {
  const browser = await launch();
  try {
    const page = await browser.newPage();
    const sizes: number[] = [];
    page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => {
      if (typeof payload !== "string") sizes.push(payload.length);
    }));
    await page.goto(url);
    await page.waitForTimeout(seconds * 1e3);
    return { pictures: sizes.length, bytes: sizes.reduce((sum, size) => sum + size, 0) };
  } finally {
    await browser.close();
  }
}

test("bundle", async () => {
  const program = await startProgram("run", "grasp", "--no-record", "--duration", "2");
  let all = 0;
  for (const path of ["/", "/page.js", "/page.css"]) {
    const answer = await fetch(program.url + path, { headers: { "Accept-Encoding": "identity" } });
    const whole = (await answer.arrayBuffer()).byteLength;
    const packed = Number((await fetch(program.url + path, { method: "GET" })).headers.get("content-length"));
    all += packed;
    console.log(`${path}: ${whole} bytes, ${packed} compressed`);
  }
  console.log(`bundle: ${(all / 1000).toFixed(1)} kB compressed (goal: under 300)`);
  await program.stop();
});

test("time from start to a drawn scene", async () => {
  const browser = await launch();
  const times: number[] = [];
  for (let round = 0; round < 5; round++) {
    const program = await startProgram("run", "grasp", "--no-record", "--duration", "30");
    const page = await browser.newPage();
    const began = performance.now();
    await page.goto(program.url);
    await page.locator("canvas[data-drawn]").first().waitFor();
    times.push((performance.now() - began) / 1e3);
    await page.close();
    await program.stop();
  }
  times.sort((a, b) => a - b);
  console.log(`page asked for to scene drawn: median ${times[2]?.toFixed(2)} s, ${times.map((s) => s.toFixed(2)).join(" ")} (goal: under 2)`);
  await browser.close();
});

test("what a viewer costs the host", async () => {
  const program = await startProgram("run", "grasp", "--no-record", "--duration", String(SECONDS + 20));
  const pid = program.process.pid ?? 0;
  const before = await processorTime(pid, "viewer");
  const { pictures, bytes } = await asPage(program.url, SECONDS);
  const cost = (await processorTime(pid, "viewer")) - before;
  console.log(`viewer thread: ${cost.toFixed(2)} s of processor time in ${SECONDS} s: ${((100 * cost) / SECONDS).toFixed(2)} % of a core`);
  console.log(`${pictures} pictures of ${(bytes / pictures).toFixed(0)} bytes, ${(pictures / SECONDS).toFixed(1)} a second`);
  await program.stop();
});

