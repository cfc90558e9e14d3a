import "uplot/dist/uPlot.min.css";

import uPlot from "uplot";

import type { Table } from "../model/table";
import { kPoseColumns, kStatusColumns, type Vehicle } from "../model/vehicle";
import { element, fixed, setText, themeColor } from "./dom";

type PoseColumn = (typeof kPoseColumns)[number];
type StatusColumn = (typeof kStatusColumns)[number];

interface Curve {
  column: PoseColumn | StatusColumn;
  label: string;
  color: string;
  digits: number;
}
interface Spec {
  title: string;
  unit: string;
  from: "pose" | "status";
  curves: Curve[];
  /** Columns of a band around the first curve. */
  band?: [PoseColumn, PoseColumn];
  zero?: boolean;
  bars?: boolean;
  note?: string;
}

const kSpecs: Spec[] = [
  {
    title: "Scale",
    unit: "× start, ±2σ",
    from: "pose",
    curves: [{ column: "scale", label: "", color: "--teal", digits: 4 }],
    band: ["scaleLow", "scaleHigh"],
    note: "corrections of the scale since the segment began; the band is two standard deviations",
  },
  {
    title: "Scale residual",
    unit: "grey levels",
    from: "pose",
    curves: [{ column: "scaleResidual", label: "", color: "--teal", digits: 2 }],
    zero: true,
    note: "points where the measurement was refused are marked",
  },
  {
    title: "Speed",
    unit: "m/s",
    from: "pose",
    curves: [{ column: "speed", label: "", color: "--blue", digits: 2 }],
    zero: true,
  },
  {
    title: "Depth",
    unit: "m, −z of odom",
    from: "pose",
    curves: [{ column: "depth", label: "", color: "--blue", digits: 2 }],
  },
  {
    title: "Latency",
    unit: "ms",
    from: "status",
    curves: [{ column: "latency", label: "", color: "--amber", digits: 0 }],
    zero: true,
  },
  {
    title: "Rate",
    unit: "Hz",
    from: "status",
    curves: [{ column: "rate", label: "", color: "--violet", digits: 1 }],
    zero: true,
  },
  {
    title: "Drops",
    unit: "frames",
    from: "status",
    curves: [{ column: "drops", label: "", color: "--red", digits: 0 }],
    zero: true,
    bars: true,
    note: "lost in transport, dropped because tracking was behind, or refused",
  },
  {
    title: "Sync error",
    unit: "ms",
    from: "status",
    curves: [{ column: "syncError", label: "", color: "--violet", digits: 2 }],
    zero: true,
    note: "between the exposures of the two cameras",
  },
  {
    title: "Stages",
    unit: "ms",
    from: "status",
    curves: [
      { column: "track", label: "track", color: "--teal", digits: 1 },
      { column: "map", label: "map", color: "--blue", digits: 1 },
      { column: "scaleStage", label: "scale", color: "--amber", digits: 1 },
    ],
    zero: true,
  },
];

const kHeight = 62;

class Plot {
  readonly node = element("div", { class: "plot" });
  private readonly values = element("span", { class: "values" });
  private readonly numbers: HTMLElement[];
  private readonly chart: uPlot;

  constructor(
    private readonly spec: Spec,
    width: number,
    private readonly onCursor: (time: number | undefined) => void,
  ) {
    const title = element("span", { class: "title" }, spec.title);
    const unit = element("span", { class: "unit" }, spec.unit);
    if (spec.note) this.node.title = spec.note;
    this.numbers = spec.curves.map((curve) => {
      const number = element("span");
      number.style.color = `var(${curve.color})`;
      this.values.append(number);
      return number;
    });
    const wrap = element("div", { class: "u-wrap" });
    this.node.append(element("div", { class: "head" }, title, unit, this.values), wrap);
    this.chart = new uPlot(this.options(width), this.empty(), wrap);
  }

  resize(width: number): void {
    this.chart.setSize({ width, height: kHeight });
  }

  update(vehicle: Vehicle | undefined, from: number, to: number, at: number): void {
    const table = this.table(vehicle);
    if (!table || Number.isNaN(to)) {
      this.chart.setData(this.empty());
      for (const number of this.numbers) setText(number, "–");
      return;
    }
    const range = table.range(from, to);
    const columns = this.columns();
    const data = [table.times(range), ...columns.map((c) => table.values(c, range))];
    this.chart.setData(data as unknown as uPlot.AlignedData, false);
    this.chart.setScale("x", { min: from, max: to });
    const row = table.at(at);
    this.spec.curves.forEach((curve, i) => {
      const value = table.get(curve.column, row);
      const label = curve.label === "" ? "" : `${curve.label} `;
      setText(this.numbers[i]!, label + fixed(value, curve.digits));
    });
  }

  destroy(): void {
    this.chart.destroy();
    this.node.remove();
  }

  private columns(): string[] {
    return [...this.spec.curves.map((c) => c.column), ...(this.spec.band ?? [])];
  }

  private empty(): uPlot.AlignedData {
    return [[], ...this.columns().map(() => [])] as unknown as uPlot.AlignedData;
  }

