// The scope: asks the server for pictures of signals, by a trigger or without one, and measures in them.

import { byId, note, setAttribute, setOptions, setText } from "./dom.js";
import { on, send } from "./connection.js";
import { engineering } from "./format.js";
import { refuse } from "./requests.js";
import { ScopePlot, nameOf } from "./scope_plot.js";
import { Traces } from "./traces.js";

const SECONDS = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10];
/** Signals that a scope begins with, the first that the machine has. */
const FIRST = [/^progress\.tool\.x$/, /following_error/, /^feedback\.current/, /^feedback\.lit$/];

let traces = null;
let plot = null;
/** "off", "run" or "single". */
let running = "off";
let timer = 0;

function request() {
  clearTimeout(timer);
  timer = 0;
  if (running === "off") {
    send({ type: "scope_off" });
    return;
  }
  const signals = traces.names();
  if (signals.length === 0) {
    send({ type: "scope_off" });
    note(byId("scope-note"), "Choose a signal first.", "warning");
    return;
  }
  const signal = byId("scope-trigger").value;
  const trigger = signal ? { signal, level: Number(byId("scope-level").value), edge: byId("scope-edge").value } : null;
  plot.trigger = trigger;
  const mode = running === "single" ? "single" : byId("scope-mode").value;
  note(byId("scope-note"), "");
  send({ type: "scope", signals, trigger, mode, seconds: Number(byId("scope-seconds").value), position: Number(byId("scope-position").value) / 100 });
}

/** Asks again after a moment, since several things change at once. */
function requestSoon() {
  clearTimeout(timer);
  timer = setTimeout(request, 60);
}

function say(words, isOn) {
  setText(byId("scope-state"), words);
  setAttribute(byId("scope-state"), "data-on", isOn);
}

function run(how) {
  running = how;
  setAttribute(byId("scope-run"), "aria-pressed", how === "run");
  setText(byId("scope-run"), how === "run" ? "Freeze" : "Run");
  setAttribute(byId("scope-single"), "aria-pressed", how === "single");
  say(how === "off" ? "frozen" : how === "single" ? "armed" : "waits", false);
  request();
}

function showPicture(picture) {
  if (running === "off") return;
  const names = picture.signals.map(nameOf);
  traces.autoScale(names, picture.traces);
  plot.show(picture);
  measure();
  if (running === "single") {
    if (!picture.triggered && byId("scope-trigger").value) return;
    running = "off";
    setAttribute(byId("scope-single"), "aria-pressed", false);
    say(picture.triggered ? "taken by the trigger" : "taken", true);
    send({ type: "scope_off" });
    return;
  }
  say(picture.triggered ? "triggered" : byId("scope-trigger").value ? "free, no trigger" : "free", picture.triggered);
}

/** Shows what the cursors measure. */
function measure() {
  const { cursors, picture } = plot;
  setAttribute(byId("scope-cursors"), "aria-pressed", cursors !== null);
  if (!cursors || !picture) {
    setText(byId("scope-delta"), "");
    for (const name of traces.names()) traces.showValues(name, NaN, NaN);
    return;
  }
  const [a, b] = cursors;
  const apart = b - a;
  const rate = apart === 0 ? "" : `   1/Δt ${engineering(1 / Math.abs(apart), "Hz")}`;
  setText(byId("scope-delta"), `A ${engineering(a, "s")}   B ${engineering(b, "s")}   Δt ${engineering(apart, "s")}${rate}`);
  picture.signals.forEach((signal, index) => {
    if (traces.shown.has(nameOf(signal))) traces.showValues(nameOf(signal), plot.valueAt(index, a), plot.valueAt(index, b));
  });
}

function save() {
  const { picture } = plot;
  if (!picture) {
    note(byId("scope-note"), "There is no picture to save.", "warning");
    return;
  }
  const field = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const head = ["time [s]", ...picture.signals.map((signal) => `${nameOf(signal)} [${traces.unitOf(nameOf(signal)) || "1"}]`)];
  const lines = [head.map(field).join(",")];
  for (let index = 0; index < picture.samples; index++) {
    const time = picture.start + index * picture.period;
    lines.push([Number(time.toPrecision(9)), ...picture.traces.map((values) => (Number.isFinite(values[index]) ? values[index] : ""))].join(","));
  }
  const address = URL.createObjectURL(new Blob([lines.join("\n"), "\n"], { type: "text/csv" }));
  const link = document.createElement("a");
  link.href = address;
  link.download = `scope-${new Date().toISOString().slice(0, 19).replaceAll(":", "")}.csv`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

function showTriggers() {
  const names = traces.names();
  setOptions(byId("scope-trigger"), [["", "none"], ...names.map((name) => [name, name])]);
}

function begin(signals) {
  // Without a pipeline there are none; those that were chosen stay.
  if (!signals?.length) return;
  const isFirst = traces.known.length === 0;
  traces.setKnown(signals);
  const saved = JSON.parse(localStorage.getItem("graver.signals") ?? "[]");
  if (isFirst) {
    const names = new Set(traces.known.map(({ name }) => name));
    const first = saved.filter((name) => names.has(name));
    const chosen = first.length ? first : FIRST.map((pattern) => traces.known.find(({ name }) => pattern.test(name))?.name).filter(Boolean);
    if (chosen.length === 0) chosen.push(...traces.known.slice(0, 1).map(({ name }) => name));
    for (const name of new Set(chosen)) traces.add(name);
    run("run");
  } else if (running !== "off") requestSoon();
}

/** Gives the scope its work. Pictures are asked for only while its view is shown. */
export function startScope() {
  traces = new Traces(() => {
    localStorage.setItem("graver.signals", JSON.stringify(traces.names()));
    showTriggers();
    requestSoon();
    measure();
  }, () => plot.request());
  plot = new ScopePlot(byId("scope-canvas"), () => traces.shown, measure);
  setOptions(byId("scope-seconds"), SECONDS.map((value) => [value, engineering(value, "s")]), 1);
  showTriggers();
  byId("scope-run").addEventListener("click", () => run(running === "run" ? "off" : "run"));
  byId("scope-single").addEventListener("click", () => run("single"));
  for (const id of ["scope-seconds", "scope-trigger", "scope-level", "scope-edge", "scope-mode", "scope-position"]) {
    byId(id).addEventListener("input", requestSoon);
  }
  byId("scope-cursors").addEventListener("click", () => plot.toggleCursors());
  byId("scope-all").addEventListener("click", () => plot.showAll());
  byId("scope-auto").addEventListener("click", () => {
    traces.allAuto();
    for (const trace of traces.shown.values()) trace.isFitted = false;
    if (plot.picture) traces.autoScale(plot.picture.signals.map(nameOf), plot.picture.traces);
    plot.request();
  });
  byId("scope-save").addEventListener("click", save);
  const isShown = () => !byId("view-scope").hidden;
  on("hello", ({ signals }) => {
    pending = signals;
    if (isShown()) begin(signals);
  });
  let pending = null;
  window.addEventListener("viewshown", () => {
    if (isShown()) {
      if (pending) begin(pending);
      plot.request();
    } else send({ type: "scope_off" });
  });
  on("scope", showPicture);
  on("scope_state", ({ state, text }) => say(text ?? state, state === "triggered"));
  on("refusal", ({ of, text }) => {
    if (of === "scope") refuse(byId("scope-note"), text);
  });
}
