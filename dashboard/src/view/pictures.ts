import type { TrackedPoints } from "../bus/messages";
import { seconds } from "../bus/messages";
import type { PictureFeed, Vehicle } from "../model/vehicle";
import { element, fixed, setText } from "./dom";

const kStaleMs = 2500;

/** Near is warm, far is cool: 0 to 1. */
export function depthColor(t: number): string {
  const stops = [
    [59, 76, 192],
    [64, 158, 214],
    [82, 208, 168],
    [242, 206, 92],
    [236, 88, 64],
  ];
  const x = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const i = Math.min(Math.floor(x), stops.length - 2);
  const mixed = stops[i]!.map((c, k) => Math.round(c + (stops[i + 1]![k]! - c) * (x - i)));
  return `rgb(${mixed.join(",")})`;
}

const kTones = 24;
const kColors = Array.from({ length: kTones }, (_, i) => depthColor(i / (kTones - 1)));

/** One camera's picture, with the points that are tracked in it when they are of the same frame. */
export class PictureView {
  readonly node = element("div", { class: "picture", tabindex: "0" });
  private readonly canvas = element("canvas");
  private readonly title: HTMLElement;
  private readonly info = element("span", { class: "num" });
  private readonly empty = element("div", { class: "empty" });
  private readonly key = element("div", { class: "depth-key" });
  private drawn = "";

  constructor(
    private readonly side: "left" | "right",
    enlarge: () => void,
  ) {
    this.title = element("span", {}, side === "left" ? "Left" : "Right");
    const caption = element("div", { class: "caption" }, this.title, this.info);
    this.node.append(this.canvas, this.empty, caption);
    if (side === "left") this.node.append(this.key);
    this.node.addEventListener("click", enlarge);
    this.node.title = `${side} camera; click to enlarge`;
  }

  update(vehicle: Vehicle | undefined, time: number, live: boolean): void {
    const feed = vehicle?.[this.side];
    const picture = feed?.at(time);
    this.empty.hidden = picture !== undefined;
    if (!vehicle || !feed || !picture) {
      setText(this.empty, "no preview yet");
      setText(this.info, "");
      this.key.hidden = true;
      this.canvas.width = this.canvas.width || 1;
      return;
    }
    const age = performance.now() - feed.heard;
    this.node.classList.toggle("stale", live && age > kStaleMs);
    const points = this.side === "left" ? matching(vehicle.tracked, picture.time) : undefined;
    setText(this.info, this.describe(feed, points, live, age));
    const size = vehicle.calibration?.[this.side] ?? {
      width: picture.bitmap.width,
      height: picture.bitmap.height,
    };
    const key = `${picture.time}/${points ? points.u.length : -1}/${size.width}`;
    if (key === this.drawn) return;
    this.drawn = key;
    const range = points ? depthRange(points.inverse_depth) : undefined;
    drawPicture(this.canvas, picture.bitmap, size.width, points, range);
    this.showKey(range);
  }

  private describe(
    _feed: PictureFeed,
    points: TrackedPoints | undefined,
    live: boolean,
    age: number,
  ): string {
    if (live && age > kStaleMs) return `${fixed(age / 1000, 0)} s old`;
    return points ? `${points.u.length} points` : "";
  }

  private showKey(range: [number, number] | undefined): void {
    this.key.hidden = range === undefined;
    if (!range) return;
    const bar = element("i");
    bar.style.background = `linear-gradient(90deg, ${kColors.slice().reverse().join(",")})`;
    const metres = (inverse: number) => {
      const d = 1 / Math.max(inverse, 1e-3);
      return d >= 100 ? "100+" : d >= 10 ? d.toFixed(0) : d.toFixed(1);
    };
    this.key.replaceChildren(metres(range[1]), bar, `${metres(range[0])} m`);
  }
}

/** The large picture over the 3D view. */
export class LargePicture {
  readonly node = element("div", { class: "big-picture" });
  side: "left" | "right" | undefined;
  private readonly canvas = element("canvas");

  constructor() {
    this.node.append(this.canvas);
    this.node.addEventListener("click", () => this.show(undefined));
  }

  show(side: "left" | "right" | undefined): void {
    this.side = this.side === side ? undefined : side;
    this.node.classList.toggle("on", this.side !== undefined);
  }

  update(vehicle: Vehicle | undefined, time: number): void {
    if (!this.side || !vehicle) return;
    const picture = vehicle[this.side].at(time);
    if (!picture) return;
    const points = this.side === "left" ? matching(vehicle.tracked, picture.time) : undefined;
    const width = vehicle.calibration?.[this.side].width ?? picture.bitmap.width;
    const range = points ? depthRange(points.inverse_depth) : undefined;
    drawPicture(this.canvas, picture.bitmap, width, points, range);
  }
}

/** The points of this very picture, or of a frame so near that nobody sees the difference. */
function matching(all: TrackedPoints[], time: number): TrackedPoints | undefined {
  let best: TrackedPoints | undefined;
  let least = 0.12;
  for (const points of all) {
    const apart = Math.abs(seconds(points.header.stamp) - time);
    if (apart < least) [best, least] = [points, apart];
  }
  return best;
}

/** Inverse depths that 5 % of the points are below, and above. */
function depthRange(inverse: Float32Array): [number, number] | undefined {
  if (inverse.length < 10) return undefined;
  const sorted = Float32Array.from(inverse).sort();
  const low = sorted[Math.floor(sorted.length * 0.05)]!;
  const high = sorted[Math.floor(sorted.length * 0.95)]!;
  return high > low ? [low, high] : [low * 0.9, low * 1.1 + 1e-6];
}

function drawPicture(
  canvas: HTMLCanvasElement,
  bitmap: ImageBitmap,
  fullWidth: number,
  points: TrackedPoints | undefined,
  range: [number, number] | undefined,
): void {
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) {
    canvas.width = bitmap.width;
    canvas.height = bitmap.height;
  }
  const context = canvas.getContext("2d")!;
  context.drawImage(bitmap, 0, 0);
  if (!points || !range) return;
  const factor = bitmap.width / fullWidth;
  const dot = Math.max(2, bitmap.width / 260);
  const byTone: number[][] = kColors.map(() => []);
  for (let i = 0; i < points.u.length; ++i) {
    const t = (points.inverse_depth[i]! - range[0]) / (range[1] - range[0]);
    byTone[Math.round(Math.min(Math.max(t, 0), 1) * (kTones - 1))]!.push(i);
  }
  // A pixel's centre is a whole number there, and half a pixel further in the canvas.
  const at = (x: number) => (x + 0.5) * factor - dot / 2;
  byTone.forEach((indices, tone) => {
    context.fillStyle = kColors[tone]!;
    for (const i of indices) context.fillRect(at(points.u[i]!), at(points.v[i]!), dot, dot);
  });
}
