/** Points of all keyframes, one a voxel, bounded: when it is full the voxels grow. */
export class VoxelMap {
  count = 0;
  /** Rises when points moved: everything must be uploaded anew. */
  revision = 0;
  readonly positions: Float32Array;
  readonly intensities: Uint8Array;
  private readonly voxels = new Map<number, number>();
  private size: number;

  constructor(
    private readonly most = 250_000,
    private readonly firstSize = 0.03,
  ) {
    this.size = firstSize;
    this.positions = new Float32Array(3 * most);
    this.intensities = new Uint8Array(most);
  }

  get voxelSize(): number {
    return this.size;
  }

  add(x: number, y: number, z: number, intensity: number): void {
    if (!Number.isFinite(x + y + z)) return;
    const key = this.key(x, y, z);
    if (this.voxels.has(key)) return;
    if (this.count === this.most) {
      this.coarsen();
      this.add(x, y, z, intensity);
      return;
    }
    this.voxels.set(key, this.count);
    this.positions.set([x, y, z], 3 * this.count);
    this.intensities[this.count] = intensity;
    this.count += 1;
  }

  clear(): void {
    this.count = 0;
    this.size = this.firstSize;
    this.voxels.clear();
    this.revision += 1;
  }

  private key(x: number, y: number, z: number): number {
    const n = 131_072; // 17 bits an axis: the key is exact in a double
    const a = ((Math.floor(x / this.size) % n) + n) % n;
    const b = ((Math.floor(y / this.size) % n) + n) % n;
    const c = ((Math.floor(z / this.size) % n) + n) % n;
    return (a * n + b) * n + c;
  }

  private coarsen(): void {
    this.size *= Math.SQRT2;
    this.voxels.clear();
    let to = 0;
    for (let i = 0; i < this.count; ++i) {
      const [x, y, z] = [0, 1, 2].map((k) => this.positions[3 * i + k]!) as [number, number, number];
      const key = this.key(x, y, z);
      if (this.voxels.has(key)) continue;
      this.voxels.set(key, to);
      this.positions.set([x, y, z], 3 * to);
      this.intensities[to] = this.intensities[i]!;
      to += 1;
    }
    this.count = to;
    this.revision += 1;
  }
}
