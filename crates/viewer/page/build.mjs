// Bundles the page into a folder: index.html, page.js and page.css, each with its gzip form. `node build.mjs FOLDER`
import { build } from "esbuild";
import { copyFile, mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const here = dirname(fileURLToPath(import.meta.url));
const folder = resolve(process.argv[2] ?? "dist");
await mkdir(folder, { recursive: true });
await build({
  absWorkingDir: here,
  entryPoints: { page: "src/main.ts" },
  bundle: true,
  minify: true,
  format: "esm",
  target: ["es2022"],
  outdir: folder,
  legalComments: "eof",
  logLevel: "warning",
});
await copyFile(join(here, "index.html"), join(folder, "index.html"));
for (const name of ["index.html", "page.js", "page.css"]) {
  await writeFile(join(folder, `${name}.gz`), gzipSync(await readFile(join(folder, name)), { level: 9 }));
}
