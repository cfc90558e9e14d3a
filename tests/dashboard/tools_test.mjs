// What an operator does with the page, fed by made-up vehicles: choose one of several, save what
// was seen, lay a second trajectory beside it, measure, go back in time, lose the connection.
import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

import { launch, skip, until } from "./browser.mjs";
import { frameAt, startFakeVehicle } from "./fake_vehicle.mjs";

const kPage = process.env.SOVO_PAGE;
const kRate = 20;
const kVehicles = ["/sovo", "/tug"];
const kStart = 1_700_000_000;
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "tools_"));

if (!fs.existsSync(path.join(kPage, "index.html"))) skip("the page was not built: npm was missing");
const browser = await launch();
let bus = await startFakeVehicle(kPage, kVehicles);
const context = await browser.newContext({ viewport: { width: 1280, height: 720 }, acceptDownloads: true });
const page = await context.newPage();
page.setDefaultTimeout(120_000);
const errors = [];
page.on("pageerror", (error) => errors.push(error.message));
const textOf = (selector) => page.locator(selector).first().textContent();
const stateName = () => textOf(".state .name");

function send(i, ns = "/sovo", aside = 0) {
  const { status, scaled } = frameAt(i / kRate);
  bus.send("status", status, i / kRate, ns);
  if (!scaled) return undefined;
  const position = { ...scaled.pose.pose.position, x: scaled.pose.pose.position.x + aside };
  const message = { ...scaled, pose: { ...scaled.pose, pose: { ...scaled.pose.pose, position } } };
  bus.send("scaled_odometry", message, i / kRate, ns);
  return { time: kStart + i / kRate, position, orientation: message.pose.pose.orientation, state: status.state };
}

function sail(from, to, ns, aside) {
  const sent = [];
  for (let i = from; i < to; ++i) sent.push(send(i, ns, aside));
  return sent.filter((pose) => pose !== undefined);
}

async function download(label) {
  const [file] = await Promise.all([page.waitForEvent("download"), page.click(`text=${label}`)]);
  const to = path.join(folder, file.suggestedFilename());
  await file.saveAs(to);
  return to;
}

async function savedTum() {
  const text = fs.readFileSync(await download("Trajectory, TUM"), "utf8");
  return text.split("\n").filter((l) => l !== "" && !l.startsWith("#")).map((l) => l.split(" ").map(Number));
}

async function step(name, work) {
  await work();
  console.log(`ok: ${name}`);
}

/** Poses turned by a quarter, moved, and off by `noise` [m] up and down in turn. */
function movedTum(poses, noise) {
  return poses
    .map((p, i) => {
      const { x, y, z } = p.position;
      const at = [-y + 7, x - 3, z + 1 + (i % 2 === 0 ? noise : -noise)];
      return `${p.time.toFixed(6)} ${at.map((n) => n.toFixed(9)).join(" ")} 0 0 0.7071068 0.7071068`;
    })
    .join("\n");
}

async function checkSecondTrajectory(sent) {
  const chooser = page.locator("input[type=file]");
  const told = (words) => until(async () => words.test((await page.locator(".section p").allTextContents()).join()), words);
  for (const noise of [0, 0.25]) {
    const name = `truth_${noise}.txt`;
    await chooser.setInputFiles({ name, mimeType: "text/plain", buffer: Buffer.from(movedTum(sent, noise)) });
    await told(new RegExp(`${name}: laid over the own one; ${noise === 0 ? "0\\.000" : "0\\.2[45]\\d"} m apart`));
  }
  await chooser.setInputFiles({ name: "bad.txt", mimeType: "text/plain", buffer: Buffer.from("1 2 <b>3</b>\n") });
  await until(async () => /bad\.txt: line 1 is not/.test(await page.locator(".notices").textContent()), "a notice");
  await page.selectOption("select[aria-label='second trajectory']", "/tug/odom");
  await told(/tug\/odom: drawn as it is/);
  await until(() => bus.isHeard("/tug/odom"), "a subscription to the other vehicle");
  const offered = await page.locator("select[aria-label='second trajectory'] option").allTextContents();
  assert.ok(!offered.some((name) => name.includes("/sovo/odom")), "the own one is drawn already");
  await page.selectOption("select[aria-label='second trajectory']", "/sovo/map_path");
  await told(/sovo\/map_path: drawn as it is/);
  await until(() => bus.isHeard("/sovo/map_path"), "a subscription to the own places");
  await page.click("button:has-text('None')");
  await told(/Ground truth, a replay/);
  await until(() => !bus.isHeard("/tug/odom"), "the end of that subscription");
}

