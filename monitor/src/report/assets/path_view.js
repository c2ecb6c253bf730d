// The picture of the path: pan, zoom and turn it, with the tool where it was at the cursor.

/** How near to the pointer a place must be to be told [units of the page]. */
const NEAR = 14;

class PathView {
  constructor(run, clock) {
    Object.assign(this, { run, clock });
    this.bounds = run.track.bounds(run.plan);
    const sizes = this.bounds.map(([low, high]) => high - low);
    this.isSpatial = sizes[2] > Math.max(1e-5, 0.002 * Math.max(sizes[0], sizes[1]));
    this.camera = new Camera(this.bounds);
    this.painter = new Painter(run);
    this.suggested = run.track.gain(Math.max(...sizes));
    this.options = { gain: 1, colourBy: "none", isPlanShown: true, isMarkedShown: true, isDarkShown: true, isGrowing: false, isFollowing: false };
    this.layer = document.createElement("canvas");
    this.drawn = { key: "", planned: 0, until: 0 };
    this.most = 50000;
    this.hover = null;
    this.build();
    clock.listen(() => this.draw());
  }

  build() {
    const label = "Path of the tool, planned and marked, in millimetres. Arrow keys move it, plus and minus zoom, F fits it.";
    this.canvas = element("canvas", { class: "path", tabindex: "0", role: "img", "aria-label": label });
    this.told = element("p", { class: "told" });
    this.scale = element("div", { class: "ramp", hidden: true });
    const set = (name) => (value) => {
      this.options[name] = value;
      this.refresh();
    };
    const gains = GAINS.map((gain) => [gain, gain === 1 ? "true to scale" : `× ${gain}`]);
    const gain = choice("Deviation", gains, 1, (value) => set("gain")(Number(value)));
    const measures = [["none", "one colour"], ["deviation", "deviation"], ["speed", "speed"], ["power", "power"], ["time", "time"]];
    const colour = choice("Colour by", measures.filter(([name]) => name === "none" || this.painter.measures[name]), "none", set("colourBy"));
    const view = (name, text) => button(text, `${text} view`, () => this.turn(VIEWS[name]));
    const magnify = button(`× ${this.suggested}`, `Magnify the deviation ${this.suggested} times, so that the largest is well seen`, () => {
      gain.querySelector("select").value = String(this.suggested);
      set("gain")(this.suggested);
    });
    const tools = element("div", { class: "tools", role: "group", "aria-label": "Path" },
      button("Fit", "Fit: show all that is marked (F)", () => this.fit()),
      button("+", "Zoom in", () => this.zoom(1.5)), button("−", "Zoom out", () => this.zoom(1 / 1.5)),
      ...(this.isSpatial ? [view("top", "Top"), view("front", "Front"), view("side", "Side"), view("corner", "Corner")] : []),
      gain, ...(this.suggested > 1 ? [magnify] : []), colour,
      toggle("planned", true, set("isPlanShown")), toggle("marked", true, set("isMarkedShown")),
      toggle("in the dark", true, set("isDarkShown")), toggle("only up to the cursor", false, set("isGrowing")),
      toggle("follow the tool", false, set("isFollowing")));
    const frame = element("div", { class: "frame" }, this.canvas, this.scale);
    this.root = element("section", { class: "path-view", "aria-label": "Path" }, element("h2", {}, "Path"), tools, frame, this.told);
    fitCanvas(this.canvas, () => {
      this.camera.resize(this.canvas.clientWidth, this.canvas.clientHeight);
      this.draw();
    });
    if (this.isSpatial) this.camera.turn(VIEWS.corner);
    new Gestures(this.canvas, {
      drag: (x, y, isPan) => this.drag(x, y, isPan),
      zoom: (factor, x, y) => this.zoom(factor, x, y),
      tap: (x, y) => this.tap(x, y),
      hover: (x, y) => this.point(x, y),
      leave: () => this.point(null),
      double: () => this.fit(),
    });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  refresh() {
    this.drawn.key = "";
    this.clock.changed();
  }

  fit() {
    this.camera.fit();
    this.clock.changed();
  }

  turn(view) {
    this.camera.turn(view);
    this.fit();
  }

  zoom(factor, x, y) {
    this.camera.zoom(factor, x, y);
    this.clock.changed();
  }

  drag(x, y, isPan) {
    if (this.isSpatial && !isPan) {
      this.camera.turn({ yaw: this.camera.yaw - x * 0.008, pitch: this.camera.pitch + y * 0.008 });
    } else {
      this.camera.move(x, y);
    }
    this.clock.changed();
  }

  key(event) {
    const moves = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
    if (moves[event.key]) this.drag(...moves[event.key], !event.altKey);
    else if (event.key === "+" || event.key === "=") this.zoom(1.25);
    else if (event.key === "-") this.zoom(0.8);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** The point of the way nearest to a place on the screen; null where none is near. */
  nearest(x, y) {
    const { track } = this.run;
    const extra = this.options.gain - 1;
    const { camera } = this;
    const [rx, ry, rz] = camera.right.map((part) => part * camera.scale);
    const [ux, uy, uz] = camera.up.map((part) => part * camera.scale);
    const [px, py, pz] = track.place;
    const [dx, dy, dz] = track.deviation;
    const [cx, cy, cz] = camera.centre;
    let [best, found] = [NEAR * NEAR, null];
    let [x0, y0] = [0, 0];
    for (let index = 0; index < track.count; index += 1) {
      const a = px[index] - cx + extra * dx[index];
      const b = py[index] - cy + extra * dy[index];
      const c = pz[index] - cz + extra * dz[index];
      const x1 = 0.5 * camera.width + rx * a + ry * b + rz * c - x;
      const y1 = 0.5 * camera.height - ux * a - uy * b - uz * c - y;
      if (index > 0 && track.light[index - 1] !== LIGHT.UNKNOWN) {
        // The foot on the line from the point before, places relative to the pointer.
        const [alongX, alongY] = [x1 - x0, y1 - y0];
        const square = alongX * alongX + alongY * alongY;
        const part = square > 0 ? Math.min(Math.max(-(x0 * alongX + y0 * alongY) / square, 0), 1) : 0;
        const [footX, footY] = [x0 + part * alongX, y0 + part * alongY];
        const lit = track.isLit(index - 1) ? 1 : 2;
        const distance = (footX * footX + footY * footY) * lit;
        if (distance < best) {
          best = distance;
          found = track.time[index - 1] + part * (track.time[index] - track.time[index - 1]);
        }
      }
      [x0, y0] = [x1, y1];
    }
    return found;
  }

  tap(x, y) {
    const time = this.nearest(x, y);
    if (time === null) return;
    this.clock.isPlaying = false;
    this.clock.seek(time);
  }

  point(x, y) {
    this.hover = x === null ? null : { x, y };
    this.clock.changed();
  }

  draw() {
    const { camera, options, clock, canvas } = this;
    if (canvas.clientWidth === 0) return;
    const scheme = colours();
    if (options.isFollowing) {
      const tool = this.run.track.at(clock.cursor);
      if (tool) camera.look(tool.place);
    }
    this.drawLayer(scheme);
    const context = begin(canvas);
    context.drawImage(this.layer, 0, 0, canvas.clientWidth, canvas.clientHeight);
    this.drawTool(context, scheme);
    if (camera.isTop()) drawRulerText(context, camera, scheme);
    this.tell();
  }

  /**
   * Draws what does not move with the cursor, and only what is new of it. A long path takes several pictures, so that
   * it can be moved all the while.
   */
  drawLayer(scheme) {
    const { camera, options, clock, layer, canvas } = this;
    const { track, plan } = this.run;
    const window = clock.isWhole() ? [0, track.count] : [track.index(clock.from), track.index(clock.to)];
    const key = [camera.key(), ...Object.values(options), scheme.paper, canvas.width, window].join();
    const until = options.isGrowing ? track.index(clock.cursor) + 1 : track.count;
    const planned = options.isPlanShown ? plan.stroke.length : 0;
    const isNew = key !== this.drawn.key || until < this.drawn.until;
    if (isNew) this.drawn = { key, planned: 0, until: 0 };
    const { drawn } = this;
    if (!isNew && until === drawn.until && planned === drawn.planned) return;
    const context = isNew ? begin(layer, canvas) : layer.getContext("2d");
    if (isNew) {
      context.lineJoin = "round";
      if (camera.isTop()) drawRuler(context, camera, scheme);
      else drawBox(context, camera, scheme);
    }
    let left = this.pace();
    if (drawn.planned < planned) {
      const isThin = options.gain > 1;
      const to = Math.min(drawn.planned + left, planned);
      const style = { colour: scheme.plan, line: isThin ? 1.2 : 5, alpha: isThin ? 1 : 0.45 };
      this.painter.plan(context, camera, drawn.planned, to, style);
      left -= to - drawn.planned;
      drawn.planned = to;
    }
    if (drawn.until < until && left > 0) {
      const to = Math.min(drawn.until + left, until);
      this.painter.track(context, camera, {
        from: Math.max(drawn.until - 1, 0), to, extra: options.gain - 1,
        colourBy: options.colourBy, isDarkShown: options.isDarkShown && options.gain === 1,
        isMarkedShown: options.isMarkedShown, faint: window, colours: scheme,
      });
      drawn.until = to;
    }
    this.isBusy = drawn.until < until || drawn.planned < planned;
    if (this.isBusy) clock.changed();
    this.showRamp();
  }

  /** How many points to draw in this picture: as many as keep pictures a thirtieth of a second apart. */
  pace() {
    const now = performance.now();
    if (this.isBusy) this.most = Math.min(Math.max(this.most * Math.min(33 / (now - this.paced), 2), 4000), 1e6);
    this.paced = now;
    return Math.ceil(this.most);
  }

  showRamp() {
    const { colourBy } = this.options;
    this.scale.hidden = colourBy === "none";
    if (this.scale.hidden) return;
    const [low, high] = this.painter.range(colourBy);
    const { unit } = this.painter.measures[colourBy];
    const bar = element("span", { class: "bar" });
    bar.style.background = `linear-gradient(to right, ${RAMP.join(", ")})`;
    this.scale.replaceChildren(short(low, (high - low) / 100), bar, `${short(high, (high - low) / 100)} ${unit}`);
  }

  /** Draws the tool and where the plan has it. */
  drawTool(context, scheme) {
    const { camera, options } = this;
    const tool = this.run.track.at(this.clock.cursor);
    if (!tool) return;
    const moved = tool.place.map((value, axis) => value + (options.gain - 1) * tool.deviation[axis]);
    const planned = tool.place.map((value, axis) => value - tool.deviation[axis]);
    const [x, y] = [camera.x(moved), camera.y(moved)];
    context.lineWidth = 1.5;
    context.strokeStyle = scheme.plan;
    context.beginPath();
    context.moveTo(camera.x(planned), camera.y(planned));
    context.lineTo(x, y);
    context.stroke();
    context.strokeStyle = scheme.cursor;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + 7 * dx, y + 7 * dy);
      context.lineTo(x + 18 * dx, y + 18 * dy);
    }
    context.stroke();
    context.fillStyle = this.run.track.isLit(tool.index) ? scheme.curves[4] : scheme.paper;
    context.beginPath();
    context.arc(x, y, 4.5, 0, 2 * Math.PI);
    context.fill();
    context.stroke();
  }

  /** Says in words where the tool is at the cursor, or at the place under the pointer. */
  tell() {
    const { track, plan, strokes } = this.run;
    const time = this.hover ? this.nearest(this.hover.x, this.hover.y) ?? this.clock.cursor : this.clock.cursor;
    const tool = track.at(time);
    if (!tool) {
      this.told.textContent = `${clockText(time)}: the tool's place is not known`;
      return;
    }
    const axes = this.isSpatial ? ["x", "y", "z"] : ["x", "y"];
    const place = axes.map((name, axis) => `${name} ${short(tool.place[axis] * 1000, 0.001)}`).join(", ");
    const distance = Math.hypot(...tool.deviation) * 1e6;
    const stroke = track.stroke[tool.index];
    const line = plan.lines[stroke - 1];
    const light = track.isLit(tool.index)
      ? `stroke ${stroke} of ${strokes}${line ? `, line ${line}` : ""}, power ${short(track.power(tool.index) * 100, 1)} %`
      : "in the dark";
    this.told.textContent = `${this.hover && time !== this.clock.cursor ? "here " : ""}${clockText(time)}: ${place} mm, off the plan by ${short(distance, 0.01)} µm, ${light}`;
  }
}
