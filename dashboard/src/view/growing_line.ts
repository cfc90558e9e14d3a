import {
  BufferAttribute,
  BufferGeometry,
  type Color,
  DoubleSide,
  DynamicDrawUsage,
  GLSL3,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  Mesh,
  ShaderMaterial,
  SRGBColorSpace,
  Vector2,
} from "three";

/** Each piece is four corners and two triangles. */
const kCorners = 4;

// Corners 0 and 1 lie beside the start, half a width before it, 2 and 3 behind the end. They are
// given out as seen on the screen (w = 1), where distances along the piece are linear.
const kVertexShader = `
in vec3 start;
in vec3 end;
in vec3 color;
uniform vec2 resolution;
uniform float width;
out vec3 tone;
out vec2 place;
flat out float span;

void main() {
  vec4 a = projectionMatrix * modelViewMatrix * vec4(start, 1.0);
  vec4 b = projectionMatrix * modelViewMatrix * vec4(end, 1.0);
  float beforeA = a.z + a.w;
  float beforeB = b.z + b.w;
  if (max(beforeA, beforeB) <= 0.0) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  if (beforeA < 0.0) a = mix(a, b, beforeA / (beforeA - beforeB));
  if (beforeB < 0.0) b = mix(b, a, beforeB / (beforeB - beforeA));
  a /= a.w;
  b /= b.w;
  vec2 way = 0.5 * (b.xy - a.xy) * resolution;
  float pixels = length(way);
  vec2 along = pixels > 1e-6 ? way / pixels : vec2(1.0, 0.0);
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  bool isEnd = (gl_VertexID & 2) != 0;
  vec2 off = vec2(-along.y, along.x) * side + along * (isEnd ? 1.0 : -1.0);
  gl_Position = isEnd ? b : a;
  gl_Position.xy += off * width / resolution;
  span = 2.0 * pixels / width;
  place = vec2(side, isEnd ? span + 1.0 : -1.0);
  tone = color;
}`;

// Ends are round, so that pieces join without a gap.
const kFragmentShader = `
in vec3 tone;
in vec2 place;
flat in float span;
uniform float opacity;
out vec4 drawn;

void main() {
  float beyond = max(max(-place.y, place.y - span), 0.0);
  if (beyond > 0.0 && beyond * beyond + place.x * place.x > 1.0) discard;
  drawn = vec4(tone, opacity);
}`;

/**
 * Wide line pieces that are added one by one; only what is new goes to the graphics card. All are
 * one draw call without instances, each of which costs a processor that draws as much as a call.
 */
export class GrowingLine {
  readonly object: Mesh<BufferGeometry, ShaderMaterial>;
  private capacity = 0;
  private count = 0;
  private uploaded = 0;
  private ends = new InterleavedBuffer(new Float32Array(0), 6);
  private colors = new BufferAttribute(new Uint8Array(0), 4, true);

  /** `width`: of the line, in pixels of the page. */
  constructor(width: number, opacity = 1) {
    const material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: kVertexShader,
      fragmentShader: kFragmentShader,
      uniforms: { resolution: { value: new Vector2(1, 1) }, width: { value: width }, opacity: { value: opacity } },
      transparent: opacity < 1,
      side: DoubleSide,
    });
    this.object = new Mesh(new BufferGeometry(), material);
    this.object.frustumCulled = false;
    this.reserve(1024);
  }

  get length(): number {
    return this.count;
  }

  /** `size`: of the view, in pixels of the page. */
  setResolution(size: Vector2): void {
    (this.object.material.uniforms.resolution!.value as Vector2).copy(size);
  }

  push(ax: number, ay: number, az: number, bx: number, by: number, bz: number, color: Color): void {
    if (this.count === this.capacity) this.reserve(2 * this.capacity);
    const hex = color.getHex(SRGBColorSpace);
    const tone = [hex >> 16, (hex >> 8) & 255, hex & 255, 255];
    for (let corner = kCorners * this.count; corner < kCorners * (this.count + 1); ++corner) {
      this.ends.array.set([ax, ay, az, bx, by, bz], 6 * corner);
      this.colors.array.set(tone, 4 * corner);
    }
    this.count += 1;
  }

  clear(): void {
    this.count = 0;
    this.uploaded = 0;
    this.flush();
  }

  /** Hands what was pushed to the graphics card. */
  flush(): void {
    this.object.geometry.setDrawRange(0, 6 * this.count);
    this.object.visible = this.count > 0;
    if (this.uploaded === this.count) return;
    const [first, added] = [kCorners * this.uploaded, kCorners * (this.count - this.uploaded)];
    this.ends.addUpdateRange(6 * first, 6 * added);
    this.ends.needsUpdate = true;
    this.colors.addUpdateRange(4 * first, 4 * added);
    this.colors.needsUpdate = true;
    this.uploaded = this.count;
  }

  private reserve(capacity: number): void {
    const ends = new Float32Array(6 * kCorners * capacity);
    ends.set(this.ends.array);
    const colors = new Uint8Array(4 * kCorners * capacity);
    colors.set(this.colors.array);
    this.ends = new InterleavedBuffer(ends, 6).setUsage(DynamicDrawUsage);
    this.colors = new BufferAttribute(colors, 4, true).setUsage(DynamicDrawUsage);
    const indices = new Uint32Array(6 * capacity);
    for (let i = 0; i < capacity; ++i) {
      indices.set([0, 1, 2, 2, 1, 3].map((corner) => kCorners * i + corner), 6 * i);
    }
    this.capacity = capacity;
    this.uploaded = 0;
    const geometry = new BufferGeometry();
    geometry.setAttribute("start", new InterleavedBufferAttribute(this.ends, 3, 0));
    geometry.setAttribute("end", new InterleavedBufferAttribute(this.ends, 3, 3));
    geometry.setAttribute("color", this.colors);
    geometry.setIndex(new BufferAttribute(indices, 1));
    geometry.setDrawRange(0, 6 * this.count);
    this.object.geometry.dispose();
    this.object.geometry = geometry;
  }
}