  private table(vehicle: Vehicle | undefined): Table<string> | undefined {
    const table = this.spec.from === "pose" ? vehicle?.poseTable : vehicle?.statusTable;
    return table as unknown as Table<string> | undefined;
  }

  private options(width: number): uPlot.Options {
    const { spec } = this;
    const series: uPlot.Series[] = [{}];
    for (const curve of spec.curves) {
      const stroke = themeColor(curve.color);
      series.push({
        stroke,
        width: 1.6,
        spanGaps: false,
        points: { show: false },
        ...(spec.bars ? { paths: uPlot.paths.bars!({ size: [1, 6, 2] }), fill: stroke } : {}),
      });
    }
    for (const _ of spec.band ?? []) {
      series.push({ stroke: "transparent", width: 0, points: { show: false } });
    }
    const axis = {
      stroke: themeColor("--faint"),
      font: '10px "IBM Plex Mono"',
      grid: { stroke: themeColor("--grid"), width: 1 },
      ticks: { show: false },
    };
    return {
      width,
      height: kHeight,
      padding: [6, 2, 6, 0],
      legend: { show: false },
      cursor: {
        y: false,
        points: { size: 5 },
        drag: { x: false, y: false },
        sync: { key: "time", scales: ["x", null] },
      },
      scales: { x: { time: false, auto: false }, y: { range: (_, low, high) => span(low, high, spec) } },
      axes: [
        { ...axis, show: false },
        { ...axis, size: 46, gap: 5, space: 20, values: (_u, splits) => splits.map(short) },
      ],
      bands: spec.band
        ? [{ series: [3, 2], fill: alpha(themeColor(spec.curves[0]!.color), 0.2) }]
        : [],
      series,
      hooks: {
        setCursor: [
          (u) => {
            const { left } = u.cursor;
            if (u.cursor.event === null || u.cursor.event === undefined) return;
            this.onCursor(left === undefined || left < 0 ? undefined : u.posToVal(left, "x"));
          },
        ],
        draw: [(u) => this.mark(u)],
      },
    };
  }

  /** Marks measurements of the scale that were refused. */
  private mark(u: uPlot): void {
    if (this.spec.title !== "Scale residual") return;
    const times = u.data[0];
    const refused = this.refused;
    if (!refused || refused.length !== times.length) return;
    u.ctx.fillStyle = themeColor("--amber");
    const y = u.bbox.top + u.bbox.height - 3;
    for (let i = 0; i < times.length; ++i) {
      if (refused[i] !== 0) continue;
      u.ctx.fillRect(Math.round(u.valToPos(times[i]!, "x", true)), y, 2, 3);
    }
  }
  refused: ArrayLike<number> | undefined;
}

/** All series, below each other, with one time axis and one cursor. */
export class Plots {
  readonly node = element("div", { class: "plots" });
  /** Length of the time axis [s]. */
  span = 60;
  onCursor: (time: number | undefined) => void = () => {};
  private plots: Plot[] = [];
  private width = 0;

  constructor() {
    new ResizeObserver(() => this.fitWidth()).observe(this.node);
  }

  /** Builds the plots with the colours of the theme. */
  rebuild(): void {
    for (const plot of this.plots) plot.destroy();
    this.width = this.node.clientWidth;
    this.plots = kSpecs.map((spec) => new Plot(spec, this.chartWidth(), (t) => this.onCursor(t)));
    this.node.replaceChildren(...this.plots.map((p) => p.node));
  }

  update(vehicle: Vehicle | undefined, to: number, at: number): void {
    if (this.node.offsetParent === null) return;
    const from = to - this.span;
    this.plots.forEach((plot, i) => {
      if (kSpecs[i]!.title === "Scale residual" && vehicle && !Number.isNaN(to)) {
        plot.refused = vehicle.poseTable.values("accepted", vehicle.poseTable.range(from, to));
      }
      plot.update(vehicle, from, to, at);
    });
  }

  private chartWidth(): number {
    return Math.max(this.width - 20, 120);
  }

  private fitWidth(): void {
    if (this.node.clientWidth === this.width || this.node.clientWidth === 0) return;
    this.width = this.node.clientWidth;
    for (const plot of this.plots) plot.resize(this.chartWidth());
  }
}

function span(low: number | null, high: number | null, spec: Spec): [number, number] {
  let a = low ?? 0;
  let b = high ?? 1;
  if (spec.zero) a = Math.min(a, 0);
  const least = spec.bars ? 1 : Math.max(Math.abs(b) * 0.02, 0.01);
  if (b - a < least) {
    if (spec.zero) b = a + least;
    else [a, b] = [a - least / 2, b + least / 2];
  }
  const margin = (b - a) * 0.08;
  return [spec.zero && a === 0 ? 0 : a - margin, b + margin];
}

/** A tick's number without the noise of binary fractions. */
function short(value: number): string {
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

function alpha(color: string, opacity: number): string {
  return `color-mix(in srgb, ${color} ${Math.round(opacity * 100)}%, transparent)`;
}
