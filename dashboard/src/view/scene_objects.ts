import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  DynamicDrawUsage,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Points,
  PointsMaterial,
  Quaternion,
  SRGBColorSpace,
  Texture,
  Vector3,
} from "three";

import type { Pose, StereoCalibration } from "../bus/messages";
import type { KeyframeMark } from "../model/vehicle";
import type { VoxelMap } from "../model/voxel_map";

/** Corners of a camera's view at depth 1: left top, right top, right bottom, left bottom. */
export function viewCorners(calibration: StereoCalibration | undefined): Vector3[] {
  const camera = calibration?.left;
  const [fx, fy, cx, cy] = camera ? Array.from(camera.fx_fy_cx_cy) : [500, 500, 320, 240];
  const [w, h] = camera ? [camera.width, camera.height] : [640, 480];
  return [
    [0, 0],
    [w, 0],
    [w, h],
    [0, h],
  ].map(([u, v]) => new Vector3((u! - cx!) / fx!, (v! - cy!) / fy!, 1));
}

/** The left camera's mount on the vehicle: rotation and position of it in base_link. */
export function cameraMount(calibration: StereoCalibration | undefined): [Quaternion, Vector3] {
  if (!calibration) return [new Quaternion(-0.5, 0.5, -0.5, 0.5), new Vector3()];
  const { rotation: q, translation: t } = calibration.base_from_left;
  return [new Quaternion(q.x, q.y, q.z, q.w), new Vector3(t.x, t.y, t.z)];
}

export function placeAt(object: { position: Vector3; quaternion: Quaternion }, pose: Pose): void {
  const { position: p, orientation: q } = pose;
  object.position.set(p.x, p.y, p.z);
  object.quaternion.set(q.x, q.y, q.z, q.w);
}

/** The left camera's view pyramid with its picture, and the axes of the vehicle. */
export class CameraMarker {
  readonly object = new Group();
  private readonly mount = new Group();
  private readonly lines: LineSegments;
  private readonly plane: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly picture = document.createElement("canvas");
  private texture: Texture | undefined;
  private shown: ImageBitmap | undefined;

  /** `mostPictureWidth` [px]: a wider picture is reduced. */
  constructor(private readonly mostPictureWidth: number) {
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
    this.plane = new Mesh(
      new BufferGeometry(),
      new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.92 }),
    );
    this.plane.visible = false;
    this.mount.add(this.lines, this.plane);
    this.object.add(this.mount);
    this.setCalibration(undefined);
  }

  setCalibration(calibration: StereoCalibration | undefined): void {
    const [q, t] = cameraMount(calibration);
    this.mount.quaternion.copy(q);
    this.mount.position.copy(t);
    const c = viewCorners(calibration);
    const positions: number[] = [];
    for (let i = 0; i < 4; ++i) {
      positions.push(0, 0, 0, ...c[i]!.toArray(), ...c[i]!.toArray(), ...c[(i + 1) % 4]!.toArray());
    }
    this.lines.geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
    const [a, b, d, e] = c as [Vector3, Vector3, Vector3, Vector3];
    const corners = [a, b, d, a, d, e].flatMap((v) => v.toArray());
    this.plane.geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners), 3));
    const uv = new Float32Array([0, 1, 1, 1, 1, 0, 0, 1, 1, 0, 0, 0]);
    this.plane.geometry.setAttribute("uv", new BufferAttribute(uv, 2));
  }

  setColor(color: Color): void {
    (this.lines.material as LineBasicMaterial).color.copy(color);
  }

  setPicture(bitmap: ImageBitmap | undefined): void {
    this.plane.visible = bitmap !== undefined;
    if (!bitmap || bitmap === this.shown) return;
    this.shown = bitmap;
    // The feed closes old pictures: the texture keeps a copy.
    const reduced = Math.min(1, this.mostPictureWidth / bitmap.width);
    const [width, height] = [bitmap.width, bitmap.height].map((n) => Math.max(1, Math.round(n * reduced)));
    if (!this.texture || this.picture.width !== width || this.picture.height !== height) {
      [this.picture.width, this.picture.height] = [width!, height!];
      this.texture?.dispose();
      this.texture = new Texture(this.picture);
      this.texture.colorSpace = SRGBColorSpace;
      this.plane.material.map = this.texture;
      this.plane.material.needsUpdate = true;
    }
    this.picture.getContext("2d")!.drawImage(bitmap, 0, 0, width!, height!);
    this.texture.needsUpdate = true;
  }

  setSize(size: number): void {
    this.lines.scale.setScalar(size);
    this.plane.scale.setScalar(size);
  }
}

/** The newest keyframes as small view pyramids, all older ones as dots. */
export class KeyframeMarkers {
  readonly object = new Group();
  private readonly pyramids = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ transparent: true, opacity: 0.6 }),
  );
  private readonly dots = new Points(
    new BufferGeometry(),
    new PointsMaterial({ size: 3, sizeAttenuation: false, transparent: true, opacity: 0.8 }),
  );

  constructor(private readonly mostPyramids: number) {
    this.pyramids.frustumCulled = this.dots.frustumCulled = false;
    this.object.add(this.dots, this.pyramids);
  }

  setColor(color: string): void {
    this.pyramids.material.color.set(color);
    this.dots.material.color.set(color);
  }

  /**
   * `marks`: poses of the left camera, oldest first; `spacing`: a dot that lies nearer to the one
   * before is left out [m].
   */
  update(marks: Map<string, KeyframeMark>, corners: Vector3[], size: number, spacing: number): void {
    const numDots = Math.max(0, marks.size - this.mostPyramids);
    const dots: number[] = [];
    const last = new Vector3(Infinity, Infinity, Infinity);
    const lines = new Float32Array(48 * (marks.size - numDots));
    const q = new Quaternion();
    const p = new Vector3();
    const c = corners.map(() => new Vector3());
    let [i, at] = [0, 0];
    for (const { pose } of marks.values()) {
      const { x, y, z } = pose.position;
      p.set(x, y, z);
      if (i++ < numDots) {
        if (!(p.distanceTo(last) < spacing)) dots.push(...last.copy(p).toArray());
        continue;
      }
      q.copy(pose.orientation as Quaternion);
      corners.forEach((corner, k) => {
        c[k]!.copy(corner).multiplyScalar(size).applyQuaternion(q).add(p);
      });
      for (let k = 0; k < 4; ++k) {
        const [a, b] = [c[k]!, c[(k + 1) % 4]!];
        lines.set([x, y, z, a.x, a.y, a.z, a.x, a.y, a.z, b.x, b.y, b.z], at);
        at += 12;
      }
    }
    setPositions(this.dots, new Float32Array(dots));
    setPositions(this.pyramids, lines);
  }
}

