// From places in the machine to places on the screen: an orthographic view that is turned, moved and scaled.

const VIEWS = {
  top: { yaw: 0, pitch: Math.PI / 2 },
  front: { yaw: 0, pitch: 0 },
  side: { yaw: Math.PI / 2, pitch: 0 },
  corner: { yaw: -Math.PI / 6, pitch: Math.PI / 5 },
};

class Camera {
  constructor(bounds) {
    this.bounds = bounds;
    this.centre = bounds.map(([low, high]) => 0.5 * (low + high));
    this.width = 1;
    this.height = 1;
    this.scale = 1;
    this.isFitted = true;
    this.turn(VIEWS.top);
  }

  turn({ yaw, pitch }) {
    this.yaw = yaw;
    this.pitch = Math.min(Math.max(pitch, -Math.PI / 2), Math.PI / 2);
    const [sine, cosine] = [Math.sin(this.yaw), Math.cos(this.yaw)];
    const [rise, level] = [Math.sin(this.pitch), Math.cos(this.pitch)];
    this.right = [cosine, sine, 0];
    this.up = [-sine * rise, cosine * rise, level];
  }

  /** Whether x goes to the right and y up, in true scale. */
  isTop() {
    return this.yaw === 0 && this.pitch === Math.PI / 2;
  }

  resize(width, height) {
    [this.width, this.height] = [Math.max(width, 1), Math.max(height, 1)];
    if (this.isFitted) this.fit();
  }

  /** Shows all of the bounds. */
  fit() {
    this.centre = this.bounds.map(([low, high]) => 0.5 * (low + high));
    const extent = (direction) =>
      this.bounds.reduce((sum, [low, high], axis) => sum + Math.abs(direction[axis]) * (high - low), 0);
    const [across, along] = [Math.max(extent(this.right), 1e-6), Math.max(extent(this.up), 1e-6)];
    this.scale = Math.min((this.width - 110) / across, (this.height - 80) / along, 1e7);
    this.scale = Math.max(this.scale, 1);
    this.isFitted = true;
  }

  x(place) {
    return 0.5 * this.width + this.scale * this.along(this.right, place);
  }

  y(place) {
    return 0.5 * this.height - this.scale * this.along(this.up, place);
  }

  along(direction, place) {
    return direction.reduce((sum, part, axis) => sum + part * (place[axis] - this.centre[axis]), 0);
  }

  /** The place in the plane of the screen through the centre. */
  place(x, y) {
    const [right, up] = [(x - 0.5 * this.width) / this.scale, (0.5 * this.height - y) / this.scale];
    return this.centre.map((middle, axis) => middle + right * this.right[axis] + up * this.up[axis]);
  }

  /** Moves what is seen by some units of the page. */
  move(x, y) {
    this.centre = this.centre.map(
      (middle, axis) => middle - (x / this.scale) * this.right[axis] + (y / this.scale) * this.up[axis],
    );
    this.isFitted = false;
  }

  /** Scales about a point of the page. */
  zoom(factor, x = 0.5 * this.width, y = 0.5 * this.height) {
    const before = this.place(x, y);
    this.scale = Math.min(Math.max(this.scale * factor, 1), 1e9);
    const after = this.place(x, y);
    this.centre = this.centre.map((middle, axis) => middle + before[axis] - after[axis]);
    this.isFitted = false;
  }

  look(place) {
    this.centre = [...place];
    this.isFitted = false;
  }

  key() {
    return [this.yaw, this.pitch, this.scale, ...this.centre, this.width, this.height].join();
  }
}
