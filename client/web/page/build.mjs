// Checks the types, then bundles main.ts with three.js into out/page.js, beside the page and its style.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdirSync } from "node:fs";
import { build } from "esbuild";

execFileSync(process.execPath, ["node_modules/typescript/bin/tsc", "--project", "tsconfig.json"], { stdio: "inherit" });
mkdirSync("out", { recursive: true });
await build({
  entryPoints: ["main.ts"],
  outfile: "out/page.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2021",
  charset: "ascii",
  legalComments: "eof",
  logLevel: "warning",
});
for (const file of ["index.html", "login.html", "page.css"]) copyFileSync(file, `out/${file}`);