function setPositions(object: { geometry: BufferGeometry }, positions: Float32Array): void {
  object.geometry.dispose();
  object.geometry = new BufferGeometry();
  object.geometry.setAttribute("position", new BufferAttribute(positions, 3));
}

/** Linear colours of the map's points by their grey level; `light`: bright points must darken. */
function mapTones(light: boolean): Uint8Array {
  const tones = new Uint8Array(4 * 256);
  for (let grey = 0; grey < 256; ++grey) {
    const tone = light ? 70 + grey * 0.45 : 48 + grey * 0.5;
    tones.set([tone * 0.93, tone * 0.98, Math.min(255, tone * 1.04), 255], 4 * grey);
  }
  return tones;
}

/** The accumulated map, in the grey levels of the pictures. */
export class MapCloud {
  readonly object: Points<BufferGeometry, PointsMaterial>;
  private uploaded = 0;
  private revision = -1;

  /** `size`: of a point [px of the page]. */
  constructor(
    private readonly map: VoxelMap,
    size: number,
  ) {
    const geometry = new BufferGeometry();
    const positions = new BufferAttribute(map.positions, 3);
    const colors = new BufferAttribute(new Uint8Array(4 * map.intensities.length), 4, true);
    geometry.setAttribute("position", positions.setUsage(DynamicDrawUsage));
    geometry.setAttribute("color", colors.setUsage(DynamicDrawUsage));
    geometry.setDrawRange(0, 0);
    const material = new PointsMaterial({ size, sizeAttenuation: false, vertexColors: true });
    this.object = new Points(geometry, material);
    this.object.frustumCulled = false;
  }

  /** Takes in what is new; returns whether anything is. */
  update(light: boolean): boolean {
    if (this.revision !== this.map.revision) {
      this.revision = this.map.revision;
      this.uploaded = 0;
    }
    const geometry = this.object.geometry;
    if (this.uploaded === this.map.count && geometry.drawRange.count === this.map.count) return false;
    geometry.setDrawRange(0, this.map.count);
    // What can be clicked has grown.
    geometry.boundingSphere = null;
    const colors = geometry.getAttribute("color") as BufferAttribute;
    const tones = mapTones(light);
    for (let i = this.uploaded; i < this.map.count; ++i) {
      const at = 4 * this.map.intensities[i]!;
      colors.array.set(tones.subarray(at, at + 4), 4 * i);
    }
    const positions = geometry.getAttribute("position") as BufferAttribute;
    const added = this.map.count - this.uploaded;
    positions.addUpdateRange(3 * this.uploaded, 3 * added);
    colors.addUpdateRange(4 * this.uploaded, 4 * added);
    positions.needsUpdate = colors.needsUpdate = added > 0;
    this.uploaded = this.map.count;
    return true;
  }

  redraw(): void {
    this.uploaded = 0;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.object.material.dispose();
  }
}

/** Lines of a ground grid about a place; every fifth is stronger. */
export class GroundGrid {
  readonly object = new Group();
  step = 1;
  private readonly fine = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
  private readonly strong = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
  private key = "";

  constructor() {
    this.object.add(this.fine, this.strong);
    this.fine.frustumCulled = this.strong.frustumCulled = false;
  }

  setColors(fine: string, strong: string): void {
    (this.fine.material as LineBasicMaterial).color.set(fine);
    (this.strong.material as LineBasicMaterial).color.set(strong);
  }

  update(x: number, y: number, distance: number): void {
    const exponent = Math.floor(Math.log10(Math.max(distance, 1e-3) / 8));
    const mantissa = distance / 8 / 10 ** exponent;
    this.step = (mantissa < 2 ? 1 : mantissa < 5 ? 2 : 5) * 10 ** exponent;
    const unit = 5 * this.step;
    const [cx, cy] = [Math.round(x / unit) * unit, Math.round(y / unit) * unit];
    const key = [this.step, cx, cy].join();
    if (key === this.key) return;
    this.key = key;
    const [fine, strong]: [number[], number[]] = [[], []];
    const n = 40;
    // In pieces: a renderer may lose a whole line that passes behind the eye.
    const piece = 8;
    for (let i = -n; i <= n; ++i) {
      const out = i % 5 === 0 ? strong : fine;
      const [gx, gy] = [cx + i * this.step, cy + i * this.step];
      for (let k = -n; k < n; k += piece) {
        const [from, to] = [k * this.step, (k + piece) * this.step];
        out.push(gx, cy + from, 0, gx, cy + to, 0, cx + from, gy, 0, cx + to, gy, 0);
      }
    }
    setPositions(this.fine, new Float32Array(fine));
    setPositions(this.strong, new Float32Array(strong));
  }
}
