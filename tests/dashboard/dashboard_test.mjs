// The dashboard as its users have it: simulated cameras, the odometry and the dashboard as
// processes, the page in a browser, an independent client of Foxglove's protocol, and an
// independent subscriber on the bus. SOVO_SCREENSHOTS=FOLDER keeps pictures of every view.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

import { launch, require, until } from "./browser.mjs";

const kSovo = process.env.SOVO;
const kListener = process.env.SOVO_LISTENER;
const kBus = ["--network", "lo"];
const kNs = `e2e_${process.pid}`;
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "dashboard_"));
const processes = new Set();

function start(command, ...args) {
  const child = spawn(command, args, { stdio: ["ignore", "ignore", "pipe"] });
  child.log = "";
  child.stderr.on("data", (data) => (child.log += data));
  child.ended = new Promise((resolve) => child.on("exit", (code) => resolve(code)));
  processes.add(child);
  return child;
}

async function stop(child, signal = "SIGINT") {
  child.kill(signal);
  processes.delete(child);
  return await child.ended;
}

async function startDashboard(...args) {
  const child = start(kSovo, "dashboard", ...kBus, ...args);
  await until(() => /dashboard: (http\S+)/.exec(child.log), `an address in: ${child.log}`);
  child.url = /dashboard: (http:\/\/[\d.:]+\/)/.exec(child.log)[1];
  return child;
}

/** A walk takes half a minute: cameras come again until the test is over. */
function keepCameras() {
  const world = ["--world", "lawn", "--rate", "6", "--restamp"];
  const camera = start(kSovo, "camera", "sim", ...kBus, "--ns", kNs, ...world);
  void camera.ended.then(() => {
    if (processes.delete(camera)) keepCameras();
  });
}

const startVo = () => start(kSovo, "vo", ...kBus, "--ns", kNs);

async function step(name, work) {
  const begin = Date.now();
  await work();
  console.log(`ok: ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`);
}

async function picture(page, name) {
  if (process.env.SOVO_SCREENSHOTS) {
    await page.screenshot({ path: path.join(process.env.SOVO_SCREENSHOTS, `${name}.png`) });
  }
}

const textOf = (page, selector) => page.locator(selector).first().textContent();
const stateOf = (page) => textOf(page, ".state .name");

/** Lines of a TUM file as [stamp, x, y, z]. */
function readTum(text) {
  return text
    .split("\n")
    .filter((line) => line !== "" && !line.startsWith("#"))
    .map((line) => line.split(" ").slice(0, 4).map(Number));
}

async function exportedTrajectory(page) {
  await page.click("text=Tools");
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.click("text=Trajectory, TUM"),
  ]);
  const file = path.join(folder, "page.txt");
  await download.saveAs(file);
  await page.click("text=Plots");
  return readTum(fs.readFileSync(file, "utf8"));
}

/** The page's poses against those that came over the bus, within 1 % of the path. */
async function compareTrajectory(page) {
  const shown = await exportedTrajectory(page);
  const heard = readTum(fs.readFileSync(path.join(folder, "heard.txt"), "utf8"));
  const byStamp = new Map(heard.map((pose) => [pose[0].toFixed(6), pose]));
  const within = heard.filter((p) => p[0] >= shown[0][0] && p[0] <= shown.at(-1)[0]);
  assert.ok(shown.length >= 20, `${shown.length} poses`);
  assert.ok(shown.length >= 0.99 * within.length, `${shown.length} of ${within.length} poses`);
  let [length, worst] = [0, 0];
  shown.forEach((pose, i) => {
    const truth = byStamp.get(pose[0].toFixed(6));
    assert.ok(truth, `stamp ${pose[0]} was never on the bus`);
    worst = Math.max(worst, Math.hypot(...[1, 2, 3].map((k) => pose[k] - truth[k])));
    if (i > 0) length += Math.hypot(...[1, 2, 3].map((k) => pose[k] - shown[i - 1][k]));
  });
  console.log(`    ${shown.length} poses, ${length.toFixed(2)} m, at most ${worst.toExponential(1)} m apart`);
  assert.ok(worst <= 0.01 * length);
}

