#!/usr/bin/env node
// What drawing the dashboard's page takes: the full scene (2000 window points, 5000 keyframes, a
// map, four minutes of trajectory), turned by hand while frames, clouds and pictures keep coming.
//
// Usage: bench/dashboard_page.mjs [--page FOLDER] [--seconds N] [--gpu | --fine] [--still]
//          [--tab Plots|Health|Tools] [--hide Map,Keyframes,...] [--trace FILE] [--screenshot FILE]
//
//   --page FOLDER    the built page (build/release/share/sovo/dashboard)
//   --gpu            with this machine's graphics card, if Chromium finds one; else in software
//   --fine           in software, but as finely as with a graphics card
//   --hide LAYERS    without these layers of the room
//   --still          not turned by hand: only the data change
//   --trace FILE     Chromium's own trace of it, for chrome://tracing
//
// Prints frames drawn a second, counted where the page calls WebGL, and for each the draw calls,
// vertices and bytes handed over and the processor time of Chromium's processes. Exit codes: 0
// measured, 1 something failed, 77 no Chromium or no page.
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { parseArgs } from "node:util";

import { launch, root, skip, until } from "../tests/dashboard/browser.mjs";
import { startFakeVehicle } from "../tests/dashboard/fake_vehicle.mjs";
import {
  countDrawing,
  drawingCounts,
  fillScene,
  keepSending,
  processorTime,
  sail,
  turnByHand,
} from "../tests/dashboard/full_scene.mjs";

const { values: options } = parseArgs({
  options: {
    page: { type: "string", default: path.join(root, "build/release/share/sovo/dashboard") },
    seconds: { type: "string", default: "10" },
    gpu: { type: "boolean", default: false },
    fine: { type: "boolean", default: false },
    tab: { type: "string", default: "Plots" },
    hide: { type: "string", default: "" },
    still: { type: "boolean", default: false },
    trace: { type: "string" },
    screenshot: { type: "string" },
  },
});
const kSailed = 240;
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function measure(browser, page) {
  const seconds = Number(options.seconds);
  if (options.trace) await browser.startTracing(page, { path: options.trace });
  const [before, cpuBefore, begin] = [await drawingCounts(page), processorTime(), performance.now()];
  const isDone = () => performance.now() - begin > 1000 * seconds;
  if (options.still) await until(isDone, "the end", 2 * seconds + 60);
  else await turnByHand(page, isDone);
  const [after, cpuAfter] = [await drawingCounts(page), processorTime()];
  const took = (performance.now() - begin) / 1000;
  if (options.trace) await browser.stopTracing();
  const frames = after.frames - before.frames;
  const each = (name) => (after[name] - before[name]) / Math.max(frames, 1);
  const cpu = (kind) => (cpuAfter[kind] - cpuBefore[kind]) / Math.max(frames, 1);
  console.log(
    `${(frames / took).toFixed(1)} frames/s drawn (${frames} in ${took.toFixed(1)} s); each: ` +
      `${each("draws").toFixed(1)} draw calls, ${each("instances").toFixed(0)} instances, ` +
      `${(each("vertices") / 1e3).toFixed(1)} thousand vertices, ${(each("bytes") / 1e3).toFixed(1)} kB handed over, ` +
      `${cpu("gpu").toFixed(0)} ms of the drawing process, ${cpu("page").toFixed(0)} ms of the page's`,
  );
}

/** The page asks the graphics card's name to know whether it is one. */
async function pretendGraphicsCard(page) {
  await page.addInitScript(() => {
    const kind = WebGL2RenderingContext.prototype;
    const { getParameter } = kind;
    const kUnmaskedRenderer = 0x9246;
    kind.getParameter = function (name) {
      return name === kUnmaskedRenderer ? "graphics card" : getParameter.call(this, name);
    };
  });
}

async function run(browser, vehicle) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  page.setDefaultTimeout(120_000);
  await countDrawing(page);
  if (options.fine) await pretendGraphicsCard(page);
  await page.goto(vehicle.url);
  await until(() => vehicle.subscribed(), "subscriptions");
  await sail(vehicle, 0, kSailed);
  await fillScene(vehicle, kSailed);
  await page.click(`.tabs >> text=${options.tab}`);
  for (const layer of options.hide.split(",").filter((name) => name !== "")) {
    await page.click(`.overlay.top >> button:has-text('${layer}')`);
  }
  const end = await keepSending(page, vehicle, kSailed);
  await pause(8000); // until the page has found its pace
  await measure(browser, page);
  if (options.screenshot) await page.screenshot({ path: options.screenshot });
  end();
}

if (!fs.existsSync(path.join(options.page, "index.html"))) skip(`no page in ${options.page}`);
const browser = await launch({ gpu: options.gpu });
const vehicle = await startFakeVehicle(options.page);
let code = 0;
try {
  await run(browser, vehicle);
  console.log(`load of this machine ${os.loadavg()[0].toFixed(1)} on ${os.cpus().length} cores`);
} catch (error) {
  console.error(`dashboard_page: ${error.stack}`);
  code = 1;
}
await browser.close();
vehicle.close();
process.exit(code);
