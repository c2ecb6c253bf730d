// A curve over time in several levels: buckets of 1, 4, 16 … of the finest ones, each with its extremes.

const FACTOR = 4;

class Curve {
  constructor(name, low, high, width) {
    this.name = name;
    this.width = width;
    this.isExact = low === high;
    this.levels = [{ low, high }];
    while (low.length > 512) {
      [low, high] = Curve.coarser(low, high);
      this.levels.push({ low, high });
    }
  }

  static coarser(low, high) {
    const count = Math.ceil(low.length / FACTOR);
    const [lowest, highest] = [new Float32Array(count).fill(NaN), new Float32Array(count).fill(NaN)];
    for (let index = 0; index < low.length; index += 1) {
      const to = (index / FACTOR) | 0;
      // A comparison with NaN is false.
      if (!(lowest[to] <= low[index]) && low[index] === low[index]) lowest[to] = low[index];
      if (!(highest[to] >= high[index]) && high[index] === high[index]) highest[to] = high[index];
    }
    return [lowest, highest];
  }

  /** Lowest and highest value around a time [s]; NaN where there is none. */
  at(time) {
    const { low, high } = this.levels[0];
    const index = Math.min(Math.max(Math.floor(time / this.width + 1e-6), 0), low.length - 1);
    return [low[index] ?? NaN, high[index] ?? NaN];
  }

  /** The level with about `most` buckets or fewer between two times, and the width of its buckets [s]. */
  level(from, to, most) {
    let width = this.width;
    for (const level of this.levels) {
      if ((to - from) / width <= most) return { ...level, width };
      width *= FACTOR;
    }
    return { ...this.levels.at(-1), width: width / FACTOR };
  }

  /** Lowest and highest value between two times, as a chart of some width shows them; null without any. */
  range(from, to) {
    const { low, high, width } = this.level(from, to, 4096);
    const first = Math.max(Math.floor(from / width), 0);
    const last = Math.min(Math.ceil(to / width), low.length - 1);
    let [lowest, highest] = [Infinity, -Infinity];
    for (let index = first; index <= last; index += 1) {
      if (low[index] < lowest) lowest = low[index];
      if (high[index] > highest) highest = high[index];
    }
    return lowest <= highest ? [lowest, highest] : null;
  }

  /** The step in which values are told: a thousandth of the largest. */
  step() {
    this.told ??= Math.abs(this.extreme()?.value ?? 1) / 1000;
    return this.told;
  }

  /** The value farthest from 0 and when [s]; null without any. */
  extreme() {
    const { low, high } = this.levels[0];
    let [value, at] = [0, -1];
    for (let index = 0; index < low.length; index += 1) {
      const candidate = -low[index] > high[index] ? low[index] : high[index];
      if (at < 0 ? candidate === candidate : Math.abs(candidate) > Math.abs(value)) {
        [value, at] = [candidate, index];
      }
    }
    return at < 0 ? null : { value, time: (at + 0.5) * this.width };
  }
}
