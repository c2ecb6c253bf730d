// How places of the machine come onto a canvas: from above with y up, or turned in space. Both are parallel, so that a
// millimetre is as long anywhere on the canvas. Places are in metres, the canvas in CSS pixels.

const LARGEST = 4e7;
const SMALLEST = 20;

/** What both have: a scale, and the middle of the canvas. */
class Projection {
  constructor() {
    this.scale = 2000;
    this.width = 1;
    this.height = 1;
  }

  resize(width, height) {
    this.width = width;
    this.height = height;
  }

  /** Makes everything `factor` times as large; the place at (x, y) of the canvas stays where it is. */
  zoomAt(x, y, factor) {
    const scale = Math.min(LARGEST, Math.max(SMALLEST, this.scale * factor));
    const [aside, down] = [x - this.width / 2, y - this.height / 2];
    const ratio = scale / this.scale;
    this.panBy(aside * (1 - ratio), down * (1 - ratio), ratio);
    this.scale = scale;
  }
}

/** From above. */
export class Flat extends Projection {
  constructor() {
    super();
    this.x = 0;
    this.y = 0;
  }

  /** Writes the place on the canvas into `out`. */
  project(x, y, z, out) {
    out[0] = this.width / 2 + (x - this.x) * this.scale;
    out[1] = this.height / 2 - (y - this.y) * this.scale;
  }

  /** The place under a point of the canvas. */
  placeAt(left, top) {
    return [this.x + (left - this.width / 2) / this.scale, this.y - (top - this.height / 2) / this.scale];
  }

  panBy(right, down, ratio = 1) {
    this.x -= right / (this.scale * ratio);
    this.y += down / (this.scale * ratio);
  }

  centerOn(x, y) {
    this.x = x;
    this.y = y;
  }

  /** Shows the box from `lower` to `upper`, with a margin in pixels. */
  fit({ lower, upper }, margin) {
    const wide = Math.max(upper[0] - lower[0], 1e-4);
    const high = Math.max(upper[1] - lower[1], 1e-4);
    const scale = Math.min((this.width - 2 * margin) / wide, (this.height - 2 * margin) / high);
    this.scale = Math.min(LARGEST, Math.max(SMALLEST, scale));
    this.x = (lower[0] + upper[0]) / 2;
    this.y = (lower[1] + upper[1]) / 2;
  }
}

/** Turned in space about a place in the middle. */
export class Orbit extends Projection {
  constructor() {
    super();
    this.yaw = -0.65;
    this.pitch = 0.6;
    this.middle = [0, 0, 0];
    this.turnBy(0, 0);
  }

  /** Turns as the pointer goes: the pitch stays between from below and from above. */
  turnBy(right, down) {
    this.yaw += right * 0.008;
    this.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.pitch + down * 0.008));
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    this.rightAxis = [cy, -sy, 0];
    this.upAxis = [sy * sp, cy * sp, cp];
  }

  project(x, y, z, out) {
    const [dx, dy, dz] = [x - this.middle[0], y - this.middle[1], z - this.middle[2]];
    const [r, u] = [this.rightAxis, this.upAxis];
    out[0] = this.width / 2 + (r[0] * dx + r[1] * dy) * this.scale;
    out[1] = this.height / 2 - (u[0] * dx + u[1] * dy + u[2] * dz) * this.scale;
  }

  panBy(right, down, ratio = 1) {
    const scale = this.scale * ratio;
    for (let axis = 0; axis < 3; axis++) {
      this.middle[axis] += (-right * this.rightAxis[axis] + down * this.upAxis[axis]) / scale;
    }
  }

  centerOn(x, y, z) {
    this.middle = [x, y, z];
  }

  fit({ lower, upper }, margin) {
    this.middle = [0, 1, 2].map((axis) => ((lower[axis] ?? 0) + (upper[axis] ?? 0)) / 2);
    let [wide, high] = [1e-4, 1e-4];
    for (let corner = 0; corner < 8; corner++) {
      const d = [0, 1, 2].map((axis) => ((corner >> axis) & 1 ? upper : lower)[axis] - this.middle[axis] || 0);
      const dot = (axis) => Math.abs(axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2]);
      wide = Math.max(wide, 2 * dot(this.rightAxis));
      high = Math.max(high, 2 * dot(this.upAxis));
    }
    const scale = Math.min((this.width - 2 * margin) / wide, (this.height - 2 * margin) / high);
    this.scale = Math.min(LARGEST, Math.max(SMALLEST, scale));
  }
}
