// The picture of a scope: ten by eight divisions, traces with a scale and an offset of their own, two cursors, and the
// part of the time that is shown. Time is seen from the trigger, in seconds.

import { frames, sharpCanvas } from "./dom.js";
import { engineering } from "./format.js";
import { color, onTheme } from "./theme.js";

const ACROSS = 10;
export const DOWN = 8;
/** How near to a cursor a pointer takes it [pixels]. */
const NEAR = 10;

export class ScopePlot {
  /** `traces()` gives {index, scale, offset, isHidden} by signal name; `moved()` is called when cursors moved. */
  constructor(canvas, traces, moved) {
    this.canvas = canvas;
    this.traces = traces;
    this.moved = moved;
    this.picture = null;
    /** The time shown, or null for all of it. */
    this.range = null;
    /** Both cursors [s], or null where they are off. */
    this.cursors = null;
    this.lastCursor = 0;
    /** The level of the trigger: {signal, level}, or null. */
    this.trigger = null;
    this.request = frames(canvas, () => this.draw());
    onTheme(() => this.request());
    this.listen();
  }

  span() {
    const { start, period, samples } = this.picture ?? { start: 0, period: 0.1, samples: 11 };
    return [start, start + period * Math.max(1, samples - 1)];
  }

  shown() {
    return this.range ?? this.span();
  }

  show(picture) {
    const before = this.picture && this.span();
    this.picture = picture;
    const [low, high] = this.span();
    if (before && Math.abs(before[1] - before[0] - (high - low)) > (high - low) * 0.02) this.range = null;
    this.request();
  }

  xOf(time) {
    const [low, high] = this.shown();
    return ((time - low) / (high - low)) * this.canvas.clientWidth;
  }

  timeAt(x) {
    const [low, high] = this.shown();
    return low + (x / this.canvas.clientWidth) * (high - low);
  }

  zoom(x, factor) {
    const at = this.timeAt(x);
    const [low, high] = this.shown();
    const period = this.picture?.period ?? 1e-4;
    const width = Math.max((high - low) / factor, period * 4);
    const ratio = width / (high - low);
    this.setRange(at - (at - low) * ratio, at + (high - at) * ratio);
  }

  pan(pixels) {
    const [low, high] = this.shown();
    const way = (pixels / this.canvas.clientWidth) * (high - low);
    this.setRange(low - way, high - way);
  }

  setRange(low, high) {
    const [first, last] = this.span();
    if (high - low >= last - first) this.range = null;
    else {
      const shift = Math.max(0, first - low) - Math.max(0, high - last);
      this.range = [low + shift, high + shift];
    }
    this.request();
  }

  showAll() {
    this.range = null;
    this.request();
  }

  toggleCursors() {
    const [low, high] = this.shown();
    this.cursors = this.cursors ? null : [low + (high - low) * 0.33, low + (high - low) * 0.67];
    this.moved();
    this.request();
  }

  setCursor(which, time) {
    if (!this.cursors) this.toggleCursors();
    const [first, last] = this.span();
    this.cursors[which] = Math.min(last, Math.max(first, time));
    this.lastCursor = which;
    this.moved();
    this.request();
  }

  /** The value of a trace at a time. */
  valueAt(index, time) {
    const { start, period, traces } = this.picture;
    return traces[index]?.[Math.round((time - start) / period)] ?? NaN;
  }

