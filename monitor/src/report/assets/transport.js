// Playback: the bar at the foot of the page with the whole run in small, and the keys.

const RATES = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 50, 100];

class Transport {
  constructor(run, clock, actions) {
    Object.assign(this, { run, clock, actions });
    this.build();
    clock.listen(() => this.draw());
    document.addEventListener("keydown", (event) => this.key(event));
  }

  build() {
    const { clock } = this;
    this.playButton = button("▶", "Play (space)", () => clock.play(), { class: "play" });
    this.rate = choice("Speed", RATES.map((rate) => [rate, `× ${rate}`]), 1, (value) => {
      clock.rate = Number(value);
    });
    this.canvas = element("canvas", { "aria-hidden": "true" });
    this.slider = element("input", {
      type: "range", min: "0", max: String(clock.end), step: "any", value: "0", "aria-label": "Time of the run",
      oninput: () => {
        clock.isPlaying = false;
        clock.seek(Number(this.slider.value));
      },
    });
    this.time = element("output", { class: "time" });
    this.root = element("div", { class: "transport", role: "group", "aria-label": "Playback" },
      button("|◂", "To the start (Home)", () => clock.seek(0)),
      button("◂", "One cycle back (arrow left)", () => this.step(-1)), this.playButton,
      button("▸", "One cycle on (arrow right)", () => this.step(1)),
      button("▸|", "To the end (End)", () => clock.seek(clock.end)), this.rate,
      element("div", { class: "overview" }, this.canvas, this.slider), this.time,
      button("−", "Show more time (minus)", () => clock.zoom(2)), button("+", "Show less time (plus)", () => clock.zoom(0.5)),
      button("All", "Show all of the time (0)", () => clock.show(0, clock.end)),
      button("Marker", "Set a marker at the cursor, or take it away (M)", () => clock.mark()));
    fitCanvas(this.canvas, () => this.draw());
  }

  step(cycles) {
    this.clock.isPlaying = false;
    const { cursor, step } = this.clock;
    this.clock.seek((Math.round(cursor / step) + cycles) * step);
  }

  key(event) {
    const { clock } = this;
    const inField = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
    const onButton = /^(BUTTON|SUMMARY)$/.test(event.target.tagName);
    if (event.ctrlKey || event.metaKey || event.altKey || (inField && event.target.type !== "checkbox")) return;
    const much = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => (onButton || inField ? false : clock.play()),
      ArrowLeft: () => this.step(-much), ArrowRight: () => this.step(much),
      Home: () => clock.seek(0), End: () => clock.seek(clock.end),
      "+": () => clock.zoom(0.5), "=": () => clock.zoom(0.5), "-": () => clock.zoom(2), 0: () => clock.show(0, clock.end),
      m: () => clock.mark(), f: () => this.actions.fit(), "[": () => this.changeRate(-1), "]": () => this.changeRate(1),
    };
    const act = keys[event.key];
    if (!act || act() === false) return;
    event.preventDefault();
  }

  changeRate(places) {
    const select = this.rate.querySelector("select");
    select.selectedIndex = Math.min(Math.max(select.selectedIndex + places, 0), RATES.length - 1);
    this.clock.rate = Number(select.value);
  }

  draw() {
    const { clock, canvas, run } = this;
    this.playButton.textContent = clock.isPlaying ? "❚❚" : "▶";
    this.playButton.setAttribute("aria-label", clock.isPlaying ? "Pause (space)" : "Play (space)");
    if (document.activeElement !== this.slider || clock.isPlaying) this.slider.value = String(clock.cursor);
    this.slider.setAttribute("aria-valuetext", clockText(clock.cursor, run.period));
    const since = clock.marker === null ? "" : `, Δ ${clockText(clock.cursor - clock.marker, run.period)}`;
    this.time.textContent = `${clockText(clock.cursor, run.period)} of ${clockText(clock.end, 0.01)}${since}`;
    if (canvas.clientWidth === 0) return;
    const scheme = colours();
    const context = begin(canvas);
    const { clientWidth: width, clientHeight: height } = canvas;
    const x = (time) => (time / clock.end) * width;
    this.sketch(context, "speed", scheme.curves[2], width, height);
    this.sketch(context, "deviation", scheme.curves[0], width, height);
    context.fillStyle = scheme.back;
    context.globalAlpha = 0.7;
    context.fillRect(0, 0, x(clock.from), height);
    context.fillRect(x(clock.to), 0, width - x(clock.to), height);
    context.globalAlpha = 1;
    context.fillStyle = scheme.plan;
    for (const event of run.events) context.fillRect(x(event.time) - 1, 0, 2, 5);
    context.fillStyle = scheme.cursor;
    context.fillRect(x(clock.cursor) - 1, 0, 2, height);
  }

  /** A curve of the whole run, as high as the bar. */
  sketch(context, chart, colour, width, height) {
    const curve = this.run.charts.get(chart)?.[0];
    const range = curve?.range(0, this.clock.end);
    if (!range) return;
    const { low, high, width: bucket } = curve.level(0, this.clock.end, width * 2);
    const y = (value) => height - 1 - (value / (range[1] || 1)) * (height - 3);
    context.strokeStyle = colour;
    context.globalAlpha = 0.65;
    context.lineWidth = 1;
    context.beginPath();
    for (let index = 0; index < low.length; index += 1) {
      if (low[index] !== low[index]) continue;
      const x = (((index + 0.5) * bucket) / this.clock.end) * width;
      context.moveTo(x, y(low[index]));
      context.lineTo(x, y(high[index]) - 0.5);
    }
    context.stroke();
    context.globalAlpha = 1;
  }
}
