// Bundles the page into a folder: index.html, page.js and page.css. `node build.mjs FOLDER`
import { build } from "esbuild";
import { copyFile, mkdir } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const folder = process.argv[2] ?? "dist";
await mkdir(folder, { recursive: true });
await build({
  absWorkingDir: here,
  entryPoints: { page: "src/main.ts" },
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  outdir: join(process.cwd(), folder),
  legalComments: "eof",
  logLevel: "warning",
});
await copyFile(join(here, "index.html"), join(process.cwd(), folder, "index.html"));
