// A drawing on a canvas: working area, what is to be marked, the path as it is marked, and the tool. What seldom changes
// is kept as pictures: the ground with the drawing, and the path, to which only its new end is added.

import { frames, setAttribute, setText, sharpCanvas, show } from "./dom.js";
import { listen } from "./gestures.js";
import { fixed } from "./format.js";
import { Flat, Orbit } from "./projection.js";
import { drawGrid, drawRulers } from "./rulers.js";
import { color, onTheme } from "./theme.js";
import { drawArea, drawArtwork, drawAxes, drawBounds, drawTool } from "./marks.js";

/** While a view moves, no more pieces of the path than these are drawn. */
const QUICK = 40_000;

export class Drawing {
  /** `box` is the element around the canvas and its tools; `trail` the path, where there is one. */
  constructor(box, trail = null) {
    this.box = box;
    this.canvas = box.querySelector("canvas");
    this.label = box.querySelector(".pointer-place");
    this.trail = trail;
    this.flat = new Flat();
    this.orbit = new Orbit();
    this.isOrbit = false;
    /** Called with how far the drawing was dragged [m], where it may be. */
    this.onPlace = null;
    this.shift = [0, 0];
    this.showsDark = true;
    this.follows = false;
    this.isFitted = true;
    this.area = null;
    this.artwork = null;
    this.tool = null;
    this.isLit = false;
    this.pointer = null;
    this.ground = document.createElement("canvas");
    this.path = document.createElement("canvas");
    this.isGroundOld = true;
    this.drawnTo = 0;
    this.drawnVersion = -1;
    this.request = frames(this.canvas, () => this.draw());
    listen(this.canvas, this);
    onTheme(() => this.invalidate());
    for (const button of box.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => this.press(button));
    }
  }

  projection() {
    return this.isOrbit ? this.orbit : this.flat;
  }

  /** The view was moved by hand. */
  changed() {
    this.isFitted = false;
    this.isMoving = true;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.isMoving = false;
      this.invalidate();
    }, 160);
    this.invalidate();
  }

  invalidate() {
    this.isGroundOld = true;
    this.drawnVersion = -1;
    this.request();
  }

  hover(x, y) {
    this.pointer = x === null ? null : [x, y];
    if (this.label) {
      const isShown = this.pointer && !this.isOrbit;
      setText(this.label, isShown ? this.flat.placeAt(x, y).map((value, axis) => `${"xy"[axis]} ${fixed(value * 1e3, 2)}`).join("  ") + " mm" : "");
    }
    this.request();
  }

  /** Takes hold of the drawing, if it may be placed and the pointer is on it. */
  grab(x, y) {
    const bounds = this.artwork?.bounds;
    if (!this.onPlace || this.isOrbit || !bounds) return null;
    const from = this.flat.placeAt(x, y);
    const margin = 6 / this.flat.scale;
    const isOn = from.every((value, axis) => value > bounds.lower[axis] - margin && value < bounds.upper[axis] + margin);
    if (!isOn) return null;
    return {
      move: (left, top) => {
        this.shift = this.flat.placeAt(left, top).map((value, axis) => value - from[axis]);
        this.isFitted = false;
        this.invalidate();
      },
      end: () => {
        if (Math.hypot(...this.shift) * this.flat.scale > 3) this.onPlace(this.shift);
        else this.shift = [0, 0];
        this.invalidate();
      },
    };
  }

  press(button) {
    const projection = this.projection();
    const middle = [projection.width / 2, projection.height / 2];
    const toggle = (name) => {
      this[name] = !this[name];
      setAttribute(button, "aria-pressed", this[name]);
    };
    switch (button.dataset.view) {
      case "in": projection.zoomAt(...middle, 1.5); this.changed(); break;
      case "out": projection.zoomAt(...middle, 1 / 1.5); this.changed(); break;
      case "fit": this.fit(); break;
      case "area": this.fit(this.area); break;
      case "follow": toggle("follows"); break;
      case "dark": toggle("showsDark"); break;
      case "orbit": this.setOrbit(!this.isOrbit); break;
    }
    this.invalidate();
  }

  setOrbit(isOrbit) {
    this.isOrbit = isOrbit;
    const button = this.box.querySelector('[data-view="orbit"]');
    if (button) setAttribute(button, "aria-pressed", isOrbit);
    this.fit();
  }

  setArea(area, home) {
    this.area = area;
    this.home = home;
    if (this.isFitted) this.fit();
    this.invalidate();
  }

  /** What is to be marked: {strokes, bounds}, or null. */
  setArtwork(artwork) {
    this.artwork = artwork;
    this.shift = [0, 0];
    if (this.isFitted) this.fit();
    this.invalidate();
  }

  setTool(place, isLit) {
    const isSame = this.tool && this.isLit === isLit && place.every((value, axis) => value === this.tool[axis]);
    if (isSame && (!this.trail || this.drawnTo === this.trail.count)) return;
    this.tool = place;
    this.isLit = isLit;
    this.request();
  }

  /** Shows a box, by default the drawing with some of what is around it, or the area. */
  fit(bounds = this.artwork?.bounds ?? this.area) {
    if (!bounds?.lower) return;
    const projection = this.projection();
    if (this.canvas.clientWidth > 0) projection.resize(this.canvas.clientWidth, this.canvas.clientHeight);
    projection.fit(bounds, this.isOrbit ? 50 : Math.min(70, projection.width / 8));
    this.isFitted = bounds !== this.area || !this.artwork;
    this.fitted = bounds;
    this.invalidate();
  }

  /** Keeps the tool in sight: moves the view when it comes near the edge. */
  follow() {
    if (!this.follows || !this.tool) return;
    const projection = this.projection();
    const at = [0, 0];
    projection.project(...this.tool, at);
    const margin = Math.min(projection.width, projection.height) * 0.15;
    const isInside = at[0] > margin && at[1] > margin && at[0] < projection.width - margin && at[1] < projection.height - margin;
    if (isInside) return;
    projection.centerOn(...this.tool);
    this.isFitted = false;
    this.isGroundOld = true;
    this.drawnVersion = -1;
  }

  draw() {
    const [context, width, height] = sharpCanvas(this.canvas);
    const projection = this.projection();
    if (projection.width !== width || projection.height !== height) {
      projection.resize(width, height);
      if (this.isFitted && this.fitted) projection.fit(this.fitted, this.isOrbit ? 50 : Math.min(70, width / 8));
      this.isGroundOld = true;
      this.drawnVersion = -1;
    }
    this.follow();
    if (this.isGroundOld) this.drawGround();
    this.drawPath();
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.ground, 0, 0);
    if (this.trail) context.drawImage(this.path, 0, 0);
    context.restore();
    let at = null;
    if (this.tool) {
      at = [0, 0];
      projection.project(...this.tool, at);
      drawTool(context, at, this.isLit);
    }
    if (!this.isOrbit) drawRulers(context, projection, this.pointer, at);
    else drawAxes(context, projection);
  }

  /** A layer as large as the canvas, emptied. */
  layer(canvas) {
    const ratio = this.canvas.width / this.canvas.clientWidth;
    canvas.width = this.canvas.width;
    canvas.height = this.canvas.height;
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return context;
  }

  drawGround() {
    this.isGroundOld = false;
    const context = this.layer(this.ground);
    const projection = this.projection();
    context.fillStyle = color("ink-paper");
    context.fillRect(0, 0, projection.width, projection.height);
    drawArea(context, projection, this.area, this.home, this.isOrbit ? null : () => drawGrid(context, projection));
    if (!this.artwork) return;
    context.translate(this.shift[0] * projection.scale, -this.shift[1] * projection.scale);
    drawArtwork(context, projection, this.artwork.strokes, this.trail === null);
    if (this.trail === null && !this.isOrbit) drawBounds(context, projection, this.artwork.bounds);
  }

  drawPath() {
    const trail = this.trail;
    if (!trail) return;
    let first = this.drawnTo;
    let context = this.path.getContext("2d");
    if (this.drawnVersion !== trail.version || this.path.width !== this.canvas.width || this.path.height !== this.canvas.height) {
      context = this.layer(this.path);
      this.drawnVersion = trail.version;
      first = 0;
    }
    // The end of the last line may have moved on since it was drawn, so the line is drawn again.
    first = Math.max(0, Math.min(first, trail.count) - 1);
    const step = this.isMoving ? Math.max(1, Math.ceil((trail.count - first) / QUICK)) : 1;
    context.lineJoin = "round";
    context.lineCap = "round";
    trail.draw(context, this.projection(), first, step, (it, level) => {
      if (level === 0 && !this.showsDark) return;
      it.strokeStyle = color(level === 0 ? "ink-dark" : "ink-mark");
      it.globalAlpha = [1, 0.4, 0.7, 1][level];
      it.lineWidth = level === 0 ? 1 : 2;
      it.stroke();
      it.globalAlpha = 1;
    });
    this.drawnTo = trail.count;
  }
}

/** Offers the view in space where a machine is spatial, and begins with it. */
export function offerOrbit(drawing, isSpatial) {
  const button = drawing.box.querySelector('[data-view="orbit"]');
  show(button, isSpatial);
  if (isSpatial !== drawing.isOrbit) drawing.setOrbit(isSpatial);
}

