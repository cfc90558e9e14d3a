// Starts Debian's Chromium for tests, or says why that cannot be.
import fs from "node:fs";
import path from "node:path";
import { createRequire } from "node:module";

export const root = path.resolve(path.dirname(new URL(import.meta.url).pathname), "../..");
export const require = createRequire(path.join(root, "dashboard/package.json"));

/** Exit code that the test program takes for "skipped". */
export const kSkipped = 77;

export function skip(why) {
  console.log(`SKIPPED: ${why}`);
  process.exit(kSkipped);
}

export function chromiumPath() {
  return ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((p) =>
    fs.existsSync(p),
  );
}

/** `gpu`: with a graphics card where there is one; else everything is drawn by the processor. */
export async function launch({ gpu = false } = {}) {
  const executablePath = chromiumPath();
  if (!executablePath) skip("no chromium here; scripts/install-deps --dev installs it");
  if (!fs.existsSync(path.join(root, "dashboard/node_modules/playwright-core"))) {
    skip("the page's npm packages are not installed; scripts/build fetches them");
  }
  const { chromium } = require("playwright-core");
  const drawing = gpu
    ? "--enable-gpu --ignore-gpu-blocklist"
    : "--disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader";
  const flags =
    `--no-sandbox ${drawing} --disable-quic ` +
    "--no-first-run --disable-background-networking --disable-component-update --disable-sync";
  return await chromium.launch({ executablePath, headless: true, args: flags.split(" ") });
}

/** Waits until `condition` gives something true; throws `what` after `seconds`. */
export async function until(condition, what, seconds = 60) {
  const end = Date.now() + 1000 * seconds;
  while (Date.now() < end) {
    const value = await condition();
    if (value) return value;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`in ${seconds} s not: ${what}`);
}
