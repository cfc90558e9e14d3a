import { Matrix3, Quaternion, Vector3 } from "three";

import type { Pose } from "../bus/messages";
import type { PoseLog } from "./poses";

/** Pairs of positions of one instant. */
function pairsOf(other: { time: number; pose: Pose }[], own: PoseLog): [Vector3, Vector3][] {
  const pairs: [Vector3, Vector3][] = [];
  const step = Math.max(1, Math.floor(other.length / 2000));
  for (let k = 0; k < other.length; k += step) {
    const { time, pose } = other[k]!;
    const i = own.at(time + 0.02);
    if (i < 0 || Math.abs(own.time(i) - time) > 0.03) continue;
    const { x, y, z } = pose.position;
    pairs.push([new Vector3(x, y, z), new Vector3(own.x(i), own.y(i), own.z(i))]);
  }
  return pairs;
}

/**
 * Rotation of the best rigid motion from the first points to the second (Horn's quaternion: the
 * eigenvector of the largest eigenvalue of a symmetric 4x4 matrix, found by power iteration).
 */
function bestRotation(pairs: [Vector3, Vector3][]): Quaternion {
  const s = new Matrix3().set(0, 0, 0, 0, 0, 0, 0, 0, 0).elements;
  for (const [a, b] of pairs) {
    const [p, q] = [a.toArray(), b.toArray()];
    for (let i = 0; i < 3; ++i) for (let j = 0; j < 3; ++j) s[3 * i + j]! += p[i]! * q[j]!;
  }
  const [xx, xy, xz, yx, yy, yz, zx, zy, zz] = s as unknown as number[];
  const n = [
    [xx! + yy! + zz!, yz! - zy!, zx! - xz!, xy! - yx!],
    [yz! - zy!, xx! - yy! - zz!, xy! + yx!, zx! + xz!],
    [zx! - xz!, xy! + yx!, -xx! + yy! - zz!, yz! + zy!],
    [xy! - yx!, zx! + xz!, yz! + zy!, -xx! - yy! + zz!],
  ];
  // Shifted so that the largest eigenvalue is the largest in size.
  const shift = Math.max(...n.map((row) => row.reduce((sum, v) => sum + Math.abs(v), 0)));
  let q = [1, 0.1, 0.1, 0.1];
  for (let k = 0; k < 500; ++k) {
    const next = n.map((row, i) => row.reduce((sum, v, j) => sum + v * q[j]!, shift * q[i]!));
    const size = Math.hypot(...next);
    q = next.map((v) => v / size);
  }
  return new Quaternion(q[1], q[2], q[3], q[0]);
}

/**
 * Brings another trajectory onto the own one by the rigid motion that fits best at equal times, and
 * says how far the positions are apart then (RMS) [m]. Without 10 common times it stays where it is.
 */
export function align(
  other: { time: number; pose: Pose }[],
  own: PoseLog,
): { poses: Pose[]; rms: number | undefined } {
  const pairs = pairsOf(other, own);
  if (pairs.length < 10) return { poses: other.map((o) => o.pose), rms: undefined };
  const mean = (k: 0 | 1) =>
    pairs.reduce((sum, pair) => sum.add(pair[k]), new Vector3()).divideScalar(pairs.length);
  const [from, to] = [mean(0), mean(1)];
  const centred = pairs.map(([a, b]): [Vector3, Vector3] => [a.clone().sub(from), b.clone().sub(to)]);
  const rotation = bestRotation(centred);
  let sum = 0;
  for (const [a, b] of centred) sum += a.clone().applyQuaternion(rotation).distanceToSquared(b);
  const poses = other.map(({ pose }) => {
    const { x, y, z } = pose.position;
    const position = new Vector3(x, y, z).sub(from).applyQuaternion(rotation).add(to);
    return { position, orientation: pose.orientation };
  });
  return { poses, rms: Math.sqrt(sum / pairs.length) };
}
