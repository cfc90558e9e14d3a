import {
  type Color,
  DynamicDrawUsage,
  InstancedInterleavedBuffer,
  InterleavedBufferAttribute,
  type Vector2,
} from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";

/** Wide line pieces that are added one by one; only what is new goes to the graphics card. */
export class GrowingLine {
  readonly object: LineSegments2;
  private readonly material: LineMaterial;
  private capacity = 0;
  private count = 0;
  private uploaded = 0;
  private ends = new InstancedInterleavedBuffer(new Float32Array(0), 6, 1);
  private colors = new InstancedInterleavedBuffer(new Float32Array(0), 6, 1);

  constructor(width: number, opacity = 1) {
    this.material = new LineMaterial({
      linewidth: width,
      vertexColors: true,
      transparent: opacity < 1,
      opacity,
    });
    this.object = new LineSegments2(new LineSegmentsGeometry(), this.material);
    this.object.frustumCulled = false;
    this.reserve(1024);
  }

  get length(): number {
    return this.count;
  }

  setResolution(size: Vector2): void {
    this.material.resolution.copy(size);
  }

  push(ax: number, ay: number, az: number, bx: number, by: number, bz: number, color: Color): void {
    if (this.count === this.capacity) this.reserve(2 * this.capacity);
    (this.ends.array as Float32Array).set([ax, ay, az, bx, by, bz], 6 * this.count);
    const { r, g, b } = color;
    (this.colors.array as Float32Array).set([r, g, b, r, g, b], 6 * this.count);
    this.count += 1;
  }

  clear(): void {
    this.count = 0;
    this.uploaded = 0;
    this.flush();
  }

  /** Hands what was pushed to the graphics card. */
  flush(): void {
    this.object.geometry.instanceCount = this.count;
    this.object.visible = this.count > 0;
    if (this.uploaded === this.count) return;
    for (const buffer of [this.ends, this.colors]) {
      buffer.addUpdateRange(6 * this.uploaded, 6 * (this.count - this.uploaded));
      buffer.needsUpdate = true;
    }
    this.uploaded = this.count;
  }

  private reserve(capacity: number): void {
    const grown = (old: InstancedInterleavedBuffer) => {
      const array = new Float32Array(6 * capacity);
      array.set(old.array as Float32Array);
      const buffer = new InstancedInterleavedBuffer(array, 6, 1);
      buffer.setUsage(DynamicDrawUsage);
      return buffer;
    };
    this.ends = grown(this.ends);
    this.colors = grown(this.colors);
    this.capacity = capacity;
    this.uploaded = 0;
    const geometry = new LineSegmentsGeometry();
    geometry.setAttribute("instanceStart", new InterleavedBufferAttribute(this.ends, 3, 0));
    geometry.setAttribute("instanceEnd", new InterleavedBufferAttribute(this.ends, 3, 3));
    geometry.setAttribute("instanceColorStart", new InterleavedBufferAttribute(this.colors, 3, 0));
    geometry.setAttribute("instanceColorEnd", new InterleavedBufferAttribute(this.colors, 3, 3));
    geometry.instanceCount = this.count;
    this.object.geometry.dispose();
    this.object.geometry = geometry;
  }
}
