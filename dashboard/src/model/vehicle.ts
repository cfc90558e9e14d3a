import type { Connection } from "../bus/connection";
import {
  type CompressedImage,
  type DiagnosticArray,
  type Keyframe,
  type Odometry,
  type Path,
  type PointCloud2,
  type Pose,
  type RecorderStatus,
  type ScaledOdometry,
  type StereoCalibration,
  seconds,
  type TrackedPoints,
  type VoStatus,
} from "../bus/messages";
import { PoseLog } from "./poses";
import { Table } from "./table";
import { VoxelMap } from "./voxel_map";

/** Rows of ten minutes at 60 frames a second. */
const kRows = 36_000;
const kMostKeyframes = 10_000;
const kImagesKept = 24;

export const kPoseColumns = [
  "scale",
  "scaleLow",
  "scaleHigh",
  "scaleResidual",
  "accepted",
  "scaleAge",
  "speed",
  "depth",
  "state",
] as const;
export const kStatusColumns = [
  "latency",
  "rate",
  "drops",
  "syncError",
  "residual",
  "state",
  "track",
  "map",
  "scaleStage",
  "points",
  "inliers",
  "distance",
] as const;

export interface KeyframeMark {
  time: number;
  segment: number;
  pose: Pose;
}
export interface Picture {
  time: number;
  bitmap: ImageBitmap;
}
export interface HealthEntry {
  name: string;
  level: number;
  message: string;
  hardware: string;
  values: { key: string; value: string }[];
  heard: number;
}

/** Pictures of one camera: the newest ones, for the past a few. */
export class PictureFeed {
  readonly kept: Picture[] = [];
  heard = 0;
  private decoding = false;

  async take(message: CompressedImage): Promise<void> {
    this.heard = performance.now();
    if (this.decoding) return;
    this.decoding = true;
    try {
      const blob = new Blob([message.data as BlobPart], { type: "image/jpeg" });
      const bitmap = await createImageBitmap(blob);
      this.kept.push({ time: seconds(message.header.stamp), bitmap });
      while (this.kept.length > kImagesKept) this.kept.shift()!.bitmap.close();
    } catch {
      // A picture that cannot be decoded is skipped; the next one comes soon.
    } finally {
      this.decoding = false;
    }
  }

  /** The picture at or before `time`. */
  at(time: number): Picture | undefined {
    for (let i = this.kept.length - 1; i >= 0; --i) {
      if (this.kept[i]!.time <= time + 1e-6) return this.kept[i];
    }
    return undefined;
  }

  clear(): void {
    for (const picture of this.kept.splice(0)) picture.bitmap.close();
  }
}

/** Everything that is known of one vehicle, bounded in memory. */
export class Vehicle {
  readonly poses = new PoseLog();
  readonly poseTable = new Table(kPoseColumns, kRows);
  readonly statusTable = new Table(kStatusColumns, kRows);
  readonly keyframes = new Map<string, KeyframeMark>();
  keyframeRevision = 0;
  readonly map: VoxelMap;
  windowPoints = new Float32Array(0);
  windowRevision = 0;
  readonly left = new PictureFeed();
  readonly right = new PictureFeed();
  readonly tracked: TrackedPoints[] = [];
  readonly health = new Map<string, HealthEntry>();
  path: Path | undefined;
  calibration: StereoCalibration | undefined;
  status: VoStatus | undefined;
  odometry: ScaledOdometry | undefined;
  recorder: RecorderStatus | undefined;
  /** performance.now() of the last status and pose. */
  statusHeard = -Infinity;
  poseHeard = -Infinity;

  private readonly ends: (() => void)[] = [];
  private readonly arrivals: number[] = [];
  private losses = NaN;

