// The way of the tool through space and time.

const LIGHT = { UNKNOWN: 0, DARK: 1, LIT: 2 };

class Track {
  constructor(parts) {
    Object.assign(this, parts);
    this.count = this.time.length;
  }

  isLit(index) {
    return this.light[index] >= LIGHT.LIT;
  }

  /** Power from a point on, as a fraction of full scale; 0 in the dark. */
  power(index) {
    return this.isLit(index) ? (this.light[index] - LIGHT.LIT) * this.powerStep : 0;
  }

  /** How far the tool is from its plan at a point [m]. */
  distance(index) {
    const [dx, dy, dz] = this.deviation;
    return Math.hypot(dx[index], dy[index], dz[index]);
  }

  /** The last point not later than a time [s]; 0 before the first. */
  index(time) {
    let [low, high] = [0, this.count];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[middle] <= time) low = middle + 1;
      else high = middle;
    }
    return Math.max(low - 1, 0);
  }

  /** Where the tool was at a time and how far from its plan [m]; null where nobody knows. */
  at(time) {
    if (this.count === 0 || time < this.time[0]) return null;
    const index = this.index(time);
    const next = Math.min(index + 1, this.count - 1);
    const span = this.time[next] - this.time[index];
    if (this.light[index] === LIGHT.UNKNOWN && time > this.time[index] + 1e-9) return null;
    const part = span > 0 ? Math.min((time - this.time[index]) / span, 1) : 0;
    const between = (numbers) => numbers[index] + part * (numbers[next] - numbers[index]);
    return { index, place: this.place.map(between), deviation: this.deviation.map(between) };
  }

  /** Lowest and highest place along x, y and z of what was to be marked and was; of all where that is nothing [m]. */
  bounds(plan) {
    const isLit = (index) => this.isLit(index) || (index > 0 && this.isLit(index - 1));
    const isAnything = plan.stroke.length > 0 || this.light.some((light) => light >= LIGHT.LIT);
    return this.place.map((numbers, axis) => {
      let [low, high] = [Infinity, -Infinity];
      const widen = (value) => {
        if (value < low) low = value;
        if (value > high) high = value;
      };
      for (let index = 0; index < this.count; index += 1) {
        if (!isAnything || isLit(index)) widen(numbers[index]);
      }
      plan.place[axis].forEach(widen);
      return low <= high ? [low, high] : [0, 0.01];
    });
  }

  /** The number by which the largest deviation shows as a part of a drawing of this size [m]. */
  gain(size) {
    let largest = 0;
    for (let index = 0; index < this.count; index += 1) {
      if (this.isLit(index)) largest = Math.max(largest, this.distance(index));
    }
    const wanted = (0.03 * size) / Math.max(largest, 1e-9);
    return GAINS.filter((gain) => gain <= wanted).at(-1) ?? 1;
  }
}

const GAINS = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
