// Curves over the time that all charts share.

const CHARTS = {
  deviation: { title: "Deviation from the plan", unit: "µm" },
  speed: { title: "Speed of the tool", unit: "m/s" },
  power: { title: "Laser power", unit: "%" },
  following: { title: "Following error", unit: "mrad" },
  torque: { title: "Motor torque", unit: "mN·m" },
  current: { title: "Motor current", unit: "A" },
  voltage: { title: "Motor voltage", unit: "V" },
  latency: { title: "Latency", unit: "µs", hidden: ["loop", "setpoint"] },
};

/** Places of a chart's edges [units of the page]. */
const EDGE = { left: 56, right: 10, top: 8, bottom: 22 };

class Chart {
  constructor(id, curves, run, clock) {
    const { title, unit, hidden = [] } = CHARTS[id];
    Object.assign(this, { id, title, unit, run, clock });
    this.curves = curves.map((curve, index) => ({ curve, index: Chart.colour(id, index), isShown: !hidden.includes(curve.name) }));
    this.hover = null;
    this.layer = document.createElement("canvas");
    this.build();
    clock.listen(() => this.draw());
  }

  /** The dark way is grey wherever it is drawn. */
  static colour(id, index) {
    const own = { deviation: [0, 7], speed: [2], power: [4] }[id];
    return own ? own[index] : index % 8;
  }

  build() {
    const label = `${this.title} over time in ${this.unit}. The table of extremes and the values beside the names say it in numbers.`;
    this.canvas = element("canvas", { class: "chart", role: "img", "aria-label": label });
    this.values = this.curves.map((entry) => {
      const value = element("span", { class: "value" });
      const swatch = element("span", { class: "swatch" });
      swatch.style.background = `var(--curve-${entry.index})`;
      const name = element("button", {
        type: "button", class: "curve", "aria-pressed": String(entry.isShown), title: `Show or hide ${entry.curve.name}`,
        onclick: () => {
          entry.isShown = !entry.isShown;
          name.setAttribute("aria-pressed", String(entry.isShown));
          this.clock.changed();
        },
      }, swatch, `${entry.curve.name} `, value);
      entry.value = value;
      return name;
    });
    this.span = element("span", { class: "span" });
    const summary = element("summary", {}, `${this.title} `, element("span", { class: "unit" }, `[${this.unit}]`));
    this.root = element("details", { class: "chart-box", open: true }, summary,
      element("div", { class: "legend" }, ...this.values, this.span), this.canvas);
    fitCanvas(this.canvas, () => this.draw());
    new TimeGestures(this.canvas, this.clock, (x) => this.time(x), (time) => {
      this.hover = time;
      this.clock.changed();
    });
  }

  width() {
    return Math.max(this.canvas.clientWidth - EDGE.left - EDGE.right, 1);
  }

  x(time) {
    const { from, to } = this.clock;
    return EDGE.left + ((time - from) / (to - from)) * this.width();
  }

  time(x) {
    const { from, to } = this.clock;
    return from + ((x - EDGE.left) / this.width()) * (to - from);
  }

  /** Lowest and highest value of the window with some air; 0 is always seen. */
  range() {
    let [low, high] = [0, 0];
    for (const { curve, isShown } of this.curves) {
      const range = isShown ? curve.range(this.clock.from, this.clock.to) : null;
      if (range) [low, high] = [Math.min(low, range[0]), Math.max(high, range[1])];
    }
    if (high - low < 1e-12) high = low + 1;
    const air = 0.06 * (high - low);
    return [low < 0 ? low - air : low, high > 0 ? high + air : high];
  }

  draw() {
    const { canvas, clock } = this;
    this.tell();
    if (!this.root.open || canvas.clientHeight === 0) return;
    const scheme = colours();
    this.drawLayer(scheme);
    const context = begin(canvas);
    context.drawImage(this.layer, 0, 0, canvas.clientWidth, canvas.clientHeight);
    const height = canvas.clientHeight - EDGE.top - EDGE.bottom;
    const line = (time, colour, dashes) => {
      if (time === null || time < clock.from || time > clock.to) return;
      const at = Math.round(this.x(time)) + 0.5;
      context.strokeStyle = colour;
      context.setLineDash(dashes);
      context.lineWidth = 1.2;
      context.beginPath();
      context.moveTo(at, EDGE.top);
      context.lineTo(at, EDGE.top + height);
      context.stroke();
      context.setLineDash([]);
    };
    for (const event of this.run.events) line(event.time, scheme.plan, [2, 3]);
    line(clock.marker, scheme.cursor, [6, 4]);
    line(this.hover, scheme.dark, []);
    line(clock.cursor, scheme.cursor, []);
    if (clock.selection) {
      const [from, to] = clock.selection.map((time) => this.x(time));
      context.fillStyle = scheme.cursor;
      context.globalAlpha = 0.15;
      context.fillRect(from, EDGE.top, to - from, height);
      context.globalAlpha = 1;
    }
  }