/** What an independent implementation of the protocol makes of the server. */
async function checkFoxgloveClient(url, subprotocol) {
  const { FoxgloveClient } = require("@foxglove/ws-protocol");
  const { WebSocket } = require("ws");
  const { parse } = require("@foxglove/rosmsg");
  const { MessageReader } = require("@foxglove/rosmsg2-serialization");
  const socket = new WebSocket(url.replace("http", "ws"), [subprotocol]);
  const wanted = {
    odom: (m) => Math.abs(Math.hypot(...["x", "y", "z", "w"].map((k) => m.pose.pose.orientation[k])) - 1) < 1e-6,
    "left/camera_info": (m) => m.k[0] > 0 && m.width > 0,
    points: (m) => m.fields.length === 4 && m.data.length === m.width * m.point_step,
    status: (m) => m.stages.length > 0 && m.received > 0n,
    scaled_odometry: (m) => m.child_frame_id.endsWith("base_link"),
    keyframe: (m) => m.u.length === m.inverse_depth.length,
    tracked_points: (m) => m.u.length > 0,
    calibration: (m) => m.left.fx_fy_cx_cy[0] > 0,
    "left/preview/compressed": (m) => m.data[0] === 0xff && m.data[1] === 0xd8,
  };
  const client = new FoxgloveClient({ ws: socket });
  const channels = new Map();
  const bySubscription = new Map();
  const seen = new Set();
  client.on("advertise", (list) => {
    for (const channel of list) {
      channels.set(channel.topic, channel);
      const name = channel.topic.replace(`/${kNs}/`, "");
      if (!(name in wanted)) continue;
      const reader = new MessageReader(parse(channel.schema, { ros2: true }));
      bySubscription.set(client.subscribe(channel.id), { name, reader });
    }
  });
  client.on("message", ({ subscriptionId, data }) => {
    const { name, reader } = bySubscription.get(subscriptionId);
    if (wanted[name](reader.readMessage(data))) seen.add(name);
  });
  const all = Object.keys(wanted);
  await until(
    () => all.every((name) => seen.has(name)),
    `decoded ${all.filter((n) => !seen.has(n))} of ${[...channels.keys()]}`,
    120,
  );
  for (const topic of channels.keys()) {
    assert.ok(!/\/stereo$|image_raw|image_rect/.test(topic), `${topic} would fill a tether`);
  }
  client.close();
}

async function checkCommands(browser) {
  const token = "0123456789abcdef-e2e";
  const file = path.join(folder, "token");
  fs.writeFileSync(file, `${token}\n`, { mode: 0o600 });
  const dashboard = await startDashboard("--listen", "127.0.0.1:0", "--allow-commands", "--token-file", file);
  assert.equal((await fetch(dashboard.url)).status, 401);
  assert.equal((await fetch(`${dashboard.url}metrics`)).status, 401);
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } });
  const page = await context.newPage();
  page.setDefaultTimeout(120_000);
  await page.goto(`${dashboard.url}?token=${token}`);
  assert.equal(page.url(), dashboard.url, "the token leaves the address");
  const cookie = (await context.cookies()).find((c) => c.name.startsWith("sovo_session"));
  assert.ok(cookie.httpOnly && cookie.sameSite === "Strict");
  await until(async () => (await stateOf(page)) === "Tracking", "tracking");
  await page.click("text=Tools");
  await page.waitForTimeout(1500); // until the odometry's reader is matched
  await page.click("button:has-text('Reset')");
  await picture(page, "confirm");
  await page.click("dialog button:has-text('Cancel')");
  await page.click("button:has-text('Reset')");
  await page.click("dialog button:has-text('Reset')");
  await until(
    async () => (await page.locator(".section").allTextContents()).join().includes("a new segment begins"),
    "the odometry's answer",
  );
  await context.close();
  assert.equal(await stop(dashboard), 0);
}

/** The report of the recording, in the browser: as it is told, and loading nothing. */
async function checkReport(browser, recorder) {
  assert.equal(await stop(recorder), 0, recorder.log);
  const file = path.join(folder, "report.html");
  const report = start(kSovo, "report", path.join(folder, "dive"), "-o", file);
  assert.equal(await report.ended, 0, report.log);
  processes.delete(report);
  const context = await browser.newContext({ viewport: { width: 1280, height: 900 } });
  for (const colorScheme of ["light", "dark"]) {
    const page = await context.newPage();
    const asked = [];
    const told = [];
    page.on("request", (request) => asked.push(request.url()));
    page.on("console", (message) => told.push(message.text()));
    await page.emulateMedia({ colorScheme });
    await page.goto(`file://${file}`);
    assert.deepEqual(asked, [`file://${file}`]);
    assert.deepEqual(told, []);
    assert.ok(parseFloat(await textOf(page, "#distance")) > 1);
    assert.match((await page.locator("#periods").textContent()) ?? "", /Silent/);
    const back = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    assert.equal(back, colorScheme === "light" ? "rgb(255, 255, 255)" : "rgb(18, 21, 24)");
    const drawn = await page.evaluate(() => getComputedStyle(document.querySelector("path.line")).stroke);
    assert.equal(drawn, colorScheme === "light" ? "rgb(11, 98, 176)" : "rgb(93, 178, 255)");
    if (process.env.SOVO_SCREENSHOTS) {
      await page.screenshot({ path: path.join(process.env.SOVO_SCREENSHOTS, `report_${colorScheme}.png`), fullPage: true });
    }
  }
  await context.close();
}

