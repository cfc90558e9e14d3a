// The page alone, fed by a made-up vehicle: a long dive must not fill the memory, and a full scene
// must be drawn, with few calls, by parts that are new, and only when something changes. What is
// measured is printed. SOVO_TEST_LONG=1: a whole hour.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";

import { launch, skip, until } from "./browser.mjs";
import { startFakeVehicle } from "./fake_vehicle.mjs";
import {
  countDrawing,
  drawingCounts,
  fillScene,
  keepSending,
  kKeyframes,
  kRate,
  sail,
  turnByHand,
} from "./full_scene.mjs";

const kPage = process.env.SOVO_PAGE;
const kMinutes = process.env.SOVO_TEST_LONG ? 60 : 4;
const kHalf = 30 * kMinutes;

if (!fs.existsSync(path.join(kPage, "index.html"))) skip("the page was not built: npm was missing");
const browser = await launch();
const vehicle = await startFakeVehicle(kPage);
const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
const errors = [];
page.on("pageerror", (error) => errors.push(error.message));
page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
const memory = await page.context().newCDPSession(page);

async function heapMegabytes() {
  await memory.send("HeapProfiler.collectGarbage");
  const { usedSize, backingStorageSize } = await memory.send("Runtime.getHeapUsage");
  return (usedSize + (backingStorageSize ?? 0)) / 1e6;
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const figure = async () => (await page.locator(".figure .value").allTextContents()).join(" ");

async function checkMemory() {
  await sail(vehicle, 0, kHalf);
  await until(async () => /0\.\d\d|1\.\d\d/.test(await figure()), "figures");
  const middle = await heapMegabytes();
  await sail(vehicle, kHalf, 2 * kHalf);
  await pause(2000);
  const end = await heapMegabytes();
  console.log(`${kMinutes} minutes of messages: ${middle.toFixed(0)} MB halfway, ${end.toFixed(0)} MB at the end`);
  // What is kept grows with the poses until their limit: 69 bytes each, doubled while growing.
  const poses = kHalf * kRate * 140e-6;
  assert.ok(end < middle + poses + 25, "memory keeps growing");
}

/** The full scene while it is turned and data come: what each frame hands over. */
async function checkDrawing() {
  await fillScene(vehicle, 2 * kHalf);
  await page.click("text=Tools");
  const end = await keepSending(page, vehicle, 2 * kHalf);
  await pause(3000);
  const before = await drawingCounts(page);
  const begin = performance.now();
  const isDone = () => performance.now() - begin > 5000;
  await turnByHand(page, isDone);
  await until(async () => (await drawingCounts(page)).frames >= before.frames + 10, "ten frames", 120);
  const after = await drawingCounts(page);
  const took = (performance.now() - begin) / 1000;
  end();
  const frames = after.frames - before.frames;
  const each = (name) => (after[name] - before[name]) / frames;
  console.log(
    `2000 points and ${kKeyframes} keyframes, turned by hand: ${(frames / took).toFixed(1)} frames a second in ` +
      `software; each ${each("draws").toFixed(1)} draw calls, ${each("vertices").toFixed(0)} vertices`,
  );
  // With the pictures come the draw calls that reduce them.
  assert.ok(each("draws") < 30, `${each("draws")} draw calls a frame`);
  assert.equal(each("instances"), 0, "a processor that draws pays for each instance as for a call");
  assert.ok(each("vertices") < 60_000, `${each("vertices")} vertices a frame`);
  // Each second: a window of points, the marks of keyframes, pictures of the marker, little else.
  const bytes = (after.bytes - before.bytes) / took;
  assert.ok(bytes < 2e6, `${bytes} bytes a second handed over`);
}

async function checkStillness() {
  await until(async () => {
    const before = await drawingCounts(page);
    await pause(1500);
    return (await drawingCounts(page)).frames === before.frames;
  }, "that nothing is drawn while nothing changes");
  const before = await drawingCounts(page);
  await sail(vehicle, 2 * kHalf + 600, 2 * kHalf + 601);
  await until(async () => (await drawingCounts(page)).frames > before.frames, "what is new");
}

try {
  const begin = Date.now();
  page.setDefaultTimeout(120_000);
  await countDrawing(page);
  await page.goto(vehicle.url);
  await until(() => vehicle.subscribed(), "subscriptions", 60);
  console.log(`connected and subscribed after ${Date.now() - begin} ms`);
  await checkMemory();
  await checkDrawing();
  await checkStillness();
  assert.deepEqual(errors, []);
} finally {
  await browser.close();
  vehicle.close();
}
process.exit(0);
