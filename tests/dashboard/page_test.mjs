// The page alone, fed by a made-up vehicle: a long dive must not fill the memory, and a full scene
// must be drawn. What is measured is printed. SOVO_TEST_LONG=1: a whole hour.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";

import { launch, skip, until } from "./browser.mjs";
import { cloudAt, frameAt, keyframeAt, startFakeVehicle } from "./fake_vehicle.mjs";

const kPage = process.env.SOVO_PAGE;
const kRate = 20;
const kMinutes = process.env.SOVO_TEST_LONG ? 60 : 4;
const kKeyframes = 5000;

if (!fs.existsSync(path.join(kPage, "index.html"))) skip("the page was not built: npm was missing");
const browser = await launch();
const vehicle = await startFakeVehicle(kPage);
const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
const errors = [];
page.on("pageerror", (error) => errors.push(error.message));
const memory = await page.context().newCDPSession(page);

async function heapMegabytes() {
  await memory.send("HeapProfiler.collectGarbage");
  const { usedSize, backingStorageSize } = await memory.send("Runtime.getHeapUsage");
  return (usedSize + (backingStorageSize ?? 0)) / 1e6;
}

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const figure = async () => (await page.locator(".figure .value").allTextContents()).join(" ");

/** Sends frames as fast as the page takes them. */
async function sail(fromSeconds, toSeconds) {
  for (let i = Math.round(fromSeconds * kRate); i < toSeconds * kRate; ++i) {
    const { status, scaled, pose, stamp } = frameAt(i / kRate);
    vehicle.send("status", status, i / kRate);
    if (scaled) vehicle.send("scaled_odometry", scaled, i / kRate);
    if (scaled && i % 20 === 0) {
      vehicle.send("keyframe", keyframeAt(i, pose, stamp), i / kRate);
      vehicle.send("points", cloudAt(pose, stamp, 300), i / kRate);
    }
    if (i % 50 === 0) while (vehicle.backlog > 1e6) await pause(20);
  }
}

try {
  const begin = Date.now();
  page.setDefaultTimeout(120_000);
  await page.goto(vehicle.url);
  await until(() => vehicle.subscribed(), "subscriptions", 60);
  console.log(`connected and subscribed after ${Date.now() - begin} ms`);

  const half = 30 * kMinutes;
  await sail(0, half);
  await until(async () => /0\.\d\d|1\.\d\d/.test(await figure()), "figures");
  const middle = await heapMegabytes();
  await sail(half, 2 * half);
  await pause(2000);
  const end = await heapMegabytes();
  console.log(`${kMinutes} minutes of messages: ${middle.toFixed(0)} MB halfway, ${end.toFixed(0)} MB at the end`);
  // What is kept grows with the poses until their limit: 69 bytes each, doubled while growing.
  const poses = half * kRate * 140e-6;
  assert.ok(end < middle + poses + 25, "memory keeps growing");

  for (let k = 0; k < kKeyframes; ++k) {
    const { pose, stamp } = frameAt(2 * half + k / 50);
    vehicle.send("keyframe", { ...keyframeAt(k, pose, stamp), segment: 9 }, 0);
    if (k % 100 === 0) while (vehicle.backlog > 1e6) await pause(20);
  }
  const { pose, stamp } = frameAt(2 * half);
  vehicle.send("points", cloudAt(pose, stamp, 2000), 0);
  await pause(1000);
  await page.click("text=Tools");
  const box = await page.locator("canvas.gl").boundingBox();
  await page.mouse.move(box.x + 300, box.y + 200);
  await page.mouse.down();
  for (let i = 0; i < 80; ++i) {
    await page.mouse.move(box.x + 300 + 2 * i, box.y + 200);
    await pause(50);
  }
  await page.mouse.up();
  const drawn = /(\d+) frames\/s drawn/.exec((await page.locator(".section").allTextContents()).join());
  console.log(`2000 points and ${kKeyframes} keyframes, turned by hand: ${drawn?.[1]} frames a second in software`);
  assert.ok(Number(drawn?.[1]) > 0, "nothing is drawn");
  assert.deepEqual(errors, []);
} finally {
  await browser.close();
  vehicle.close();
}
process.exit(0);