  /** `ns`: "/auv1", with the domain's prefix where there is one. */
  constructor(
    private readonly link: Connection,
    readonly ns: string,
    mostMapPoints: number,
    private readonly tell: (notice: string) => void,
  ) {
    this.map = new VoxelMap(mostMapPoints);
    this.hear("status", (m: VoStatus) => this.addStatus(m));
    this.hear("scaled_odometry", (m: ScaledOdometry) => this.addPose(m));
    this.hear("keyframe", (m: Keyframe) => this.addKeyframe(m));
    this.hear("points", (m: PointCloud2) => this.addPoints(m));
    this.hear("path", (m: Path) => {
      this.path = m;
    });
    this.hear("calibration", (m: StereoCalibration) => {
      this.calibration = m;
    });
    this.hear("left/preview/compressed", (m: CompressedImage) => void this.left.take(m));
    this.hear("right/preview_small/compressed", (m: CompressedImage) => void this.right.take(m));
    this.hear("tracked_points", (m: TrackedPoints) => {
      this.tracked.push(m);
      if (this.tracked.length > kImagesKept) this.tracked.shift();
    });
    this.hear("record_status", (m: RecorderStatus) => {
      this.recorder = m;
    });
    this.ends.push(link.want(`${this.domain}/diagnostics`, (m: DiagnosticArray) => this.addHealth(m)));
  }

  /** "/domain_7" where several domains are shown. */
  get domain(): string {
    return /^\/domain_\d+(?=\/)/.exec(this.ns)?.[0] ?? "";
  }

