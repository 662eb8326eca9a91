// Bundles the tests and runs them with Node's own runner. `node tests/run.mjs unit|browser|program|bench [NAME…]`
//
// unit: plain functions. browser: in a real headless Chromium, with a made-up server. program: there, with the real program.
// bench: what a page costs, with the real program.
import { build } from "esbuild";
import { mkdtemp, readdir, rm } from "node:fs/promises";
import { spawnSync } from "node:child_process";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const [kind = "unit", ...names] = process.argv.slice(2);
const all = (await readdir(join(here, kind))).filter((file) => file.endsWith(".test.ts"));
const chosen = names.length === 0 ? all : all.filter((file) => names.some((name) => file.includes(name)));
if (chosen.length === 0) throw new Error(`no ${kind} tests${names.length ? ` named ${names.join(", ")}` : ""}`);
// Beside node_modules, so that what is not bundled is found.
const folder = await mkdtemp(join(here, "..", "node_modules", ".tests-"));
try {
  await build({
    entryPoints: chosen.map((file) => join(here, kind, file)),
    outdir: folder,
    outExtension: { ".js": ".mjs" },
    bundle: true,
    platform: "node",
    format: "esm",
    target: ["node20"],
    external: ["playwright-core", "esbuild"],
    sourcemap: "inline",
    logLevel: "warning",
  });
  const run = (files, workers) => {
    const bundled = files.map((file) => join(folder, file.replace(/\.ts$/, ".mjs")));
    const flags = ["--enable-source-maps", "--test", `--test-concurrency=${workers}`];
    const result = spawnSync(process.execPath, [...flags, ...bundled], { stdio: "inherit", cwd: join(here, "..") });
    process.exitCode ||= result.status ?? 1;
  };
  // A made-up server and the page's own clock do not mind company; real-time sessions and what is measured do.
  run(chosen, kind === "program" || kind === "bench" ? 1 : 2);
} finally {
  await rm(folder, { recursive: true, force: true });
}
