// Latency of each hop as a histogram that goes on, times and counts on logarithmic axes.

import { byId, make, setText, sharpCanvas } from "./dom.js";
import { on } from "./connection.js";
import { nanoseconds } from "./format.js";
import { color, onTheme } from "./theme.js";

const MEANING = {
  wake: "deadline to controller running", compute: "controller's step", command: "controller to drives",
  exchange: "drives with the hardware", feedback: "drives to controller", loop: "measurement to its command",
  setpoint: "planner to controller",
};
const MARKS = [["p50", "50 %"], ["p99", "99 %"], ["p999", "99.9 %"], ["max", "max"]];
const BINS_PER_DECADE = 12;

let hops = {};
const rows = new Map();

/** Powers of ten between which all hops lie. */
function decades() {
  let [low, high] = [Infinity, 0];
  for (const { count, min, max } of Object.values(hops)) {
    if (!count) continue;
    low = Math.min(low, Math.max(1, min));
    high = Math.max(high, max);
  }
  if (!(high > 0)) return [2, 7];
  const first = Math.floor(Math.log10(low));
  return [first, Math.max(first + 2, Math.ceil(Math.log10(high + 1)))];
}

function binned(histogram, first, last) {
  const bins = new Float64Array((last - first) * BINS_PER_DECADE);
  for (const [ns, count] of histogram ?? []) {
    const bin = Math.floor((Math.log10(Math.max(1, ns)) - first) * BINS_PER_DECADE);
    bins[Math.min(bins.length - 1, Math.max(0, bin))] += count;
  }
  return bins;
}

function draw(canvas, hop, [first, last]) {
  const [context, width, height] = sharpCanvas(canvas);
  if (width === 0) return;
  context.clearRect(0, 0, width, height);
  const [left, bottom] = [34, height - 16];
  const x = (ns) => left + ((Math.log10(Math.max(1, ns)) - first) / (last - first)) * (width - left - 40);
  const bins = binned(hop.histogram, first, last);
  const most = Math.max(1, ...bins);
  const top = Math.max(1, Math.ceil(Math.log10(most + 1)));
  const y = (count) => bottom - (count > 0 ? (Math.log10(count) + 0.3) / (top + 0.3) : 0) * (bottom - 6);
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = color("dim");
  context.strokeStyle = color("line");
  context.lineWidth = 1;
  context.beginPath();
  for (let decade = first; decade <= last; decade++) {
    const at = Math.round(x(10 ** decade)) + 0.5;
    context.moveTo(at, 4);
    context.lineTo(at, bottom);
    context.fillText(nanoseconds(10 ** decade), at + 3, height - 4);
  }
  context.textAlign = "right";
  for (let power = 0; power <= top; power += Math.max(1, Math.ceil(top / 3))) {
    const at = Math.round(y(10 ** power)) + 0.5;
    context.moveTo(left, at);
    context.lineTo(width, at);
    context.fillText(power === 0 ? "1" : `10${[..."⁰¹²³⁴⁵⁶⁷⁸⁹⁺"][power]}`, left - 4, at + 4);
  }
  context.textAlign = "left";
  context.stroke();
  context.fillStyle = color("accent");
  context.globalAlpha = 0.75;
  bins.forEach((count, bin) => {
    if (count === 0) return;
    const from = x(10 ** (first + bin / BINS_PER_DECADE));
    const to = x(10 ** (first + (bin + 1) / BINS_PER_DECADE));
    context.fillRect(from + 0.5, y(count), Math.max(1, to - from - 1), bottom - y(count));
  });
  context.globalAlpha = 1;
  for (const [name, style] of [["p50", "go"], ["p99", "wait"], ["max", "bad"]]) {
    context.fillStyle = color(style);
    context.fillRect(x(hop[name]) - 1, 4, 2, bottom - 4);
    context.fillText(name, Math.min(x(hop[name]) + 4, width - 30), name === "max" ? 36 : name === "p99" ? 24 : 12);
  }
}

function row(name) {
  const canvas = make("canvas", { role: "img", "aria-label": `Histogram of ${name}` });
  const values = MARKS.map(() => make("dd", {}, "–"));
  const count = make("dd", {}, "–");
  const element = make("div", { class: "hop" },
    make("div", {}, make("h3", {}, name, make("small", {}, MEANING[name] ?? "")),
      make("dl", {}, ...MARKS.flatMap(([, label], index) => [make("dt", {}, label), values[index]]), make("dt", {}, "count"), count)),
    canvas);
  return { element, canvas, values, count };
}

function redraw() {
  if (byId("view-latency").hidden) return;
  const range = decades();
  for (const [name, hop] of Object.entries(hops)) {
    if (!rows.has(name)) {
      rows.set(name, row(name));
      byId("hops").replaceChildren(...[...rows.values()].map(({ element }) => element));
    }
    const { canvas, values, count } = rows.get(name);
    MARKS.forEach(([key], index) => setText(values[index], nanoseconds(hop[key])));
    setText(count, hop.count.toLocaleString("en"));
    draw(canvas, hop, range);
  }
}

/** Shows the histograms whenever they come, if they can be seen. */
export function startLatency() {
  on("latency", (message) => {
    hops = message.hops ?? {};
    redraw();
  });
  onTheme(redraw);
  window.addEventListener("viewshown", redraw);
  window.addEventListener("resize", redraw);
}
