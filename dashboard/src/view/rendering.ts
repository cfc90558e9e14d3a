/** Whether pictures are drawn by the processor, for want of a graphics card: less must do then. */
export function isSoftwareRendering(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return true;
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = info ? String(context.getParameter(info.UNMASKED_RENDERER_WEBGL)) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

const kFrameMs = 1000 / 30;
/** A browser that is not held up calls again within this time. */
const kFreeGapMs = 40;
const kFreeCostMs = 4;
const kSlowCostMs = 55;
const kEasyCostMs = 20;
const kSlowForMs = 1500;
const kEasyForMs = 8000;
const kLongestEasyMs = 300_000;

/**
 * When to draw, and how finely: at most 30 times a second, and where a frame takes long, so seldom
 * that the rest of the page stays at hand, and with fewer pixels while that lasts.
 */
export class FramePace {
  framesPerSecond = 0;
  /** Whether one pixel is drawn for each of the page, where the screen has more. */
  isCoarse = false;
  private cost = kFreeCostMs;
  private lastTick = NaN;
  private lastDrawn = -Infinity;
  private drewLast = false;
  private slowSince = NaN;
  private easySince = NaN;
  private easyForMs = kEasyForMs;
  private refinedAt = -Infinity;
  private frames: number[] = [];

  /** Each time that the browser is ready for a frame. Returns whether one may be drawn. */
  tick(now: number): boolean {
    const gap = now - this.lastTick;
    this.lastTick = now;
    // A slow frame delays the next: that is what drawing costs, whoever does it. After seconds the
    // page was out of sight.
    if (this.drewLast && gap < 2000) this.learn(now, gap < kFreeGapMs ? kFreeCostMs : gap);
    this.drewLast = false;
    while (this.frames.length > 0 && this.frames[0]! < now - 2000) this.frames.shift();
    this.framesPerSecond = this.frames.length / 2;
    return now - this.lastDrawn >= Math.max(kFrameMs - 4, 1.5 * this.cost);
  }

  /** A frame was drawn in this tick. */
  drew(now: number): void {
    this.lastDrawn = now;
    this.drewLast = true;
    this.frames.push(now);
  }

  private learn(now: number, cost: number): void {
    this.cost = 0.7 * this.cost + 0.3 * cost;
    this.slowSince = this.cost > kSlowCostMs ? this.slowSince || now : NaN;
    this.easySince = this.cost < kEasyCostMs ? this.easySince || now : NaN;
    if (!this.isCoarse && now - this.slowSince > kSlowForMs) {
      this.isCoarse = true;
      // What was too fine once is tried again later and later.
      const wasRefined = now - this.refinedAt < kEasyForMs;
      if (wasRefined) this.easyForMs = Math.min(4 * this.easyForMs, kLongestEasyMs);
    } else if (this.isCoarse && now - this.easySince > this.easyForMs) {
      this.isCoarse = false;
      this.refinedAt = now;
    }
  }
}
