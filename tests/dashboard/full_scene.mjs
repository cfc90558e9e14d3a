// The fullest scene that the page promises to draw, data that keep coming, and what drawing it
// takes, counted where the page hands its work to the graphics card.
import fs from "node:fs";

import { cloudAt, frameAt, keyframeAt } from "./fake_vehicle.mjs";

export const kRate = 20;
export const kKeyframes = 5000;
export const kPoints = 2000;

const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Sends frames as fast as the page takes them, a keyframe and `numPoints` points each second. */
export async function sail(vehicle, fromSeconds, toSeconds, numPoints = 300) {
  for (let i = Math.round(fromSeconds * kRate); i < toSeconds * kRate; ++i) {
    sendFrame(vehicle, i, numPoints);
    if (i % 50 === 0) while (vehicle.backlog > 1e6) await pause(20);
  }
}

function sendFrame(vehicle, i, numPoints) {
  const { status, scaled, pose, stamp } = frameAt(i / kRate);
  vehicle.send("status", status, i / kRate);
  if (!scaled) return;
  vehicle.send("scaled_odometry", scaled, i / kRate);
  if (i % kRate !== 0) return;
  vehicle.send("keyframe", keyframeAt(i, pose, stamp), i / kRate);
  vehicle.send("points", cloudAt(pose, stamp, numPoints), i / kRate);
}

/** Keyframes and window points, about where the vehicle is after `seconds`. */
export async function fillScene(vehicle, seconds) {
  for (let k = 0; k < kKeyframes; ++k) {
    const { pose, stamp } = frameAt(seconds + k / 50);
    vehicle.send("keyframe", { ...keyframeAt(k, pose, stamp), segment: 9 }, 0);
    if (k % 100 === 0) while (vehicle.backlog > 1e6) await pause(20);
  }
  const { pose, stamp } = frameAt(seconds);
  vehicle.send("points", cloudAt(pose, stamp, kPoints), 0);
}

/** A noisy picture as JPEG, made by the browser. */
async function jpeg(page, width, height) {
  const text = await page.evaluate(([w, h]) => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [w, h];
    const context = canvas.getContext("2d");
    for (let k = 0; k < 4000; ++k) {
      context.fillStyle = `hsl(90 20% ${Math.round(100 * Math.random())}%)`;
      context.fillRect(w * Math.random(), h * Math.random(), 9, 9);
    }
    return canvas.toDataURL("image/jpeg", 0.7).split(",")[1];
  }, [width, height]);
  return Buffer.from(text, "base64");
}

/** Frames, clouds and pictures at their usual rates from `seconds` on; returns how to end that. */
export async function keepSending(page, vehicle, seconds) {
  const left = await jpeg(page, 640, 480);
  const right = await jpeg(page, 320, 240);
  const random = (most) => Array.from({ length: 1500 }, () => most * Math.random());
  const begin = performance.now();
  let i = Math.round(seconds * kRate);
  const sendDue = () => {
    for (; i < (seconds + (performance.now() - begin) / 1000) * kRate; ++i) {
      sendFrame(vehicle, i, kPoints);
      const header = { stamp: frameAt(i / kRate).stamp, frame_id: "left" };
      if (i % 4 === 0) {
        vehicle.send("left/preview/compressed", { header, format: "jpeg", data: left }, i / kRate);
        const points = { header, u: random(640), v: random(480), inverse_depth: random(1) };
        vehicle.send("tracked_points", points, i / kRate);
      }
      if (i % 10 !== 0) continue;
      vehicle.send("right/preview_small/compressed", { header, format: "jpeg", data: right }, i / kRate);
    }
  };
  const timer = setInterval(sendDue, 1000 / kRate);
  return () => clearInterval(timer);
}

/** Before the page is opened: counts what every WebGL context is given, a frame of the browser each. */
export async function countDrawing(page) {
  await page.addInitScript(() => {
    const counts = { frames: 0, draws: 0, instances: 0, vertices: 0, bytes: 0 };
    globalThis.drawingCounts = counts;
    const kind = WebGL2RenderingContext.prototype;
    const sizeOf = (data) => (typeof data === "number" ? 0 : (data?.byteLength ?? 4 * (data?.width ?? 0) * (data?.height ?? 0)));
    const watch = (name, count) => {
      const original = kind[name];
      kind[name] = function (...given) {
        count(given);
        return original.apply(this, given);
      };
    };
    let inFrame = false;
    const draw = (vertices, instances) => {
      counts.draws += 1;
      counts.vertices += vertices;
      counts.instances += instances;
      if (inFrame) return;
      inFrame = true;
      counts.frames += 1;
      requestAnimationFrame(() => (inFrame = false));
    };
    watch("drawArrays", ([, , count]) => draw(count, 0));
    watch("drawElements", ([, count]) => draw(count, 0));
    watch("drawArraysInstanced", ([, , count, instances]) => draw(count * instances, instances));
    watch("drawElementsInstanced", ([, count, , , instances]) => draw(count * instances, instances));
    watch("bufferData", ([, data]) => (counts.bytes += sizeOf(data)));
    // The three.js way to give a part: (target, offset, array, first, length).
    watch("bufferSubData", ([, , data, , length]) => {
      counts.bytes += length ? length * (data.BYTES_PER_ELEMENT ?? 1) : sizeOf(data);
    });
    watch("texImage2D", (given) => (counts.bytes += sizeOf(given.at(-1))));
    watch("texSubImage2D", (given) => (counts.bytes += sizeOf(given.at(-1))));
  });
}

export const drawingCounts = (page) => page.evaluate(() => ({ ...globalThis.drawingCounts }));

/** Turns the 3D view by hand until `isDone()`. */
export async function turnByHand(page, isDone) {
  const box = await page.locator("canvas.gl").boundingBox();
  const [x, y] = [box.x + 300, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 0; !isDone(); ++i) {
    await page.mouse.move(x + 150 * Math.sin(i / 30), y + 10 * Math.sin(i / 50));
    await pause(33);
  }
  await page.mouse.up();
}

/** Processor time [ms] that Chromium's processes of this test have taken, by their kind. */
export function processorTime() {
  const times = { gpu: 0, page: 0 };
  for (const pid of fs.readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const command = fs.readFileSync(`/proc/${pid}/cmdline`, "utf8");
      const kind = /--type=(gpu-process|renderer)/.exec(command)?.[1];
      if (!kind || !isOurs(pid)) continue;
      const fields = statOf(pid);
      times[kind === "renderer" ? "page" : "gpu"] += 10 * (Number(fields[11]) + Number(fields[12]));
    } catch {
      // A process that has ended since.
    }
  }
  return times;
}

/** The fields after the name, which may hold anything. */
function statOf(pid) {
  return fs.readFileSync(`/proc/${pid}/stat`, "utf8").replace(/^.*\) /s, "").split(" ");
}

function isOurs(pid) {
  for (let at = Number(pid); at > 1; at = Number(statOf(at)[1])) if (at === process.pid) return true;
  return false;
}