/** In the plan from above a metre is a number of pixels, which the scale bar shows. */
async function checkRuler() {
  await page.keyboard.press("3");
  await page.keyboard.press("f");
  const scale = async () => {
    const text = await page.locator(".legend .row").last().locator("span").first().textContent();
    const [, number, unit] = /([\d.]+) (c?m)/.exec(text);
    const width = await page.locator(".scale-bar").evaluate((bar) => parseFloat(bar.style.width));
    return (Number(number) * (unit === "cm" ? 0.01 : 1)) / width;
  };
  let before = 0;
  await until(async () => {
    const now = await scale();
    const still = now === before;
    before = now;
    return still;
  }, "the view to come to rest");
  await page.keyboard.press("r");
  const box = await page.locator("canvas.gl").boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.click(x - 120, y - 60);
  await page.mouse.click(x + 40, y + 60);
  const label = /([\d.]+) m +\(/.exec(await until(async () => {
    const text = await textOf(".ruler-label");
    return /m/.test(text) ? text : "";
  }, "a length"));
  const expected = 200 * (await scale());
  assert.ok(Math.abs(Number(label[1]) - expected) < 0.03 * expected, `${label[1]} m, not ${expected}`);
  await page.keyboard.press("Escape");
  await until(() => page.locator(".ruler-label").isHidden(), "the ruler put away");
}

async function run() {
  await page.goto(bus.url);
  await until(() => bus.subscribed(), "subscriptions", 120);
  const sent = sail(0, 400);
  await page.click("text=Tools");
  await step("saves the trajectory as TUM and CSV, and the picture", async () => {
    await until(async () => (await savedTum()).length === sent.length, "all poses");
    (await savedTum()).forEach((line, i) => {
      const { time, position: p, orientation: q } = sent[i];
      const expected = [time, p.x, p.y, p.z, q.x, q.y, q.z, q.w];
      line.forEach((value, k) => assert.ok(Math.abs(value - expected[k]) < 2e-6, `line ${i}: ${line}`));
    });
    const csv = fs.readFileSync(await download("Trajectory, CSV"), "utf8").trim().split("\n");
    assert.equal(csv[0], "time_s,x_m,y_m,z_m,qx,qy,qz,qw,state,segment");
    assert.equal(csv.length, sent.length + 1);
    assert.deepEqual(csv.at(-1).split(",").slice(-2), [String(sent.at(-1).state), "0"]);
    const png = fs.readFileSync(await download("Picture, PNG"));
    assert.equal(png.subarray(1, 4).toString(), "PNG");
    assert.ok(png.readUInt32BE(16) > 300 && png.length > 3000, `${png.length} bytes`);
  });
  await step("lays a second trajectory over it", () => checkSecondTrajectory(sent));
  await step("measures between two points", checkRuler);
  await step("holds the time and goes back", async () => {
    const speed = () => page.locator(".figure .value").allTextContents();
    await page.keyboard.press(" ");
    for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowLeft");
    await page.waitForTimeout(500);
    const held = await speed();
    sail(400, 460);
    await page.waitForTimeout(1000);
    assert.deepEqual(await speed(), held);
    await page.keyboard.press("l");
    await until(async () => (await speed()).join() !== held.join(), "the newest figures");
  });
  await step("keeps what was seen over a cut connection", async () => {
    const seen = (await savedTum()).length;
    const port = Number(new URL(bus.url).port);
    bus.close();
    await until(async () => (await stateName()) === "Not connected", "the notice that it is cut");
    assert.ok(await page.locator(".veil.on").isVisible());
    bus = await startFakeVehicle(kPage, kVehicles, port);
    await until(() => bus.subscribed(), "subscriptions again", 120);
    sail(460, 480);
    await until(async () => (await savedTum()).length === seen + 20, "old poses and new ones");
    await until(async () => /Tracking|Scale/.test(await stateName()), "a state again");
  });
  await step("begins anew with an odometry that was started again", async () => {
    const begin = 480; // under the same camera: stamps go on, the odometry's counts begin anew
    const restarted = [];
    for (let i = begin; i < begin + 60; ++i) {
      const { status, scaled } = frameAt(i / kRate);
      bus.send("status", { ...status, received: BigInt(i - begin), segment: 0 }, i / kRate);
      if (!scaled) continue;
      bus.send("scaled_odometry", { ...scaled, segment: 0 }, i / kRate);
      restarted.push(kStart + i / kRate);
    }
    await until(async () => /started again/.test(await page.locator(".notices").textContent()), "a notice");
    const seen = async () => (await savedTum()).map((line) => line[0]);
    await until(async () => (await seen()).length === restarted.length, "the new poses alone");
    (await seen()).forEach((time, i) => assert.ok(Math.abs(time - restarted[i]) < 1e-6));
  });
  await step("shows another vehicle", async () => {
    const names = await page.locator("select[aria-label=vehicle] option").allTextContents();
    assert.deepEqual([...names].sort(), ["sovo", "tug"]);
    await page.evaluate(() => document.activeElement?.blur());
    await page.keyboard.press("v");
    await until(() => bus.subscribed("/tug"), "subscriptions to the other one");
    assert.match(await page.title(), /tug/);
    const others = sail(0, 50, "/tug", 100);
    await until(async () => (await savedTum()).length === others.length, "its poses alone");
    assert.ok((await savedTum()).every((line, i) => Math.abs(line[1] - others[i].position.x) < 1e-6));
    assert.ok(!bus.isHeard("/sovo/scaled_odometry"));
  });
  assert.deepEqual(errors, []);
}

let code = 0;
try {
  await run();
} catch (error) {
  console.log(error, errors);
  code = 1;
}
await browser.close();
bus.close();
fs.rmSync(folder, { recursive: true, force: true });
process.exit(code);