  listen() {
    const { canvas } = this;
    let drag = null;
    const pointers = new Map();
    const xFrom = (event) => event.clientX - canvas.getBoundingClientRect().left;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      canvas.setPointerCapture(event.pointerId);
      const x = xFrom(event);
      pointers.set(event.pointerId, x);
      const reach = event.pointerType === "touch" ? NEAR * 2 : NEAR;
      const near = this.cursors?.map((time) => Math.abs(this.xOf(time) - x)) ?? [];
      const cursor = near.length && Math.min(...near) < reach ? near.indexOf(Math.min(...near)) : -1;
      drag = { cursor };
    });
    canvas.addEventListener("pointermove", (event) => {
      const x = xFrom(event);
      if (!drag || !pointers.has(event.pointerId)) {
        const isNear = this.cursors?.some((time) => Math.abs(this.xOf(time) - x) < NEAR);
        canvas.style.cursor = isNear ? "ew-resize" : "crosshair";
        return;
      }
      const before = [...pointers.values()];
      pointers.set(event.pointerId, x);
      const now = [...pointers.values()];
      if (drag.cursor >= 0) this.setCursor(drag.cursor, this.timeAt(x));
      else if (now.length > 1) {
        const apart = Math.abs(before[0] - before[1]);
        if (apart > 5) this.zoom((now[0] + now[1]) / 2, Math.max(5, Math.abs(now[0] - now[1])) / apart);
      } else this.pan(now[0] - before[0]);
    });
    for (const type of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(type, (event) => {
        pointers.delete(event.pointerId);
        if (pointers.size === 0) drag = null;
      });
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(xFrom(event), Math.exp(-event.deltaY * (event.deltaMode === 1 ? 33 : 1) * 0.0016));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.showAll());
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      const middle = canvas.clientWidth / 2;
      const nudge = (sign) => {
        const [low, high] = this.shown();
        const step = Math.max(this.picture?.period ?? 0, (high - low) / 200);
        this.setCursor(this.lastCursor, (this.cursors?.[this.lastCursor] ?? this.timeAt(middle)) + sign * step);
      };
      const keys = {
        ArrowLeft: () => this.pan(60), ArrowRight: () => this.pan(-60), "+": () => this.zoom(middle, 1.5), "=": () => this.zoom(middle, 1.5),
        "-": () => this.zoom(middle, 1 / 1.5), "0": () => this.showAll(), a: () => this.setCursor(0, this.timeAt(middle)),
        b: () => this.setCursor(1, this.timeAt(middle)), ",": () => nudge(-1), ".": () => nudge(1),
      };
      if (!keys[event.key]) return;
      event.preventDefault();
      event.stopPropagation();
      keys[event.key]();
    });
  }

  draw() {
    const [context, width, height] = sharpCanvas(this.canvas);
    context.fillStyle = color("ink-paper");
    context.fillRect(0, 0, width, height);
    this.drawDivisions(context, width, height);
    if (this.picture) {
      const known = this.traces();
      this.picture.signals.forEach((signal, index) => {
        const trace = known.get(nameOf(signal));
        if (trace && !trace.isHidden) this.drawTrace(context, index, trace, width, height);
      });
    }
    this.drawTrigger(context, width, height);
    this.drawCursors(context, height);
  }

  drawDivisions(context, width, height) {
    context.lineWidth = 1;
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = color("dim");
    for (let index = 0; index <= ACROSS; index++) {
      const x = Math.round((index / ACROSS) * (width - 1)) + 0.5;
      context.strokeStyle = color(index === ACROSS / 2 ? "line-strong" : "ink-grid-strong");
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, height);
      context.stroke();
      if (index % 2 === 0 && index < ACROSS) context.fillText(engineering(this.timeAt(x), "s", 3), x + 4, height - 6);
    }
    for (let index = 0; index <= DOWN; index++) {
      const y = Math.round((index / DOWN) * (height - 1)) + 0.5;
      context.strokeStyle = color(index === DOWN / 2 ? "line-strong" : "ink-grid-strong");
      context.beginPath();
      context.moveTo(0, y);
      context.lineTo(width, y);
      context.stroke();
    }
  }

  /** Where a value of a trace is, from above. */
  yOf(value, trace, height) {
    return height / 2 - ((value - trace.offset) / trace.scale) * (height / DOWN);
  }

  drawTrace(context, index, trace, width, height) {
    const { start, period } = this.picture;
    const values = this.picture.traces[index];
    const [low, high] = this.shown();
    const first = Math.max(0, Math.floor((low - start) / period) - 1);
    const last = Math.min(values.length - 1, Math.ceil((high - start) / period) + 1);
    const y = (value) => Math.max(-1e4, Math.min(1e4, this.yOf(value, trace, height)));
    context.strokeStyle = color(`trace-${trace.index + 1}`);
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    context.beginPath();
    let isDown = false;
    const perPixel = (last - first) / width;
    if (perPixel > 2) {
      // Of more samples than pixels, the least and the greatest of each pixel: no peak is lost.
      for (let x = 0; x <= width; x++) {
        const from = Math.max(first, Math.floor((this.timeAt(x) - start) / period));
        const to = Math.min(last, Math.floor((this.timeAt(x + 1) - start) / period));
        let [least, most] = [Infinity, -Infinity];
        for (let i = from; i <= to; i++) {
          if (values[i] < least) least = values[i];
          if (values[i] > most) most = values[i];
        }
        if (least > most) {
          isDown = false;
          continue;
        }
        if (isDown) context.lineTo(x, y(most));
        else context.moveTo(x, y(most));
        context.lineTo(x, y(least));
        isDown = true;
      }
    } else {
      for (let i = first; i <= last; i++) {
        const value = values[i];
        if (!Number.isFinite(value)) {
          isDown = false;
          continue;
        }
        const x = this.xOf(start + i * period);
        if (isDown) context.lineTo(x, y(value));
        else context.moveTo(x, y(value));
        isDown = true;
      }
    }
    context.stroke();
    // Where its zero is, at the left edge.
    const zero = this.yOf(0, trace, height);
    context.fillStyle = context.strokeStyle;
    const inside = Math.min(height - 6, Math.max(6, zero));
    context.beginPath();
    context.moveTo(0, inside - 5);
    context.lineTo(8, inside);
    context.lineTo(0, inside + 5);
    context.fill();
  }

  drawTrigger(context, width, height) {
    const trace = this.trigger && this.traces().get(this.trigger.signal);
    if (!trace) return;
    context.strokeStyle = color(`trace-${trace.index + 1}`);
    context.setLineDash([2, 5]);
    const y = this.yOf(this.trigger.level, trace, height);
    const x = this.xOf(0);
    context.beginPath();
    context.moveTo(0, y);
    context.lineTo(width, y);
    if (this.picture?.triggered) {
      context.moveTo(x, 0);
      context.lineTo(x, height);
    }
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = context.strokeStyle;
    context.fillText("T", width - 12, y - 4);
  }

  drawCursors(context, height) {
    if (!this.cursors) return;
    context.strokeStyle = color("text");
    context.fillStyle = color("text");
    context.lineWidth = 1.2;
    context.font = "600 12px system-ui, sans-serif";
    this.cursors.forEach((time, which) => {
      const x = Math.round(this.xOf(time)) + 0.5;
      context.setLineDash(which === 0 ? [] : [6, 4]);
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, height);
      context.stroke();
      context.fillText("AB"[which], x + 4, 14);
    });
    context.setLineDash([]);
  }
}

/** A signal in the header of a picture is its name, or an object with one. */
export function nameOf(signal) {
  return typeof signal === "string" ? signal : signal.name;
}
