/** Rows of numbers by rising time; the oldest go when it is full or when they are too old. */
export class Table<Column extends string> {
  length = 0;
  private start = 0;
  private readonly capacity: number;
  readonly time: Float64Array;
  readonly columns: Record<Column, Float64Array>;

  /** Twice the rows are kept in memory, so that a view of them is always one piece. */
  constructor(
    readonly names: readonly Column[],
    private readonly most: number,
  ) {
    this.capacity = 2 * most;
    this.time = new Float64Array(this.capacity);
    this.columns = {} as Record<Column, Float64Array>;
    for (const name of names) this.columns[name] = new Float64Array(this.capacity);
  }

  get lastTime(): number {
    return this.length === 0 ? NaN : this.time[this.start + this.length - 1]!;
  }

  /** Adds a row; one that is older than the last begins the table anew. Returns false then. */
  push(time: number, row: Record<Column, number>): boolean {
    const follows = this.length === 0 || time > this.lastTime;
    if (!follows) {
      if (time > this.lastTime - 1) return true;
      this.clear();
    }
    if (this.length === this.most) {
      this.start += 1;
      this.length -= 1;
    }
    if (this.start + this.length === this.capacity) this.compact();
    const at = this.start + this.length;
    this.time[at] = time;
    for (const name of this.names) this.columns[name][at] = row[name];
    this.length += 1;
    return follows;
  }

  clear(): void {
    this.start = 0;
    this.length = 0;
  }

  /** Times from `from` to `to`, and the index range, for `slice`. */
  range(from: number, to: number): [number, number] {
    return [this.lowerBound(from), this.lowerBound(to + 1e-9)];
  }

  times(range: [number, number]): Float64Array {
    return this.time.subarray(this.start + range[0], this.start + range[1]);
  }

  values(name: Column, range: [number, number]): Float64Array {
    return this.columns[name].subarray(this.start + range[0], this.start + range[1]);
  }

  /** Row at or before `time`; -1 when there is none. */
  at(time: number): number {
    return this.lowerBound(time + 1e-9) - 1;
  }

  get(name: Column, row: number): number {
    return row < 0 || row >= this.length ? NaN : this.columns[name][this.start + row]!;
  }

  timeOf(row: number): number {
    return row < 0 || row >= this.length ? NaN : this.time[this.start + row]!;
  }

  private lowerBound(time: number): number {
    let low = 0;
    let high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[this.start + middle]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  private compact(): void {
    const end = this.start + this.length;
    this.time.copyWithin(0, this.start, end);
    for (const name of this.names) this.columns[name].copyWithin(0, this.start, end);
    this.start = 0;
  }
}
