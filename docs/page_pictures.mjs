// Makes the pictures of the page in this folder, after `cargo build --release` and `npm ci` in crates/viewer/page:
//
//   node docs/page_pictures.mjs [NAME ...]
//
// CHROMIUM names the browser. Sessions run in real time: make them on a computer that does nothing else.
import { spawn } from "node:child_process";
import { createRequire } from "node:module";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const { chromium } = createRequire(here("../crates/viewer/page/package.json"))("playwright-core");

const pictures = [
  { name: "page", scene: "grasp", after_s: 11, tab: "People", legend: true, height: 860 },
  { name: "lesson", scene: "single-axis", after_s: 14, tab: "Lesson", legend: false, height: 900 },
  { name: "balloon", scene: "balloon", after_s: 9, tab: "People", legend: false, height: 860 },
];

/** The address that `run` says its page is on. */
function address(session) {
  return new Promise((resolve, reject) => {
    let said = "";
    const listen = (text) => {
      said += text;
      const found = /http:\/\/\S+/.exec(said);
      if (found) resolve(found[0]);
    };
    session.stdout.on("data", listen);
    session.stderr.on("data", listen);
    session.on("exit", () => reject(new Error(`the session ended:\n${said}`)));
  });
}

async function make(browser, { name, scene, after_s, tab, legend, height }) {
  const session = spawn(here("../target/release/cotouch"),
    ["run", scene, "--serve", "127.0.0.1:0", "--duration", "120", "--no-record"]);
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height } });
    await page.goto(await address(session));
    await page.getByRole("tab", { name: tab }).click();
    const shown = page.locator("details", { hasText: "Legend" }).first();
    if ((await shown.getAttribute("open") !== null) !== legend) await shown.locator("summary").click();
    await page.waitForTimeout(1000 * after_s);
    await page.screenshot({ path: here(`${name}.png`) });
    await page.close();
  } finally {
    session.removeAllListeners("exit");
    session.kill("SIGINT");
  }
}

const wanted = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
for (const picture of pictures.filter(({ name }) => wanted.length === 0 || wanted.includes(name))) {
  await make(browser, picture);
}
await browser.close();
