import type { Pose } from "../bus/messages";

const kWidth = 8; // x y z qx qy qz qw and the time

/** All poses of a dive: bounded, every other one of the older half is given up when it is full. */
export class PoseLog {
  length = 0;
  /** Rises when rows were taken away or changed: what was drawn must be drawn anew. */
  revision = 0;
  private data = new Float64Array(1024 * kWidth);
  private marks = new Uint8Array(1024 * 5); // state, and the segment in four bytes

  constructor(private readonly most = 240_000) {}

  push(time: number, pose: Pose, state: number, segment: number): void {
    if (this.length === this.most) this.thin();
    if ((this.length + 1) * kWidth > this.data.length) this.grow();
    const { position: p, orientation: q } = pose;
    this.data.set([p.x, p.y, p.z, q.x, q.y, q.z, q.w, time], this.length * kWidth);
    const at = this.length * 5;
    this.marks[at] = state;
    new DataView(this.marks.buffer).setUint32(at + 1, segment);
    this.length += 1;
  }

  clear(): void {
    this.length = 0;
    this.revision += 1;
  }

  time(i: number): number {
    return this.data[i * kWidth + 7]!;
  }
  x(i: number): number {
    return this.data[i * kWidth]!;
  }
  y(i: number): number {
    return this.data[i * kWidth + 1]!;
  }
  z(i: number): number {
    return this.data[i * kWidth + 2]!;
  }
  /** x y z w */
  orientation(i: number): [number, number, number, number] {
    const at = i * kWidth;
    return [this.data[at + 3]!, this.data[at + 4]!, this.data[at + 5]!, this.data[at + 6]!];
  }
  state(i: number): number {
    return this.marks[i * 5]!;
  }
  segment(i: number): number {
    return new DataView(this.marks.buffer).getUint32(i * 5 + 1);
  }

  /** The last pose at or before `time`; -1 when there is none. */
  at(time: number): number {
    let low = 0;
    let high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) <= time + 1e-9) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  private grow(): void {
    const data = new Float64Array(this.data.length * 2);
    data.set(this.data);
    this.data = data;
    const marks = new Uint8Array(this.marks.length * 2);
    marks.set(this.marks);
    this.marks = marks;
  }

  private thin(): void {
    const half = this.length >> 1;
    let to = 0;
    for (let i = 0; i < this.length; i += i < half ? 2 : 1) {
      this.data.copyWithin(to * kWidth, i * kWidth, (i + 1) * kWidth);
      this.marks.copyWithin(to * 5, i * 5, (i + 1) * 5);
      to += 1;
    }
    this.length = to;
    this.revision += 1;
  }
}

/** One line a pose: time, position, quaternion x y z w, as trajectory tools read it. */
export function toTum(log: PoseLog): string {
  const lines = ["# time x y z qx qy qz qw (base_link in odom)"];
  for (let i = 0; i < log.length; ++i) {
    const q = log.orientation(i);
    const numbers = [log.x(i), log.y(i), log.z(i), ...q].map((n) => n.toFixed(9));
    lines.push(`${log.time(i).toFixed(9)} ${numbers.join(" ")}`);
  }
  return lines.join("\n") + "\n";
}

export function toCsv(log: PoseLog): string {
  const lines = ["time_s,x_m,y_m,z_m,qx,qy,qz,qw,state,segment"];
  for (let i = 0; i < log.length; ++i) {
    const q = log.orientation(i);
    const numbers = [log.x(i), log.y(i), log.z(i), ...q].map((n) => n.toFixed(9));
    lines.push(`${log.time(i).toFixed(9)},${numbers.join(",")},${log.state(i)},${log.segment(i)}`);
  }
  return lines.join("\n") + "\n";
}

/** Poses of a TUM file; throws with the line that is wrong. */
export function parseTum(text: string): { time: number; pose: Pose }[] {
  const poses: { time: number; pose: Pose }[] = [];
  text.split("\n").forEach((line, i) => {
    if (line.trim() === "" || line.startsWith("#")) return;
    const n = line.trim().split(/[\s,]+/).map(Number);
    if (n.length < 8 || n.slice(0, 8).some((x) => !Number.isFinite(x))) {
      throw new Error(`line ${i + 1} is not: time x y z qx qy qz qw`);
    }
    poses.push({
      time: n[0]!,
      pose: {
        position: { x: n[1]!, y: n[2]!, z: n[3]! },
        orientation: { x: n[4]!, y: n[5]!, z: n[6]!, w: n[7]! },
      },
    });
  });
  return poses;
}
