import type { Vehicle } from "../model/vehicle";
import { kStates } from "../model/words";
import { button, duration, element, setText, themeColor } from "./dom";

/** Length of what can be scrolled back to [s]. */
export const kMemory = 600;

/** The last ten minutes, coloured by state; dragging goes back in time. */
export class Timeline {
  readonly node = element("div", { class: "time" });
  /** Where the page stands; undefined: at the newest, moving on. */
  held: number | undefined;
  onChange: () => void = () => {};
  private readonly ribbon = element("div", { class: "ribbon", title: "drag to go back in time" });
  private readonly canvas = element("canvas");
  private readonly at = element("span", { class: "at num" });
  private readonly live: HTMLButtonElement;
  private readonly pause: HTMLButtonElement;
  private newest = NaN;
  private first = NaN;
  private drawn = "";

  constructor() {
    this.pause = button("Pause", "Hold the page (space)", () => this.toggle());
    this.live = button("Live", "Back to now (L)", () => this.hold(undefined));
    this.live.classList.add("live");
    this.ribbon.append(this.canvas);
    this.node.append(this.pause, this.ribbon, this.at, this.live);
    this.ribbon.addEventListener("pointerdown", (e) => {
      this.ribbon.setPointerCapture(e.pointerId);
      this.drag(e);
    });
    this.ribbon.addEventListener("pointermove", (e) => {
      if (this.ribbon.hasPointerCapture(e.pointerId)) this.drag(e);
    });
  }

  get isLive(): boolean {
    return this.held === undefined;
  }

  toggle(): void {
    this.hold(this.held === undefined ? this.newest : undefined);
  }

  step(seconds: number): void {
    const to = (this.held ?? this.newest) + seconds;
    this.hold(to >= this.newest ? undefined : Math.max(to, this.first));
  }

  hold(time: number | undefined): void {
    this.held = time === undefined || Number.isNaN(time) ? undefined : time;
    this.onChange();
  }

  update(vehicle: Vehicle | undefined): void {
    const table = vehicle?.statusTable;
    this.newest = vehicle?.now ?? NaN;
    this.first = table && table.length > 0 ? Math.max(table.timeOf(0), this.newest - kMemory) : NaN;
    this.live.classList.toggle("on", this.isLive);
    setText(this.pause, this.isLive ? "Pause" : "Resume");
    const back = this.newest - (this.held ?? this.newest);
    const total = this.newest - this.first;
    setText(
      this.at,
      Number.isNaN(total) ? "" : this.isLive ? `${duration(total)} kept` : `−${duration(back)} of ${duration(total)}`,
    );
    this.draw(vehicle);
  }

  private drag(event: PointerEvent): void {
    if (Number.isNaN(this.newest)) return;
    const box = this.ribbon.getBoundingClientRect();
    const part = Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    const time = this.first + part * (this.newest - this.first);
    this.hold(part > 0.995 ? undefined : time);
  }

  private draw(vehicle: Vehicle | undefined): void {
    const ratio = window.devicePixelRatio;
    const width = Math.round(this.ribbon.clientWidth * ratio);
    const height = Math.round(this.ribbon.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    // A ribbon of minutes hardly moves in a tenth of a second.
    const theme = document.documentElement.dataset.theme;
    const key = [width, height, theme, this.held, Math.floor(2 * this.newest), Math.floor(2 * this.first)].join();
    if (key === this.drawn) return;
    this.drawn = key;
    const context = this.canvas.getContext("2d")!;
    context.clearRect(0, 0, width, height);
    const top = Math.round(height * 0.3);
    const thick = Math.round(height * 0.4);
    context.fillStyle = themeColor("--raised");
    context.fillRect(0, top, width, thick);
    const table = vehicle?.statusTable;
    const span = this.newest - this.first;
    if (!table || !(span > 0)) return;
    const colors = kStates.map((s) => themeColor(s.color));
    // The worst state of a pixel's time, so that a short loss is seen.
    const rank = [1, 0, 2, 3, 4, 1, 1];
    const [begin, end] = table.range(this.first, this.newest);
    let row = begin;
    for (let x = 0; x < width; x += 2) {
      const until = this.first + ((x + 2) / width) * span;
      let worst = -1;
      for (; row < end && table.timeOf(row) <= until; ++row) {
        const state = table.get("state", row);
        if (worst < 0 || (rank[state] ?? 0) > (rank[worst] ?? 0)) worst = state;
      }
      if (worst < 0) {
        const before = table.timeOf(table.at(until));
        if (until - before > Math.max(1, (4 * span) / width)) continue;
        worst = table.get("state", table.at(until));
      }
      context.fillStyle = colors[worst] ?? colors[6]!;
      context.globalAlpha = worst === 1 ? 0.75 : 1;
      context.fillRect(x, top, 2, thick);
    }
    context.globalAlpha = 1;
    const place = ((this.held ?? this.newest) - this.first) / span;
    context.fillStyle = themeColor("--text");
    context.fillRect(Math.min(Math.round(place * width), width - 3), 0, 3, height);
  }
}
