import type { Connection } from "../bus/connection";
import { type Pose, seconds } from "../bus/messages";
import { align } from "./alignment";
import { parseTum, type PoseLog } from "./poses";
import type { Odometry, Path } from "./vehicle";

const kMost = 50_000;

/** A second trajectory beside the vehicle's: of a topic, or of a file. */
export class OtherTrajectory {
  name = "";
  /** How far it is from the own one at equal times, once aligned [m]. */
  rms: number | undefined;
  aligned = true;
  onChange: (poses: Pose[]) => void = () => {};
  private raw: { time: number; pose: Pose }[] = [];
  private end: (() => void) | undefined;
  private changed = false;

  constructor(private readonly link: Connection) {}

  fromTopic(topic: string): void {
    this.clear();
    this.name = topic;
    const isPath = [...this.link.channels.values()].some(
      (c) => c.topic === topic && c.schemaName === "nav_msgs/msg/Path",
    );
    this.aligned = false; // another vehicle's place is its own
    this.end = isPath
      ? this.link.want(topic, (m: Path) => {
          this.raw = m.poses.map((p) => ({ time: seconds(p.header.stamp), pose: p.pose }));
          this.changed = true;
        })
      : this.link.want(topic, (m: Odometry) => {
          this.raw.push({ time: seconds(m.header.stamp), pose: m.pose.pose });
          if (this.raw.length > kMost) this.raw = this.raw.filter((_, i) => i % 2 === 0);
          this.changed = true;
        });
  }

  /** Throws when the text is no trajectory. */
  fromFile(name: string, text: string): void {
    const poses = parseTum(text);
    this.clear();
    this.name = name;
    this.aligned = true;
    this.raw = poses.length > kMost ? poses.filter((_, i) => i % 4 === 0) : poses;
    this.changed = true;
  }

  clear(): void {
    this.end?.();
    this.end = undefined;
    this.raw = [];
    this.name = "";
    this.rms = undefined;
    this.changed = false;
    this.onChange([]);
  }

  /** Called now and then: aligns anew with what has come since. */
  update(own: PoseLog | undefined): void {
    if (this.raw.length === 0 || !own) return;
    if (this.aligned) {
      const fitted = align(this.raw, own);
      this.rms = fitted.rms;
      this.onChange(fitted.poses);
    } else if (this.changed) {
      this.onChange(this.raw.map((r) => r.pose));
    }
    this.changed = false;
  }
}