async function pictures(page) {
  if (!process.env.SOVO_SCREENSHOTS) return;
  for (const theme of ["dark", "light"]) {
    if ((await page.getAttribute("html", "data-theme")) !== theme) await page.keyboard.press("d");
    for (const [key, view] of ["1", "2", "3", "4"].map((k, i) => [k, ["orbit", "follow", "top", "side"][i]])) {
      await page.keyboard.press(key);
      await page.waitForTimeout(1500);
      await picture(page, `${view}_${theme}`);
    }
    for (const tab of ["Health", "Tools", "Plots"]) {
      await page.click(`.tabs >> text=${tab}`);
      await page.waitForTimeout(1200);
      await picture(page, `${tab.toLowerCase()}_${theme}`);
    }
    await page.keyboard.press("1");
    for (const [name, width, height] of [["tablet", 1080, 810], ["upright", 810, 1080], ["wide", 1920, 1080]]) {
      await page.setViewportSize({ width, height });
      await page.waitForTimeout(1500);
      await picture(page, `${name}_${theme}`);
    }
    await page.setViewportSize({ width: 1280, height: 720 });
  }
}

async function run() {
  const browser = await launch();
  processes.add({ kill: () => void browser.close() });
  let dashboard = await startDashboard("--listen", "127.0.0.1:0");
  const listener = start(kListener, kNs, path.join(folder, "heard.txt"));
  const recording = ["-o", path.join(folder, "dive"), "--topics=-stereo", "--min-free", "1MB"];
  const recorder = start(kSovo, "record", ...kBus, "--ns", kNs, ...recording);
  await until(() => /recording to/.test(recorder.log), `a recording: ${recorder.log}`);
  let vo = startVo();
  keepCameras();
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, acceptDownloads: true });
  const page = await context.newPage();
  page.setDefaultTimeout(120_000);
  const errors = [];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (m) => m.type() === "error" && !/WebSocket|ERR_CONNECTION/.test(m.text()) && errors.push(m.text()));

  await step("the page connects", async () => {
    await page.goto(dashboard.url);
    await until(async () => (await page.locator("select option").count()) > 0, "a vehicle", 120);
  });
  await step("the page shows tracking, pictures and points", async () => {
    await until(async () => (await stateOf(page)) === "Tracking", "tracking", 180);
    await until(async () => /\d+ points/.test(await textOf(page, ".picture .num")), "tracked points", 120);
    await page.waitForTimeout(1000 * Number(process.env.SOVO_WATCH ?? 8));
    // A busy machine tracks few of the frames.
    const heard = () => readTum(fs.readFileSync(path.join(folder, "heard.txt"), "utf8"));
    const begin = heard().length;
    await until(() => heard().length >= begin + 40, "40 poses more", 120);
  });
  await step("its trajectory is what came over the bus", () => compareTrajectory(page));
  await pictures(page);
  await step("an independent client decodes every type", async () => {
    await checkFoxgloveClient(dashboard.url, "foxglove.websocket.v1");
  });
  await step("metrics tell of the vehicle", async () => {
    const metrics = await (await fetch(`${dashboard.url}metrics`)).text();
    assert.match(metrics, new RegExp(`sovo_vo_received_total\\{vehicle="/${kNs}"\\} \\d+`));
  });
  await step("it survives the odometry's death and return", async () => {
    await stop(vo, "SIGKILL");
    await until(async () => /last heard/.test(await textOf(page, ".state .age")), "the age of stale data");
    await picture(page, "stale");
    vo = startVo();
    await until(async () => (await textOf(page, ".state .age")) === "" && (await stateOf(page)) === "Tracking", "tracking again", 180);
  });
  await step("it survives a cut connection", async () => {
    await stop(dashboard, "SIGKILL");
    await until(async () => (await stateOf(page)) === "Not connected", "the notice that it is cut");
    await picture(page, "cut");
    dashboard = await startDashboard("--listen", new URL(dashboard.url).host);
    await until(async () => (await stateOf(page)) === "Tracking", "tracking again", 120);
  });
  await step("commands need a token and a confirmation", () => checkCommands(browser));
  await step("a report tells of it all and loads nothing", () => checkReport(browser, recorder));
  assert.deepEqual(errors, []);
  await stop(listener);
  assert.equal(await stop(dashboard), 0, dashboard.log);
  await browser.close();
}

let code = 0;
try {
  await run();
} catch (error) {
  console.log(error);
  for (const child of processes) if (child.log) console.log(child.spawnargs.join(" "), "\n", child.log.slice(-2000));
  code = 1;
}
const last = [...processes];
processes.clear();
for (const child of last) child.kill("SIGKILL");
fs.rmSync(folder, { recursive: true, force: true });
process.exit(code);