  /** Draws grid and curves, unless they are as before. */
  drawLayer(scheme) {
    const { canvas, clock, layer } = this;
    const shown = this.curves.map(({ isShown }) => isShown);
    const key = [clock.from, clock.to, shown, canvas.width, canvas.height, scheme.paper].join();
    if (key === this.drawn) return;
    this.drawn = key;
    const context = begin(layer, canvas);
    const [low, high] = this.range();
    const height = canvas.clientHeight - EDGE.top - EDGE.bottom;
    const y = (value) => EDGE.top + ((high - value) / (high - low)) * height;
    this.drawGrid(context, scheme, [low, high], y);
    context.beginPath();
    context.rect(EDGE.left, EDGE.top, this.width(), height);
    context.clip();
    for (const entry of this.curves) {
      if (entry.isShown) this.drawCurve(context, entry.curve, scheme.curves[entry.index], y);
    }
  }

  drawGrid(context, { ink, grid }, [low, high], y) {
    const { from, to } = this.clock;
    const { clientWidth, clientHeight } = this.canvas;
    context.font = "12px system-ui, sans-serif";
    context.fillStyle = ink;
    context.strokeStyle = grid;
    context.lineWidth = 1;
    context.beginPath();
    const step = tickStep(high - low, clientHeight / 42);
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const value of ticks(low, high, step)) {
      const at = Math.round(y(value)) + 0.5;
      context.moveTo(EDGE.left, at);
      context.lineTo(clientWidth - EDGE.right, at);
      context.fillText(short(value, step), EDGE.left - 6, at);
    }
    const tick = timeStep(to - from, this.width() / 90);
    context.textAlign = "center";
    context.textBaseline = "top";
    for (const time of ticks(from, to, tick)) {
      const at = Math.round(this.x(time)) + 0.5;
      context.moveTo(at, EDGE.top);
      context.lineTo(at, clientHeight - EDGE.bottom);
      if (at < clientWidth - 24) context.fillText(clockText(time, tick), at, clientHeight - EDGE.bottom + 5);
    }
    context.stroke();
  }

  drawCurve(context, curve, colour, y) {
    const { from, to } = this.clock;
    const { low, high, width } = curve.level(from, to, this.width() * 3);
    const first = Math.max(Math.floor(from / width) - 1, 0);
    const last = Math.min(Math.ceil(to / width) + 1, low.length - 1);
    const pitch = this.x(width) - this.x(0);
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 1.4;
    context.beginPath();
    let [isOpen, before] = [false, 0];
    for (let index = first; index <= last; index += 1) {
      if (low[index] !== low[index]) {
        isOpen = false;
        continue;
      }
      const x = this.x((index + 0.5 * (width > this.run.period * 1.5)) * width);
      // From the value before to the nearer end of what the bucket holds, and through it.
      const isFalling = isOpen && before > 0.5 * (low[index] + high[index]);
      const [near, far] = isFalling ? [high[index], low[index]] : [low[index], high[index]];
      if (isOpen) context.lineTo(x, y(near));
      else context.moveTo(x, y(near));
      if (far !== near) context.lineTo(x, y(far));
      else if (!isOpen && low[index + 1] !== low[index + 1]) context.lineTo(x + 1, y(far));
      before = far;
      isOpen = true;
    }
    context.stroke();
    if (pitch < 7) return;
    for (let index = first; index <= last; index += 1) {
      if (low[index] === low[index]) context.fillRect(this.x(index * width) - 2, y(low[index]) - 2, 4, 4);
    }
  }

  /** Says the values at the cursor, the pointer or between cursor and marker. */
  tell() {
    const { clock } = this;
    const time = this.hover ?? clock.cursor;
    for (const { curve, value } of this.curves) {
      const [low, high] = curve.at(time);
      const step = curve.step();
      let text = high - low > step ? `${short(low, step)} … ${short(high, step)}` : short(high, step);
      if (clock.marker !== null) text += ` (Δ ${short(high - curve.at(clock.marker)[1], step)})`;
      value.textContent = text;
    }
    this.span.textContent = this.hover === null ? "" : `at ${clockText(this.hover, this.run.period)}`;
  }
}

/** Time by pointer: a drag chooses what to show, with shift or by touch it moves; a tap sets the cursor. */
class TimeGestures {
  constructor(canvas, clock, time, hover) {
    let start = null;
    const finish = () => {
      const chosen = clock.selection;
      clock.selection = null;
      start = null;
      if (chosen && chosen[1] - chosen[0] > 0.005 * (clock.to - clock.from)) clock.show(...chosen);
      clock.changed();
    };
    new Gestures(canvas, {
      drag: (dx, _, isPan) => {
        const moved = time(dx) - time(0);
        if (isPan || this.isTouch) clock.show(clock.from - moved, clock.to - moved);
        else if (start !== null) {
          clock.selection = [Math.min(start, this.at), Math.max(start, this.at)];
          clock.changed();
        }
      },
      zoom: (factor, x) => clock.zoom(1 / factor, time(x)),
      tap: (x) => {
        clock.isPlaying = false;
        clock.seek(time(x));
      },
      hover: (x) => hover(time(x)),
      leave: () => hover(null),
      double: () => clock.show(0, clock.end),
    }, (event) => event.ctrlKey || event.metaKey || event.altKey);
    canvas.addEventListener("pointerdown", (event) => {
      this.isTouch = event.pointerType === "touch";
      start = time(event.offsetX);
      this.at = start;
      hover(null);
    });
    canvas.addEventListener("pointermove", (event) => {
      this.at = time(event.offsetX);
    }, { capture: true });
    canvas.addEventListener("pointerup", finish);
    canvas.addEventListener("pointercancel", finish);
  }
}