  get name(): string {
    return this.ns.slice(1).replace(/^domain_(\d+)\//, "domain $1 · ");
  }

  /** Newest time of the vehicle's own clock [s]. */
  get now(): number {
    const times = [this.statusTable.lastTime, this.poseTable.lastTime].filter((t) => !Number.isNaN(t));
    return times.length === 0 ? NaN : Math.max(...times);
  }

  end(): void {
    for (const end of this.ends) end();
    this.left.clear();
    this.right.clear();
  }

  clear(): void {
    this.clearRoom();
    this.poseTable.clear();
    this.statusTable.clear();
    this.windowPoints = new Float32Array(0);
    this.windowRevision += 1;
    this.left.clear();
    this.right.clear();
    this.tracked.length = 0;
    this.path = undefined;
  }

  private hear<T>(name: string, handler: (message: T) => void): void {
    this.ends.push(this.link.want(`${this.ns}/${name}`, handler));
  }

  private addStatus(m: VoStatus): void {
    const now = performance.now();
    const before = this.status;
    if (before && (m.received < before.received || m.segment < before.segment)) this.beginRun();
    this.status = m;
    this.statusHeard = now;
    this.arrivals.push(now);
    while (this.arrivals.length > 2 && this.arrivals[0]! < now - 2000) this.arrivals.shift();
    const span = (now - this.arrivals[0]!) / 1000;
    const losses = Number(m.lost_transport + m.dropped_queue + m.rejected);
    const stage = (name: string) => m.stages.find((s) => s.name === name)?.last_ms ?? NaN;
    const follows = this.statusTable.push(seconds(m.header.stamp), {
      latency: m.latency_s * 1e3,
      rate: span > 0.2 ? (this.arrivals.length - 1) / span : NaN,
      drops: Math.max(0, losses - (Number.isNaN(this.losses) ? losses : this.losses)),
      syncError: m.sync_error_s * 1e3,
      residual: m.residual,
      state: m.state,
      track: stage("tracking"),
      map: stage("bundle_adjustment"),
      scaleStage: stage("scale_optimization"),
      points: m.points,
      inliers: m.inliers,
      distance: m.distance_m,
    });
    this.losses = losses;
    if (!follows) this.startAnew();
  }

  private addPose(m: ScaledOdometry): void {
    this.odometry = m;
    this.poseHeard = performance.now();
    const v = m.twist.twist.linear;
    const scale = Math.exp(m.log_scale);
    const band = 2 * m.log_scale_sigma;
    const time = seconds(m.header.stamp);
    const metric = m.scale_valid;
    this.poseTable.push(time, {
      scale: metric ? scale : NaN,
      scaleLow: metric ? scale * Math.exp(-band) : NaN,
      scaleHigh: metric ? scale * Math.exp(band) : NaN,
      scaleResidual: m.scale_residual,
      accepted: m.scale_verdict === 0 ? 1 : 0,
      scaleAge: m.scale_age_s,
      speed: metric ? Math.hypot(v.x, v.y, v.z) : NaN,
      depth: metric ? -m.pose.pose.position.z : NaN,
      state: m.state,
    });
    const last = this.poses.length - 1;
    if (last < 0 || time > this.poses.time(last)) {
      this.poses.push(time, m.pose.pose, m.state, m.segment);
    }
  }

  private addKeyframe(m: Keyframe): void {
    const key = `${m.segment}/${m.id}`;
    this.keyframes.set(key, { time: seconds(m.header.stamp), segment: m.segment, pose: m.pose });
    if (this.keyframes.size > kMostKeyframes) {
      this.keyframes.delete(this.keyframes.keys().next().value!);
    }
    this.keyframeRevision += 1;
  }

  private addPoints(m: PointCloud2): void {
    const offset = (name: string) => m.fields.find((f) => f.name === name)?.offset ?? -1;
    const [x, y, z, i] = ["x", "y", "z", "intensity"].map(offset) as [number, number, number, number];
    if (x < 0 || y < 0 || z < 0) return;
    const view = new DataView(m.data.buffer, m.data.byteOffset, m.data.byteLength);
    const count = Math.min(m.width * m.height, Math.floor(m.data.byteLength / m.point_step));
    const points = new Float32Array(3 * count);
    for (let k = 0; k < count; ++k) {
      const at = k * m.point_step;
      const p = [x, y, z].map((o) => view.getFloat32(at + o, true)) as [number, number, number];
      points.set(p, 3 * k);
      this.map.add(...p, i < 0 ? 200 : view.getFloat32(at + i, true));
    }
    this.windowPoints = points;
    this.windowRevision += 1;
  }

  /** Names begin with the namespace: "auv1: camera". */
  private addHealth(m: DiagnosticArray): void {
    const ns = this.ns.slice(this.domain.length + 1);
    for (const status of m.status) {
      const owner = /^([^:]+): /.exec(status.name)?.[1];
      if (owner !== undefined && owner !== ns) continue;
      if (!this.health.has(status.name) && this.health.size >= 64) continue;
      this.health.set(status.name, {
        name: status.name,
        level: status.level,
        message: status.message,
        hardware: status.hardware_id,
        values: status.values,
        heard: performance.now(),
      });
    }
  }

  /** The odometry was started again: its `odom` begins anew, and so do segments and keyframes. */
  private beginRun(): void {
    if (this.poses.length > 0) {
      this.tell("The odometry was started again: its odom, and the room, begin anew");
    }
    this.clearRoom();
    this.windowPoints = new Float32Array(0);
    this.windowRevision += 1;
    this.path = undefined;
  }

  /** The stamps began again: another run of the same recording. */
  private startAnew(): void {
    this.clearRoom();
    this.poseTable.clear();
    this.left.clear();
    this.right.clear();
    this.tracked.length = 0;
  }

  private clearRoom(): void {
    this.poses.clear();
    this.keyframes.clear();
    this.keyframeRevision += 1;
    this.map.clear();
  }
}

/** Vehicles are the namespaces where an odometry speaks. */
export function vehiclesOf(link: Connection): string[] {
  const names = new Set<string>();
  for (const channel of link.channels.values()) {
    if (channel.schemaName === "sovo_msgs/msg/VoStatus") {
      names.add(channel.topic.replace(/\/status$/, ""));
    }
  }
  return [...names].sort();
}

/** Topics that a second trajectory can be drawn from: of other vehicles, and the own places with
    loops closed. */
export function trajectoryTopics(link: Connection, own: string): string[] {
  const types = ["nav_msgs/msg/Odometry", "nav_msgs/msg/Path"];
  return [...link.channels.values()]
    .filter((c) => types.includes(c.schemaName))
    .filter((c) => !c.topic.startsWith(`${own}/`) || c.topic === `${own}/map_path`)
    .map((c) => c.topic)
    .sort();
}

export type { Odometry, Path };
