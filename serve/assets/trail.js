// The path that the tool has gone, lit and dark. Points on one straight line are kept as its ends; when there are too
// many all the same, every other one is let go.

/** Numbers of a point: x, y, z [m], how much it was lit, 0 to 1. */
export const STRIDE = 4;
const MOST = 400_000;
/** How far a point may lie beside the line that it is left out of [m]. */
const STRAIGHT = 2e-6;
/** A way that is too short to have a direction [m]. */
const POINT = 5e-7;

/** What of four levels of light a share of time is: 0 dark, 3 all of it. */
export function lightLevel(lit) {
  return lit <= 0.02 ? 0 : lit < 0.34 ? 1 : lit < 0.75 ? 2 : 3;
}

export class Trail {
  constructor() {
    this.values = new Float64Array(4096 * STRIDE);
    this.clear();
  }

  clear() {
    this.count = 0;
    /** Counts up whenever points that were drawn have changed. */
    this.version = (this.version ?? 0) + 1;
    this.direction = null;
  }

  /** Adds points [x, y, z, lit]. */
  add(points) {
    for (const point of points) this.push(point[0], point[1], point[2] ?? 0, point[3] ?? 0);
  }

  push(x, y, z, lit) {
    if (![x, y, z].every(Number.isFinite)) return;
    const v = this.values;
    const last = (this.count - 1) * STRIDE;
    if (this.count > 0) {
      const isSameLight = lightLevel(lit) === lightLevel(v[last + 3]);
      const [dx, dy, dz] = [x - v[last], y - v[last + 1], z - v[last + 2]];
      const way = Math.hypot(dx, dy, dz);
      if (way < POINT && isSameLight) return;
      if (isSameLight && this.direction && this.goesOn(x, y, z)) {
        // The end of the line moves on; it was drawn before, and the rest of it is drawn over.
        v[last] = x;
        v[last + 1] = y;
        v[last + 2] = z;
        return;
      }
      this.direction = way > POINT ? [dx / way, dy / way, dz / way] : null;
    }
    this.reserve();
    this.values.set([x, y, z, lit], this.count * STRIDE);
    this.count += 1;
  }

  /** Whether a place is ahead on the line that the last two points began. */
  goesOn(x, y, z) {
    if (this.count < 2) return false;
    const v = this.values;
    const from = (this.count - 2) * STRIDE;
    const [dx, dy, dz] = [x - v[from], y - v[from + 1], z - v[from + 2]];
    const [ux, uy, uz] = this.direction;
    const along = dx * ux + dy * uy + dz * uz;
    const soFar = Math.hypot(v[from + STRIDE] - v[from], v[from + STRIDE + 1] - v[from + 1], v[from + STRIDE + 2] - v[from + 2]);
    return along > soFar && Math.hypot(dx - along * ux, dy - along * uy, dz - along * uz) < STRAIGHT;
  }

  reserve() {
    if (this.count === MOST) this.thin();
    if ((this.count + 1) * STRIDE <= this.values.length) return;
    const larger = new Float64Array(Math.min(this.values.length * 2, MOST * STRIDE));
    larger.set(this.values);
    this.values = larger;
  }

  thin() {
    const v = this.values;
    let kept = 0;
    for (let index = 0; index < this.count; index++) {
      const isEdge = index > 0 && lightLevel(v[index * STRIDE + 3]) !== lightLevel(v[(index - 1) * STRIDE + 3]);
      if (index % 2 === 0 || (isEdge && kept < index)) {
        v.copyWithin(kept * STRIDE, index * STRIDE, (index + 1) * STRIDE);
        kept += 1;
      }
    }
    this.count = Math.min(kept, MOST / 2 + MOST / 4);
    this.version += 1;
    this.direction = null;
  }

  /** Draws from point `first` on, those that are `step` apart. The light of a piece is that of its end. */
  draw(context, projection, first, step, style) {
    const v = this.values;
    const at = [0, 0];
    let level = -1;
    let [left, top] = [0, 0];
    const start = Math.max(0, first - 1);
    for (let index = start; index < this.count; index += step) {
      const i = index * STRIDE;
      projection.project(v[i], v[i + 1], v[i + 2], at);
      if (index > start) {
        const now = lightLevel(v[i + 3]);
        if (now !== level) {
          if (level >= 0) style(context, level);
          level = now;
          context.beginPath();
          context.moveTo(left, top);
        }
        context.lineTo(at[0], at[1]);
      }
      [left, top] = at;
    }
    if (level >= 0) style(context, level);
  }
}
