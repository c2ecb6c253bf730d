// What an operator does by hand, besides the jog: axes and homing, the overrides, the probe, the test pulse, inputs and
// outputs.

import { byId, make, note, setAttribute, setOptions, setText, show } from "./dom.js";
import { on } from "./connection.js";
import { percent, place, unitScale } from "./format.js";
import { ask, locked, operates } from "./requests.js";

/** How long a test pulse stays armed [ms]. */
const ARMED = 10_000;

function axisRow(name) {
  const home = operates(make("button", { class: "small operate-only", "aria-label": `Home ${name}` }, "Home"));
  home.addEventListener("click", () => ask("home", { axes: [name] }, byId("power-note")));
  const mark = make("i");
  return make("tr", { "data-axis": name },
    make("td", { class: "name" }, name), make("td", { class: "right" }),
    make("td", {}, make("span", { class: "range", "aria-hidden": "true" }, mark), make("span", { class: "unhomed" })),
    make("td", {}, home));
}

function showAxes(now) {
  const body = byId("axes");
  const names = Object.keys(now.axes);
  const key = names.join();
  if (body.dataset.axes !== key) {
    body.dataset.axes = key;
    body.replaceChildren(...names.map(axisRow));
  }
  names.forEach((name, index) => {
    const { position, unit, homed, limits } = now.axes[name];
    const isAxis = now.homed.includes(name) || now.unhomed.includes(name);
    const [, where, range, action] = body.children[index].children;
    setText(where, place(position, unit));
    const [bar, text] = range.children;
    const [low, high] = limits ?? [null, null];
    const isBounded = low !== null && high !== null && high > low;
    show(bar, homed && isBounded);
    if (isBounded) {
      bar.firstChild.style.left = `${Math.min(100, Math.max(0, ((position - low) / (high - low)) * 100))}%`;
      setAttribute(bar, "title", `${place(low, unit, 1)} to ${place(high, unit, 1)}`);
    }
    setText(text, homed ? "" : "not homed");
    show(action.firstChild, isAxis);
  });
  setOptions(byId("probe-axis"), names.map((name) => [name, name]));
}

/** A slider that asks for `verb`; `told` is what the status says of it. */
function startOverride(id, verb, told) {
  const slider = byId(id);
  const value = byId(`${id}-value`);
  const noteElement = byId(`${id}-note`);
  let timer = 0;
  let isHeld = 0;
  const wanted = () => setText(value, `${slider.value} %`);
  const request = () => ask(verb, { value: Number(slider.value) / 100 }, noteElement);
  slider.addEventListener("input", () => {
    wanted();
    isHeld = performance.now();
    clearTimeout(timer);
    timer = setTimeout(request, 120);
  });
  byId(`${id}-100`).addEventListener("click", () => {
    slider.value = 100;
    wanted();
    request();
  });
  on("status", ({ status: now }) => {
    // What was just asked for is not there yet.
    if (performance.now() - isHeld < 2500) return;
    if (!(now[told] > 0)) return;
    slider.value = Math.round(now[told] * 100);
    wanted();
  });
}

function startProbe() {
  const axis = byId("probe-axis");
  let units = {};
  const unit = () => units[axis.value]?.unit ?? "m";
  const showUnit = () => document.querySelectorAll(".probe-unit").forEach((it) => setText(it, unitScale(unit()).name));
  axis.addEventListener("change", showUnit);
  on("status", ({ status: now }) => {
    units = now.axes;
    showUnit();
    const before = byId("probe-note");
    const touched = now.probed;
    if (touched && before.dataset.waits === "true" && now.state === "idle" && now.motion_end === "reached") {
      before.dataset.waits = "false";
      note(before, `${touched.axis} touched at ${place(touched.position, touched.unit)}`, "done");
    }
  });
  byId("probe-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const { scale } = unitScale(unit());
    const [distance, speed] = ["probe-distance", "probe-speed"].map((id) => Number(byId(id).value) * scale);
    const noteElement = byId("probe-note");
    const isBegun = await ask("probe", { axes: [axis.value], value: distance, second: speed, unit: unit() }, noteElement, "moving until it touches");
    noteElement.dataset.waits = String(isBegun);
  });
}

/** The test pulse is armed first, and then fired: by another button, at another place. */
function startPulse() {
  const confirm = byId("pulse-confirm");
  const noteElement = byId("pulse-note");
  let timer = 0;
  const disarm = () => {
    clearTimeout(timer);
    show(confirm, false);
  };
  byId("pulse-form").addEventListener("submit", (event) => {
    event.preventDefault();
    note(noteElement, "");
    show(confirm, true);
    byId("pulse-cancel").focus();
    clearTimeout(timer);
    timer = setTimeout(disarm, ARMED);
  });
  byId("pulse-form").addEventListener("input", disarm);
  byId("pulse-cancel").addEventListener("click", () => {
    disarm();
    byId("pulse-arm").focus();
  });
  byId("pulse-fire").addEventListener("click", () => {
    disarm();
    const [power, time] = [Number(byId("pulse-power").value) / 100, Number(byId("pulse-time").value) / 1e3];
    ask("test-pulse", { value: power, second: time }, noteElement, `lit for ${time * 1e3} ms at ${percent(power, 1)}`);
  });
  on("link", disarm);
  on("hello", ({ machine }) => {
    const { test_power: power = 0.1, test_time: time = 0.1 } = machine.safety ?? {};
    setAttribute(byId("pulse-power"), "max", power * 100);
    setAttribute(byId("pulse-time"), "max", time * 1e3);
  });
}

function startSwitches() {
  let isSimulated = false;
  on("hello", ({ machine }) => {
    isSimulated = Boolean(machine.simulated);
  });
  const noteElement = byId("switch-note");
  const showGroup = (id, values, build) => {
    const group = byId(id);
    const names = Object.keys(values);
    const key = `${isSimulated}${document.body.dataset.role}${names.join()}`;
    if (group.dataset.names !== key) {
      group.dataset.names = key;
      group.replaceChildren(...names.map(build));
    }
    names.forEach((name, index) => {
      const element = group.children[index];
      setAttribute(element, "data-on", values[name]);
      if (element.tagName === "BUTTON") setAttribute(element, "aria-pressed", values[name]);
      else setAttribute(element, "aria-label", `${name}: ${values[name] ? "on" : "off"}`);
    });
    return names.length > 0;
  };
  const toggle = (verb, key) => (name) => {
    const button = operates(make("button", { class: "switch", type: "button" }, name));
    button.disabled = locked();
    button.addEventListener("click", () => {
      ask(verb, { name, [key]: button.dataset.on !== "true" }, noteElement);
    });
    return button;
  };
  const lamp = (name) => make("span", { class: "switch", role: "img" }, name);
  on("status", ({ status: now }) => {
    const watches = document.body.dataset.role === "watch";
    const hasInputs = showGroup("inputs", now.inputs ?? {}, isSimulated && !watches ? toggle("input", "is_active") : lamp);
    const hasOutputs = showGroup("outputs", now.outputs ?? {}, watches ? lamp : toggle("output", "is_on"));
    show(byId("switches"), hasInputs || hasOutputs);
  });
}

/** Gives the controls by hand their work. */
export function startHand() {
  on("status", ({ status: now }) => showAxes(now));
  startOverride("override", "override", "rate_override");
  startOverride("rapid-override", "rapid", "rapid_override");
  startOverride("power-override", "power", "power_override");
  startProbe();
  startPulse();
  startSwitches();
}
